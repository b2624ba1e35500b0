//! `load_dependence`: µ itself depends on the normal force.
//!
//! Coordinate: ln of the load. Columns: its powers, and a force affine in the load. Law: the core's
//! ([`model_core::extension::load_dependence`]).

use model_core::extension::load_dependence::LoadDependence as Law;

use super::{About, ContactView, Effect};
use crate::identify::contact::change::ContactTerm;
use crate::identify::term::{Parameter, Starts};

/// The effect.
pub(super) struct LoadDependence;

impl Effect for LoadDependence {
    fn about(&self) -> About {
        About {
            id: "load_dependence",
            meaning: "the friction coefficient itself depends on the normal force",
            experiment: "slide steadily at 30 rpm under loads of 10, 20, 40, 80 and 160 N, up and down again",
        }
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

        let reference = view.scales.load_n;
        let values = move |p: &[f64]| [p[0].clamp(-2.0, 2.0), reference, (p[1].exp() * reference).min(1e3 * reference)];
        let load: Vec<Vec<f64>> = view.logs.iter().map(|log| log.load_n.clone()).collect();
        let law = vec![Parameter::amplitude("exponent", 0.5), Parameter::logarithm("offset", 0.3, 1.5)];
        let starts = [0.03, 0.3, 3.0].map(|o: f64| [-0.1, 0.1].map(|n| vec![n, o.ln()])).concat();
        let act = move |p: &[f64], change: &mut super::Change| {
            let Ok(law) = Law::new(&values(p)) else { return };
            let column = load.iter().map(|log| log.iter().map(|n| law.factor(*n).ln()).collect()).collect();
            change.add_log_factor(&[column], &[1.0]);
        };
        let law = ContactTerm::any(self.id(), law, Starts::BestOf(starts, 2), act).as_law();
        let names = Law::<f64>::NAMES;
        vec![
            ContactTerm::factor(self.id(), "", columns, parameters),
            law.exported(move |p, _| names.iter().map(ToString::to_string).zip(values(p)).collect()),
        ]
    }
}
