//! The paper's original rig (Figs. 6–7): two motors on one elastic shaft, each with a bearing and a resolver.
//!
//! J1 ω̇1 = τ1 + τ_s − b1(ω1),   J2 ω̇2 = τ2 − τ_s − b2(ω2),   τ_s = k·gap(θ2 − θ1) + c (ω2 − ω1) outside the gap
//!
//! Bearing, shaft and gap are those of the tribometer's disc (`disc.rs`); the drives have its lag. Inertia discs are
//! part of J1 or J2. There is no normal-load actuator and no rubber, so the control core, whose M1 presses against springs,
//! has no place here: both drives are given their torques.
//!
//! **Resolver.** Two windings give sin θ and cos θ; the converter behind them takes the angle from both. Where the
//! amplitude of one is off by the share a, it reads atan2((1 + a) sin θ, cos θ) ≈ θ + (a/2) sin 2θ: twice a turn, where an
//! eccentric encoder errs once. Then it is cut to 2^bits steps a turn. (W. Swinnen, ed., "Synchro and Resolver Conversion",
//! Analog Devices 1980.)
//!
//! **Step**: velocity Verlet with linearised bearings, as the disc's, below 0.1 rad of the torsional mode.
//!
//! Left out: the lag of the converter's tracking loop (α/ω², 0.3 mrad at 1000 rad/s² and 300 Hz), bending and couplings of
//! the shaft, ripple of the motors.

use super::PERIOD_S;
use super::disc::Bearing;
use super::noise::Noise;
use super::parameters::{BearingParameters, DriveParameters, ShaftParameters};
use model_core::real::Real;
use std::f64::consts::TAU;

/// A motor with what is fixed to it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MotorParameters {
    /// Its drive.
    pub drive: DriveParameters,
    /// Inertia of motor and inertia discs.
    pub inertia_kg_m2: f64,
    /// Its bearing.
    pub bearing: BearingParameters,
}

/// A resolver with its converter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ResolverParameters {
    /// Of the converter: 2^bits steps a turn.
    pub bits: u32,
    /// Amplitude of the sine winding over that of the cosine winding, less one.
    pub imbalance: f64,
}

/// Two motors on a shaft.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TwoMotorParameters {
    /// Loads.
    pub m1: MotorParameters,
    /// Drives.
    pub m2: MotorParameters,
    /// Between them; its inertia counts for nothing.
    pub shaft: ShaftParameters,
    /// On each motor.
    pub resolver: ResolverParameters,
}

impl ResolverParameters {
    /// What the converter gives at an angle, turns counted.
    #[must_use]
    pub fn angle_rad(&self, angle_rad: f64) -> f64 {
        // The error alone through atan2, so that turns are kept.
        let (sin, cos) = (angle_rad.sin(), angle_rad.cos());
        let error = (self.imbalance * sin * cos).atan2(1.0 + self.imbalance * sin * sin);
        let step = TAU / f64::from(1u32 << self.bits);
        ((angle_rad + error) / step).floor() * step
    }
}

/// The true state; of each pair the first is M1's.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct TwoMotorTruth {
    /// Torques of the motors.
    pub torque_nm: [f64; 2],
    /// Angles.
    pub angle_rad: [f64; 2],
    /// Speeds.
    pub speed_rad_s: [f64; 2],
    /// Torque of the shaft from M2 to M1.
    pub shaft_nm: f64,
}

/// What is read: torques from the drives' monitors, angles from the resolvers.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct TwoMotorReading {
    /// Torques of the motors.
    pub torque_nm: [f64; 2],
    /// Angles.
    pub angle_rad: [f64; 2],
}

/// The rig, prepared.
#[derive(Debug, Clone)]
pub struct TwoMotors {
    bearings: [Bearing; 2],
    inertias_kg_m2: [f64; 2],
    lags_s: [f64; 2],
    half_decays: [f64; 2],
    shaft: ShaftParameters,
    resolver: ResolverParameters,
    substeps: u32,
    step_s: f64,
    state: TwoMotorTruth,
    noise: Noise,
    torque_noise_nm: f64,
}

