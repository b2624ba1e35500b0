//! Friction changes with the distance slid and does not come back ([`model_core::extension::wear_drift`]).
//!
//! Signature: a drift that goes on only while the disc turns, in proportion to distance and not to power or
//! time. Rivals: thermal fade recovers at rest; drift of the bridge goes on at rest.

use model_core::extension::Extension;

use super::{ContactEffect, ContactModel, Parameter, Scales, Start};

pub(super) struct WearDrift;

impl ContactEffect for WearDrift {
    fn id(&self) -> &'static str {
        "wear_drift"
    }

    fn parameters(&self, _variant: usize, scales: &Scales) -> Vec<Parameter> {
        let distance_m = scales.distance_m;
        vec![
            // Relative change after the longest distance of a record.
            Parameter::linear("change_over_record", 0.0, -0.9, 4.0),
            Parameter::logarithmic("scale_m", distance_m, 0.02 * distance_m, (1e3 * distance_m).min(1e6)),
        ]
    }

    fn starts(&self, _variant: usize, scales: &Scales) -> Vec<Start> {
        [0.08, 0.25, 0.8, 15.0].map(|share| Start::shape(&[0.0, share * scales.distance_m], &[0])).to_vec()
    }

    fn apply(
        &self,
        _variant: usize,
        values: &[f64],
        _origin: f64,
        scales: &Scales,
        model: &mut ContactModel,
    ) {
        let reached = -(-scales.distance_m / values[1]).exp_m1();
        model.set(Extension::WearDrift, vec![values[0] / (values[1] * reached), values[1]]);
    }
}
