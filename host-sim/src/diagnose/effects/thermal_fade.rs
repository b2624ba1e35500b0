//! Friction falls while the surface is heated and recovers while it cools
//! ([`model_core::extension::thermal_fade`]).
//!
//! Signature: the coefficient falls along a stretch of sliding, faster at high power, and is back after a
//! rest or a slow stretch. Rivals: wear does not come back; drift of the bridge does not care for power
//! and is not seen by M2's torque; a falling g(v) answers at once.

use model_core::extension::Extension;

use super::{ContactEffect, ContactModel, Parameter, Scales, Start};

pub(super) struct ThermalFade;

impl ContactEffect for ThermalFade {
    fn id(&self) -> &'static str {
        "thermal_fade"
    }

    fn parameters(&self, _variant: usize, scales: &Scales) -> Vec<Parameter> {
        vec![
            // x of the law at the mean power, after the cooling time or the record, whichever is shorter.
            Parameter::linear("fast_fade", 0.0, 0.0, 3.0),
            Parameter::logarithmic("cooling_s", 1.0, 0.05, 0.5 * scales.duration_s),
            Parameter::linear("slow_fade", 0.0, 0.0, 3.0),
            Parameter::logarithmic("slow_cooling_s", 10.0, 0.5, 20.0 * scales.duration_s),
            Parameter::linear("saturation", 0.5, 0.0, 8.0),
            Parameter::logarithmic("exponent", 1.0, 0.5, 2.5),
        ]
    }

    fn starts(&self, _variant: usize, scales: &Scales) -> Vec<Start> {
        let slowest_s = 5.0 * scales.duration_s;
        [[0.3, 3.0], [0.7, 8.0], [2.0, 25.0], [6.0, slowest_s]]
            .map(|[fast_s, slow_s]| Start::shape(&[0.0, fast_s, 0.0, slow_s, 0.5, 1.0], &[0, 2]))
            .to_vec()
    }

    fn apply(
        &self,
        _variant: usize,
        values: &[f64],
        _origin: f64,
        scales: &Scales,
        model: &mut ContactModel,
    ) {
        let held_j = |cooling_s: f64| scales.power_w * cooling_s.min(scales.duration_s);
        let (fast, slow) = (values[0] / held_j(values[1]), values[2] / held_j(values[3]));
        model.set(Extension::ThermalFade, vec![fast, values[1], slow, values[3], values[4], values[5]]);
    }
}
