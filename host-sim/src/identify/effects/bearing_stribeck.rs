//! `bearing_stribeck`: the bearing's friction falls with speed near zero.
//!
//! However it falls: a sum of Gaussians that are not negative, `stribeck_curve.rs`, beside Coulomb friction that is not so either.

use super::stribeck_curve::Curve;
use super::{About, DriveLaw, DriveView, Effect};
use crate::identify::balance::Alternative;
use crate::identify::drive::COULOMB;

/// The effect.
pub(super) struct BearingStribeck;

impl Effect for BearingStribeck {
    fn about(&self) -> About {
        About {
            id: "bearing_stribeck",
            meaning: "the bearing's friction falls with speed near zero",
            experiment: "turn the lifted disc steadily at eight speeds from 0.1 to 10 rad/s",
        }
    }

    fn drive(&self, view: &DriveView<'_>) -> Vec<Alternative> {
        let curve = Curve::new(view);
        vec![Alternative {
            constants: curve.constants(),
            // What falls over all speeds down to less than no friction is a drag that rises with them.
            not_negative: vec![COULOMB],
            ..Alternative::columns(self.id(), curve.parameters("", view.scales.own), curve.columns(view, |d| d))
        }]
    }

    fn drive_law(&self, value: &dyn Fn(&str) -> Option<f64>) -> Option<DriveLaw> {
        let excess = Curve::of_file("", value)?;
        Some(DriveLaw::effort(move |v| v.signum() * excess(v)))
    }
}
