//! The block creeps ([`model_core::extension::rubber_relaxation`]).
//!
//! Signature: after a stop the held force sinks over seconds, and starts and reversals wind up more
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
        // Compliance of each creeping branch over that of the block, and its time.
        let ratio = |name| Parameter::linear(name, 0.0, 0.0, 10.0);
        vec![
            ratio("creep_ratio"),
            Parameter::logarithmic("relaxation_s", 0.02, 3e-3, 0.2),
            ratio("creep_ratio_2"),
            Parameter::logarithmic("relaxation_2_s", 0.2, 0.02, 2.0),
            ratio("creep_ratio_3"),
            Parameter::logarithmic("relaxation_3_s", 2.0, 0.2, 30.0),
        ]
    }

    fn starts(&self, _variant: usize, _scales: &Scales) -> Vec<Start> {
        [0.5, 1.5].map(|f| Start::shape(&[0.0, 0.02 * f, 0.0, 0.2 * f, 0.0, 1.5 * f], &[0, 2, 4])).to_vec()
    }

    fn apply(
        &self,
        _variant: usize,
        values: &[f64],
        _origin: f64,
        scales: &Scales,
        model: &mut ContactModel,
    ) {
        let stiffness = |ratio: f64| (scales.stiffness_n_per_m / ratio.max(1e-9)).clamp(1.0, 1e12);
        let branches = values.chunks_exact(2).flat_map(|branch| [stiffness(branch[0]), branch[1]]);
        model.set(Extension::RubberRelaxation, branches.collect());
    }
}
