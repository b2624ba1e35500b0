//! `presliding`: the bearing yields elastically before it slides.
//!
//! Source: Prandtl (1928) and Ishlinskii (1944); Masing's rule; generalised Maxwell slip (Al-Bender,
//! Lampaert and Swevers, 2005) without its sliding law. Friction is carried by springs in parallel that
//! slide at their limits: d_k follows the position with slope 1/x_k and stays within ±1. Three yield
//! lengths a third of a decade or so apart, with free weights, follow any curve of that width, Dahl's
//! (1968) too. Extension: u = … + Σ F_k d_k(q; x_k) in place of Fc sign(q̇).
//! Sets it apart: after a reversal friction builds up over a *distance*, whatever the speed.

use std::sync::Arc;

use super::conditioned::DriveLog;
use super::effect::{DriveEffect, Known, Prepared, Regressor, Seen};
use super::units::Units;
use crate::fit::bounds::Parameter;

/// The effect.
pub struct Presliding;

/// Yield lengths in multiples of the fitted one; the first replaces the sign of the speed.
const SPREAD: [f64; 3] = [1.0, 0.3, 3.0];

struct Sliders {
    shapes: [Parameter; 1],
    starts: Vec<Vec<f64>>,
}

/// State of a spring that slides at its limit, −1 to 1, over the smooth position.
fn slider(log: &DriveLog, length: f64) -> Vec<f64> {
    let mut state: f64 = 0.0;
    let mut last = log.position.first().copied().unwrap_or(0.0);
    log.position
        .iter()
        .map(|x| {
            state = (state + (x - last) / length).clamp(-1.0, 1.0);
            last = *x;
            state
        })
        .collect()
}

impl Prepared for Sliders {
    fn shapes(&self) -> &[Parameter] {
        &self.shapes
    }

    fn starts(&self) -> &[Vec<f64>] {
        &self.starts
    }

    fn direction(&self, shape: &[f64], log: &DriveLog) -> Option<Vec<f64>> {
        Some(slider(log, SPREAD[0] * shape[0]))
    }

    fn regressors(&self, shape: &[f64], seen: &Seen<'_>) -> Vec<Regressor> {
        let units = Units::of(seen.log.motion);
        [(SPREAD[1], "coulomb_of_third_length"), (SPREAD[2], "coulomb_of_triple_length")]
            .into_iter()
            .map(|(spread, name)| Regressor {
                name: units.effort(name),
                values: slider(seen.log, spread * shape[0]),
            })
            .collect()
    }
}

impl DriveEffect for Presliding {
    fn id(&self) -> &'static str {
        "presliding"
    }

    fn prepare(&self, logs: &[&DriveLog], _known: &Known) -> Result<Arc<dyn Prepared>, String> {
        let Some(log) = logs.first() else { return Err("no training log".into()) };
        let reversals: usize =
            logs.iter().map(|log| log.direction.windows(2).filter(|w| w[0] != w[1]).count()).sum();
        if reversals == 0 {
            return Err("the drive never reverses or stops".into());
        }
        let travel = log.position.windows(2).map(|w| (w[1] - w[0]).abs()).sum::<f64>();
        // From twice the encoder's noise to where every reversal would take a tenth of the log.
        let low = 2.0 * log.position_std.max(1e-12);
        let high = (0.1 * travel).max(100.0 * low);
        let name = Units::of(log.motion).position("yield_length");
        let shapes = [Parameter::logarithmic(&name, (low * high).sqrt(), low, high)];
        let steps = 14;
        let starts =
            (0..steps).map(|i| vec![low * (high / low).powf(f64::from(i) / f64::from(steps - 1))]).collect();
        Ok(Arc::new(Sliders { shapes, starts }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::analysis::Role;
    use crate::fit::drive::inverse::Motion;
    use crate::fit::drive::record::DriveRecord;

    #[test]
    fn friction_builds_up_over_the_yield_length_after_a_reversal() {
        let position: Vec<f64> =
            (0..4000).map(|i| (0.5 * 2.0 * std::f64::consts::PI * 1e-3 * f64::from(i)).sin()).collect();
        let record = DriveRecord { start_s: 0.0, step_s: 1e-3, effort: vec![0.0; 4000], position };
        let log = DriveLog::from_record(record, None, Motion::Rotary, Role::Train);
        let state = slider(&log, 0.05);
        // The reversal is at the crest, 0.5 s; find where the way back is once and twice the length.
        let behind = |way: f64| (500..1500).find(|&i| log.position[500] - log.position[i] > way).unwrap();
        assert!((state[490] - 1.0).abs() < 1e-3);
        // One sample of travel there is 0.0005 of 0.05.
        assert!(state[behind(0.05)].abs() < 0.03);
        assert!((state[behind(0.1)] + 1.0).abs() < 0.03);
    }
}
