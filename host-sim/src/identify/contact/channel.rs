//! The friction channel of one log under a hypothesis: a sensor of whole series.
//!
//! On the grid's steps low-pass and a mode that does not ring from sample to sample are a delay, the rig file's; to it comes
//! what the hypothesis says that the channel is late.

use std::borrow::Cow;

use model_core::sensor::{LEAST_GAIN, SecondOrder, SecondOrderState, SensorChain, SensorUndo};

use super::change::Change;
use super::ends::Ends;
use super::log::ContactLog;
use super::problem::Numbers;
use super::smoothing::OBSERVED_OVER;
use crate::identify::filters::{adaptively_smoothed, before_mode, shifted, smoothed_flat};
use crate::identify::grid::STEP_S;

/// A mode slower than this many times the sampling rate is simulated; a faster one is its delay.
const SIMULATED_MODE: f64 = 0.25;
/// A hypothesis' mode is no slower than this: slower is the rig's motion.
pub const SLOWEST_MODE_HZ: f64 = 5.0;
/// Nor faster than this: it has to ring from sample to sample of the usual grid.
pub const FASTEST_MODE_HZ: f64 = 0.996 * SIMULATED_MODE / STEP_S;

/// White noise of the channel is at most some twice as large in the force before a mode: 0.9/(ω² w^2.5) for ω in radians per
/// sample behind a filter of width w.
const DEVIATION_BEFORE_MODE: f64 = 0.45;

/// The mode (Hz, damping ratio) where it rings from sample to sample.
pub(super) fn ringing(mode: Option<(f64, f64)>, step_s: f64) -> Option<(f64, f64)> {
    mode.filter(|(hz, _)| hz * step_s < SIMULATED_MODE)
}

/// What a mode (Hz, damping ratio) of the sensor was driven by, from what it shows; `None` where it is too fast to ring from
/// sample to sample.
pub fn before_ringing(shown: &[f64], mode: (f64, f64), step_s: f64) -> Option<Vec<f64>> {
    ringing(Some(mode), step_s).map(|(hz, zeta)| {
        let omega = std::f64::consts::TAU * hz * step_s;
        let width = (DEVIATION_BEFORE_MODE / (omega * omega)).powf(0.4).max(OBSERVED_OVER);
        before_mode(shown, omega, zeta, width)
    })
}

/// What a change adds to the torque that the friction channel of each log shows, N m; `None` where it changes nothing of it.
pub fn error_nm(logs: &[ContactLog], change: &Change) -> Option<Vec<Vec<f64>>> {
    let of_log = |(at, log)| Channel::of_effects(log, at, change).error_nm();
    change.changes_friction_channel().then(|| logs.iter().enumerate().map(of_log).collect())
}

/// What the normal channel of each log shows too much, N, where what a change does to friction is an error of that channel;
/// `None` where it does nothing.
pub fn normal_error_n(logs: &[ContactLog], change: &Change) -> Option<Vec<Vec<f64>>> {
    let log_factor = change.log_factor.as_ref()?;
    let of_log = |(log, factor): (&ContactLog, &Vec<f64>)| {
        log.normal_n.iter().zip(factor).map(|(shown, m)| -shown * m.exp_m1()).collect()
    };
    Some(logs.iter().zip(log_factor).map(of_log).collect())
}

/// The channel.
pub(super) struct Channel<'a> {
    log: &'a ContactLog,
    /// How late it is, samples.
    late: f64,
    ringing: Option<(f64, f64)>,
    /// What the gain has drifted by, relative.
    gain: Option<&'a [f64]>,
    zero_nm: Option<&'a [f64]>,
    /// The same that never changes, N m.
    steady_zero_nm: f64,
    ends_nm: Option<Ends>,
}

impl<'a> Channel<'a> {
    /// Of the log at this place, as a hypothesis changes it.
    pub(super) fn new(log: &'a ContactLog, at: usize, change: &'a Change, numbers: &Numbers) -> Self {
        let Numbers { late_ms, friction_zero_nm, .. } = *numbers;
        let of_effects = Self::of_effects(log, at, change);
        let late = of_effects.late + 1e-3 * late_ms / log.grid.step_s;
        Self { late, steady_zero_nm: friction_zero_nm, ..of_effects }
    }

