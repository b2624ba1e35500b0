//! `presliding`: the bearing yields elastically before it slides (reversals).
//!
//! Stops side by side, whose sum has any concave curve after a reversal, the same between any two; or Dahl's spring (P. R. Dahl,
//! Aerospace Corp. TOR-158, 1968), dz/dx = (1 − z sgn ẋ)/X, which after a reversal half way is softer than those.

use rayon::prelude::*;

use super::stops::{Stops, about, coarse, log_prior, stop};
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
/// The name of the way of Dahl's spring.
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
        let at_once: Vec<Vec<f64>> = view.logs.iter().map(|log| direction(log, view.scales.speed)).collect();
        // By how much less than at once it slides.
        let later = |carried: &dyn Fn(&[f64]) -> Vec<f64>| -> Vec<f64> {
            let of = |(log, at_once): (&DriveLog, &Vec<f64>)| {
                let carried = log.filtered(&carried(&log.position));
                carried.iter().zip(at_once).map(|(y, s)| y - s).collect::<Vec<f64>>()
            };
            view.logs.iter().zip(&at_once).flat_map(of).collect()
        };
        let units @ [of_way, of_size] = if view.rotary { ["rad", "nm"] } else { ["m", "n"] };
        let stops = Stops {
            effect: self.id(),
            size: view.scales.own,
            units,
            column: &|way| later(&|position| stop(position, way)),
            deflection: None,
        };
        let spring = |way: f64| Alternative {
            form: "Dahl's spring".into(),
            constants: vec![(format!("{YIELD_WAY}_{of_way}"), way)],
            ..Alternative::columns(
                self.id(),
                vec![Parameter::positive(format!("sliding_later_{of_size}"), view.scales.own)],
                vec![later(&|position| dahl(position, way))],
            )
        };
        if let Some(fixed) = view.fixed {
            let way = fixed.iter().find(|(name, _)| name.starts_with(YIELD_WAY));
            return vec![way.map_or_else(|| stops.of_constants(fixed), |(_, way)| spring(*way))];
        }
        let best = |ways: Vec<f64>| {
            let evidence = |way: f64| view.balance.solve_forms(&view.company.with(&spring(way))).log_evidence;
            let tried: Vec<(f64, f64)> = ways.into_par_iter().map(|way| (evidence(way), way)).collect();
            tried.into_iter().max_by(|a, b| a.0.total_cmp(&b.0)).map_or(longest, |(_, way)| way)
        };
        let ways = coarse([SHORTEST * longest, longest]);
        let way = best(about(best(ways.clone())).collect());
        let spring = Alternative { log_prior: log_prior(&ways), ..spring(way) };
        vec![stops.searched(view.balance, view.company, &ways), spring]
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
