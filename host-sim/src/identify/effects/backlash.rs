//! `backlash`: a dead zone in the coupling of motor and disc.

use super::{About, DriveView, Effect};
use crate::identify::balance::Alternative;
use crate::identify::two_mass::{TwoMass, alternatives};

/// The effect.
pub(super) struct Backlash;

impl Effect for Backlash {
    fn about(&self) -> About {
        About {
            id: "backlash",
            meaning: "disc and motor are coupled with a dead zone",
            experiment: "reverse the lifted disc slowly with small torques",
        }
    }

    fn drive(&self, view: &DriveView<'_>) -> Vec<Alternative> {
        let grid = [40.0, 80.0].into_iter().flat_map(|mode_hz| {
            [0.35, 0.65].into_iter().flat_map(move |disc_share| {
                [0.003, 0.01, 0.03, 0.08].map(|gap_rad| TwoMass { mode_hz, damping_ratio: 0.2, disc_share, gap_rad })
            })
        });
        alternatives("backlash", view, grid.collect())
    }
}
