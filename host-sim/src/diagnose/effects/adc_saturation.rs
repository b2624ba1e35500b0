//! The friction channel clips ([`model_core::extension::adc_saturation`]).
//!
//! Signature: many samples on end show exactly the channel's extreme while motion and load change and the
//! model goes beyond it. The ends are read off the record, nothing is fitted.

use model_core::extension::Extension;

use super::{ContactEffect, ContactModel, Parameter, Scales, Start};

pub(super) struct AdcSaturation;

impl ContactEffect for AdcSaturation {
    fn id(&self) -> &'static str {
        "adc_saturation"
    }

    fn parameters(&self, _variant: usize, _scales: &Scales) -> Vec<Parameter> {
        Vec::new()
    }

    fn starts(&self, _variant: usize, _scales: &Scales) -> Vec<Start> {
        vec![Start::whole(&[])]
    }

    fn apply(
        &self,
        _variant: usize,
        _values: &[f64],
        _origin: f64,
        scales: &Scales,
        model: &mut ContactModel,
    ) {
        if let Some((low, high)) = scales.friction_ends_nm {
            model.set(Extension::AdcSaturation, vec![low, high]);
        }
    }

    fn applies(&self, _model: &ContactModel, scales: &Scales) -> bool {
        scales.friction_ends_nm.is_some()
    }
}
