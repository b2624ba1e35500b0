//! `adc_saturation`: a channel clips.

use super::{About, ContactView, Effect};
use crate::identify::contact::change::ContactTerm;
use crate::identify::contact::log::END_NOISES;
use crate::identify::filters::gaussian;
use crate::identify::linear::{self, normal_equations};
use crate::identify::term::{Parameter, Starts};

/// The effect.
pub(super) struct AdcSaturation;

/// Share of samples that are spikes at most.
const SPIKES: f64 = 1e-3;
/// A clipped end holds at least this share of a channel's samples, …
const LEAST_SHARE: f64 = 0.004;
/// … within so many deviations of the noise on either side of it.
const EDGE_NOISES: f64 = 2.5;
/// M1's torque is smoothed over so many samples: the mechanism follows no faster.
const TORQUE_WIDTH: f64 = 2.0;
/// The elements touch above this share of the usual load.
const TOUCHING: f64 = 0.1;
/// Load over M1's torque is a line within this share: the mechanism's friction and springs.
const LINE_WITHIN: f64 = 0.03;
/// ln of an end's width over the channel's noise: a converter ends within its noise, an amplifier bends before it does.
const KNEE_WITHIN: f64 = 1.5;

/// The end at which samples of a log pile up: more of them in the last band of values than in the next one below, thrice over.
/// No log goes beyond it; one that rests just below it says nothing against it.
fn end(logs: &[Vec<f64>], noise: f64) -> Option<f64> {
    let band = 2.0 * EDGE_NOISES * noise;
    let piled_up = |values: &[f64]| {
        let n = values.len();
        let top = top(values)?;
        let above = |level: f64| n - values.partition_point(|x| *x < level);
        let (last, two) = (above(top - band), above(top - 2.0 * band));
        (last as f64 > LEAST_SHARE * n as f64 && last > 3 * (two - last)).then(|| values[n - last / 2 - 1])
    };
    let sorted: Vec<Vec<f64>> = logs
        .iter()
        .map(|log| {
            let mut values = log.clone();
            values.sort_by(f64::total_cmp);
            values
        })
        .collect();
    let highest = sorted.iter().filter_map(|log| top(log)).fold(f64::NEG_INFINITY, f64::max);
    let ends = sorted.iter().filter_map(|log| piled_up(log)).filter(|end| *end > highest - band);
    ends.reduce(f64::max)
}

/// Where values end that rise, but for a few samples: spikes on the line behind what clips.
fn top(values: &[f64]) -> Option<f64> {
    values.get(((1.0 - SPIKES) * values.len() as f64) as usize).copied()
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
        self.friction(view).into_iter().chain(self.normal(view)).collect()
    }
}

impl AdcSaturation {
    /// The friction channel shows nothing beyond its ends.
    fn friction(&self, view: &ContactView<'_>) -> Option<ContactTerm> {
        let of_logs = |sign: f64| -> Vec<Vec<f64>> {
            view.logs.iter().map(|log| log.friction_nm.iter().map(|x| sign * x).collect()).collect()
        };
        let noise = view.logs.iter().map(|log| log.friction_noise_nm).fold(1e-9, f64::max);
        let scale = view.scales.torque_nm;
        let (high, low) = if view.training {
            (end(&of_logs(1.0), noise), end(&of_logs(-1.0), noise))
        } else {
            (Some(scale), Some(scale))
        };
        if high.is_none() && low.is_none() {
            return None;
        }
        const FAR: f64 = 1e3;
        let at = |name: &str, end: Option<f64>| Parameter { reach: 0.05, ..known(name, end.map_or(FAR, |e| e / scale), 0.02) };
        let parameters = vec![at("high", high), at("low", low)];
        let start = parameters.iter().map(|p| p.mean).collect();
        let term = ContactTerm::any(self.id(), parameters, Starts::At(vec![start]), move |p, change| {
            change.ends_nm = Some((-p[1] * scale, p[0] * scale));
        });
        Some(term.exported(move |p, _| {
            vec![("friction_low_nm".into(), -p[1] * scale), ("friction_high_nm".into(), p[0] * scale)]
        }))
    }

