//! The friction coefficient depends on normal force ([`model_core::extension::load_dependence`]).
//!
//! Signature: the residual's ratio to friction goes with the logarithm of the load, at every speed and in
//! both directions. Rivals: crosstalk has one sign in both directions; a film goes with speed.

use model_core::extension::Extension;

use super::{ContactEffect, ContactModel, Parameter, Scales, Start};

pub(super) struct LoadDependence;

impl ContactEffect for LoadDependence {
    fn id(&self) -> &'static str {
        "load_dependence"
    }

    fn parameters(&self, _variant: usize, scales: &Scales) -> Vec<Parameter> {
        vec![
            Parameter::linear("exponent", 0.0, -0.9, 0.9),
            Parameter::logarithmic("offset_n", scales.load_n, 1e-2 * scales.load_n, 30.0 * scales.load_n),
        ]
    }

    fn starts(&self, _variant: usize, scales: &Scales) -> Vec<Start> {
        [0.02, 0.6, 6.0].map(|share| Start::shape(&[0.0, share * scales.load_n], &[0])).to_vec()
    }

    fn apply(
        &self,
        _variant: usize,
        values: &[f64],
        _origin: f64,
        scales: &Scales,
        model: &mut ContactModel,
    ) {
        model.set(Extension::LoadDependence, vec![values[0], scales.load_n, values[1]]);
    }
}
