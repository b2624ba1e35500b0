//! Friction varies with the angle of the disc ([`model_core::extension::disc_angle`]).
//!
//! Signature: a residual in proportion to friction, periodic in the disc's angle and not in time, the same
//! in both directions. Rivals: ripple of M2 leaves the friction channel alone; an eccentric encoder changes
//! the measured motion only.
//! Each log has its own origin of the angle.

use std::f64::consts::TAU;

use model_core::extension::Extension;

use super::{ContactEffect, ContactModel, Parameter, Scales, Start};

/// Orders that are fitted.
pub(super) const ORDERS: usize = 10;

pub(super) struct DiscAngle;

impl ContactEffect for DiscAngle {
    fn id(&self) -> &'static str {
        "disc_angle"
    }

    fn parameters(&self, _variant: usize, _scales: &Scales) -> Vec<Parameter> {
        Extension::DiscAngle.names()[1..].iter().map(|name| Parameter::linear(name, 0.0, -0.7, 0.7)).collect()
    }

    fn origin(&self) -> Option<Parameter> {
        Some(Parameter::linear("origin_rad", 0.0, -2.0 * TAU, 2.0 * TAU))
    }

    fn starts(&self, _variant: usize, _scales: &Scales) -> Vec<Start> {
        let amplitudes: Vec<usize> = (0..2 * ORDERS).collect();
        vec![Start::shape(&[0.0; 2 * ORDERS], &amplitudes)]
    }

    fn apply(
        &self,
        _variant: usize,
        values: &[f64],
        origin: f64,
        _scales: &Scales,
        model: &mut ContactModel,
    ) {
        let mut all = vec![origin];
        all.extend(values);
        model.set(Extension::DiscAngle, all);
    }
}
