//! A film between rubber and road ([`model_core::extension::viscous_film`]).
//!
//! Signature: a residual in proportion to speed that is the same under every load. Rivals: the model's
//! own viscous term goes with load; the bearing's is not seen by the friction bridge.

use model_core::extension::Extension;

use super::{ContactEffect, ContactModel, Parameter, Scales, Start};

pub(super) struct ViscousFilm;

impl ContactEffect for ViscousFilm {
    fn id(&self) -> &'static str {
        "viscous_film"
    }

    fn parameters(&self, _variant: usize, scales: &Scales) -> Vec<Parameter> {
        let most = 3.0 * scales.load_n / scales.speed_m_s.1;
        vec![Parameter::linear("coefficient_n_s_per_m", 0.0, 0.0, most)]
    }

    fn starts(&self, _variant: usize, _scales: &Scales) -> Vec<Start> {
        vec![Start::shape(&[0.0], &[0])]
    }

    fn apply(
        &self,
        _variant: usize,
        values: &[f64],
        _origin: f64,
        _scales: &Scales,
        model: &mut ContactModel,
    ) {
        model.set(Extension::ViscousFilm, values.to_vec());
    }
}
