//! `ring_resonance`: the torque ring's mode is lower or less damped than the rig file says.

use super::{ContactView, Effect};
use crate::identify::contact::change::ContactTerm;
use crate::identify::term::{Parameter, Starts};

/// The effect.
pub struct RingResonance;

impl Effect for RingResonance {
    fn id(&self) -> &'static str {
        "ring_resonance"
    }

    fn contact(&self, _view: &ContactView<'_>) -> Vec<ContactTerm> {
        let parameters = vec![Parameter::logarithm("mode_hz", 100.0, 0.6), Parameter::logarithm("damping_ratio", 0.05, 0.7)];
        // Steps of 6 %: a mode with 5 % damping is half as wide.
        let hertz = (0..40).map(|i| 22.0 * 1.06f64.powi(i)).filter(|hz| *hz < 240.0);
        let starts = hertz.flat_map(|hz| [0.03, 0.1].map(|zeta: f64| vec![hz.ln(), zeta.ln()])).collect();
        vec![ContactTerm::any(self.id(), parameters, Starts::BestOf(starts, 3), |p, change| {
            change.mode = Some((p[0].exp().clamp(5.0, 249.0), p[1].exp().clamp(2e-3, 0.7)));
        })]
    }
}
