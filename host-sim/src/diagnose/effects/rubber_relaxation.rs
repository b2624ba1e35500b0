//! The block creeps ([`model_core::extension::rubber_relaxation`]).
//!
//! Signature: after a stop the held force sinks with one time constant, and starts and reversals wind up more
//! slowly than a single spring and damper can. Rivals: the elastic block itself, whose k_u and c_u are
//! refitted; ageing, which raises the next breakaway instead.

use model_core::extension::Extension;

use super::{ContactEffect, ContactModel, Parameter, Scales, Start};

pub(super) struct RubberRelaxation;

impl ContactEffect for RubberRelaxation {
    fn id(&self) -> &'static str {
        "rubber_relaxation"
    }

    fn parameters(&self, _variant: usize, _scales: &Scales) -> Vec<Parameter> {
        vec![
            // Compliance of the creeping branch over that of the block.
            Parameter::linear("creep_ratio", 0.0, 0.0, 10.0),
            Parameter::logarithmic("relaxation_s", 0.2, 5e-3, 20.0),
        ]
    }

    fn starts(&self, _variant: usize, _scales: &Scales) -> Vec<Start> {
        [0.02, 0.06, 0.2, 0.6, 2.0].map(|relaxation_s| Start::shape(&[0.0, relaxation_s], &[0])).to_vec()
    }

    fn apply(
        &self,
        _variant: usize,
        values: &[f64],
        _origin: f64,
        scales: &Scales,
        model: &mut ContactModel,
    ) {
        let stiffness = (scales.stiffness_n_per_m / values[0].max(1e-6)).clamp(1.0, 1e10);
        model.set(Extension::RubberRelaxation, vec![stiffness, values[1]]);
    }
}
