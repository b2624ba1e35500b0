//! `load_dependence`: µ itself depends on the normal force.

use super::{ContactView, Effect};
use crate::identify::contact::change::ContactTerm;
use crate::identify::term::Parameter;

/// The effect.
pub struct LoadDependence;

impl Effect for LoadDependence {
    fn id(&self) -> &'static str {
        "load_dependence"
    }

    fn contact(&self, view: &ContactView<'_>) -> Vec<ContactTerm> {
        let power = |n: i32| view.coordinates.iter().map(|c| c.log_load.iter().map(|x| x.powi(n)).collect()).collect();
        let mut columns = [1, 2, 3].map(power).to_vec();
        // A force that is affine in the load, as that of adhesion.
        let inverse = |c: &super::Coordinates| c.log_load.iter().map(|x| (-x.max(-2.8)).exp() - 1.0).collect();
        columns.push(view.coordinates.iter().map(inverse).collect());
        // A power law first, its bend and skew less.
        let parameters = [("exponent", 0.5), ("bend", 0.2), ("skew", 0.1), ("affine", 0.2)];
        let parameters = parameters.map(|(name, sd)| Parameter::amplitude(name, sd)).to_vec();
        vec![ContactTerm::factor(self.id(), "", columns, parameters)]
    }
}
