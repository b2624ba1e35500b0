//! `wear_drift`: µ changes with the distance slid and does not come back.
//!
//! Coordinate: distance slid. Columns: changes that run out over four shares of the longest distance. Law: the core's
//! ([`model_core::extension::wear_drift`]).

use model_core::extension::wear_drift::WearDrift as Law;

use super::coordinates::saturating;
use super::{About, ContactView, Effect};
use crate::identify::contact::change::ContactTerm;
use crate::identify::term::{Parameter, Starts};

/// The effect.
pub(super) struct WearDrift;

/// Bends of the law over distance, in shares of the longest.
const BENDS: [f64; 4] = [0.02, 0.06, 0.2, 1.0];

impl Effect for WearDrift {
    fn about(&self) -> About {
        About {
            id: "wear_drift",
            meaning: "friction changes with the distance slid and does not come back",
            experiment: "repeat one short slide before and after 50 m of sliding, each after 10 minutes of rest",
        }
    }

    fn contact(&self, view: &ContactView<'_>) -> Vec<ContactTerm> {
        let longest = view.scales.distance_m;
        let column = |bend| view.coordinates.iter().map(|c| saturating(&c.distance_m, longest, bend)).collect();
        let columns = BENDS.map(column).to_vec();
        let parameters = BENDS.map(|bend| Parameter::amplitude(format!("change_{bend}"), 1.0)).to_vec();
        let distance: Vec<Vec<f64>> = view.coordinates.iter().map(|c| c.distance_m.clone()).collect();
        let law = vec![Parameter::amplitude("change", 1.0), Parameter::logarithm("scale_m", 0.5 * longest, 1.5)];
        let starts = [0.05, 0.3, 3.0].map(|s: f64| [-0.05, 0.05].map(|c| vec![c, (s * longest).ln()])).concat();
        // The change over the longest distance is what is fitted.
        let values = move |p: &[f64]| {
            let scale = p[1].exp().clamp(1e-3, 1e6);
            [(p[0] / (scale * (1.0 - (-longest / scale).exp()))).clamp(-100.0, 100.0), scale]
        };
        let act = move |p: &[f64], change: &mut super::Change| {
            let [rate, scale] = values(p);
            let of = |x: &f64| (1.0 + rate * scale * (1.0 - (-x / scale).exp())).max(0.05).ln();
            let column = distance.iter().map(|log| log.iter().map(of).collect()).collect();
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
