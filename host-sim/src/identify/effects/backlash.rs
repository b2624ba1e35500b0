//! `backlash`: a dead zone in the coupling of motor and disc, or motor and load.

use super::{About, DriveView, Effect};
use crate::identify::balance::Alternative;
use crate::identify::coupling::Coupling;
use crate::identify::two_mass::{alternatives_of_grid, machine};

/// The effect.
pub(super) struct Backlash;

impl Effect for Backlash {
    fn about(&self) -> About {
        About {
            id: "backlash",
            meaning: "motor and disc, or motor and load, are coupled with a dead zone",
            experiment: "reverse the lifted disc slowly with small torques",
        }
    }

    fn drive(&self, view: &DriveView<'_>) -> Vec<Alternative> {
        let play = machine(view).play();
        let mut grid = Vec::new();
        for mode_hz in [34.0, 48.0, 68.0] {
            for disc_share in [0.35, 0.55, 0.75] {
                for damping_ratio in [0.05, 0.2] {
                    let of_gap = |plays| Coupling {
                        gap: plays * play,
                        ..Coupling::spring(mode_hz, damping_ratio, disc_share)
                    };
                    grid.extend([0.75, 1.5, 3.0, 6.0, 12.0, 25.0].map(of_gap));
                }
            }
        }
        alternatives_of_grid("backlash", view, grid)
    }
}
