//! `ring_resonance`: the torque ring's mode is lower or less damped than the rig file says.

use super::{About, ContactView, Effect};
use crate::identify::contact::change::ContactTerm;
use crate::identify::term::{Parameter, Starts};

/// The effect.
pub(super) struct RingResonance;

/// Frequency and damping ratio.
fn mode(p: &[f64]) -> (f64, f64) {
    (p[0].exp().clamp(5.0, 249.0), p[1].exp().clamp(2e-3, 0.7))
}

impl Effect for RingResonance {
    fn about(&self) -> About {
        About {
            id: "ring_resonance",
            meaning: "the torque ring's mode is lower or less damped than the rig file says",
            experiment: "strike the ring at rest and log its ringing at 10 kHz",
        }
    }

    fn contact(&self, _view: &ContactView<'_>) -> Vec<ContactTerm> {
        let parameters = vec![Parameter::logarithm("mode_hz", 100.0, 0.6), Parameter::logarithm("damping_ratio", 0.05, 0.7)];
        // Steps of 2 %: a mode with 1 % damping is as wide.
        let hertz = (0..122).map(|i| 22.0 * 1.02f64.powi(i));
        let starts = hertz.flat_map(|hz| [0.012, 0.06].map(|zeta: f64| vec![hz.ln(), zeta.ln()])).collect();
        vec![ContactTerm::any(self.id(), parameters, Starts::BestOf(starts, 3), |p, change| {
            change.mode = Some(mode(p));
        })
        .exported(|p, _| {
            let (hz, damping) = mode(p);
            vec![("mode_hz".into(), hz), ("damping_ratio".into(), damping)]
        })]
    }
}
