//! `shaft_torsion`: motor and disc, or motor and load, are coupled by a spring: a two-mass resonance.

use super::{About, DriveView, Effect};
use crate::identify::balance::Alternative;
use crate::identify::coupling::Coupling;
use crate::identify::two_mass::alternatives_of_grid;

/// The effect.
pub(super) struct ShaftTorsion;

impl Effect for ShaftTorsion {
    fn about(&self) -> About {
        About {
            id: "shaft_torsion",
            meaning: "motor and disc, or motor and load, are coupled by a spring",
            experiment: "drive the lifted disc with a torque sweep from 2 to 100 Hz",
        }
    }

    fn drive(&self, view: &DriveView<'_>) -> Vec<Alternative> {
        let grid = [12.0, 17.0, 24.0, 34.0, 48.0, 68.0].into_iter().flat_map(|mode_hz| {
            [0.03, 0.15].into_iter().flat_map(move |damping_ratio| {
                [0.35, 0.65].map(|disc_share| Coupling::spring(mode_hz, damping_ratio, disc_share))
            })
        });
        alternatives_of_grid("shaft_torsion", view, grid.collect())
    }
}
