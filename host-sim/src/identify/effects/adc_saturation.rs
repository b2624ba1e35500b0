//! `adc_saturation`: a channel clips.

use super::{About, ContactView, Effect};
use crate::identify::contact::change::ContactTerm;
use crate::identify::term::{Parameter, Starts};

/// The effect.
pub(super) struct AdcSaturation;

/// Share of samples that are spikes at most.
const SPIKES: f64 = 1e-3;
/// A clipped end holds at least this share of a channel's samples, …
const LEAST_SHARE: f64 = 0.004;
/// … within so many deviations of the noise on either side of it.
const EDGE_NOISES: f64 = 2.5;

/// The end at which samples pile up: more of them in the last band of values than in the next one below, thrice over.
fn end(values: &mut [f64], noise: f64) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    let n = values.len();
    let band = 2.0 * EDGE_NOISES * noise;
    // A few samples stand above an end: spikes on the line behind what clips.
    let top = *values.get(((1.0 - SPIKES) * n as f64) as usize)?;
    let above = |level: f64| n - values.partition_point(|x| *x < level);
    let (last, two) = (above(top - band), above(top - 2.0 * band));
    (last as f64 > LEAST_SHARE * n as f64 && last > 3 * (two - last)).then(|| values[n - last / 2 - 1])
}

impl Effect for AdcSaturation {
    fn about(&self) -> About {
        About {
            id: "adc_saturation",
            meaning: "a channel clips",
            experiment: "repeat the run at half the load: the flat top must go",
        }
    }

    fn contact(&self, view: &ContactView<'_>) -> Vec<ContactTerm> {
        let all = |sign: f64| -> Vec<f64> { view.logs.iter().flat_map(|log| log.friction_nm.iter().map(move |x| sign * x)).collect() };
        let noise = view.logs.iter().map(|log| log.friction_noise_nm).fold(1e-9, f64::max);
        let scale = view.scales.torque_nm;
        let (high, low) = if view.training {
            (end(&mut all(1.0), noise), end(&mut all(-1.0), noise))
        } else {
            (Some(scale), Some(scale))
        };
        if high.is_none() && low.is_none() {
            return Vec::new();
        }
        const FAR: f64 = 1e3;
        let parameter = |name: &str, at: f64| Parameter { mean: at / scale, ..Parameter::amplitude(name, 0.05) };
        let parameters: Vec<Parameter> = [("high", high), ("low", low)]
            .into_iter()
            .map(|(name, end)| Parameter { amplitude: false, sd: 0.02, step: 2e-3, reach: 0.05, ..parameter(name, end.map_or(FAR * scale, |e| e)) })
            .collect();
        let start = parameters.iter().map(|p| p.mean).collect();
        vec![ContactTerm::any(self.id(), parameters, Starts::At(vec![start]), move |p, change| {
            change.ends_nm = Some((-p[1] * scale, p[0] * scale));
        })
        .exported(move |p, _| {
            vec![("friction_low_nm".into(), -p[1] * scale), ("friction_high_nm".into(), p[0] * scale)]
        })]
    }
}
