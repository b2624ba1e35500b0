//! `adc_saturation`: a channel clips.

use model_core::extension::adc_saturation::AdcSaturation as Law;

use super::{About, ContactView, Effect};
use crate::identify::contact::change::ContactTerm;
use crate::identify::contact::ends::Ends;
use crate::identify::contact::log::{ContactLog, END_NOISES};
use crate::identify::filters::gaussian;
use crate::identify::linear::{self, normal_equations};
use crate::identify::term::{Parameter, Starts};

/// The effect.
pub(super) struct AdcSaturation;

/// The friction channel's ends in the core's law, and the knee before them.
const NAMES: [&str; 2] = [Law::<f64>::NAMES[0], Law::<f64>::NAMES[1]];
const KNEE: &str = Law::<f64>::NAMES[2];
/// Share of samples that are spikes at most.
const SPIKES: f64 = 1e-3;
/// A clipped end holds at least this share of a channel's samples, …
const LEAST_SHARE: f64 = 0.004;
/// … within so many deviations of the noise on either side of it.
const EDGE_NOISES: f64 = 2.5;
/// A band of values is an end by itself where it holds so many times more than the next: the top of a sine holds 2.4 times more.
const SHARP: usize = 3;
/// M1's torque is smoothed over so many samples: the mechanism follows no faster.
const TORQUE_WIDTH: f64 = 2.0;
/// The elements touch above this share of the usual load.
const TOUCHING: f64 = 0.1;
/// Load over M1's torque is a line within this share: the mechanism's friction and springs.
const LINE_WITHIN: f64 = 0.03;
/// ln of an end's width over the channel's noise: a converter ends within its noise, an amplifier bends before it does.
const KNEE_WITHIN: f64 = 1.5;
/// Widest end, as a share of it: a soft limiter of order 5 (Rapp 1991) is 2 % off at four such widths below its end. One that is
/// wider is no end, but M1's torque in place of a noisy bridge.
const WIDEST: f64 = 0.03;

/// ln of a bending end over the highest torque shown: one that is further off is not seen.
const BEYOND_SHOWN: f64 = 0.2;
/// Width of a knee over the end, and ln of what it is known within: an output stage leaves its straight range some tenth before its
/// supply, sooner where nothing holds it straight. At a quarter the middle of the range is 2 % off, which a gain would be.
const SOFT_KNEE: f64 = 0.1;
const SOFT_KNEE_WITHIN: f64 = 0.7;
const WIDEST_KNEE: f64 = 0.25;

/// The end at which samples of a log pile up: more of them in the last band of values than in the next one below, thrice over,
/// or more at all where another log ends at the same value: two courses have no reason to. No log goes beyond it; one that rests
/// just below it says nothing against it.
fn end(logs: &[Vec<f64>], noise: f64) -> Option<f64> {
    let band = 2.0 * EDGE_NOISES * noise;
    let sorted: Vec<Vec<f64>> = logs
        .iter()
        .map(|log| {
            let mut values = log.clone();
            values.sort_by(f64::total_cmp);
            values
        })
        .collect();
    let tops: Vec<f64> = sorted.iter().filter_map(|log| top(log)).collect();
    let highest = tops.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let piled_up = |values: &Vec<f64>| {
        let n = values.len();
        let top = top(values)?;
        let above = |level: f64| n - values.partition_point(|x| *x < level);
        let (last, next) = (above(top - band), above(top - 2.0 * band) - above(top - band));
        let shared = tops.iter().filter(|other| (**other - top).abs() < noise).count() > 1;
        let more = if shared { last > next } else { last > SHARP * next };
        (more && last as f64 > LEAST_SHARE * n as f64).then(|| values[n - last / 2 - 1])
    };
    let ends = sorted.iter().filter_map(piled_up).filter(|end| *end > highest - band);
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

    fn absent(&self, parameter: &str) -> f64 {
        let far = Law::<f64>::NO_END_NM;
        let ends = [(NAMES[0], -far), (NAMES[1], far)];
        ends.iter().find(|(name, _)| *name == parameter).map_or(0.0, |(_, end)| *end)
    }

    fn contact(&self, view: &ContactView<'_>) -> Vec<ContactTerm> {
        self.friction(view).into_iter().chain([self.knee(view)]).chain(self.normal(view)).collect()
    }
}

