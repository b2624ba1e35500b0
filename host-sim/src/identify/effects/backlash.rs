//! `backlash`: a dead zone in the coupling of motor and disc.

use super::{About, DriveView, Effect};
use crate::identify::balance::Alternative;
use crate::identify::two_mass::{TwoMass, alternative_of_grid};

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
        let mut grid = Vec::new();
        for (mode_hz, disc_share) in [(40.0, 0.35), (40.0, 0.65), (80.0, 0.35), (80.0, 0.65)] {
            for damping_ratio in [0.05, 0.2] {
                let of_gap = |gap_rad| TwoMass { mode_hz, damping_ratio, disc_share, gap_rad };
                grid.extend([0.003, 0.01, 0.03, 0.05, 0.08].map(of_gap));
            }
        }
        alternative_of_grid("backlash", view, grid).into_iter().collect()
    }
}
