//! Standard deviation of the friction channel about a right model, sample by sample, from named sources.
//!
//! σ² = Σ a_s n_s², with a_s = 1 before and fitted to the residuals (a_s ≥ 0) after a first fit:
//!
//! | source | n |
//! |---|---|
//! | sensor | its noise, from the channel alone |
//! | motion between samples | 0.3 of the channel's change a sample; likewise the prediction's |
//! | load between samples | a quarter of the load's change a sample |
//! | form of the model | 0.4 % of the force |
//! | noise of the slip speed | through g′, where the tip slips |
//! | noise of the root's motion | through the stiffness, where it sticks; of bristles without a block [`certainty`](super::observer::Observed::certainty) has it, and this only what is named |
//! | transitions | 3 % of the load near a change between slip and stick; of a brush 0.3 of the fall, and what that rings with |
//!
//! What swings faster than a model follows is not independent from sample to sample: residuals go through a filter that tells
//! it from its last samples (`ringing.rs`), and σ² has what the filter does not know of it besides. Nor is the channel's 1/f
//! noise: in a diagnosis residuals and columns go through the filter that makes them white (`whitening.rs`).

use std::borrow::Cow;

use super::law::Contact;
use super::log::ContactLog;
use super::problem::{FREEDOM, Prediction};
use super::ringing::Filter;
use crate::identify::filters::{gradient, local_maximum};
use crate::identify::linear::Slope;
use crate::identify::slow_noise::Errors;
use crate::identify::spectrum::{SLOW_HZ, share_below};
use crate::identify::variance_components::{self, Sample};
use crate::identify::whitening::{LogPoints, SLOW, Whitening};

/// What no model of friction is more accurate than, relative.
pub(crate) const MODEL_FORM: f64 = 0.004;
/// Share of a change within a sample that is not known: about 1/√12, the deviation of an even distribution.
const BETWEEN_SAMPLES: f64 = 0.3;
/// Error near a transition between slip and stick, relative to the load.
const TRANSITION: f64 = 0.03;
/// Sources.
const SOURCES: usize = 8;
/// Place of the form of the model among them.
const MODEL_FORM_SOURCE: usize = 4;
/// Place of the root's motion through the stiffness.
const ROOT_MOTION_SOURCE: usize = 6;
/// Sources that are errors of the force before its sensor: load between samples, form of the model, slip speed, root's motion.
const OF_FORCE: std::ops::Range<usize> = 3..7;
/// Samples of a cycle of slip and stick below which its jumps run into each other: each is uncertain over the smoothing's width
/// and the two samples beside it, and there are two in a cycle.
const SAMPLES_PER_CYCLE: usize = 10;
/// A sample that is off its two neighbours by more than so many deviations of what the sensor's noise makes of that: one of twenty is
/// by noise alone.
const SWING_NOISES: f64 = 2.0;
/// The sensor's noise is known from the channel itself: its variance is at least this share of it.
const LEAST_SENSOR: f64 = 0.2;
/// Sources that are errors of the channel, from which the slip is observed too: the sensor's, motion between samples.
const OF_CHANNEL: std::ops::Range<usize> = 0..3;
/// Least certainty of a sample that takes part: the way's noise is up to three quarters of the variance.
const LEAST_CERTAINTY: f64 = 0.5;
/// Least certainty of a sample that tells how large the sources are: the way's noise is a tenth of the variance, and however wrong
/// it is (an encoder at rest shows none of its counts) no more of the sensor's.
const SURE: f64 = 0.95;

