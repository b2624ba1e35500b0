//! `presliding`: the bearing yields elastically before it slides (reversals).
//!
//! Stops side by side, whose sum has any concave curve after a reversal, the same between any two; or Dahl's spring.

use super::dahl::{self, Spring};
use super::stops::{Stops, coarse, stop};
use super::waves::travel;
use super::{About, DriveView, Effect};
use crate::identify::balance::Alternative;
use crate::identify::drive::{DriveLog, direction};

/// The effect.
pub(super) struct Presliding;

/// The longest way over which it yields, in shares of the travel, or of what is no travel between reversals any more, rad; and the
/// shortest, in shares of the longest.
const LONGEST: f64 = 0.1;
const LONGEST_TRAVEL_RAD: f64 = 3.0;
const SHORTEST: f64 = 1.0 / 128.0;

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
        let spring = Spring {
            effect: self.id(),
            size: view.scales.own,
            sliding: &format!("sliding_later_{of_size}"),
            unit: of_way,
            column: &|way| later(&|position| dahl::spring(position, way)),
            deflection: None,
        };
        if let Some(fixed) = view.fixed {
            return vec![spring.of_constants(fixed).unwrap_or_else(|| stops.of_constants(fixed))];
        }
        let ways = [SHORTEST * longest, longest];
        vec![
            stops.searched(view.balance, view.company, &coarse(ways)),
            spring.searched(view.balance, view.company, ways),
        ]
    }
}
