//! `presliding`: the bearing yields elastically before it slides (reversals).

use super::waves::travel;
use super::{About, DriveView, Effect};
use crate::identify::balance::Alternative;
use crate::identify::drive::{COULOMB, direction};
use crate::identify::term::Parameter;

/// The effect.
pub(super) struct Presliding;

/// Yield lengths that are tried, in shares of the travel, a factor of two apart; and in radians at most.
const LENGTHS: usize = 9;
/// The longest, in shares of the travel between reversals.
const LONGEST: f64 = 0.1;

impl Effect for Presliding {
    fn about(&self) -> About {
        About {
            id: "presliding",
            meaning: "the bearing yields elastically before it slides",
            experiment: "reverse the lifted disc slowly with amplitudes of 1, 10 and 100 mrad",
        }
    }

    fn drive(&self, view: &DriveView<'_>) -> Vec<Alternative> {
        let reach = view.logs.iter().map(|log| travel(log.position.iter().copied())).fold(0.0, f64::max);
        let longest = LONGEST * if view.rotary { reach.min(3.0) } else { reach };
        let shape = |length: f64| {
            // Dahl's spring: it follows the motion and fades towards the direction's sign.
            let state: Vec<f64> = view
                .logs
                .iter()
                .flat_map(|log| {
                    let (mut z, mut last) = (0.0, log.position[0]);
                    let follow = |x: &f64| {
                        let moved = (x - last) / length;
                        last = *x;
                        z = if moved.abs() > 0.0 { (z - moved.signum()) * (-moved.abs()).exp() + moved.signum() } else { z };
                        z
                    };
                    let state: Vec<f64> = log.position.iter().map(follow).collect();
                    log.filtered(&state)
                })
                .collect();
            let sliding = view.logs.iter().flat_map(|log| direction(log, view.scales.speed)).collect();
            Alternative {
                form: format!("over {length:.2e}"),
                constants: vec![("yield_length".to_string(), length)],
                replaces: vec![(COULOMB, state)],
                log_prior: -(LENGTHS as f64).ln(),
                ..Alternative::columns("presliding", vec![Parameter::amplitude("sliding_at_once", view.scales.own)], vec![sliding])
            }
        };
        let grid = (0..LENGTHS).map(|i| longest * 0.5f64.powi(i as i32)).collect();
        super::shapes(view.fixed, "yield_length", grid).into_iter().map(shape).collect()
    }
}