/// The noise model.
#[derive(Debug, Clone, Default)]
pub struct Noise {
    /// Deviation of each sample, N m.
    pub deviation: Vec<f64>,
    /// Whether a sample takes part: not where held bristles show the noise of the root's way and little else, nor where the tip
    /// slips and sticks faster than samples tell. It is the same for every hypothesis: one that is certain of a sample would
    /// pay for it, and one that is not would not.
    pub known: Vec<bool>,
    /// Where the samples tell slip and stick apart: no law of held bristles shows there, and whether the tip was held does.
    resolved: Vec<bool>,
    /// [`certainty`](super::observer::Observed::certainty) of each sample by the numbers that this noise is of: one that moved with a
    /// stiffness would draw it to where a sample says nothing.
    certainty: Vec<f64>,
    /// Time in which slip and stick change faster than samples tell, in all logs together, and the time in which they are used
    /// but for that, s.
    unresolved_s: (f64, f64),
    /// n² of each source for each sample.
    sources: Vec<[f64; SOURCES]>,
    /// The filter of what swings in each log with the present deviations, and the log's length.
    filters: Vec<(Option<Filter>, usize)>,
    /// Variance of what is uncertain of the force itself, which strikes the sensor's mode: at most that of the named sources, since
    /// one taken from residuals would grow with what nothing explains.
    pub(super) of_force: Vec<f64>,
    /// Share of the channel's own noise in each sample's variance.
    of_channel: Vec<f64>,
    /// Deviations before anything is fitted, the form of the model left out.
    named: Vec<f64>,
    /// Samples that count as one: the spectral density of the residuals below 30 Hz over their variance.
    pub temper: f64,
    /// The same, times `temper`, of samples whose error is that of what swings between them: it repeats itself in each swing.
    repeated: f64,
    /// Which samples these are: the sensor's own noise is less than half of their variance.
    swinging: Vec<bool>,
    /// Factors a of the sources, as fitted.
    factors: [f64; SOURCES],
    /// Variance of slow noise, as fitted.
    slow: f64,
    /// What is new in each sample beside slow noise; no rows before anything is fitted.
    whitening: Whitening,
}

impl Noise {
    /// Before anything is fitted.
    pub fn new(logs: &[ContactLog], contact: &Contact, prediction: &Prediction) -> Self {
        let (curve, stiffness_n_per_m) = (&contact.curve, contact.stiffness_n_per_m);
        // A block falls within some samples; what has none falls within one, at any time in it.
        let fall = if contact.slips_on { curve.at(0.0) - curve.at_speed() } else { 0.0 };
        let transition_of_load = TRANSITION.max(BETWEEN_SAMPLES * fall);
        let (mut sources, mut resolved) = (Vec::new(), Vec::new());
        let mut from = 0;
        for (log, observed) in logs.iter().zip(&prediction.observed) {
            let shown = &prediction.shown_nm[from..from + log.len()];
            from += log.len();
            let magnitude = |x: Vec<f64>| x.into_iter().map(f64::abs).collect::<Vec<f64>>();
            let wide_change = local_maximum(&log.friction_change_nm, 2);
            // What the prediction does that the channel does not is an error and no noise, and the other way round.
            let predicted = local_maximum(&magnitude(gradient(shown)), 3);
            let floor = log.friction_noise_nm;
            let predicted: Vec<f64> =
                predicted.iter().zip(&wide_change).map(|(p, m)| p.min(3.0 * m + floor)).collect();
            let wide_predicted = local_maximum(&predicted, 6);
            let slides: Vec<bool> = observed.sliding.iter().map(|s| *s > 0.5).collect();
            let unstable = unstable(log, contact);
            let mut of_log = cycles_resolved(&slides, &swings(log, &unstable));
            leave_out_between(&mut of_log, &unstable, &cycle_rate(log));
            resolved.extend(of_log);
            let transition = local_maximum(
                &magnitude(gradient(&slides.iter().map(|s| f64::from(u8::from(*s))).collect::<Vec<f64>>())),
                4,
            );
            let slip_noise =
                log.speed_noise_m_s.max(1e-3 * crate::identify::filters::rms(&log.root_speed_m_s));
            let radius = log.radius_m;
            let (struck, kept) = log.unseen_ringing.filter(|_| contact.slips_on).unwrap_or_default();
            let mut rings = 0.0;
            for i in 0..log.len() {
                let changed = wide_change[i].min(2.0 * wide_predicted[i] + floor);
                let sliding = observed.sliding[i] > 0.5;
                let slope =
                    if sliding { curve.slope(observed.slip_m_s[i].abs().max(3.0 * slip_noise)) } else { 0.0 };
                let load = log.load_n[i].max(0.0);
                let breaks = slides[i] && !slides[i.saturating_sub(1)];
                rings = if breaks { struck } else { kept * rings };
                let near = if transition[i] > 0.0 { transition_of_load } else { 0.0 };
                sources.push(
                    [
                        log.friction_noise_nm,
                        BETWEEN_SAMPLES * changed,
                        BETWEEN_SAMPLES * predicted[i],
                        0.25 * radius * log.load_change_n[i],
                        MODEL_FORM * log.smooth_nm[i],
                        radius * load * slope * slip_noise,
                        if sliding {
                            0.0
                        } else {
                            2.0 * radius * stiffness_n_per_m * log.speed_noise_m_s * log.grid.step_s
                        },
                        near.hypot(fall * rings) * radius * load,
                    ]
                    .map(|n| n * n),
                );
            }
        }
        let certainties = prediction.observed.iter().flat_map(|observed| &observed.certainty);
        let certainty: Vec<f64> = certainties.copied().collect();
        let times = logs
            .iter()
            .flat_map(|log| log.usable.iter().map(|used| f64::from(u8::from(*used)) * log.grid.step_s));
        let unresolved_s = times.zip(&resolved).fold((0.0, 0.0), |(out, all), (step_s, resolved)| {
            (out + if *resolved { 0.0 } else { step_s }, all + step_s)
        });
        let known =
            certainty.iter().zip(&resolved).map(|(c, resolved)| *c > LEAST_CERTAINTY && *resolved).collect();
        let mut noise = Self {
            sources,
            known,
            resolved,
            certainty,
            unresolved_s,
            temper: 3.0,
            repeated: 1.0,
            factors: [1.0; SOURCES],
            ..Self::default()
        };
        let mut factors = [1.0; SOURCES];
        factors[MODEL_FORM_SOURCE] = 0.0;
        noise.weigh(logs, &factors);
        // The model's form is no error from sample to sample; how large it is the residuals tell.
        noise.share_channel(&factors);
        noise.named = std::mem::take(&mut noise.deviation);
        if contact.bristles_alone {
            // It is in the residuals' scale, by the certainty.
            noise.sources.iter_mut().for_each(|n| n[ROOT_MOTION_SOURCE] = 0.0);
        }
        noise.weigh(logs, &[1.0; SOURCES]);
        noise
    }

