//! What a person does to the rig by hand, with the drives off: turn the disc, press M1's lever, hang weights.
//!
//! Turning is a torque on the disc that follows an angle, K (α − θ) − D ω, limited to what a hand can do; α goes at
//! half a turn a second. K = 40 N·m/rad and D = 1.5 N·m·s are assumed: stiff enough that the bearing's Coulomb friction
//! of 0.15 N·m costs 4 mrad. Weights load a bridge only, as a lever that hangs on it does; M1's lever is pressed through
//! the mechanism and moves it.

use super::PERIOD_S;

/// Torque of a hand on the disc.
const STIFFNESS_NM_PER_RAD: f64 = 40.0;
const DAMPING_NM_S: f64 = 1.5;
const MOST_NM: f64 = 4.0;
/// Speed at which it turns.
const SPEED_RAD_S: f64 = std::f64::consts::PI;

/// What hands do at present.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Hands {
    /// Torque on M1's shaft.
    pub m1_nm: f64,
    /// Known torque that hangs on the friction bridge.
    pub friction_load_nm: f64,
    /// Known force that hangs on the normal force bridge.
    pub normal_load_n: f64,
    /// Where the hand on the disc is, and where it goes to; none: the disc is free.
    turning: Option<Turning>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Turning {
    from_rad: f64,
    now_rad: f64,
    to_rad: f64,
    /// The hand holds on for a moment when it is there.
    rest_s: f64,
}

impl Hands {
    /// Begins to turn the disc from where it is.
    pub(super) fn turn(&mut self, angle_rad: f64, by_rad: f64) {
        self.turning = Some(Turning {
            from_rad: angle_rad,
            now_rad: angle_rad,
            to_rad: angle_rad + by_rad,
            rest_s: 0.3,
        });
    }

    /// Torque on the disc over the coming control period.
    pub(super) fn disc_nm(&mut self, angle_rad: f64, speed_rad_s: f64) -> f64 {
        let Some(turning) = &mut self.turning else { return 0.0 };
        let step = SPEED_RAD_S * PERIOD_S * (turning.to_rad - turning.from_rad).signum();
        let left = turning.to_rad - turning.now_rad;
        if left.abs() > step.abs() {
            turning.now_rad += step;
        } else {
            turning.now_rad = turning.to_rad;
            turning.rest_s -= PERIOD_S;
        }
        let torque = STIFFNESS_NM_PER_RAD * (turning.now_rad - angle_rad) - DAMPING_NM_S * speed_rad_s;
        if turning.rest_s <= 0.0 {
            self.turning = None;
        }
        torque.clamp(-MOST_NM, MOST_NM)
    }
}