    /// As effects change it.
    fn of_effects(log: &'a ContactLog, at: usize, change: &'a Change) -> Self {
        let step_s = log.grid.step_s;
        Self {
            log,
            late: log.friction_late + change.late_s / step_s,
            ringing: ringing(change.mode, step_s),
            gain: change.gain.as_ref().map(|gain| gain[at].as_slice()),
            zero_nm: change.zero_nm.as_ref().map(|zero| zero[at].as_slice()),
            steady_zero_nm: 0.0,
            ends_nm: change.ends_nm,
        }
    }

    /// How late it is, samples.
    pub(super) fn late(&self) -> f64 {
        self.late
    }

    /// What its amplifier, its lateness and a mode add to the torque that it shows, N m, taken ahead by the rig file's delay.
    pub(super) fn error_nm(&mut self) -> Vec<f64> {
        let log = self.log;
        // The noise of a channel is no error of its lateness: it would be there twice, now and when it was late.
        let smooth_nm = adaptively_smoothed(&log.friction_nm, log.friction_noise_nm);
        let mut shown_nm = shifted(&smooth_nm, log.friction_late);
        let bent = self.before_clip(Cow::Owned(smooth_nm));
        let delayed = self.before_delay(bent);
        let acted = self.before_amplifier(delayed);
        let behind = self.ringing.and_then(|mode| before_ringing(&acted, mode, log.grid.step_s));
        let torque_nm = behind.map_or(acted, Cow::Owned);
        shown_nm.iter_mut().zip(torque_nm.iter()).for_each(|(shown, torque)| *shown -= torque);
        shown_nm
    }

    /// The torque that acted, N m, but for what the ends of the range took.
    pub(super) fn seen_nm(&mut self) -> Vec<f64> {
        let log = self.log;
        let seen = if self.ringing.is_none() && self.gain.is_none() && self.zero_nm.is_none() {
            // The same, smoothed once for all hypotheses: smoothing commutes with a delay and with a steady zero, and over so few
            // samples a knee is straight.
            let bent = self.before_clip(Cow::Borrowed(&log.observed_nm));
            let delayed = self.before_delay(bent);
            self.before_amplifier(delayed)
        } else {
            self.undo(Cow::Borrowed(&log.friction_nm))
        };
        seen.into_owned()
    }

    /// Where it is at an end of its range, so that the torque is at least (1) or at most (−1) what was seen; `None` where its
    /// range has no ends.
    pub(super) fn ends(&mut self, seen_nm: Vec<f64>) -> Option<Vec<i8>> {
        let ends = self.ends_nm?;
        let (low, high) = self.log.near_ends(&ends);
        let (low, high) = (ends.acts(low), ends.acts(high));
        // The range ends behind the amplifier.
        let amplified = self.amplifier(Cow::Owned(seen_nm));
        Some(amplified.iter().map(|shown| i8::from(*shown > high) - i8::from(*shown < low)).collect())
    }

    /// What it shows of a torque, N m.
    pub(super) fn shown_nm(&mut self, torque_nm: Vec<f64>) -> Vec<f64> {
        self.show(Cow::Owned(torque_nm)).into_owned()
    }
}

impl<'a> SensorChain for Channel<'a> {
    type Signal = Cow<'a, [f64]>;

    fn mode(&mut self, torque_nm: Self::Signal) -> Self::Signal {
        let Some((hz, zeta)) = self.ringing else { return torque_nm };
        let mode = SecondOrder::new(hz, zeta, self.log.grid.step_s);
        let mut state = SecondOrderState::holding(torque_nm.first().copied().unwrap_or(0.0));
        changed(torque_nm, |torque| torque.iter_mut().for_each(|t| *t = mode.step(&mut state, *t)))
    }

    fn amplifier(&mut self, mut torque_nm: Self::Signal) -> Self::Signal {
        if let Some(gain) = self.gain {
            torque_nm =
                changed(torque_nm, |torque| torque.iter_mut().zip(gain).for_each(|(t, g)| *t *= 1.0 + g));
        }
        if let Some(zero_nm) = self.zero_nm {
            torque_nm =
                changed(torque_nm, |torque| torque.iter_mut().zip(zero_nm).for_each(|(t, z)| *t += z));
        }
        if self.steady_zero_nm != 0.0 {
            torque_nm =
                changed(torque_nm, |torque| torque.iter_mut().for_each(|t| *t += self.steady_zero_nm));
        }
        torque_nm
    }

    fn delay(&mut self, torque_nm: Self::Signal) -> Self::Signal {
        shifted(&torque_nm, -self.late).into()
    }

    fn clip(&mut self, torque_nm: Self::Signal) -> Self::Signal {
        let Some(ends) = self.ends_nm else { return torque_nm };
        changed(torque_nm, |torque| ends.show(torque))
    }
}