    /// What is left out since slip and stick change within few samples, in a sentence; `None` where nothing is.
    pub fn unresolved(&self) -> Option<String> {
        let (out_s, all_s) = self.unresolved_s;
        (out_s > 0.0).then(|| {
            format!(
                "{out_s:.1} s of {all_s:.1} s are left out: the tip slips and sticks there within fewer than {SAMPLES_PER_CYCLE} \
                 samples; log at a higher rate to see it"
            )
        })
    }

    /// Leaves out what the model of another hypothesis leaves out too.
    pub fn leave_out(&mut self, other: &Self) {
        for (own, other) in [(&mut self.known, &other.known), (&mut self.resolved, &other.resolved)] {
            own.iter_mut().zip(other).for_each(|(own, other)| *own &= other);
        }
        self.unresolved_s.0 = self.unresolved_s.0.max(other.unresolved_s.0);
    }

    /// Deviation of a sample from its named sources before anything is fitted, the form of the model left out: what noise
    /// alone leaves.
    pub fn named(&self, sample: usize) -> f64 {
        self.named[sample]
    }

    /// Samples at which a prediction can be held against what was measured, of those that may be used: all that named sources leave
    /// this well known, and at which slip and stick are told apart.
    pub fn compared(&self, usable: impl Iterator<Item = bool>, limit: f64) -> Vec<usize> {
        let each = usable.zip(&self.resolved).zip(&self.named).enumerate();
        let told = each.filter(|(_, ((usable, resolved), named))| *usable && **resolved && **named < limit);
        told.map(|(i, _)| i).collect()
    }

    /// Deviation of each sample from what is named and the slow noise of `fitted`, the noise in logs of the same rig. That shows where the tip slides, and is no more than a bridge's zero of this deviation: beyond that it is nothing of a
    /// sensor's.
    pub fn of_sensors(&self, fitted: &Self, slides: &[bool], zero_nm: f64) -> Vec<f64> {
        let slow = fitted.slow.min(zero_nm * zero_nm);
        let slow = slides.iter().map(|slides| if *slides { slow } else { 0.0 });
        self.named.iter().zip(slow).map(|(named, slow)| (named * named + slow).sqrt()).collect()
    }

