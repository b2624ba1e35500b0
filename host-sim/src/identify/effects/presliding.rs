//! `presliding`: the bearing yields elastically before it slides (reversals).
//!
//! Stops side by side, whose sum has any concave curve after a reversal, the same between any two; or Dahl's spring (P. R. Dahl,
//! Aerospace Corp. TOR-158, 1968), dz/dx = (1 − z sgn ẋ)/X, which after a reversal half way is softer than those.

use rayon::prelude::*;

use super::stops::{Stops, stop};
use super::waves::travel;
use super::{About, DriveView, Effect};
use crate::identify::balance::Alternative;
use crate::identify::drive::{DriveLog, direction};
use crate::identify::term::Parameter;

/// The effect.
pub(super) struct Presliding;

/// The longest way over which it yields, in shares of the travel, or of what is no travel between reversals any more, rad; and the
/// shortest, in shares of the longest.
const LONGEST: f64 = 0.1;
const LONGEST_TRAVEL_RAD: f64 = 3.0;
const SHORTEST: f64 = 1.0 / 128.0;
/// Ways of Dahl's spring that are tried from the longest on, a factor of √2 apart, and steps of a finer grid between two.
const WAYS: i32 = 15;
const FINE: i32 = 4;
/// The name of it.
const YIELD_WAY: &str = "yield_way";

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
        let longest = LONGEST * if view.rotary { reach.min(LONGEST_TRAVEL_RAD) } else { reach };
        // By how much less than at once it slides.
        let column = |way: f64| {
            let of = |log: &DriveLog| {
                let at_once = direction(log, view.scales.speed);
                let carried = log.filtered(&stop(&log.position, way));
                carried.iter().zip(at_once).map(|(y, s)| y - s).collect::<Vec<f64>>()
            };
            view.logs.iter().flat_map(of).collect()
        };
        let stops = Stops { effect: self.id(), size: view.scales.own, column: &column, deflection: None };
        let spring = |way: f64| {
            let of = |log: &DriveLog| {
                let at_once = direction(log, view.scales.speed);
                let carried = log.filtered(&dahl(&log.position, way));
                carried.iter().zip(at_once).map(|(y, s)| y - s).collect::<Vec<f64>>()
            };
            Alternative {
                form: "Dahl's spring".into(),
                constants: vec![(YIELD_WAY.into(), way)],
                ..Alternative::columns(
                    self.id(),
                    vec![Parameter::positive("sliding_later", view.scales.own)],
                    vec![view.logs.iter().flat_map(of).collect()],
                )
            }
        };
        if let Some(fixed) = view.fixed {
            let way = fixed.iter().find(|(name, _)| name == YIELD_WAY);
            return vec![way.map_or_else(|| stops.of_constants(fixed), |(_, way)| spring(*way))];
        }
        let evidence = |way: f64| {
            let form = spring(way);
            let forms: Vec<&Alternative> = view.company.forms.iter().copied().chain([&form]).collect();
            view.balance.solve_forms(&forms).log_evidence
        };
        let best = |ways: Vec<f64>| {
            let tried: Vec<(f64, f64)> = ways.into_par_iter().map(|way| (evidence(way), way)).collect();
            tried.into_iter().max_by(|a, b| a.0.total_cmp(&b.0)).map_or(longest, |(_, way)| way)
        };
        let coarse = best((0..WAYS).map(|i| longest * 0.5f64.powf(0.5 * f64::from(i))).collect());
        let fine = best((1 - FINE..FINE).map(|i| coarse * 0.5f64.powf(0.5 * f64::from(i) / f64::from(FINE))).collect());
        let spring = Alternative { log_prior: -f64::from(WAYS * FINE).ln(), ..spring(fine) };
        vec![stops.searched(view.balance, view.company, [SHORTEST * longest, longest]), spring]
    }
}

/// Dahl's spring over its full force.
fn dahl(position: &[f64], way: f64) -> Vec<f64> {
    let (mut z, mut last) = (0.0, position[0]);
    let follow = |x: &f64| {
        let moved = (x - last) / way;
        last = *x;
        if moved != 0.0 {
            z = moved.signum() + (z - moved.signum()) * (-moved.abs()).exp();
        }
        z
    };
    position.iter().map(follow).collect()
}
