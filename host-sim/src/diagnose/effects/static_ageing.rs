//! Breakaway grows with dwell time ([`model_core::extension::static_ageing`]).
//!
//! Signature: the peak at a start is higher after a longer rest, about with its logarithm, and is gone
//! after a short slide. Rivals: an elastic block overshoots alike after every rest; a cooled surface gives
//! more friction for seconds, not millimetres.

use model_core::extension::Extension;

use super::{ContactEffect, ContactModel, Parameter, Scales, Start};

pub(super) struct StaticAgeing;

impl ContactEffect for StaticAgeing {
    fn id(&self) -> &'static str {
        "static_ageing"
    }

    fn parameters(&self, _variant: usize, _scales: &Scales) -> Vec<Parameter> {
        vec![
            Parameter::linear("growth", 0.0, 0.0, 1.0),
            Parameter::logarithmic("onset_s", 0.1, 3e-3, 30.0),
            Parameter::logarithmic("memory_m", 1e-3, 2e-5, 0.05),
            Parameter::logarithmic("first_age_s", 1.0, 1e-3, 1e4),
        ]
    }

    fn starts(&self, _variant: usize, _scales: &Scales) -> Vec<Start> {
        let mut starts = Vec::new();
        for onset_s in [0.05, 0.5, 3.0] {
            for memory_m in [2e-4, 1e-3, 5e-3] {
                starts.push(Start::shape(&[0.0, onset_s, memory_m, 1.0], &[0]));
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
        model.set(Extension::StaticAgeing, values.to_vec());
    }
}