impl<'a> SensorUndo for Channel<'a> {
    type Signal = Cow<'a, [f64]>;

    fn before_clip(&mut self, shown_nm: Self::Signal) -> Self::Signal {
        let Some(ends) = self.ends_nm.filter(Ends::bend) else { return shown_nm };
        changed(shown_nm, |shown| ends.act(shown))
    }

    fn before_delay(&mut self, shown_nm: Self::Signal) -> Self::Signal {
        shifted(&shown_nm, self.late).into()
    }

    fn before_amplifier(&mut self, mut shown_nm: Self::Signal) -> Self::Signal {
        if self.steady_zero_nm != 0.0 {
            shown_nm = changed(shown_nm, |shown| shown.iter_mut().for_each(|s| *s -= self.steady_zero_nm));
        }
        if let Some(zero_nm) = self.zero_nm {
            shown_nm = changed(shown_nm, |shown| shown.iter_mut().zip(zero_nm).for_each(|(s, z)| *s -= z));
        }
        if let Some(gain) = self.gain {
            let divided = |(s, g): (&mut f64, &f64)| *s /= (1.0 + g).max(LEAST_GAIN);
            shown_nm = changed(shown_nm, |shown| shown.iter_mut().zip(gain).for_each(divided));
        }
        shown_nm
    }

    fn before_mode(&mut self, shown_nm: Self::Signal) -> Self::Signal {
        let behind = self.ringing.and_then(|mode| before_ringing(&shown_nm, mode, self.log.grid.step_s));
        let smooth = behind.unwrap_or_else(|| smoothed_flat(&shown_nm, OBSERVED_OVER));
        self.log.smoothing.further(smooth, self.late).into()
    }
}

