//! The answer to a case.

use std::collections::BTreeMap;

use serde::Serialize;

use crate::effect::{Effect, Subsystem};
use crate::imperfections::Imperfections;
use crate::laws::Laws;
use crate::rig::{Friction, Rig};
use crate::scenario::Plan;
use crate::sensors::Noise;
use crate::shadow::Residual;

/// Everything the generator knows and a diagnosis does not.
#[derive(Debug, Clone, Serialize)]
pub struct Truth {
    /// Hidden effects.
    pub effects: Vec<Effect>,
    /// Seed.
    pub seed: u64,
    /// Rate of the logs.
    pub rate_hz: f64,
    /// Length of each log.
    pub duration_s: f64,
    /// Plan that was run.
    pub plan: Plan,
    /// What is not perfect besides.
    pub imperfections: Imperfections,
    /// Whether the block's damping is below F_N |g′| at 10 rpm and 88 N.
    pub stick_slip: bool,
    /// Law drawn for each effect.
    pub law_names: BTreeMap<String, String>,
    /// Factor on the noise.
    pub noise_factor: f64,
    /// `kind` of the baseline model file.
    pub baseline_kind: String,
    /// True rig.
    pub rig: Rig,
    /// True friction; `None` where there is no contact.
    pub friction: Option<Friction>,
    /// Friction of the baseline model file.
    pub nominal: Option<Friction>,
    /// Laws of the effects.
    pub laws: Laws,
    /// Noise of the sensors.
    pub noise: Noise,
    /// What a baseline with the true numbers leaves of each log, held-out log last.
    pub residuals: Vec<Residual>,
    /// The same over the noise that a prediction sees: friction, normal force, drive.
    pub residual_to_noise: [f64; 3],
}

impl Truth {
    /// Size of a hidden effect relative to the channel of its subsystem that shows it most: RMS over RMS, all
    /// logs together. Of a factor on µ it is that of the factor; of other effects what a baseline with the true
    /// numbers leaves open loop, which stick-slip makes larger.
    #[must_use]
    pub fn size(&self, effect: Effect) -> f64 {
        let share = |part: fn(&Residual) -> f64, whole: fn(&Residual) -> f64| {
            let sum =
                |pick: fn(&Residual) -> f64| self.residuals.iter().map(|r| pick(r).powi(2)).sum::<f64>();
            if sum(whole) > 0.0 { (sum(part) / sum(whole)).sqrt() } else { 0.0 }
        };
        let friction = share(|r| r.friction_nm, |r| r.friction_signal_nm);
        let normal = share(|r| r.normal_n, |r| r.normal_signal_n);
        let drive = share(|r| r.drive_nm, |r| r.drive_signal_nm);
        let factor = share(|r| r.factor_nm, |r| r.friction_signal_nm);
        match effect.subsystem() {
            Subsystem::Friction if factor > 0.0 => factor,
            Subsystem::Friction => friction,
            Subsystem::Measurement => friction.max(normal).max(drive),
            Subsystem::Pressure => normal,
            Subsystem::Drive => drive,
        }
    }

    /// As JSON text.
    ///
    /// # Errors
    /// Where a number is not finite, which no drawn number is.
    pub fn to_json(&self) -> serde_json::Result<String> {
        serde_json::to_string_pretty(self)
    }
}
