//! M1, lever, foil springs: from torque to normal force.
//!
//! ẍ + 2ζω ẋ + ω² (x + hard(x)) = ω² (gain·(τ + ripple(θ1) − lost(τ)) − preload + wobble + bounce),
//! F_N = max(0, x), θ1 = x/stiffness.

use crate::filters::{Lag, Mode};
use crate::laws::Laws;
use crate::rig::Rig;

/// Pressure side with its state.
#[derive(Debug, Clone)]
pub struct Pressure {
    gain: f64,
    preload: f64,
    stiffness: f64,
    lag: Lag,
    mode: Mode,
    force: f64,
}

impl Pressure {
    /// At rest under a torque.
    #[must_use]
    pub fn new(rig: &Rig, step_s: f64, torque_nm: f64) -> Self {
        let start = rig.lever_gain_n_per_nm * torque_nm - rig.preload_n;
        Self {
            gain: rig.lever_gain_n_per_nm,
            preload: rig.preload_n,
            stiffness: rig.mechanism_n_per_rad,
            lag: Lag::new(rig.m1_lag_s, step_s, torque_nm),
            mode: Mode::new(rig.pressure_mode_hz, rig.pressure_damping, step_s, start),
            force: start,
        }
    }

    /// Torque of M1 as its drive reports it.
    #[must_use]
    pub fn torque_nm(&self) -> f64 {
        self.lag.value()
    }

    /// Angle of M1.
    #[must_use]
    pub fn angle_rad(&self) -> f64 {
        self.force / self.stiffness
    }

    /// Normal force.
    #[must_use]
    pub fn normal_n(&self) -> f64 {
        self.force.max(0.0)
    }

    /// One step under a torque command and the road's push, with the effects of `laws`.
    pub fn step(&mut self, command_nm: f64, laws: &mut Laws, disc_angle_rad: f64, bounce_n: f64) {
        let mut torque = self.lag.step(command_nm);
        if let Some(law) = &mut laws.lever_hysteresis {
            torque -= law.lost(torque);
        }
        if let Some(law) = &laws.m1_ripple {
            torque += law.at(self.angle_rad());
        }
        let mut target = self.gain * torque - self.preload;
        if let Some(law) = &laws.foil_hardening {
            target -= law.at(self.force);
        }
        if let Some(law) = &laws.disc_wobble {
            target += law.at(disc_angle_rad);
        }
        self.force = self.mode.step(target + bounce_n);
    }
}
