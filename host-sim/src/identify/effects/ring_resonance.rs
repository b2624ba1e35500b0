//! `ring_resonance`: the torque ring's mode is lower or less damped than the rig file says.

use super::{About, ContactView, Effect};
use crate::identify::contact::change::ContactTerm;
use crate::identify::contact::channel::{FASTEST_MODE_HZ, SLOWEST_MODE_HZ};
use crate::identify::spectrum::Spectrum;
use crate::identify::term::{Parameter, Starts};

/// The effect.
pub(super) struct RingResonance;

/// Damping ratios: below, it rings on for a second and more; above, its peak does not reach √2, so that it has no half-power
/// bandwidth, and is a delay.
const DAMPING: (f64, f64) = (2e-3, 0.38);

/// Frequency and damping ratio.
fn mode(p: &[f64]) -> (f64, f64) {
    (p[0].exp().clamp(SLOWEST_MODE_HZ, FASTEST_MODE_HZ), p[1].exp().clamp(DAMPING.0, DAMPING.1))
}

/// Peaks of each log's spectrum.
fn peaks_hz(view: &ContactView<'_>) -> impl Iterator<Item = f64> {
    /// In each log: mains and their harmonics are among them.
    const PEAKS: usize = 8;
    view.logs.iter().flat_map(|log| {
        let peaks = Spectrum::new(&log.friction_nm).map_or(Vec::new(), |spectrum| spectrum.peaks(PEAKS));
        peaks.into_iter().map(|f| f / log.grid.step_s).filter(|hz| *hz > SLOWEST_MODE_HZ)
    })
}

impl Effect for RingResonance {
    fn about(&self) -> About {
        About {
            id: "ring_resonance",
            meaning: "the torque ring's mode is lower or less damped than the rig file says",
            experiment: "strike the ring at rest and log its ringing at 10 kHz",
        }
    }

    fn contact(&self, view: &ContactView<'_>) -> Vec<ContactTerm> {
        let parameters = vec![Parameter::logarithm("mode_hz", 100.0, 0.6), Parameter::logarithm("damping_ratio", 0.05, 0.7)];
        // A damped mode is as wide as a step of 6 %; one that rings is a peak of the channel's spectrum.
        let damped = (0..42).map(|i| (22.0 * 1.06f64.powi(i), 0.06));
        let rings = peaks_hz(view).flat_map(|hz| [0.004, 0.012].map(|zeta| (hz, zeta)));
        // Faster than half of the sampling rate no mode is seen.
        let fastest_hz = view.logs.iter().map(|log| 0.5 / log.grid.step_s).fold(f64::INFINITY, f64::min);
        let seen = damped.chain(rings).filter(|(hz, _)| *hz < fastest_hz);
        let starts = seen.map(|(hz, zeta): (f64, f64)| vec![hz.ln(), zeta.ln()]).collect();
        vec![ContactTerm::any(self.id(), parameters, Starts::BestOf(starts, 3), |p, change| {
            change.mode = Some(mode(p));
        })
        .exported(|p, _| {
            let (hz, damping) = mode(p);
            vec![("mode_hz".into(), hz), ("damping_ratio".into(), damping)]
        })]
    }
}
