//! `shaft_torsion`: disc and motor are coupled by a torsional spring; two masses resonate.
//!
//! Source: the original rig has a changeable shaft (Figs. 6–7). Extension: the inertia splits into the
//! motor's and the disc's, which follows by [`super::shaft`]: u = J₁ q̈ + J₂ w(ω, ζ, κ) + ….
//! Sets it apart: the residual rings at one frequency after every fast change, in proportion to it,
//! small and large alike.

use std::sync::Arc;

use super::conditioned::DriveLog;
use super::effect::{DriveEffect, Known, Prepared, Regressor, Seen};
use super::resonance::Resonance;
use super::shaft::{Shaft, Spring, add_motor_share, disc_per_inertia, typical_acceleration};
use super::units::Units;
use crate::fit::bounds::Parameter;

/// The effect.
pub struct ShaftTorsion;

struct TwoMasses {
    shapes: Vec<Parameter>,
    starts: Vec<Vec<f64>>,
    coulomb: f64,
    viscous: f64,
    typical: f64,
    inertia: f64,
}

impl Prepared for TwoMasses {
    fn shapes(&self) -> &[Parameter] {
        &self.shapes
    }

    fn starts(&self) -> &[Vec<f64>] {
        &self.starts
    }

    fn resonance(&self, shape: &[f64]) -> Option<Resonance> {
        let omega_rad_s = 2.0 * std::f64::consts::PI * shape[0];
        Some(Resonance { omega_rad_s, damping_ratio: shape[1] })
    }

    fn regressors(&self, shape: &[f64], seen: &Seen<'_>) -> Vec<Regressor> {
        let name = Units::of(seen.log.motion).inertia("disc_inertia");
        vec![Regressor { name, values: self.shaft(shape).follow(seen.log).torque_per_inertia }]
    }

    fn disc_offset(&self, shape: &[f64], _sizes: &[f64], seen: &Seen<'_>) -> Option<Vec<f64>> {
        Some(self.shaft(shape).follow(seen.log).offset)
    }
}

impl TwoMasses {
    fn shaft(&self, shape: &[f64]) -> Shaft {
        let omega = 2.0 * std::f64::consts::PI * shape[0];
        let stiffness = omega * omega;
        Shaft {
            spring: Spring::Shaft { stiffness, hardening: shape[3] / (self.typical / stiffness).powi(2) },
            damping: 2.0 * shape[1] * omega,
            coulomb: shape[2] * self.coulomb,
            viscous: shape[2] * self.viscous,
            per_inertia: disc_per_inertia(shape.get(4), self.inertia),
        }
    }
}

impl DriveEffect for ShaftTorsion {
    fn id(&self) -> &'static str {
        "shaft_torsion"
    }

    fn prepare(&self, logs: &[&DriveLog], known: &Known) -> Result<Arc<dyn Prepared>, String> {
        let band = logs.iter().map(|log| log.band_hz).fold(f64::INFINITY, f64::min);
        let (low, high) = (3.0, 1.6 * band);
        let steps = 16;
        let at = |i: i32| low * (high / low).powf(f64::from(i) / f64::from(steps - 1));
        let mut shapes = vec![
            Parameter::logarithmic("natural_frequency_hz", 0.5 * band, low, high),
            Parameter::logarithmic("damping_ratio", 0.03, 2e-3, 0.7),
            // Friction of the disc in multiples of the whole friction over the whole inertia.
            Parameter::linear("disc_friction_share", 0.3, 0.0, 3.0),
            Parameter::linear("hardening", 0.0, -0.1, 0.5),
        ];
        let mut starts: Vec<Vec<f64>> =
            (0..steps).flat_map(|i| [0.02, 0.15].map(|damping| vec![at(i), damping, 0.3, 0.0])).collect();
        add_motor_share(logs, &mut shapes, &mut starts);
        let per_inertia = |value: f64| (value / known.slow.inertia).max(0.0);
        Ok(Arc::new(TwoMasses {
            shapes,
            starts,
            coulomb: per_inertia(known.slow.coulomb),
            viscous: per_inertia(known.slow.viscous),
            typical: typical_acceleration(logs),
            inertia: known.slow.inertia,
        }))
    }
}
