//! The friction channel lags the motion by a pure delay ([`model_core::extension::friction_delay`]).
//!
//! Signature: every change of friction, at starts, load steps and reversals, comes late by the same time,
//! without a change of shape. Rivals: an elastic block is late by a distance, and less at high speed; a soft
//! ring overshoots.

use model_core::extension::Extension;

use super::{ContactEffect, ContactModel, Parameter, Scales, Start};

pub(super) struct FrictionDelay;

impl ContactEffect for FrictionDelay {
    fn id(&self) -> &'static str {
        "friction_delay"
    }

    fn parameters(&self, _variant: usize, _scales: &Scales) -> Vec<Parameter> {
        vec![Parameter::logarithmic("delay_s", 3e-3, 3e-4, 0.3)]
    }

    fn starts(&self, _variant: usize, _scales: &Scales) -> Vec<Start> {
        [1e-3, 2e-3, 4e-3, 8e-3, 15e-3, 30e-3, 60e-3].map(|delay_s| Start::whole(&[delay_s])).to_vec()
    }

    fn apply(
        &self,
        _variant: usize,
        values: &[f64],
        _origin: f64,
        _scales: &Scales,
        model: &mut ContactModel,
    ) {
        model.set(Extension::FrictionDelay, values.to_vec());
    }
}