    fn weigh(&mut self, logs: &[ContactLog], factors: &[f64; SOURCES]) {
        let sum = |n: &[f64; SOURCES]| n.iter().zip(factors).map(|(n, a)| n * a).sum::<f64>().max(1e-24);
        let mut variance: Vec<f64> = self.sources.iter().map(sum).collect();
        let of_force = |n: &[f64; SOURCES]| OF_FORCE.map(|s| factors[s].min(1.0) * n[s]).sum();
        self.of_force = self.sources.iter().map(of_force).collect();
        let mut from = 0;
        self.filters.clear();
        for log in logs {
            let own = &mut variance[from..from + log.len()];
            from += log.len();
            let filter = log.ringing.as_ref().map(|ringing| ringing.filter(own, &log.usable));
            if let Some(filter) = &filter {
                own.iter_mut().zip(&filter.rung).for_each(|(variance, rung)| *variance += rung);
            }
            self.filters.push((filter, log.len()));
        }
        self.deviation = variance.into_iter().map(f64::sqrt).collect();
    }

    /// How much of an independent sample each one counts as in the evidence. The fit itself takes all of them alike: what swings
    /// is what tells of a block.
    pub fn counts(&self) -> impl Iterator<Item = f64> {
        let [steady, swinging] = [1.0, self.repeated].map(|repeated| 1.0 / (self.temper * repeated));
        // Before anything is fitted all are alike.
        let each = self.swinging.iter().copied().chain(std::iter::repeat(false));
        each.map(move |swings| if swings { swinging } else { steady })
    }

    /// Samples that swing, whose scores tell how many of them count as one.
    pub fn swinging(&self) -> &[bool] {
        &self.swinging
    }

    /// Takes how many of the samples that swing count as one.
    pub fn set_repeated(&mut self, samples: f64) {
        self.repeated = (samples / self.temper).max(1.0);
    }

    /// What the residual of a sample has to be multiplied with: its certainty, and where of the channel's noise only this share of its
    /// variance is left so much more.
    #[inline]
    pub fn scale(&self, sample: usize, left: f64) -> f64 {
        let certainty = self.certainty[sample];
        if left == 1.0 {
            certainty
        } else {
            certainty / (1.0 + self.of_channel[sample] * (left - 1.0)).sqrt()
        }
    }

    /// Takes from what is measured less predicted what the channel was seen to swing with; all logs on end, N m.
    pub fn innovations(&self, residual: &mut [f64]) {
        let mut from = 0;
        for (filter, count) in &self.filters {
            let own = from..from + count;
            from = own.end;
            if let Some(filter) = filter {
                filter.innovations(&mut residual[own]);
            }
        }
    }

    /// With factors and effective sample size that were fitted to other logs of the same rig.
    #[must_use]
    pub fn fitted_as(mut self, logs: &[ContactLog], other: &Self) -> Self {
        self.factors = other.factors;
        self.temper = other.temper;
        self.weigh(logs, &other.factors);
        self.share_channel(&other.factors);
        self
    }

    fn share_channel(&mut self, factors: &[f64; SOURCES]) {
        let own = |n: &[f64; SOURCES]| OF_CHANNEL.map(|s| factors[s] * n[s]).sum::<f64>();
        let all = |n: &[f64; SOURCES]| n.iter().zip(factors).map(|(n, a)| n * a).sum::<f64>().max(1e-24);
        self.of_channel = self.sources.iter().map(|n| own(n) / all(n)).collect();
    }

