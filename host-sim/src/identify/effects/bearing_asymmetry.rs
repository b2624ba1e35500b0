//! `bearing_asymmetry`: the bearing's Coulomb or viscous friction differs per direction.

use super::{About, DriveLaw, DriveView, Effect};
use crate::identify::balance::Alternative;
use crate::identify::drive::direction;
use crate::identify::term::Parameter;

/// The effect.
pub(super) struct BearingAsymmetry;

impl Effect for BearingAsymmetry {
    fn about(&self) -> About {
        About {
            id: "bearing_asymmetry",
            meaning: "the bearing's friction differs per direction",
            experiment: "turn the lifted disc steadily at three speeds each way, and rest it: at rest an offset shows and an asymmetry does not",
        }
    }

    fn drive(&self, view: &DriveView<'_>) -> Vec<Alternative> {
        let s = view.scales;
        let magnitude = |values: Vec<f64>| values.into_iter().map(f64::abs).collect::<Vec<f64>>();
        let coulomb = view.logs.iter().flat_map(|log| magnitude(direction(log, s.speed))).collect();
        let viscous = view.logs.iter().flat_map(|log| magnitude(log.speed.clone())).collect();
        let parameters = vec![
            Parameter::amplitude("coulomb_half_difference", s.own),
            Parameter::amplitude("viscous_half_difference", s.own / s.speed),
        ];
        vec![Alternative::columns(self.id(), parameters, vec![coulomb, viscous])]
    }

    fn drive_law(&self, value: &dyn Fn(&str) -> Option<f64>) -> Option<DriveLaw> {
        let part = |name: &str| value(&format!("{name}_difference")).or(value(&format!("{name}_half_difference")));
        let (coulomb, viscous) = (part("coulomb"), part("viscous"));
        coulomb.or(viscous)?;
        let (coulomb, viscous) = (coulomb.unwrap_or(0.0), viscous.unwrap_or(0.0));
        Some(DriveLaw::effort(move |v| coulomb + viscous * v.abs()))
    }
}