impl AdcSaturation {
    /// The friction channel shows nothing beyond the ends that the training logs show; of another log any may be asked for.
    fn friction(&self, view: &ContactView<'_>) -> Vec<ContactTerm> {
        let scale = view.scales.torque_nm;
        if !view.training {
            let ends = [[Some(scale); 2], [None, Some(scale)], [Some(scale), None]];
            return ends.into_iter().filter_map(|ends| self.of_ends(scale, ends)).collect();
        }
        let noise = view.logs.iter().map(|log| log.friction_noise_nm).fold(1e-9, f64::max);
        let found = [-1.0, 1.0].map(|sign| {
            let logs: Vec<Vec<f64>> =
                view.logs.iter().map(|log| log.logged_nm.iter().map(|x| sign * x).collect()).collect();
            Some(sign * end(&logs, noise)?)
        });
        self.of_ends(scale, found).into_iter().collect()
    }

    /// A friction channel with a low and a high end, N m, or one of them.
    fn of_ends(&self, scale: f64, ends: [Option<f64>; 2]) -> Option<ContactTerm> {
        let form = match ends {
            [Some(_), Some(_)] => "both ends",
            [Some(_), None] => "low end",
            [None, Some(_)] => "high end",
            [None, None] => return None,
        };
        let named = NAMES.into_iter().zip(ends);
        let found: Vec<(&str, f64)> = named.filter_map(|(name, end)| Some((name, end? / scale))).collect();
        let parameters =
            found.iter().map(|(name, end)| Parameter { reach: 0.05, ..known(name, *end, 0.02) }).collect();
        let start = found.iter().map(|(_, end)| *end).collect();
        let names: Vec<&str> = found.iter().map(|(name, _)| *name).collect();
        let shown = names.clone();
        let term = ContactTerm::any(self.id(), parameters, Starts::At(vec![start]), move |p, change| {
            let end = |name: &str| names.iter().position(|n| *n == name).map(|at| p[at] * scale);
            let [low, high] = NAMES.map(end);
            let range = (low.unwrap_or(f64::NEG_INFINITY), high.unwrap_or(f64::INFINITY));
            change.ends_nm = Some(Ends::hard(range));
        });
        let export =
            move |p: &[f64]| shown.iter().zip(p).map(|(name, p)| (name.to_string(), p * scale)).collect();
        Some(ContactTerm { form, ..term }.exported(move |p, _| export(p)))
    }

    /// The friction channel bends before it ends: it never shows the end, and no more than a share of what it would.
    fn knee(&self, view: &ContactView<'_>) -> ContactTerm {
        let scale = view.scales.torque_nm;
        let highest = |log: &ContactLog| {
            let mut sizes: Vec<f64> = log.logged_nm.iter().map(|x| x.abs()).collect();
            sizes.sort_by(f64::total_cmp);
            top(&sizes).unwrap_or(0.0)
        };
        let least = view.logs.iter().map(highest).fold(0.0, f64::max) / scale;
        let lower = if view.training { least.ln() } else { f64::NEG_INFINITY };
        let parameters = vec![
            Parameter { lower, reach: 0.1, ..Parameter::logarithm("ln_end", least, BEYOND_SHOWN) },
            Parameter::logarithm("ln_knee_over_end", SOFT_KNEE, SOFT_KNEE_WITHIN),
        ];
        let starts = [(0.02, 0.05), (0.05, 0.1), (0.2, 0.2)].map(|(beyond, knee)| vec![least.ln() + beyond, f64::ln(knee)]);
        let end_nm = move |p: &[f64]| scale * p[0].exp();
        let knee_nm = move |p: &[f64]| end_nm(p) * p[1].exp().min(WIDEST_KNEE);
        let term = ContactTerm::any(self.id(), parameters, Starts::At(starts.to_vec()), move |p, change| {
            change.ends_nm = Some(Ends::with_knee((-end_nm(p), end_nm(p)), knee_nm(p)));
        });
        let export = move |p: &[f64]| {
            let named = [(NAMES[0], -end_nm(p)), (NAMES[1], end_nm(p)), (KNEE, knee_nm(p))];
            named.map(|(name, value)| (name.to_string(), value)).to_vec()
        };
        let shown_nm = view.logs.iter().flat_map(|log| log.observed_nm.iter().copied()).collect();
        let term = ContactTerm { form: "knee", ..term }.over("friction torque as shown, N m", shown_nm);
        term.exported(move |p, _| export(p))
    }

