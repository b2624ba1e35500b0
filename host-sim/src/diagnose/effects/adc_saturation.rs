//! A channel clips ([`model_core::extension::adc_saturation`]).
//!
//! Signature: many samples on end show exactly the channel's extreme while motion and load change and the
//! model goes beyond it. The ends are read off the record, nothing is fitted.
//! Where the normal bridge clips, the load beyond its end is taken from M1's torque
//! ([`restored`](crate::diagnose::contact::restored)); the friction channel then says whether that is true.

use model_core::extension::Extension;

use super::{ContactEffect, ContactModel, Parameter, Scales, Start};

/// Torque that no channel reaches, N·m: an end where there is none.
const NO_END_NM: f64 = 1e4;

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
        let (low, high) = scales.friction_ends_nm;
        let ends = vec![low.unwrap_or(-NO_END_NM), high.unwrap_or(NO_END_NM)];
        model.set(Extension::AdcSaturation, ends);
        model.restored_load = scales.normal_clips;
    }

    fn applies(&self, _model: &ContactModel, scales: &Scales) -> bool {
        let (low, high) = scales.friction_ends_nm;
        low.is_some() || high.is_some() || scales.normal_clips
    }
}
