//! The answer to a case.

use serde::Serialize;

use crate::effect::Effect;
use crate::laws::Laws;
use crate::rig::{Friction, Rig};
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
    /// As JSON text.
    ///
    /// # Errors
    /// Where a number is not finite, which no drawn number is.
    pub fn to_json(&self) -> serde_json::Result<String> {
        serde_json::to_string_pretty(self)
    }
}