/// A series that was changed in place.
fn changed<'a>(series: Cow<'a, [f64]>, change: impl FnOnce(&mut [f64])) -> Cow<'a, [f64]> {
    let mut series = series.into_owned();
    change(&mut series);
    series.into()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::files::log::Log;
    use crate::files::model_file::ModelFile;
    use crate::files::rig_file::RigFile;
    use crate::files::signal::Signal;
    use crate::identify::contact::baseline::{KNOWN_WITHIN, baseline};
    use crate::identify::filters::rms;
    use crate::identify::noise::tests::white;

    const COUNT: usize = 2000;
    /// Samples.
    const LATE: f64 = 7.4;
    /// What the bridge shows where nothing pulls, N m.
    const STEADY_NM: f64 = 0.2;

    fn series(of: impl Fn(f64) -> f64) -> Vec<f64> {
        (0..COUNT).map(|i| of(i as f64)).collect()
    }

    fn numbers(late_ms: f64) -> Numbers {
        let model = ModelFile::assumed(&[]).unwrap();
        Numbers { late_ms, friction_zero_nm: STEADY_NM, ..baseline(&model, KNOWN_WITHIN).numbers }
    }

    /// A log whose friction channel shows this, N m, on a rig that is not late.
    fn log(shown_nm: Vec<f64>) -> ContactLog {
        let mut log = Log::default();
        log.set_signal(Signal::Time, series(|i| 1e-3 * i));
        log.set_signal(Signal::M2Speed, vec![5.0; COUNT]);
        log.set_signal(Signal::NormalForce, vec![80.0; COUNT]);
        log.set_signal(Signal::FrictionTorque, shown_nm);
        let log = ContactLog::new(&log, &RigFile::assumed_rig(&[]).unwrap()).unwrap();
        ContactLog { friction_late: 0.0, ..log }
    }

    /// Largest difference away from the ends.
    fn off(a: &[f64], b: &[f64]) -> f64 {
        let inner = 50..COUNT - 50;
        a[inner.clone()].iter().zip(&b[inner]).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    }

    #[test]
    fn a_gain_and_a_zero_that_drift_are_late_with_the_torque_there_and_back() {
        let torque = |i: f64| 3.0 * (0.01 * i).sin() + (0.023 * i).cos();
        let (gain, zero) = (|i: f64| 0.1 * (0.003 * i).sin(), |i: f64| 0.5 * (0.005 * i).cos());
        let shown = |i: f64| torque(i - LATE) * (1.0 + gain(i - LATE)) + zero(i - LATE);
        let change = Change {
            gain: Some(vec![series(gain)]),
            zero_nm: Some(vec![series(zero)]),
            late_s: 1e-3 * (LATE - 2.0),
            ..Change::default()
        };
        let log = log(series(|i| shown(i) + STEADY_NM));
        let mut channel = Channel::new(&log, 0, &change, &numbers(2.0));
        // Cubics between samples. A gain and a zero that were not late would be 0.02 N m off.
        assert!(off(&channel.shown_nm(series(torque)), &log.friction_nm) < 1e-5);
        assert!(off(&channel.seen_nm(), &series(torque)) < 1e-5);
    }

    /// A gain that changes nothing has the channel undone step by step.
    #[test]
    fn every_hypothesis_sees_the_same_filter() {
        let noise = white(COUNT, 5);
        let step = |i: f64| if i < 1000.0 { 1.0 } else { 4.0 };
        // 0.3 N m over a damping of 160 N s/m are 0.04 m/s, and the root moves at 0.3 m/s.
        let late = |log: ContactLog| ContactLog { friction_late: 3.0, ..log };
        let log = late(log(series(|i| step(i) + 0.3 * noise[i as usize]))).seen_through(&numbers(0.0));
        assert!(log.smoothing.ahead(0.0).iter().any(|place| *place > 0));
        let undone = Change { gain: Some(vec![vec![0.0; COUNT]]), ..Change::default() };
        let seen = |change: &Change| Channel::new(&log, 0, change, &numbers(0.0)).seen_nm();
        assert!(off(&seen(&Change::default()), &seen(&undone)) < 1e-9);
    }

    #[test]
    fn what_it_shows_too_much_is_what_is_not_the_torque_when_it_acted() {
        let torque = |i: f64| 3.0 * (0.01 * i).sin();
        let (gain, zero) = (|i: f64| 0.1 * (0.003 * i).sin(), |i: f64| 0.5 * (0.005 * i).cos());
        let change = |late_s| Change {
            gain: Some(vec![series(gain)]),
            zero_nm: Some(vec![series(zero)]),
            late_s,
            ..Change::default()
        };
        for (late, rig_late) in [(0.0, 0.0), (LATE, 0.0), (LATE, 2.0)] {
            // The rig file knows of a part of the delay.
            let shown = |i: f64| {
                let i = i - late - rig_late;
                torque(i) * (1.0 + gain(i)) + zero(i)
            };
            let logs = [ContactLog { friction_late: rig_late, ..log(series(shown)) }];
            let error = error_nm(&logs, &change(1e-3 * late)).expect("it has one");
            let expected = series(|i| shown(i + rig_late) - torque(i));
            assert!(off(&error[0], &expected) < 1e-4, "{late} {rig_late}: {}", off(&error[0], &expected));
        }
        assert!(error_nm(&[log(series(torque))], &Change::default()).is_none());
    }

    #[test]
    fn a_knee_is_taken_back_as_far_as_it_tells_and_is_an_error_of_the_channel() {
        let torque = |i: f64| 3.0 * (0.01 * i).sin();
        let ends = Ends::with_knee((-2.6, 2.6), 0.2);
        let log = log(series(|i| ends.shown(torque(i))));
        let change = Change { ends_nm: Some(ends), ..Change::default() };
        let mut channel = Channel::new(&log, 0, &change, &Numbers { friction_zero_nm: 0.0, ..numbers(0.0) });
        assert!(off(&channel.shown_nm(series(torque)), &log.friction_nm) < 1e-12);
        let seen_nm = channel.seen_nm();
        let at_end = channel.ends(seen_nm.clone()).expect("it has ends");
        let (low, high) = ends.told_between();
        assert!(log.friction_nm.iter().any(|shown| *shown > high));
        let told = |i: &usize| (50..COUNT - 50).contains(i) && (low..high).contains(&log.friction_nm[*i]);
        for i in (0..COUNT).filter(told) {
            assert!((seen_nm[i] - torque(i as f64)).abs() < 0.01, "{i}: {}", seen_nm[i]);
        }
        let error = &error_nm(std::slice::from_ref(&log), &change).expect("it has one")[0];
        let (mut inside, mut beyond) = (0, 0);
        for i in (0..COUNT).filter(|i| (50..COUNT - 50).contains(i)) {
            let torque = torque(i as f64);
            if at_end[i] == 0 {
                inside += 1;
                assert!((error[i] - (ends.shown(torque) - torque)).abs() < 0.01, "{i}: {}", error[i]);
            } else {
                beyond += 1;
                assert!(f64::from(at_end[i]) * torque > 2.5, "{i}: {torque}");
            }
        }
        assert!(inside > COUNT / 2 && beyond > COUNT / 10, "{inside} {beyond}");
        // Ends without a knee take nothing from what is between them.
        let cut = Change { ends_nm: Some(Ends::hard((-2.6, 2.6))), ..Change::default() };
        assert!(error_nm(std::slice::from_ref(&log), &cut).is_none());
    }

    #[test]
    fn what_the_sensors_mode_rings_with_is_no_torque() {
        let torque = |i: f64| 3.0 * (0.01 * i).sin() + if i % 400.0 < 200.0 { 1.0 } else { 0.0 };
        let change = Change { mode: Some((40.0, 0.02)), ..Change::default() };
        let acted = log(series(torque));
        let shown_nm =
            Channel::new(&acted, 0, &change, &numbers(0.0)).mode(Cow::Owned(series(torque))).into_owned();
        let expected: Vec<f64> =
            shown_nm.iter().zip(series(torque)).map(|(shown, acted)| shown - acted).collect();
        let error = error_nm(&[log(shown_nm)], &change).expect("it has one");
        let left: Vec<f64> = error[0].iter().zip(&expected).map(|(a, b)| a - b).collect();
        // What is smoothed of the torque's steps.
        assert!(rms(&left) < 0.2 * rms(&expected), "{} of {}", rms(&left), rms(&expected));
    }

    #[test]
    fn noise_is_no_error_of_a_late_channel() {
        const NOISE_NM: f64 = 0.1;
        let torque = |i: f64| 3.0 * (0.01 * i).sin();
        let noise = white(COUNT, 5);
        let log = log(series(|i| torque(i - LATE) + NOISE_NM * noise[i as usize]));
        let change = Change { late_s: 1e-3 * LATE, ..Change::default() };
        let [error] = error_nm(&[log], &change).unwrap().try_into().unwrap();
        let expected = series(|i| torque(i - LATE) - torque(i));
        let left: Vec<f64> =
            error.iter().zip(&expected).map(|(a, b)| a - b).skip(50).take(COUNT - 100).collect();
        // Its noise from two times would be 1.4 times that of one.
        assert!(rms(&left) < 0.7 * NOISE_NM, "{}", rms(&left));
    }

    #[test]
    fn a_normal_channel_that_shows_too_much_makes_friction_look_too_small() {
        // Of 80 N it shows a twentieth and 2 N more by and by.
        let acted = 80.0;
        let shown = |i: f64| acted + (0.05 * acted + 2.0) * i / COUNT as f64;
        let log = ContactLog { normal_n: series(shown), ..log(vec![0.0; COUNT]) };
        let factor = series(|i| (acted / shown(i)).ln());
        let change = Change { log_factor: Some(vec![factor]), ..Change::default() };
        let error = normal_error_n(&[log], &change).expect("it has one");
        assert!(off(&error[0], &series(|i| shown(i) - acted)) < 1e-9);
    }

    #[test]
    fn a_zero_that_jumps_does_not_shake_the_mode_there_nor_back() {
        let zero = |i: f64| if i < 1000.0 { 0.0 } else { 0.7 };
        let change = Change {
            zero_nm: Some(vec![series(|i| zero(i) - STEADY_NM)]),
            mode: Some((80.0, 0.01)),
            ends_nm: Some(Ends::hard((-5.0, 2.5))),
            ..Change::default()
        };
        let log = log(series(|i| 2.0 + zero(i)));
        let mut channel = Channel::new(&log, 0, &change, &numbers(0.0));
        assert!(off(&channel.shown_nm(vec![2.0; COUNT]), &series(|i| (2.0 + zero(i)).min(2.5))) < 1e-12);
        let seen = off(&channel.seen_nm(), &vec![2.0; COUNT]);
        // The way back through the mode passes what stands to 0.2 %; a zero left in it would be several N m off at its jump.
        assert!(seen < 0.01, "{seen}");
    }

    #[test]
    fn where_the_amplifier_adds_nothing_the_smoothed_channel_stands_for_the_raw_one() {
        let log = log(series(|i| (0.05 * i).sin() + 0.3 * (1.3 * i).cos()));
        let change = Change { late_s: 1e-3 * LATE, ..Change::default() };
        let mut channel = Channel::new(&log, 0, &change, &numbers(0.0));
        let whole = channel.undo(Cow::Borrowed(&log.friction_nm)).into_owned();
        assert!(off(&channel.seen_nm(), &whole) < 1e-12);
    }
}
