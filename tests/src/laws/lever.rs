//! What M1's side adds to its torque: hysteresis of the lever's joints, cogging of M1.

use serde::Serialize;

use crate::laws::Setting;
use crate::laws::family::size;
use crate::laws::hysteresis::Hysteresis;
use crate::laws::ripple::Ripple;
use crate::random::Stream;

/// A lever that holds back a band of torque; see [`crate::laws::hysteresis`] for its laws.
#[derive(Debug, Clone, Serialize)]
pub struct LeverHysteresis {
    #[serde(flatten)]
    hysteresis: Hysteresis,
    band_nm: f64,
    #[serde(skip)]
    last_nm: Option<f64>,
}

impl LeverHysteresis {
    /// Draws one: the band is its size of the torque at 0.6 of the greatest force.
    pub fn draw(s: &mut Stream, setting: &Setting<'_>) -> Self {
        let middling_nm = 0.6 * setting.greatest_normal_n / setting.rig.lever_gain_n_per_nm;
        let band_nm = 1.1 * size(s) * middling_nm;
        let reach = band_nm * s.uniform(0.3, 1.0);
        Self { hysteresis: Hysteresis::draw(s, setting.family, reach), band_nm, last_nm: None }
    }

    /// Torque lost on the way from M1 to the elements.
    pub fn lost(&mut self, torque_nm: f64) -> f64 {
        let change = torque_nm - self.last_nm.replace(torque_nm).unwrap_or(torque_nm);
        self.band_nm * self.hysteresis.step(change)
    }
}

/// Cogging of M1 over its angle; see [`crate::laws::ripple`] for its laws.
#[must_use]
pub fn m1_ripple(s: &mut Stream, setting: &Setting<'_>) -> Ripple {
    let rig = setting.rig;
    // Two to four periods over M1's travel, and no well deep enough to hold the mechanism.
    let travel_rad = setting.greatest_normal_n / rig.mechanism_n_per_rad;
    let per_rad = (std::f64::consts::TAU * s.uniform(2.0, 4.0) / travel_rad).round();
    let rms_nm = size(s) * 0.6 * setting.greatest_normal_n / rig.lever_gain_n_per_nm;
    let steepest = 0.7 * rig.mechanism_n_per_rad / rig.lever_gain_n_per_nm;
    Ripple::draw(s, setting.family, &[per_rad], rms_nm).no_steeper_than(steepest)
}
