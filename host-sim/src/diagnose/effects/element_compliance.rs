//! The rubber block between root and tip: a baseline without it cannot overshoot.
//!
//! k_u u + c_u u̇ carries the force of the bristles (Fig. 25). While the block winds up after a start or a
//! load step, the tip is slower than the root and feels a higher g(v): friction overshoots the value that
//! it settles to, and follows a change of speed late. Rival: a softer bristle (σ0), which is late but
//! cannot overshoot; it is part of the baseline that is refitted.

use super::{ContactEffect, ContactModel, Parameter, Scales, Start};
use crate::files::model_file::ModelKind;

pub(super) struct ElementCompliance;

impl ContactEffect for ElementCompliance {
    fn id(&self) -> &'static str {
        "element_compliance"
    }

    fn parameters(&self, _variant: usize, _scales: &Scales) -> Vec<Parameter> {
        vec![
            Parameter::logarithmic("k_u_n_per_m", 3e4, 1e3, 1e6),
            Parameter::logarithmic("c_u_n_s_per_m", 160.0, 2.0, 1e4),
        ]
    }

    fn starts(&self, _variant: usize, _scales: &Scales) -> Vec<Start> {
        [[3e4, 160.0], [1.2e4, 80.0], [7e4, 300.0], [3e4, 500.0]].map(|values| Start::whole(&values)).to_vec()
    }

    fn apply(
        &self,
        _variant: usize,
        values: &[f64],
        _origin: f64,
        _scales: &Scales,
        model: &mut ContactModel,
    ) {
        model.kind = ModelKind::Series;
        model.set_parameter("k_u_n_per_m", values[0]);
        model.set_parameter("c_u_n_s_per_m", values[1]);
    }

    fn applies(&self, model: &ContactModel, _scales: &Scales) -> bool {
        matches!(model.kind, ModelKind::Lugre | ModelKind::ModifiedLugre)
    }
}