    /// What is new in each sample of a series over the deviations, such as residuals.
    pub fn whitened<'r>(&self, r: &'r [f64]) -> Cow<'r, [f64]> {
        if self.whitening.is_coloured() { self.whitening.of_relative(r).into() } else { r.into() }
    }

    /// The same of columns.
    pub fn whitened_columns<'c>(&self, columns: &'c [Slope]) -> Cow<'c, [Slope]> {
        if !self.whitening.is_coloured() {
            return Cow::Borrowed(columns);
        }
        Cow::Owned(self.whitening.of_relative_columns(columns))
    }

    /// Variance of the slow processes together that a sample shows, where the residuals (over the present deviations) have them.
    fn slow_variance(&self, logs: &[ContactLog], r: &[f64], slides: &[bool]) -> f64 {
        let seen = r.iter().zip(&self.deviation).zip(slides);
        // Where a tip sticks, its slip is observed from the force, slow noise and all.
        let residual: Vec<f64> =
            seen.map(|((r, deviation), slides)| if *slides { r * deviation } else { 0.0 }).collect();
        let lengths: Vec<usize> = logs.iter().map(ContactLog::len).collect();
        Errors { residual: &residual, deviation: &self.deviation, lengths: &lengths }.likeliest_of_decade()
    }

    /// Fits the sources' factors to residuals (over the present deviations) and takes the effective sample size from their
    /// spectrum; and the level of slow noise, which shows where the tip slides, for what is new in each sample. The deviations have
    /// that noise too, and are not made smaller by it: what looks like slow noise may be an error of form, and a sample is not to
    /// tell more for that. So whitening takes from what is slow and adds to nothing.
    pub fn refit_coloured(&mut self, logs: &[ContactLog], r: &[f64], slides: &[bool]) {
        let of_each = self.slow_variance(logs, r, slides);
        self.slow = SLOW as f64 * of_each;
        self.refit(logs, r);
        let mut from = 0;
        let rows = |log: &ContactLog| {
            let own = from..from + log.len();
            from = own.end;
            LogPoints { points: own.filter(|i| r[*i] != 0.0).collect(), step_s: log.grid.step_s }
        };
        let rows: Vec<LogPoints> = logs.iter().map(rows).collect();
        self.whitening = Whitening::new(&rows, &self.deviation, |i| slides[i], of_each);
    }

    /// The same with all noise as white: what is slow is in the residuals.
    pub fn refit(&mut self, logs: &[ContactLog], r: &[f64]) {
        // Bristles at rest follow the force, noise and all: residuals there are small however noisy the sensor is.
        let used: Vec<usize> = (0..r.len()).filter(|i| r[*i] != 0.0 && self.certainty[*i] > SURE).collect();
        let square: Vec<f64> = used.iter().map(|&i| (r[i] * self.deviation[i]).powi(2)).collect();
        let rung = |(filter, count): &(Option<Filter>, usize)| {
            filter.as_ref().map_or_else(|| vec![0.0; *count], |filter| filter.rung.clone())
        };
        let rung: Vec<f64> = self.filters.iter().flat_map(rung).collect();
        let typical = used.iter().map(|&i| self.deviation[i].powi(2)).sum::<f64>() / used.len().max(1) as f64;
        let sample = |(i, square): (&usize, &f64)| Sample {
            sources: &self.sources[*i],
            square: *square,
            besides: rung[*i],
        };
        let samples: Vec<Sample<'_>> = used.iter().zip(&square).map(sample).collect();
        let mut least = [variance_components::LEAST; SOURCES];
        least[0] = LEAST_SENSOR;
        let found = variance_components::fitted(&samples, &least, typical);
        let factors: [f64; SOURCES] = std::array::from_fn(|s| found[s]);
        self.factors = factors;
        let before = std::mem::take(&mut self.deviation);
        self.weigh(logs, &factors);
        self.share_channel(&factors);
        let r: Vec<f64> =
            r.iter().zip(before.iter().zip(&self.deviation)).map(|(r, (old, new))| r * old / new).collect();
        // Influence of each residual on a slow parameter, slow noise and all: what is left when that is taken out is as white as the
        // filter makes it, and says nothing of errors of form that have the same spectrum and repeat themselves with the motion.
        let pull: Vec<f64> = r.iter().map(|r| r * (FREEDOM + 1.0) / (FREEDOM + r * r)).collect();
        let mut from = 0;
        let mut shares = Vec::new();
        for log in logs {
            shares.push(share_below(SLOW_HZ, &pull[from..from + log.len()], log.grid.step_s));
            from += log.len();
        }
        self.temper = (shares.iter().sum::<f64>() / shares.len().max(1) as f64).max(1.0);
        self.repeated = 1.0;
        self.swinging = self
            .sources
            .iter()
            .zip(&self.deviation)
            .map(|(n, deviation)| factors[0] * n[0] < 0.5 * deviation * deviation)
            .collect();
    }
}

