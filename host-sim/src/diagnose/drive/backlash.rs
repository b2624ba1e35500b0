//! `backlash`: a dead zone in the coupling of motor and disc.
//!
//! Source: the original rig has an optional backlash (Figs. 6–7); Nordin and Gutman (2002). Extension:
//! as [`super::shaft_torsion`] with a gap: u = J₁ q̈ + J₂ w(β, x₀, n, ζ) + ….
//! Sets it apart: at torque reversals the motor moves through the gap with its own inertia alone, then
//! the flanks meet; between reversals nothing is missing, however fast the motion changes.

use std::sync::Arc;

use super::conditioned::DriveLog;
use super::effect::{DriveEffect, Known, Prepared, Regressor, Seen, Slow};
use super::resonance::Resonance;
use super::shaft::{Shaft, Spring, add_motor_share, disc_per_inertia, typical_acceleration};
use super::units::Units;
use crate::fit::bounds::Parameter;
use crate::fit::drive::inverse::Motion;

/// Widest gap of a shaft's coupling.
const WIDEST_RAD: f64 = 0.1;
/// Widest gap of a stage.
const WIDEST_M: f64 = 2e-3;

/// The effect.
pub struct Backlash;

struct DeadZone {
    shapes: Vec<Parameter>,
    starts: Vec<Vec<f64>>,
    slow: Slow,
    typical: f64,
}

impl Prepared for DeadZone {
    fn shapes(&self) -> &[Parameter] {
        &self.shapes
    }

    fn starts(&self) -> &[Vec<f64>] {
        &self.starts
    }

    fn resonance(&self, shape: &[f64]) -> Option<Resonance> {
        // Of the flank at the typical torque.
        let slope = shape[2] * self.typical / shape[1];
        Some(Resonance { omega_rad_s: slope.sqrt(), damping_ratio: shape[3] })
    }

    fn regressors(&self, shape: &[f64], seen: &Seen<'_>) -> Vec<Regressor> {
        let name = Units::of(seen.log.motion).inertia("disc_inertia");
        vec![Regressor { name, values: self.shaft(shape).follow(seen.log).torque_per_inertia }]
    }

    fn disc_offset(&self, shape: &[f64], _sizes: &[f64], seen: &Seen<'_>) -> Option<Vec<f64>> {
        Some(self.shaft(shape).follow(seen.log).offset)
    }
}

impl DeadZone {
    fn shaft(&self, shape: &[f64]) -> Shaft {
        let (gap, depth, exponent) = (shape[0], shape[1], shape[2]);
        let per_inertia = shape[4] / self.slow.inertia;
        let slope = self.typical / depth;
        Shaft {
            spring: Spring::Flanks {
                half_gap: 0.5 * gap,
                factor: self.typical / depth.powf(exponent),
                exponent,
                // Up to four times the typical acceleration.
                steepest: exponent * slope * 4f64.powf(1.0 - 1.0 / exponent),
            },
            damping: 2.0 * shape[3] * slope.sqrt(),
            coulomb: self.slow.coulomb * per_inertia,
            viscous: self.slow.viscous * per_inertia,
            per_inertia: disc_per_inertia(shape.get(5), self.slow.inertia),
        }
    }
}

impl DriveEffect for Backlash {
    fn id(&self) -> &'static str {
        "backlash"
    }

    fn prepare(&self, logs: &[&DriveLog], known: &Known) -> Result<Arc<dyn Prepared>, String> {
        let Some(log) = logs.first() else { return Err("no training log".into()) };
        let band = log.band_hz;
        let travel = log.position.windows(2).map(|w| (w[1] - w[0]).abs()).sum::<f64>();
        let widest = if log.motion == Motion::Rotary { WIDEST_RAD } else { WIDEST_M };
        let high = widest.min(0.02 * travel);
        let low = (20.0 * log.position_std).max(high / 300.0);
        if high <= 4.0 * low {
            return Err("the drive hardly moves".into());
        }
        let units = Units::of(log.motion);
        let typical = typical_acceleration(logs);
        let depth_of = |hz: f64| typical / (2.0 * std::f64::consts::PI * hz).powi(2);
        let (deep, shallow) = (depth_of(5.0), depth_of(3.0 * band));
        let mut shapes = vec![
            Parameter::logarithmic(&units.position("gap"), (low * high).sqrt(), low, high),
            Parameter::logarithmic(&units.position("flank_depth"), (deep * shallow).sqrt(), shallow, deep),
            Parameter::linear("flank_exponent", 1.2, 1.0, 2.5),
            Parameter::logarithmic("damping_ratio", 0.1, 1e-2, 1.5),
            Parameter::linear("disc_friction_share", 0.3, 0.0, 3.0),
        ];
        let (gaps, depths) = (8, 6);
        let mut starts = Vec::new();
        for g in 0..gaps {
            let gap = low * (high / low).powf((f64::from(g) + 0.5) / f64::from(gaps));
            for d in 0..depths {
                let depth = shallow * (deep / shallow).powf((f64::from(d) + 0.5) / f64::from(depths));
                starts.push(vec![gap, depth, 1.2, 0.1, 0.3]);
            }
        }
        add_motor_share(logs, &mut shapes, &mut starts);
        Ok(Arc::new(DeadZone { shapes, starts, slow: known.slow, typical }))
    }
}
