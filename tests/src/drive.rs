//! M2 with its shaft, bearing and load; or a linear stage, in the same equations.
//!
//! One mass: J ω̇ = τ − drag(ω) − load. Two masses, with a [`Coupling`]: the bearing is on the motor's
//! side, the load on the other. Semi-implicit Euler: first the speeds, then the angles.
//! Torque: command → first-order lag (what the drive reports) → the laws that the drive does not know.
//! Left out: bearing friction as a set-valued law; the sign is smoothed over 0.005 rad/s.

use crate::filters::Lag;
use crate::laws::bearing::{Falling, Offset, Uneven};
use crate::laws::coupling::Coupling;
use crate::laws::lateness::Late;
use crate::laws::ripple::Ripple;
use crate::laws::{Laws, Units, Yielding};

/// Speed over which the sign of Coulomb friction turns.
const TURN_RAD_S: f64 = 0.005;
/// Speed at which the loss of torque constant is stated.
const SAG_REFERENCE_RAD_S: f64 = 15.0;

/// Numbers of a drive without effects.
#[derive(Debug, Clone, Copy)]
pub struct DriveNumbers {
    /// Inertia or mass.
    pub inertia: f64,
    /// Coulomb drag.
    pub coulomb: f64,
    /// Viscous drag.
    pub viscous: f64,
    /// Lag of the torque loop.
    pub lag_s: f64,
    /// Units.
    pub units: Units,
}

/// A drive with its state.
#[derive(Debug, Clone)]
pub struct Drive {
    numbers: DriveNumbers,
    step_s: f64,
    coupling: Option<Coupling>,
    lag: Lag,
    late: Option<Late>,
    sag: Option<f64>,
    offset: Option<Offset>,
    steps: u64,
    ripple: Option<Ripple>,
    uneven: Option<Uneven>,
    falling: Option<Falling>,
    yielding: Option<Yielding>,
    thrust: f64,
    motor_angle: f64,
    motor_speed: f64,
    load_angle: f64,
    load_speed: f64,
}

impl Drive {
    /// A drive at rest at an angle, with the effects of `laws`.
    #[must_use]
    pub fn new(numbers: DriveNumbers, laws: &Laws, step_s: f64, angle: f64) -> Self {
        Self {
            numbers,
            step_s,
            coupling: Coupling::joined(laws.shaft_torsion.as_ref(), laws.backlash.as_ref()),
            lag: Lag::new(numbers.lag_s, step_s, 0.0),
            late: laws.drive_delay.map(|law| law.running(step_s, 0.0)),
            sag: laws.torque_sag,
            offset: laws.torque_offset,
            steps: 0,
            ripple: laws.m2_ripple.clone(),
            uneven: laws.bearing_asymmetry,
            falling: laws.bearing_stribeck,
            yielding: laws.presliding.clone(),
            thrust: laws.thrust_bearing.unwrap_or(0.0),
            motor_angle: angle,
            motor_speed: 0.0,
            load_angle: angle,
            load_speed: 0.0,
        }
    }

    /// Angle on the motor's side, where the encoder is.
    #[must_use]
    pub fn motor_angle(&self) -> f64 {
        self.motor_angle
    }

    /// Speed on the motor's side.
    #[must_use]
    pub fn motor_speed(&self) -> f64 {
        self.motor_speed
    }

    /// Angle of the disc.
    #[must_use]
    pub fn load_angle(&self) -> f64 {
        self.load_angle
    }

    /// Speed of the disc.
    #[must_use]
    pub fn load_speed(&self) -> f64 {
        self.load_speed
    }

    /// Torque that the drive reports.
    #[must_use]
    pub fn reported_torque(&self) -> f64 {
        self.lag.value()
    }

    /// Drag of the bearing without effects at a speed.
    #[must_use]
    pub fn plain_drag(&self, speed: f64) -> f64 {
        let turn = TURN_RAD_S * self.numbers.units.travel;
        self.numbers.coulomb * speed / speed.hypot(turn) + self.numbers.viscous * speed
    }