/// Where slip is unstable: friction falls with speed by more than the block damps (c_u < −F_N g′), so that what looks like a slide is
/// a cycle of slip and stick, and the slip that is seen is none that was.
fn unstable(log: &ContactLog, contact: &Contact) -> Vec<bool> {
    let unstable = |i: usize| {
        let (_, rise) = contact.curve.at_with_derivative(log.root_speed_m_s[i].abs());
        let (per_load, film) = contact.viscous;
        let damps = contact.damping_n_s_per_m + per_load * log.load_n[i] + film;
        !contact.bristles_alone && -log.load_n[i] * rise > damps
    };
    (0..log.len()).map(unstable).collect()
}

/// Where the channel swings from sample to sample and slip is unstable. What the sensor smooths away and sampling mirrors leaves little
/// of a cycle, and a mean that is none of the law's.
fn swings(log: &ContactLog, unstable: &[bool]) -> Vec<bool> {
    // Of noise alone the second difference has six times the variance.
    let swing = SWING_NOISES * 6f64.sqrt() * log.friction_noise_nm;
    let shown = |i: usize| log.friction_nm[i.min(log.len() - 1)];
    let bend = |i: usize| shown(i + 1) - 2.0 * shown(i) + shown(i.saturating_sub(1));
    (0..log.len()).map(|i| unstable[i] && bend(i).abs() > swing).collect()
}

/// How fast cycles of slip and stick are, but for a factor: the root's way in which the block is wound up is in proportion to the load.
fn cycle_rate(log: &ContactLog) -> Vec<f64> {
    log.root_speed_m_s
        .iter()
        .zip(&log.load_n)
        .map(|(v, load)| v.abs() / load.max(f64::MIN_POSITIVE))
        .collect()
}

/// Between two places where cycles are too fast, and as fast as at one of them, they are too fast all along as long as slip is unstable:
/// where their rate is near a multiple of the samples' they are mirrored to what looks slow.
fn leave_out_between(resolved: &mut [bool], unstable: &[bool], rate: &[f64]) {
    let mut before: Option<usize> = None;
    for i in 0..resolved.len() {
        if !unstable[i] {
            before = None;
        } else if !resolved[i] {
            if let Some(from) = before {
                let slowest = rate[from].min(rate[i]);
                (from + 1..i).filter(|at| rate[*at] >= slowest).for_each(|at| resolved[at] = false);
            }
            before = Some(i);
        }
    }
}

/// Where cycles of slip and stick are long enough to be told from samples. Faster ones are seen through what smooths the channel,
/// and friction at a slip that is smoothed is wrong by the same in each of them.
fn cycles_resolved(slides: &[bool], swings: &[bool]) -> Vec<bool> {
    // Over two such cycles, or a single breakaway that hesitates would count.
    let reach = SAMPLES_PER_CYCLE;
    let last = slides.len().saturating_sub(1);
    let so_far = |counts: &dyn Fn(usize) -> bool| -> Vec<usize> {
        let sum = |sum: &mut usize, i: usize| {
            *sum += usize::from(counts(i));
            Some(*sum)
        };
        (0..=last).scan(0, sum).collect()
    };
    let [changes, swings] =
        [so_far(&|i| i > 0 && slides[i] != slides[i - 1]), so_far(&|i| swings.get(i) == Some(&true))];
    let near = |sums: &[usize], i: usize| sums[(i + reach).min(last)] - sums[i.saturating_sub(reach)];
    // A cycle that is resolved bends in few of its samples.
    let fast = |i: usize| near(&changes, i) > 4 || near(&swings, i) > reach;
    let fast: Vec<f64> = (0..slides.len()).map(|i| f64::from(u8::from(fast(i)))).collect();
    local_maximum(&fast, reach).into_iter().map(|fast| fast == 0.0).collect()
}

#[cfg(test)]
mod tests {
    use super::super::law::Curve;
    use super::super::observer::tests::block;
    use super::*;
    use crate::files::log::Log;
    use crate::files::rig_file::RigFile;
    use crate::files::signal::Signal;
    use crate::identify::noise::tests::white;

