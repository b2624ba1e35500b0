//! `bearing_asymmetry`: the bearing's Coulomb or viscous friction differs per direction.

use super::{DriveView, Effect};
use crate::identify::balance::Alternative;
use crate::identify::drive::direction;
use crate::identify::term::Parameter;

/// The effect.
pub struct BearingAsymmetry;

impl Effect for BearingAsymmetry {
    fn id(&self) -> &'static str {
        "bearing_asymmetry"
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
}
