//! The friction bridge picks up normal force ([`model_core::extension::bridge_crosstalk`]).
//!
//! Signature: a torque in proportion to normal force with the same sign in both directions, at every speed
//! and at rest, that M2 does not feel. Rivals: see direction asymmetry and load dependence.

use model_core::extension::Extension;

use super::{ContactEffect, ContactModel, Parameter, Scales, Start};

pub(super) struct BridgeCrosstalk;

impl ContactEffect for BridgeCrosstalk {
    fn id(&self) -> &'static str {
        "bridge_crosstalk"
    }

    fn parameters(&self, _variant: usize, scales: &Scales) -> Vec<Parameter> {
        let most = 2.0 * scales.torque_nm / scales.load_n;
        let bend = 0.3 * most / scales.load_n;
        vec![
            Parameter::linear("gain_nm_per_n", 0.0, -most, most),
            Parameter::linear("bend_nm_per_n2", 0.0, -bend, bend),
        ]
    }

    fn starts(&self, _variant: usize, _scales: &Scales) -> Vec<Start> {
        vec![Start::shape(&[0.0, 0.0], &[0, 1])]
    }

    fn apply(
        &self,
        _variant: usize,
        values: &[f64],
        _origin: f64,
        _scales: &Scales,
        model: &mut ContactModel,
    ) {
        model.set(Extension::BridgeCrosstalk, values.to_vec());
    }
}
