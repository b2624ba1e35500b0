//! `direction_asymmetry`: µ differs between the two directions of sliding.

use super::{ContactView, Effect};
use crate::identify::contact::change::ContactTerm;
use crate::identify::term::Parameter;

/// The effect.
pub struct DirectionAsymmetry;

impl Effect for DirectionAsymmetry {
    fn id(&self) -> &'static str {
        "direction_asymmetry"
    }

    fn contact(&self, view: &ContactView<'_>) -> Vec<ContactTerm> {
        let by_speed = |n: i32| {
            let of = |c: &super::Coordinates| c.direction.iter().zip(&c.log_speed).map(|(d, v)| d * v.powi(n)).collect();
            view.coordinates.iter().map(of).collect()
        };
        let columns = [0, 1, 2].map(by_speed).to_vec();
        let parameters = [("asymmetry", 1.0), ("with_speed", 0.7), ("with_speed_squared", 0.5)];
        let parameters = parameters.map(|(name, sd)| Parameter::amplitude(name, sd)).to_vec();
        vec![ContactTerm::factor(self.id(), "", columns, parameters)]
    }
}
