//! Friction rises with speed below v_m, then falls ([`model_core::extension::bell_curve`]).
//!
//! Signature: a hump over the logarithm of speed that no falling g(v) can follow, in proportion to load.
//! Rivals: a film rises without end and does not care for load; thermal fade falls with speed but late.

use model_core::extension::Extension;

use super::{ContactEffect, ContactModel, Parameter, Scales, Start};

pub(super) struct BellCurve;

impl ContactEffect for BellCurve {
    fn id(&self) -> &'static str {
        "bell_curve"
    }

    fn parameters(&self, _variant: usize, scales: &Scales) -> Vec<Parameter> {
        let (low, high) = scales.speed_m_s;
        vec![
            Parameter::linear("height", 0.0, 0.0, 5.0),
            Parameter::logarithmic("peak_m_s", (low * high).sqrt(), low, high),
            Parameter::logarithmic("rise_width", 1.0, 0.3, 6.0),
            Parameter::logarithmic("fall_width", 1.0, 0.3, 6.0),
            Parameter::logarithmic("tail", 3.0, 0.3, 50.0),
        ]
    }

    fn starts(&self, _variant: usize, scales: &Scales) -> Vec<Start> {
        let (low, high) = scales.speed_m_s;
        let mut starts = Vec::new();
        for share in [0.15, 0.35, 0.5, 0.65, 0.85] {
            for width in [0.8, 1.8] {
                let peak_m_s = low.powf(1.0 - share) * high.powf(share);
                starts.push(Start::shape(&[0.0, peak_m_s, width, width, 3.0], &[0]));
            }
        }
        starts
    }

    fn apply(
        &self,
        _variant: usize,
        values: &[f64],
        _origin: f64,
        _scales: &Scales,
        model: &mut ContactModel,
    ) {
        model.set(Extension::BellCurve, values.to_vec());
    }
}