    /// Where the normal channel is at its upper end, the load is what M1's torque makes it elsewhere.
    fn normal(&self, view: &ContactView<'_>) -> Option<ContactTerm> {
        let torque: Vec<Vec<f64>> =
            view.logs.iter().map(|log| log.m1_torque_nm.as_ref().map(|t| gaussian(t, TORQUE_WIDTH, 0))).collect::<Option<_>>()?;
        let scale = view.scales.load_n;
        let noise = view.logs.iter().map(|log| log.normal_noise_n).fold(1e-9, f64::max);
        let (high, [gain, offset]) = if view.training {
            let high = end(&view.logs.iter().map(|log| log.logged_n.clone()).collect::<Vec<_>>(), noise)?;
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
        // As smooth as the torque: a load that is less noisy than the bridge's would explain that noise, end or no end.
        let load: Vec<Vec<f64>> = view.logs.iter().map(|log| gaussian(&log.load_n, TORQUE_WIDTH, 0)).collect();
        let term = ContactTerm::any(self.id(), parameters, Starts::At(vec![start]), move |p, change| {
            let knee = scale * p[3].exp().min(WIDEST * p[0]);
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
            let values = [p[0], p[1], p[2], p[3].exp().min(WIDEST * p[0])].map(|x| x * scale);
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
    use super::super::coordinates::{Coordinates, Scales};
    use super::*;
    use crate::files::log::Log;
    use crate::files::model_file::ModelFile;
    use crate::files::rig_file::RigFile;
    use crate::files::signal::Signal;
    use crate::identify::contact::baseline::{KNOWN_WITHIN, baseline};
    use crate::identify::contact::change::Change;
    use crate::identify::noise::tests::white;

    const NOISE: f64 = 0.01;

    /// A swing up to a level that a channel cannot show wholly, and noise before the converter.
    fn swing(level: f64, end: f64) -> Vec<f64> {
        let clipped = |(i, e): (usize, &f64)| (level * (0.003 * i as f64).sin() + NOISE * e).min(end);
        white(20_000, 4).iter().enumerate().map(clipped).collect()
    }

    /// What is made of these logs.
    fn with_view<T>(logs: &[ContactLog], training: bool, make: impl FnOnce(&ContactView<'_>) -> T) -> T {
        let scales = Scales::new(logs);
        let coordinates: Vec<Coordinates> = logs.iter().map(|log| Coordinates::new(log, &scales)).collect();
        let (coordinates, scales, train_count) = (coordinates.as_slice(), &scales, logs.len());
        make(&ContactView { logs, coordinates, scales, training, train_count, block: true })
    }

    #[test]
    fn a_log_that_rests_just_below_the_end_does_not_hide_it() {
        let rests: Vec<f64> = white(20_000, 5).iter().map(|e| 2.92 + NOISE * e).collect();
        let found = end(&[swing(4.0, 3.0), rests.clone()], NOISE);
        assert!(found.is_some_and(|end| (end - 3.0).abs() < 0.01), "{found:?}");
        // A rest is no end where another log goes beyond it.
        assert_eq!(end(&[swing(4.0, f64::INFINITY), rests], NOISE), None);
    }

    #[test]
    fn an_end_that_is_not_found_is_no_parameter_and_cuts_nothing_in_the_core() {
        let term = AdcSaturation.of_ends(2.0, [None, Some(3.0)]).expect("one end");
        let mut change = Change::default();
        (term.act)(&[1.4], &mut change);
        assert_eq!(change.ends_nm, Some(Ends::hard((f64::NEG_INFINITY, 2.8))));
        let export = term.export.as_ref().expect("a law of the core");
        let mut numbers = baseline(&ModelFile::assumed(&[]).unwrap(), KNOWN_WITHIN).numbers;
        assert_eq!(export(&[1.4], &mut numbers), [(NAMES[1].to_string(), 2.8)]);
        let law = Law::new(&[AdcSaturation.absent(NAMES[0]), 2.8, AdcSaturation.absent(KNEE)]).expect("allowed");
        assert_eq!([law.shown_nm(-1e6), law.shown_nm(1e6)], [-1e6, 2.8]);
    }

    #[test]
    fn a_knee_ends_beyond_what_was_shown_and_is_the_cores() {
        let log = |amplitude_nm: f64| {
            let mut log = Log::default();
            log.set_signal(Signal::Time, (0..2000).map(|i| 1e-3 * f64::from(i)).collect());
            log.set_signal(Signal::M2Speed, vec![5.0; 2000]);
            log.set_signal(Signal::NormalForce, vec![70.0; 2000]);
            let torque = |i: i32| amplitude_nm * (0.01 * f64::from(i)).sin();
            log.set_signal(Signal::FrictionTorque, (0..2000).map(torque).collect());
            ContactLog::new(&log, &RigFile::assumed_rig(&[]).unwrap()).unwrap()
        };
        let logs = [log(2.0), log(-3.0)];
        let [term, of_another] = [true, false].map(|training| with_view(&logs, training, |view| AdcSaturation.knee(view)));
        // The picture of a knee is over what the channel shows.
        let (over, values) = term.coordinate.as_ref().expect("one of its own");
        assert!(over.contains("friction torque") && values.len() == logs[0].len() + logs[1].len(), "{over}");
        let lowest = [term.parameters[0].lower, -2.0];
        let mut numbers = baseline(&ModelFile::assumed(&[]).unwrap(), KNOWN_WITHIN).numbers;
        let export = term.export.as_ref().expect("a law of the core");
        let named = export(&lowest, &mut numbers);
        assert!((named[1].1 - 3.0).abs() < 0.01 && named[0].1 == -named[1].1, "{named:?}");
        assert!((named[2].1 / (named[1].1 * f64::exp(-2.0)) - 1.0).abs() < 1e-9, "{named:?}");
        let law = Law::new(&[named[0].1, named[1].1, named[2].1]).expect("allowed");
        let mut change = Change::default();
        (term.act)(&lowest, &mut change);
        let ends = change.ends_nm.expect("ends");
        assert!([-9.0, 0.3, 2.8, 3.5].iter().all(|nm| (law.shown_nm(*nm) - ends.shown(*nm)).abs() < 1e-9));
        // A knee as wide as the range would be another gain.
        let widest = export(&[lowest[0], 3.0], &mut numbers)[2].1;
        assert!((widest / (WIDEST_KNEE * named[1].1) - 1.0).abs() < 1e-9, "{widest}");
        // Of another log any end may be asked for, in the same unit.
        assert_eq!(of_another.parameters[0].lower, f64::NEG_INFINITY);
        let other = of_another.export.as_ref().expect("a law of the core")(&lowest, &mut numbers);
        assert_eq!(other, named);
    }

    #[test]
    fn an_end_of_the_normal_channel_is_local_however_wide_it_is_asked_for() {
        const END_N: f64 = 90.0;
        let log = |phase: f64| {
            let load_n = |i: usize| 70.0 + 40.0 * (0.003 * i as f64 + phase).sin();
            let series = |of: &dyn Fn(usize) -> f64| (0..20_000).map(of).collect::<Vec<f64>>();
            let mut log = Log::default();
            log.set_signal(Signal::Time, series(&|i| 1e-3 * i as f64));
            log.set_signal(Signal::M2Speed, vec![5.0; 20_000]);
            log.set_signal(Signal::M1Torque, series(&|i| load_n(i) / 25.0));
            log.set_signal(Signal::FrictionTorque, series(&|i| 0.04 * load_n(i)));
            let noise = white(20_000, phase as u64);
            log.set_signal(Signal::NormalForce, series(&|i| (load_n(i) + 0.3 * noise[i]).min(END_N)));
            ContactLog::new(&log, &RigFile::assumed_rig(&[]).unwrap()).unwrap()
        };
        let logs = [log(0.0), log(1.0)];
        let term = with_view(&logs, true, |view| AdcSaturation.normal(view)).expect("an end");
        let Starts::At(starts) = &term.starts else { panic!("one start") };
        let mut wide = starts[0].clone();
        wide[3] = 0f64;
        let mut change = Change::default();
        (term.act)(&wide, &mut change);
        let (end_n, knee_n) = change.normal_end_n.expect("an end");
        assert!((end_n - END_N).abs() < 1.0 && (knee_n - WIDEST * end_n).abs() < 1e-9, "{end_n} {knee_n}");
        // Half of the range below it is as the bridge shows it.
        let factor = &change.log_factor.expect("a factor")[0];
        let low = logs[0].load_n.iter().zip(factor).filter(|(load, _)| **load < 0.5 * END_N);
        assert!(low.map(|(_, factor)| factor.abs()).fold(0.0, f64::max) < 1e-6);
    }

    #[test]
    fn two_logs_that_end_at_the_same_value_show_it_though_each_rests_below_it() {
        let rests_below = |end: f64| -> Vec<f64> {
            let below = white(5_000, 6).iter().map(|e| end - 6.0 * NOISE + NOISE * e).collect::<Vec<_>>();
            swing(4.0, end).into_iter().chain(below).collect()
        };
        let found = end(&[rests_below(3.0), rests_below(3.0)], NOISE);
        assert!(found.is_some_and(|end| (end - 3.0).abs() < 0.01), "{found:?}");
        assert_eq!(end(&[rests_below(3.0), rests_below(3.03)], NOISE), None);
    }
}
