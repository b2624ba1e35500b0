//! `friction_delay`: the friction channel lags the motion by a pure delay.

use super::{ContactView, Effect};
use crate::identify::contact::change::ContactTerm;
use crate::identify::term::{Parameter, Starts};

/// The effect.
pub struct FrictionDelay;

impl Effect for FrictionDelay {
    fn id(&self) -> &'static str {
        "friction_delay"
    }

    fn contact(&self, _view: &ContactView<'_>) -> Vec<ContactTerm> {
        let parameters = vec![Parameter::logarithm("delay_s", 4e-3, 1.2)];
        let starts = [0.7e-3, 1.5e-3, 3e-3, 6e-3, 12e-3, 25e-3].map(|delay_s: f64| vec![delay_s.ln()]).to_vec();
        vec![ContactTerm::any(self.id(), parameters, Starts::BestOf(starts, 2), |p, change| {
            change.late_s += p[0].exp();
        })]
    }
}
