//! `friction_delay`: the friction channel lags the motion by a pure delay.

use super::{About, ContactView, DriveView, Effect};
use crate::identify::balance::Alternative;
use crate::identify::filters::shifted;
use crate::identify::contact::change::ContactTerm;
use crate::identify::term::{Parameter, Starts};

/// The effect.
pub(super) struct FrictionDelay;

/// Delays that are tried in the drive's balance, s: 20 % apart.
const SHORTEST_S: f64 = 3e-4;
const COUNT: i32 = 26;
const RATIO: f64 = 1.2;

impl Effect for FrictionDelay {
    fn about(&self) -> About {
        About {
            id: "friction_delay",
            meaning: "the friction channel lags the motion by a pure delay",
            experiment: "strike the ring and log both channels; or step the speed sharply at 120 rpm",
        }
    }

    fn contact(&self, _view: &ContactView<'_>) -> Vec<ContactTerm> {
        let parameters = vec![Parameter::logarithm("delay_s", 4e-3, 1.2)];
        let starts = [0.7e-3, 1.5e-3, 3e-3, 6e-3, 12e-3, 25e-3].map(|delay_s: f64| vec![delay_s.ln()]).to_vec();
        vec![ContactTerm::any(self.id(), parameters, Starts::BestOf(starts, 2), |p, change| {
            change.late_s += p[0].exp();
        })
        .exported(|p, numbers| {
            // What the channels' timing took of it belongs to it.
            let late_s = (1e-3 * numbers.late_ms + p[0].exp()).max(0.0);
            numbers.late_ms = 0.0;
            vec![("delay_s".into(), late_s)]
        })]
    }

    fn drive(&self, view: &DriveView<'_>) -> Vec<Alternative> {
        if view.scales.load_n <= 0.0 {
            return Vec::new();
        }
        let grid: Vec<f64> = (0..COUNT).map(|i| SHORTEST_S * RATIO.powi(i)).collect();
        let shape = |delay_s: f64| {
            let added = view.logs.iter().flat_map(|log| {
                let friction = log.friction.clone().unwrap_or_else(|| vec![0.0; log.len()]);
                let early = shifted(&friction, delay_s / log.grid.step_s);
                log.filtered(&early.iter().zip(&friction).map(|(a, b)| b - a).collect::<Vec<_>>())
            });
            Alternative {
                form: format!("{:.2} ms", 1e3 * delay_s),
                constants: vec![("delay_s".to_string(), delay_s)],
                response: Some(added.collect()),
                log_prior: -f64::from(COUNT).ln(),
                ..Alternative::columns("friction_delay", Vec::new(), Vec::new())
            }
        };
        super::shapes(view.fixed, "delay_s", grid).into_iter().map(shape).collect()
    }
}
