//! `element_compliance`: the baseline lacks the elastic, damped rubber block in series with the bristles.

use super::{About, ContactView, Effect};
use crate::identify::contact::change::ContactTerm;
use crate::identify::term::{Parameter, Starts};

/// The effect.
pub(super) struct ElementCompliance;

impl Effect for ElementCompliance {
    fn about(&self) -> About {
        About {
            id: "element_compliance",
            meaning: "the model lacks the elastic, damped rubber block in series with the bristles",
            experiment: "speed steps at 10, 20, 30 and 120 rpm under 88 N: a block overshoots, bristles alone do not",
        }
    }

    fn contact(&self, view: &ContactView<'_>) -> Vec<ContactTerm> {
        if view.block {
            return Vec::new();
        }
        // The assumed block, within a factor of e^1.5.
        let parameters = vec![Parameter::logarithm("k_u_n_per_m", 3e4, 1.5), Parameter::logarithm("c_u_n_s_per_m", 160.0, 1.5)];
        let starts = [-0.7, 0.7].iter().flat_map(|a| [-0.5, 0.5].map(|b| vec![3e4f64.ln() + a, 160f64.ln() + b])).collect();
        vec![ContactTerm::any(self.id(), parameters, Starts::BestOf(starts, 1), |p, change| {
            change.block = Some((p[0].exp(), p[1].exp()));
        })
        .exported(|p, _| vec![("k_u_n_per_m".into(), p[0].exp()), ("c_u_n_s_per_m".into(), p[1].exp())])]
    }
}