    #[test]
    fn rest_says_nothing_of_how_noisy_the_sensor_is() {
        const COUNT: usize = 8000;
        let at_rest = |i: usize| i < COUNT / 4;
        let mut log = Log::default();
        log.set_signal(Signal::Time, (0..COUNT).map(|i| 1e-3 * i as f64).collect());
        log.set_signal(Signal::M2Speed, vec![1.0; COUNT]);
        log.set_signal(Signal::NormalForce, vec![50.0; COUNT]);
        log.set_signal(Signal::FrictionTorque, white(COUNT, 2));
        let logs = [ContactLog::new(&log, &RigFile::assumed_rig(&[]).unwrap()).unwrap()];
        // The sensor's noise is as large as it is thought to be, and the form of a model acts where the contact moves.
        let sources = |i: usize| {
            let mut of: [f64; SOURCES] = [0.0; SOURCES];
            (of[0], of[MODEL_FORM_SOURCE]) = (1.0, if at_rest(i) { 0.0 } else { 0.05 });
            of
        };
        let noise = |certainty: Vec<f64>| Noise {
            sources: (0..COUNT).map(sources).collect(),
            certainty,
            deviation: vec![1.0; COUNT],
            filters: vec![(None, COUNT)],
            ..Noise::default()
        };
        let small_at_rest = |(i, r): (usize, f64)| if at_rest(i) { 0.2 * r } else { r };
        let r: Vec<f64> = white(COUNT, 7).into_iter().enumerate().map(small_at_rest).collect();
        let mut told = noise((0..COUNT).map(|i| if at_rest(i) { 0.6 } else { 1.0 }).collect());
        told.refit(&logs, &r);
        assert!((0.8..1.3).contains(&told.factors[0]), "{:?}", told.factors);
        // Where no sample tells, all is as it is thought to be.
        let mut untold = noise(vec![0.6; COUNT]);
        untold.refit(&logs, &r);
        assert_eq!(untold.factors, [1.0; SOURCES]);
    }

    #[test]
    fn what_either_model_does_not_resolve_is_left_out_and_told() {
        let of = |known: [bool; 4], out_s: f64| Noise {
            known: known.to_vec(),
            resolved: known.to_vec(),
            named: vec![0.1, 0.1, 0.1, 0.1],
            unresolved_s: (out_s, 4.0),
            ..Noise::default()
        };
        let mut noise = of([true, false, true, true], 1.0);
        noise.leave_out(&of([true, true, false, false], 2.0));
        assert_eq!(noise.known, [true, false, false, false]);
        // Errors are taken where samples are resolved, whether the fit counts them or not, and noise leaves them known.
        let mut own = of([true, false, true, true], 1.0);
        (own.known[0], own.named[2]) = (false, 1.0);
        assert_eq!(own.compared([true; 4].into_iter(), 0.5), [0, 3]);
        assert_eq!(own.compared([false, true, true, true].into_iter(), 0.5), [3]);
        assert!(noise.unresolved().unwrap().starts_with("2.0 s of 4.0 s"));
    }

    #[test]
    fn slip_and_stick_that_change_within_few_samples_are_not_resolved() {
        // Cycles of 6 samples, then of 30; a breakaway that hesitates before them.
        let slides = |i: usize| match i {
            0..200 => i == 100 || i == 102,
            200..600 => i % 6 < 3,
            _ => i % 30 < 10,
        };
        let slides: Vec<bool> = (0..1200).map(slides).collect();
        let resolved = cycles_resolved(&slides, &[false; 1200]);
        assert!(resolved[..170].iter().all(|resolved| *resolved));
        assert!(resolved[200..600].iter().all(|resolved| !resolved));
        assert!(resolved[640..].iter().all(|resolved| *resolved));
    }