impl TwoMotors {
    /// At rest, with noise of this deviation on the torque monitors.
    #[must_use]
    pub fn new(p: &TwoMotorParameters, torque_noise_nm: f64, seed: u64) -> Self {
        let motors = [&p.m1, &p.m2];
        let inertias_kg_m2 = motors.map(|m| m.inertia_kg_m2);
        let mobility = inertias_kg_m2.iter().map(|j| 1.0 / j).sum::<f64>();
        let (spring, damper) = (p.shaft.stiffness_nm_per_rad * mobility, p.shaft.damping_nm_s * mobility);
        // 0.1 rad of the torsional mode a step, and a tenth of what the shaft's damper takes to act.
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
        let substeps = (PERIOD_S * (spring.sqrt() / 0.1).max(damper / 0.1)).ceil().max(1.0) as u32;
        let step_s = PERIOD_S / f64::from(substeps);
        let lags_s = motors.map(|m| m.drive.lag_s());
        Self {
            bearings: motors.map(|m| Bearing::new(&m.bearing)),
            inertias_kg_m2,
            half_decays: lags_s.map(|lag_s| Real::exp(-0.5 * step_s / lag_s)),
            lags_s,
            shaft: p.shaft,
            resolver: p.resolver,
            substeps,
            step_s,
            state: TwoMotorTruth::default(),
            noise: Noise::new(seed),
            torque_noise_nm,
        }
    }

    /// Changes the speeds over half a step with the drives' torques.
    fn kick(&mut self, commands_nm: [f64; 2]) {
        let (half_s, s) = (0.5 * self.step_s, &mut self.state);
        let twist = s.angle_rad[1] - s.angle_rad[0];
        s.shaft_nm = self.shaft.torque_nm(twist, s.speed_rad_s[1] - s.speed_rad_s[0]);
        for (k, shaft_nm) in [s.shaft_nm, -s.shaft_nm].into_iter().enumerate() {
            // ∫ τ dt of a lag: u dt + T (τ − τ⁺).
            let next = commands_nm[k] + (s.torque_nm[k] - commands_nm[k]) * self.half_decays[k];
            let impulse = half_s * commands_nm[k] + self.lags_s[k] * (s.torque_nm[k] - next);
            s.torque_nm[k] = next;
            let (bearing, slope) = self.bearings[k].torque_and_slope(s.speed_rad_s[k]);
            let inertia = self.inertias_kg_m2[k] + 0.5 * half_s * slope;
            s.speed_rad_s[k] += (impulse + half_s * (shaft_nm - bearing)) / inertia;
        }
    }

    /// Advances by one control period with the torques that the drives are given.
    pub fn advance(&mut self, commands_nm: [f64; 2]) {
        for _ in 0..self.substeps {
            self.kick(commands_nm);
            for k in 0..2 {
                self.state.angle_rad[k] += self.step_s * self.state.speed_rad_s[k];
            }
            self.kick(commands_nm);
        }
    }

    /// The true state.
    #[must_use]
    pub fn truth(&self) -> TwoMotorTruth {
        self.state
    }

