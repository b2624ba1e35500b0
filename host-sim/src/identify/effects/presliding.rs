//! `presliding`: the bearing yields elastically before it slides (reversals).

use super::stops::{Stops, stop};
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
        // By how much less than at once it slides.
        let column = |way: f64| {
            let of = |log: &DriveLog| {
                let at_once = direction(log, view.scales.speed);
                let carried = log.filtered(&stop(&log.position, way));
                carried.iter().zip(at_once).map(|(y, s)| y - s).collect::<Vec<f64>>()
            };
            view.logs.iter().flat_map(of).collect()
        };
        let stops = Stops { effect: self.id(), size: view.scales.own, column: &column };
        vec![match view.fixed {
            Some(fixed) => stops.of_constants(fixed),
            None => stops.searched(view.balance, view.company, [SHORTEST * longest, longest]),
        }]
    }
}
