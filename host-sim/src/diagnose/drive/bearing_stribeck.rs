//! `bearing_stribeck`: the bearing's friction falls with speed near zero.
//!
//! Source: Stribeck (1902); Armstrong-Hélouvry, Dupont and Canudas de Wit (1994) for the form
//! exp(−(|v|/v_s)^δ), δ from 0.5 to 2. Extension: u = … + F_s d exp(−(|q̇|/v_s)^δ), F_s the static excess.
//! Sets it apart: odd in direction, only at low speed, the same on the way up and down in speed, so it
//! follows speed and not the distance since reversal ([`super::presliding`]).

use std::sync::Arc;

use super::conditioned::DriveLog;
use super::effect::{DriveEffect, Known, Prepared, Regressor, Seen};
use super::units::Units;
use crate::fit::bounds::Parameter;

/// The effect.
pub struct BearingStribeck;

struct Excess {
    shapes: [Parameter; 2],
    starts: Vec<Vec<f64>>,
}

impl Prepared for Excess {
    fn shapes(&self) -> &[Parameter] {
        &self.shapes
    }

    fn starts(&self) -> &[Vec<f64>] {
        &self.starts
    }

    fn regressors(&self, shape: &[f64], seen: &Seen<'_>) -> Vec<Regressor> {
        let (speed, exponent) = (shape[0], shape[1]);
        let values = seen
            .log
            .speed
            .iter()
            .zip(seen.direction)
            .map(|(v, d)| d * (-(v.abs() / speed).powf(exponent)).exp())
            .collect();
        vec![Regressor { name: Units::of(seen.log.motion).effort("static_excess"), values }]
    }
}

impl DriveEffect for BearingStribeck {
    fn id(&self) -> &'static str {
        "bearing_stribeck"
    }

    fn prepare(&self, logs: &[&DriveLog], _known: &Known) -> Result<Arc<dyn Prepared>, String> {
        let quantiles: Vec<Vec<f64>> =
            logs.iter().map(|log| log.speed_quantiles(&[0.01, 0.7, 0.95])).collect();
        let over = |at: usize, pick: fn(f64, f64) -> f64| quantiles.iter().map(|q| q[at]).reduce(pick);
        let (Some(low), Some(high), Some(fast)) = (over(0, f64::min), over(1, f64::max), over(2, f64::max))
        else {
            return Err("no training log".into());
        };
        let low = low.max(1e-3 * fast);
        if high <= 2.0 * low {
            return Err("the speed does not vary enough to see friction change with it".into());
        }
        let units = Units::of(logs[0].motion);
        let middle = (low * high).sqrt();
        let shapes = [
            Parameter::logarithmic(&units.speed("stribeck_speed"), middle, 0.3 * low, 1.5 * high),
            Parameter::linear("exponent", 1.0, 0.5, 2.0),
        ];
        let steps = 8;
        let starts = (0..steps)
            .map(|i| vec![low * (high / low).powf(f64::from(i) / f64::from(steps - 1)), 1.0])
            .collect();
        Ok(Arc::new(Excess { shapes, starts }))
    }
}