    fn drag(&mut self, normal_n: f64) -> f64 {
        let speed = self.motor_speed;
        let side = speed / speed.hypot(TURN_RAD_S * self.numbers.units.travel);
        let mut size = self.numbers.coulomb + self.thrust * normal_n;
        let mut extra = 0.0;
        let mut direction = side;
        if let Some(yielding) = &mut self.yielding {
            size *= yielding.stronger;
            direction = yielding.hysteresis.step(self.step_s * speed);
        }
        if let Some(uneven) = &self.uneven {
            let (factor, beside) = uneven.at(speed, side);
            size *= factor;
            extra = beside;
        }
        if let Some(falling) = &self.falling {
            size += falling.at(speed);
        }
        size * direction + self.numbers.viscous * speed + extra
    }

    /// One step: torque commanded, torque of the load, normal force on the disc.
    pub fn step(&mut self, command: f64, load: f64, normal_n: f64) {
        let reported = self.lag.step(command);
        let mut shaft = self.late.as_mut().map_or(reported, |late| late.step(reported));
        let time_s = self.steps as f64 * self.step_s;
        self.steps += 1;
        if let Some(sag) = self.sag {
            let reference = SAG_REFERENCE_RAD_S * self.numbers.units.travel;
            shaft *= 1.0 - sag * (self.motor_speed / reference).powi(2).min(2.0);
        }
        shaft += self.offset.map_or(0.0, |offset| offset.at(time_s));
        shaft += self.ripple.as_ref().map_or(0.0, |ripple| ripple.at(self.motor_angle));
        let drag = self.drag(normal_n);
        let (h, inertia) = (self.step_s, self.numbers.inertia);
        if let Some(coupling) = &self.coupling {
            let twist = self.motor_angle - self.load_angle;
            let carried = coupling.torque(twist, self.motor_speed - self.load_speed);
            self.motor_speed += h * (shaft - drag - carried) / (inertia * coupling.motor_share);
            self.load_speed += h * (carried - load) / (inertia * (1.0 - coupling.motor_share));
            self.motor_angle += h * self.motor_speed;
            self.load_angle += h * self.load_speed;
        } else {
            self.motor_speed += h * (shaft - drag - load) / inertia;
            self.motor_angle += h * self.motor_speed;
            self.load_speed = self.motor_speed;
            self.load_angle = self.motor_angle;
        }
    }
}

/// Speed loop: PI with feed-forward of the acceleration, limited torque, and an integral that stops at
/// the limit.
#[derive(Debug, Clone)]
pub struct SpeedLoop {
    gain: f64,
    integral_gain: f64,
    inertia: f64,
    limit: f64,
    period_s: f64,
    reference: f64,
    integral: f64,
}

impl SpeedLoop {
    /// A loop of the given bandwidth (rad/s) for an inertia.
    #[must_use]
    pub fn new(inertia: f64, bandwidth: f64, limit: f64, period_s: f64) -> Self {
        let gain = inertia * bandwidth;
        Self {
            gain,
            integral_gain: gain * bandwidth * 0.2,
            inertia,
            limit,
            period_s,
            reference: 0.0,
            integral: 0.0,
        }
    }

    /// One control period: speed asked for, greatest acceleration, speed read. Returns the torque.
    pub fn step(&mut self, target: f64, acceleration: f64, speed: f64) -> f64 {
        let room = acceleration * self.period_s;
        let change = (target - self.reference).clamp(-room, room);
        self.reference += change;
        let error = self.reference - speed;
        let asked = self.gain * error + self.integral + self.inertia * change / self.period_s;
        let torque = asked.clamp(-self.limit, self.limit);
        if torque == asked || (asked - torque) * error < 0.0 {
            self.integral += self.integral_gain * self.period_s * error;
        }
        torque
    }

    /// Follows a torque given from elsewhere, so that the loop can take over from it.
    pub fn follow(&mut self, torque: f64, speed: f64) {
        self.reference = speed;
        self.integral = torque;
    }
}
