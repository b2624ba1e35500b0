//! `static_ageing`: breakaway grows with the time at rest, about with its logarithm.

use super::{ContactView, Effect};
use crate::identify::contact::change::ContactTerm;
use crate::identify::contact::law::Ageing;
use crate::identify::term::{Parameter, Starts};

/// The effect.
pub struct StaticAgeing;

impl Effect for StaticAgeing {
    fn id(&self) -> &'static str {
        "static_ageing"
    }

    fn contact(&self, _view: &ContactView<'_>) -> Vec<ContactTerm> {
        let mut growth = Parameter::positive("growth", 0.3);
        growth.amplitude = false;
        let parameters =
            vec![growth, Parameter::logarithm("onset_s", 0.1, 1.5), Parameter::logarithm("memory_m", 1e-3, 1.5)];
        let (onset, memory) = (0.1f64.ln(), 1e-3f64.ln());
        let starts = [(-1.0, -1.5), (-1.0, 1.0), (1.5, -1.5), (1.5, 1.0)];
        let starts = starts.map(|(a, b)| vec![0.05, onset + a, memory + b]).to_vec();
        vec![ContactTerm::any(self.id(), parameters, Starts::At(starts), |p, change| {
            change.ageing = Some(Ageing { growth: p[0], onset_s: p[1].exp(), renewal_m: p[2].exp(), first_age_s: 1.0 });
        })]
    }
}
