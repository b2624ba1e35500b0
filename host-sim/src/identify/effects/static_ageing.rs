//! `static_ageing`: breakaway grows with the time at rest, about with its logarithm.

use super::{About, ContactView, Effect};
use crate::identify::contact::change::ContactTerm;
use crate::identify::contact::law::Ageing;
use crate::identify::term::{Parameter, Starts};

/// The effect.
pub(super) struct StaticAgeing;

/// Age of the contact at the beginning of a log, s.
const FIRST_AGE_S: f64 = 1.0;

impl Effect for StaticAgeing {
    fn about(&self) -> About {
        About {
            id: "static_ageing",
            meaning: "breakaway grows with the time at rest",
            experiment: "rest for 0.1, 1, 10 and 100 s under one load, each time followed by the same slow start",
        }
    }

    fn contact(&self, _view: &ContactView<'_>) -> Vec<ContactTerm> {
        let mut growth = Parameter::positive("growth", 0.3);
        growth.amplitude = false;
        let parameters = vec![
            growth,
            Parameter::logarithm("onset_s", 0.1, 1.5),
            Parameter::logarithm("memory_m", 1e-3, 1.5),
            // How long the elements have touched before a log begins is not logged: from no time to minutes.
            Parameter::logarithm("first_age_s", FIRST_AGE_S, 2.5),
        ];
        let (onset, memory) = (0.1f64.ln(), 1e-3f64.ln());
        let starts = [(-1.0, -1.5), (-1.0, 1.0), (1.5, -1.5), (1.5, 1.0)];
        let starts = starts.map(|(a, b)| vec![0.01, onset + a, memory + b, FIRST_AGE_S.ln()]).to_vec();
        vec![ContactTerm::any(self.id(), parameters, Starts::At(starts), |p, change| {
            change.ageing = Some(Ageing { growth: p[0], onset_s: p[1].exp(), renewal_m: p[2].exp(), first_age_s: p[3].exp() });
        })
        .exported(|p, _| {
            let names = ["growth", "onset_s", "memory_m", "first_age_s"].map(String::from);
            let [onset_s, memory_m, first_age_s] = [p[1], p[2], p[3]].map(f64::exp);
            let values =
                [p[0].clamp(0.0, 10.0), onset_s.clamp(1e-4, 1e4), memory_m.clamp(1e-6, 1.0), first_age_s.min(1e4)];
            names.into_iter().zip(values).collect()
        })]
    }
}
