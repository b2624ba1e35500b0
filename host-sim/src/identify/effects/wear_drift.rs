//! `wear_drift`: µ changes with the distance slid and does not come back.

use super::coordinates::saturating;
use super::{ContactView, Effect};
use crate::identify::contact::change::ContactTerm;
use crate::identify::term::Parameter;

/// The effect.
pub struct WearDrift;

/// Bends of the law over distance, in shares of the longest.
const BENDS: [f64; 4] = [0.02, 0.06, 0.2, 1.0];

impl Effect for WearDrift {
    fn id(&self) -> &'static str {
        "wear_drift"
    }

    fn contact(&self, view: &ContactView<'_>) -> Vec<ContactTerm> {
        let column = |bend| {
            view.coordinates.iter().map(|c| saturating(&c.distance_m, view.scales.distance_m, bend)).collect()
        };
        let columns = BENDS.map(column).to_vec();
        let parameters = BENDS.map(|bend| Parameter::amplitude(format!("change_{bend}"), 1.0)).to_vec();
        vec![ContactTerm::factor(self.id(), "", columns, parameters)]
    }
}
