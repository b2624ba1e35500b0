//! `load_dependence`: µ itself depends on the normal force.
//!
//! Coordinate: ln of the load. Columns: its powers, and a force affine in the load. Law: the core's
//! ([`model_core::extension::load_dependence`]).

use model_core::extension::load_dependence::LoadDependence as Law;

use super::{About, ContactView, Effect};
use crate::identify::contact::change::ContactTerm;
use crate::identify::contact_part::ContactPart;
use crate::identify::term::{Parameter, Starts};

/// Loads below this share of the usual one do not count for the affine law.
const LEAST_LOAD: f64 = 0.05;

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

    fn remark(&self, contact: &ContactPart, place: usize) -> Option<String> {
        let (change, numbers) = contact.change_by(place, self.id())?;
        let factor = change.log_factor?;
        // Friction at the Coulomb coefficient over the load, and the line through it.
        let points = contact.logs.iter().zip(&factor).flat_map(|(log, m)| {
            log.load_n.iter().zip(m).map(|(n, m)| (*n, numbers.a0 * n * m.exp()))
        });
        let points: Vec<(f64, f64)> =
            points.filter(|(n, _)| *n > LEAST_LOAD * contact.scales.load_n).collect();
        let count = points.len() as f64;
        let mean = |of: &dyn Fn(&(f64, f64)) -> f64| points.iter().map(of).sum::<f64>() / count.max(1.0);
        let (load, force) = (mean(&|p| p.0), mean(&|p| p.1));
        let slope = mean(&|p| (p.0 - load) * (p.1 - force)) / mean(&|p| (p.0 - load).powi(2)).max(1e-12);
        let without_load = force - slope * load;
        let off = mean(&|p| (p.1 - without_load - slope * p.0).powi(2)).sqrt() / force.abs().max(1e-12);
        let (low, high) =
            points.iter().fold((f64::INFINITY, 0.0f64), |(low, high), p| (low.min(p.0), high.max(p.0)));
        Some(format!(
            "from {low:.0} to {high:.0} N the Coulomb force is nearest to the affine law {without_load:.2} N without load \
             (adhesion) and {slope:.3} N per N, from which it differs by {:.1} % RMS",
            100.0 * off
        ))
    }
}
