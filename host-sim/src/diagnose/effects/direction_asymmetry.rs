//! Friction differs between the directions of sliding ([`model_core::extension::direction_asymmetry`]).
//!
//! Signature: the residual's ratio to friction has one value forward and the opposite backward, at every
//! load and speed, and M2 feels it. Rivals: crosstalk adds the same torque at any speed and also at rest, and
//! M2 does not feel it; an asymmetric bearing is not seen by the friction bridge.

use model_core::extension::Extension;

use super::{ContactEffect, ContactModel, Parameter, Scales, Start};

/// Share of the sliding time that each direction needs: with one direction alone there is nothing to compare,
/// and the law would only bend the Stribeck curve.
const LEAST_SHARE: f64 = 0.03;

pub(super) struct DirectionAsymmetry;

impl ContactEffect for DirectionAsymmetry {
    fn id(&self) -> &'static str {
        "direction_asymmetry"
    }

    fn parameters(&self, _variant: usize, scales: &Scales) -> Vec<Parameter> {
        let (low, high) = scales.speed_m_s;
        vec![
            Parameter::linear("asymmetry_slow", 0.0, -0.9, 0.9),
            Parameter::linear("asymmetry_fast", 0.0, -0.9, 0.9),
            Parameter::logarithmic("between_m_s", (low * high).sqrt(), 0.1 * low, 3.0 * high),
            Parameter::logarithmic("sharpness", 0.7, 0.25, 2.5),
        ]
    }

    fn starts(&self, _variant: usize, scales: &Scales) -> Vec<Start> {
        let (low, high) = scales.speed_m_s;
        [((low * high).sqrt(), 0.5), ((low * high).sqrt(), 1.2), (high, 0.6), (high, 1.2)]
            .map(|(between_m_s, sharpness)| Start::shape(&[0.0, 0.0, between_m_s, sharpness], &[0, 1]))
            .to_vec()
    }

    fn apply(
        &self,
        _variant: usize,
        values: &[f64],
        _origin: f64,
        _scales: &Scales,
        model: &mut ContactModel,
    ) {
        model.set(Extension::DirectionAsymmetry, values.to_vec());
    }

    fn applies(&self, _model: &ContactModel, scales: &Scales) -> bool {
        scales.rarer_direction > LEAST_SHARE
    }
}