    /// Where the normal channel is at its upper end, the load is what M1's torque makes it elsewhere.
    fn normal(&self, view: &ContactView<'_>) -> Option<ContactTerm> {
        let torque: Vec<Vec<f64>> =
            view.logs.iter().map(|log| log.m1_torque_nm.as_ref().map(|t| gaussian(t, TORQUE_WIDTH, 0))).collect::<Option<_>>()?;
        let scale = view.scales.load_n;
        let noise = view.logs.iter().map(|log| log.normal_noise_n).fold(1e-9, f64::max);
        let (high, [gain, offset]) = if view.training {
            let high = end(&view.logs.iter().map(|log| log.normal_n.clone()).collect::<Vec<_>>(), noise)?;
            let below = |n: f64| n > TOUCHING * scale && n < high - END_NOISES * noise;
            let points = view.logs.iter().zip(&torque).flat_map(|(log, t)| log.load_n.iter().zip(t).filter(|(n, _)| below(**n)));
            let (n, t): (Vec<f64>, Vec<f64>) = points.map(|(n, t)| (n / scale, *t)).unzip();
            let (h, g) = normal_equations(&[t, vec![1.0; n.len()]], &vec![1.0; n.len()], &n);
            let line = linear::factor(&h).solve(&g);
            (high, [line[0], line[1]])
        } else {
            (scale, [1.0, 0.0])
        };
        let parameters = vec![
            known("normal_high", high / scale, 0.5 * noise / scale),
            known("load_per_torque", gain, LINE_WITHIN * gain.abs()),
            known("load_without_torque", offset, LINE_WITHIN),
            Parameter::logarithm("normal_knee", noise / scale, KNEE_WITHIN),
        ];
        let start = parameters.iter().map(|p| p.mean).collect();
        let load: Vec<Vec<f64>> = view.logs.iter().map(|log| log.load_n.clone()).collect();
        let term = ContactTerm::any(self.id(), parameters, Starts::At(vec![start]), move |p, change| {
            let knee = scale * p[3].exp();
            let near = p[0] * scale - END_NOISES * knee;
            let of = |(load, torque): (&Vec<f64>, &Vec<f64>)| -> Vec<f64> {
                let factor = |(n, t): (&f64, &f64)| {
                    let at_end = 1.0 / (1.0 + (-(n - near) / knee).clamp(-30.0, 30.0).exp());
                    at_end * ((p[1] * t + p[2]) * scale / n.max(1e-9)).max(1.0).ln()
                };
                load.iter().zip(torque).map(factor).collect()
            };
            change.add_log_factor(&[load.iter().zip(&torque).map(of).collect()], &[1.0]);
            change.normal_end_n = Some((p[0] * scale, knee));
        });
        let export = move |p: &[f64]| {
            let names = ["normal_high_n", "load_n_per_m1_torque_nm", "load_without_m1_torque_n", "normal_knee_n"];
            let values = [p[0], p[1], p[2], p[3].exp()].map(|x| x * scale);
            names.map(String::from).into_iter().zip(values).collect()
        };
        Some(ContactTerm { form: "normal", ..term }.exported(move |p, _| export(p)))
    }
}

/// A parameter that is known about a value.
fn known(name: &str, mean: f64, sd: f64) -> Parameter {
    Parameter { amplitude: false, mean, step: 0.1 * sd, ..Parameter::amplitude(name, sd) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::identify::noise::tests::white;

    const NOISE: f64 = 0.01;

    /// A swing up to a level that a channel cannot show wholly, and noise before the converter.
    fn swing(level: f64, end: f64) -> Vec<f64> {
        let clipped = |(i, e): (usize, &f64)| (level * (0.003 * i as f64).sin() + NOISE * e).min(end);
        white(20_000, 4).iter().enumerate().map(clipped).collect()
    }

    #[test]
    fn a_log_that_rests_just_below_the_end_does_not_hide_it() {
        let rests: Vec<f64> = white(20_000, 5).iter().map(|e| 2.92 + NOISE * e).collect();
        let found = end(&[swing(4.0, 3.0), rests.clone()], NOISE);
        assert!(found.is_some_and(|end| (end - 3.0).abs() < 0.01), "{found:?}");
        // A rest is no end where another log goes beyond it.
        assert_eq!(end(&[swing(4.0, f64::INFINITY), rests], NOISE), None);
    }
}