    /// A slide that friction's fall makes unstable, and whose torque swings in every sample, is none.
    #[test]
    fn a_torque_that_swings_from_sample_to_sample_is_no_slide_where_sliding_is_unstable() {
        const COUNT: usize = 1200;
        // 40 % at each sample of the middle, and what a low-pass leaves of that: three deviations of the noise; noise elsewhere.
        let swing = |i: usize| match i {
            400..600 => [1.0, 0.2, -1.2][i % 3],
            600..800 => [0.03, 0.006, -0.036][i % 3],
            _ => 0.0,
        };
        let shown = white(COUNT, 5).iter().enumerate().map(|(i, e)| 2.0 + swing(i) + 0.01 * e).collect();
        let mut log = Log::default();
        log.set_signal(Signal::Time, (0..COUNT).map(|i| 1e-3 * i as f64).collect());
        log.set_signal(Signal::M2Speed, vec![5.0; COUNT]);
        log.set_signal(Signal::NormalForce, vec![50.0; COUNT]);
        log.set_signal(Signal::FrictionTorque, shown);
        let log = ContactLog::new(&log, &RigFile::assumed_rig(&[]).unwrap()).unwrap();
        let resolved = |damping_n_s_per_m: f64, change: f64| {
            let contact = block(1e4, damping_n_s_per_m, Curve::new(|w| 0.4 + change * (-w / 0.3).exp()));
            cycles_resolved(&[true; COUNT], &swings(&log, &unstable(&log, &contact)))
        };
        // 50 N times 1 s/m times e^(−speed/0.3).
        let slope = 50.0 * (-log.root_speed_m_s[COUNT / 2] / 0.3).exp();
        assert!(resolved(2.0 * slope, 0.3).iter().all(|resolved| *resolved));
        // Nor is a slide unstable where friction rises with speed.
        assert!(resolved(0.5 * slope, -0.3).iter().all(|resolved| *resolved));
        let found = resolved(0.5 * slope, 0.3);
        assert!(found[402..798].iter().all(|resolved| !resolved));
        assert!(found[..375].iter().chain(&found[825..]).all(|resolved| *resolved));
    }

    #[test]
    fn cycles_that_sampling_mirrors_to_slow_ones_are_too_fast_all_the_same() {
        let unstable: Vec<bool> = (0..60).map(|i| i != 45).collect();
        let rate: Vec<f64> = (0..60).map(|i| if (20..25).contains(&i) { 0.5 } else { 1.0 }).collect();
        let fast = |i: usize| [5..10, 30..40, 50..55].iter().any(|range| range.contains(&i));
        let mut resolved: Vec<bool> = (0..60).map(|i| !fast(i)).collect();
        leave_out_between(&mut resolved, &unstable, &rate);
        // Not where cycles are slower, nor beyond what is stable, nor before the first and behind the last.
        let out = |i: usize| (5..40).contains(&i) && !(20..25).contains(&i) || (50..55).contains(&i);
        assert!((0..60).all(|i| resolved[i] != out(i)), "{resolved:?}");
    }

    #[test]
    fn samples_that_swing_count_as_the_few_that_their_scores_tell() {
        let mut noise =
            Noise { temper: 2.0, repeated: 1.0, swinging: vec![false, true, false], ..Noise::default() };
        let counts = |noise: &Noise| noise.counts().take(4).collect::<Vec<f64>>();
        assert_eq!(counts(&noise), [0.5, 0.5, 0.5, 0.5]);
        noise.set_repeated(40.0);
        assert_eq!(counts(&noise), [0.5, 1.0 / 40.0, 0.5, 0.5]);
        // None counts as more than one that does not swing.
        noise.set_repeated(1.0);
        assert_eq!(counts(&noise), [0.5, 0.5, 0.5, 0.5]);
    }

    /// A mode is struck by what is uncertain of the force: of no more than residuals leave room for, and of no more than is named.
    #[test]
    fn what_strikes_a_mode_is_no_more_than_is_named_or_left() {
        let mut noise = Noise { sources: vec![[1.0; SOURCES]; 3], ..Noise::default() };
        let struck = |noise: &mut Noise, of_force: f64| {
            let mut factors = [1.0; SOURCES];
            factors[OF_FORCE].fill(of_force);
            noise.weigh(&[], &factors);
            noise.of_force[1] / OF_FORCE.len() as f64
        };
        assert_eq!([0.1, 1.0, 5.0].map(|of_force| struck(&mut noise, of_force)), [0.1, 1.0, 1.0]);
    }
}
