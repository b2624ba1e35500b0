//! `foil_hardening`: the foil springs that M1 works against stiffen as they are bent.
//!
//! Source: large deflection of clamped leaf springs, whose membrane tension adds a force that grows
//! faster than linearly (Timoshenko, Strength of Materials II). F = P[G τ − F0 − H (x/x_f)^p], p > 1, x
//! the travel from where the elements touch and x_f the greatest travel of the training logs, so that H
//! is the force lost there.
//! Sets it apart: the force over torque bends, the same on the way up and down.

use std::sync::Arc;

use super::conditioned::PressureLog;
use super::effect::{Column, OwnValue, Prepared, PressureEffect, travel_range};
use crate::fit::bounds::Parameter;

/// The effect.
pub struct FoilHardening;

struct PowerLaw {
    shapes: [Parameter; 1],
    starts: Vec<Vec<f64>>,
    full_travel_n: f64,
}

impl Prepared for PowerLaw {
    fn shapes(&self) -> &[Parameter] {
        &self.shapes
    }

    fn starts(&self) -> &[Vec<f64>] {
        &self.starts
    }

    fn own_value(&self) -> Option<OwnValue> {
        None
    }

    fn columns(&self, shape: &[f64], _own: f64, log: &PressureLog) -> Vec<Column> {
        let values = log.travel_n.iter().map(|x| (x.max(0.0) / self.full_travel_n).powf(shape[0])).collect();
        vec![Column { name: "hardening_n", values, not_negative: true }]
    }

    fn constants(&self) -> Vec<(&'static str, f64)> {
        vec![("full_travel_n", self.full_travel_n)]
    }
}

impl PressureEffect for FoilHardening {
    fn id(&self) -> &'static str {
        "foil_hardening"
    }

    fn prepare(&self, logs: &[&PressureLog], _residual_n: &[Vec<f64>]) -> Result<Arc<dyn Prepared>, String> {
        let (_, high) = travel_range(logs)?;
        Ok(Arc::new(PowerLaw {
            shapes: [Parameter::logarithmic("exponent", 2.5, 1.15, 8.0)],
            starts: vec![vec![1.5], vec![2.5], vec![4.0]],
            full_travel_n: high,
        }))
    }
}