    /// Reads monitors and resolvers; each call draws new noise.
    pub fn read(&mut self) -> TwoMotorReading {
        let noise = self.noise.draw(&[self.torque_noise_nm; 2]);
        TwoMotorReading {
            torque_nm: core::array::from_fn(|k| self.state.torque_nm[k] + noise[k]),
            angle_rad: self.state.angle_rad.map(|angle| self.resolver.angle_rad(angle)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn free(backlash_rad: f64) -> TwoMotorParameters {
        let motor = |inertia_kg_m2| MotorParameters {
            drive: DriveParameters { rated_torque_nm: 8.0, torque_lag_s: 1e-3 },
            inertia_kg_m2,
            bearing: BearingParameters { coulomb_nm: 0.0, viscous_nm_s: 0.0, ..BearingParameters::default() },
        };
        TwoMotorParameters {
            m1: motor(0.0214),
            m2: motor(0.0014),
            shaft: ShaftParameters {
                stiffness_nm_per_rad: 540.0,
                damping_nm_s: 0.0,
                backlash_rad,
                motor_inertia_kg_m2: 0.0,
            },
            resolver: ResolverParameters { bits: 16, imbalance: 0.0 },
        }
    }

    fn run(rig: &mut TwoMotors, commands_nm: [f64; 2], duration_s: f64) -> Vec<TwoMotorTruth> {
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
        let periods = (duration_s / PERIOD_S).round() as u32;
        let step = |_| {
            rig.advance(commands_nm);
            rig.truth()
        };
        (0..periods).map(step).collect()
    }

    #[test]
    fn both_motors_together_turn_as_one_inertia_whatever_the_shaft_does() {
        for backlash in [0.0, 0.05] {
            let end = *run(&mut TwoMotors::new(&free(backlash), 0.0, 1), [0.5, 1.0], 0.3).last().unwrap();
            let momentum = 0.0214 * end.speed_rad_s[0] + 0.0014 * end.speed_rad_s[1];
            // Impulse of both torques, less a lag of 1 ms.
            assert!((momentum / (1.5 * 0.299) - 1.0).abs() < 1e-9, "{momentum}");
        }
    }

    #[test]
    fn the_shaft_rings_at_the_frequency_of_two_masses_and_carries_m1s_share_of_the_torque() {
        let trace: Vec<f64> = run(&mut TwoMotors::new(&free(0.0), 0.0, 1), [0.0, 1.0], 1.0)
            .iter()
            .map(|s| s.angle_rad[1] - s.angle_rad[0])
            .collect();
        let mean = trace[1000..].iter().sum::<f64>() / (trace.len() - 1000) as f64;
        let up: Vec<usize> =
            (1000..trace.len() - 1).filter(|k| trace[*k] < mean && trace[k + 1] >= mean).collect();
        let seen = (up.len() - 1) as f64 / ((up[up.len() - 1] - up[0]) as f64 * PERIOD_S);
        let expected = (540.0f64 * (1.0 / 0.0214 + 1.0 / 0.0014)).sqrt() / TAU;
        assert!((seen / expected - 1.0).abs() < 1e-3, "{seen} Hz against {expected} Hz");
        // J1/(J1 + J2) of 1 N m over k.
        assert!((mean / (0.0214 / 0.0228 / 540.0) - 1.0).abs() < 0.01, "{mean}");
    }

    #[test]
    fn a_motor_crosses_the_backlash_before_the_other_follows() {
        let trace = run(&mut TwoMotors::new(&free(0.04), 0.0, 1), [0.0, 0.5], 0.1);
        let touch = trace.iter().position(|s| s.speed_rad_s[0] > 1e-3).unwrap() as f64 * PERIOD_S;
        // Half the gap: √(2 · 0.02 · 0.0014/0.5) ≈ 10.6 ms, and the lag of the drive.
        assert!((touch - 11.6e-3).abs() < 3e-4, "flanks meet at {touch} s");
    }

    #[test]
    fn motors_against_each_other_stand_still_and_twist_the_shaft() {
        let mut p = free(0.0);
        p.shaft.damping_nm_s = 0.2;
        let end = *run(&mut TwoMotors::new(&p, 0.0, 1), [-2.0, 2.0], 2.0).last().unwrap();
        assert!((end.angle_rad[1] - end.angle_rad[0] - 2.0 / 540.0).abs() < 1e-9);
        assert!((end.shaft_nm - 2.0).abs() < 1e-6 && end.speed_rad_s[0].abs() < 1e-6, "{end:?}");
    }

    #[test]
    fn a_resolver_errs_twice_a_turn_by_half_the_imbalance_and_keeps_its_turns() {
        let (fine, a) = (ResolverParameters { bits: 24, imbalance: 2e-3 }, 2e-3);
        let step = TAU / f64::from(1u32 << 24);
        for k in 0..200 {
            let angle = f64::from(k) * 0.173 - 9.0;
            // The two windings themselves.
            let decoded = ((1.0 + a) * angle.sin()).atan2(angle.cos());
            let error = fine.angle_rad(angle) - angle;
            let turns = ((error + angle - decoded) / TAU).round() * TAU;
            assert!((error + angle - decoded - turns).abs() <= step, "{angle}");
            assert!((error - 0.5 * a * (2.0 * angle).sin()).abs() < 2e-6 + step, "{angle}: {error}");
        }
        let coarse = ResolverParameters { bits: 12, imbalance: 0.0 };
        assert_eq!(coarse.angle_rad(1e-9 + TAU * 3.0 / 4096.0), TAU * 3.0 / 4096.0);
    }
}
