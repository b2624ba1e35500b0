//! The figures of an experiment that `summary.json` holds.
//!
//! All are taken from the log as recorded. Times count from the start of the experiment.
//!
//! * The **phase** looked at begins with the last rise of M1's torque (the load step), or, where M1 holds
//!   one torque throughout, with the last segment of M2; it ends with the next segment of either motor
//!   or with the log.
//! * **settled** is the mean over the last second of the phase, over its last quarter where the phase is
//!   shorter than 4 s. Under a sine of M2 nothing settles: then it is null, and what hangs on it too.
//! * **peak** is the extreme of the phase on the side of the settled value.
//! * **friction_overshoot** = peak/settled − 1.
//! * **normal_settled_time_s** is when the normal force enters the band of ±5 % around its settled value for
//!   the last time.
//! * **friction_ratio_at_same_normal**: after the friction peak the normal force leaves the value it had there
//!   (by more than 2.5 %, half of the band that counts as settled); when it next crosses that value,
//!   friction then over friction at the peak. A normal force that never leaves has the value all along:
//!   then it is settled over peak. Null where it leaves and does not come back.
//! * **friction_coefficient_ratio** = (settled friction/settled normal force)/(the same at the friction peak).
//! * **loop_energy_j**: ∮ T dθ of friction torque over disc angle, mean of the whole periods of M2's torque sine
//!   but the first.
//! * **damping_ratio**: of θ̈ + 2ζω θ̇ + ω² θ = const., fitted to the disc after M2's torque step in
//!   integrated form, from 10 ms after the step until the speed has died to 2 % of its peak.

use serde::Serialize;

use crate::files::experiment_file::{Course, ExperimentFile, Quantity, Segment, Study};
use crate::files::log::Log;
use crate::files::signal::Signal;
use crate::input_error::InputError;
use crate::predict::integral;

mod decay;
mod phase;

use phase::Phase;

/// Band around the settled normal force.
const SETTLED: f64 = 0.05;
/// The normal force has the same value within this part of it.
const SAME: f64 = 0.025;

/// How a run went.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct RunFacts {
    /// Time it took.
    pub wall_s: f64,
    /// Time that passed in it.
    pub simulated_s: f64,
    /// Control ticks that ran.
    pub control_ticks: u64,
    /// Of these, too late.
    pub deadline_misses: u64,
}

/// `summary.json` of an experiment; the module says what each figure means.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
#[allow(missing_docs, reason = "defined in the module's text")]
pub struct Summary {
    pub experiment: String,
    pub friction_peak_nm: Option<f64>,
    pub friction_settled_nm: Option<f64>,
    pub friction_overshoot: Option<f64>,
    pub friction_peak_time_s: Option<f64>,
    pub normal_peak_n: Option<f64>,
    pub normal_settled_n: Option<f64>,
    pub normal_settled_time_s: Option<f64>,
    pub friction_ratio_at_same_normal: Option<f64>,
    pub friction_coefficient_ratio: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub loop_energy_j: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub damping_ratio: Option<f64>,
    #[serde(flatten)]
    pub run: RunFacts,
}

/// The figures of an experiment from its log. Studies without motors have only the facts of the run.
pub fn summarise(experiment: &ExperimentFile, log: &Log, run: RunFacts) -> Result<Summary, InputError> {
    let mut summary = Summary { experiment: experiment.name.clone(), run, ..Summary::default() };
    let Study::ClosedLoop { m1, m2 } = &experiment.study else { return Ok(summary) };
    let signals = log.contact()?;
    let (from_s, to_s) = phase_of(m1, m2, experiment.duration_s);
    let last_m2 = m2.iter().rev().find(|segment| segment.start_s <= from_s.max(0.0));
    let is_sine = last_m2.is_some_and(|segment| matches!(segment.course, Course::Sine { .. }));
    let friction = Phase::new(signals.time_s, signals.friction_torque_nm, from_s, to_s);
    let normal = Phase::new(signals.time_s, signals.normal_force_n, from_s, to_s);
    if let (Some(friction), Some(normal)) = (friction, normal) {
        contact_figures(&mut summary, &friction, &normal, !is_sine);
    }
    if let Some(segment) = last_m2.filter(|segment| segment.quantity != Quantity::SpeedRadS) {
        let angle = match log.signal(Signal::M2Angle) {
            Some(angle) => angle.to_vec(),
            None => integral(signals.time_s, &signals.m2_speed_rad_s),
        };
        match segment.course {
            Course::Sine { angular_frequency_rad_s, .. } => {
                let period_s = std::f64::consts::TAU / angular_frequency_rad_s;
                summary.loop_energy_j = phase::loop_energy(
                    signals.time_s,
                    &angle,
                    signals.friction_torque_nm,
                    (segment.start_s, to_s),
                    period_s,
                );
            }
            Course::Constant { .. } if segment.start_s > 0.0 => {
                let span = (segment.start_s, to_s);
                // Where a swing turns, a speed that is a little late has less noise than the slope of the angle.
                let speed = log.signal(Signal::M2Speed).unwrap_or(&signals.m2_speed_rad_s);
                summary.damping_ratio = decay::damping_ratio(signals.time_s, &angle, speed, span);
            }
            _ => {}
        }
    }
    Ok(summary)
}

fn contact_figures(summary: &mut Summary, friction: &Phase<'_>, normal: &Phase<'_>, settles: bool) {
    let (friction_settled, normal_settled) = (friction.settled(), normal.settled());
    let side = if settles { friction_settled } else { friction.largest_magnitude() };
    let (peak_time_s, peak_nm) = friction.peak(side);
    summary.friction_peak_nm = Some(peak_nm);
    summary.friction_peak_time_s = Some(peak_time_s);
    summary.normal_peak_n = Some(normal.peak(1.0).1);
    summary.normal_settled_n = Some(normal_settled);
    summary.normal_settled_time_s = normal.settled_time(SETTLED);
    if !settles {
        return;
    }
    let ratio = |a: f64, b: f64| (b != 0.0).then(|| a / b).filter(|ratio| ratio.is_finite());
    summary.friction_settled_nm = Some(friction_settled);
    summary.friction_overshoot = ratio(peak_nm, friction_settled).map(|ratio| ratio - 1.0);
    let normal_at_peak = normal.at(peak_time_s);
    let later = match normal.comes_back(peak_time_s, normal_at_peak, SAME) {
        phase::Return::NeverLeft => Some(friction_settled),
        phase::Return::At(time_s) => Some(friction.at(time_s)),
        phase::Return::Never => None,
    };
    summary.friction_ratio_at_same_normal = later.and_then(|later| ratio(later, peak_nm));
    summary.friction_coefficient_ratio = ratio(friction_settled, normal_settled)
        .zip(ratio(peak_nm, normal_at_peak))
        .and_then(|(a, b)| ratio(a, b));
}

/// Start of the phase that is looked at; `None` for a study without motors.
pub fn phase_start_s(experiment: &ExperimentFile) -> Option<f64> {
    match &experiment.study {
        Study::ClosedLoop { m1, m2 } => Some(phase_of(m1, m2, experiment.duration_s).0),
        _ => None,
    }
}

/// Start and end of the phase that is looked at.
fn phase_of(m1: &[Segment], m2: &[Segment], end_s: f64) -> (f64, f64) {
    let value = |segment: &Segment| match segment.course {
        Course::Constant { value } => value,
        Course::Ramp { to, .. } => to,
        Course::Sine { offset, .. } => offset,
    };
    let rise = m1.windows(2).rev().find(|pair| value(&pair[1]) > value(&pair[0])).map(|pair| pair[1].start_s);
    let from_s = rise.or_else(|| m2.last().map(|segment| segment.start_s)).unwrap_or(0.0);
    let next = m1.iter().chain(m2).map(|segment| segment.start_s).filter(|start_s| *start_s > from_s);
    (from_s, next.fold(end_s, f64::min))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn log(friction: impl Fn(f64) -> f64, normal: impl Fn(f64) -> f64) -> Log {
        let time_s: Vec<f64> = (0..10_000).map(|i| f64::from(i) * 1e-3).collect();
        let mut log = Log::default();
        log.set_signal(Signal::M2Speed, vec![1.0; time_s.len()]);
        log.set_signal(Signal::FrictionTorque, time_s.iter().map(|t| friction(*t)).collect());
        log.set_signal(Signal::NormalForce, time_s.iter().map(|t| normal(*t)).collect());
        log.set_signal(Signal::Time, time_s);
        log
    }

    fn fig18() -> ExperimentFile {
        ExperimentFile::named_or_read("fig18", &[]).unwrap()
    }

    #[test]
    fn peak_and_settled_values_of_a_known_course_are_found() {
        // Friction: 20 % overshoot at 4.5 s over 3 N·m. Normal force: 90 N with a swing that dies out.
        let friction = |t: f64| if t < 4.0 { 0.2 } else { 3.0 + 0.6 * (-((t - 4.5) / 0.1).powi(2)).exp() };
        let swing = |t: f64| 45.0 * (-20.0 * (t - 4.0)).exp() * (100.0 * (t - 4.0)).cos();
        let normal = |t: f64| if t < 4.0 { 5.0 } else { 90.0 - swing(t) };
        let summary = summarise(&fig18(), &log(friction, normal), RunFacts::default()).unwrap();
        let is = |value: Option<f64>, expected: f64, within: f64| {
            assert!(value.is_some_and(|value| (value - expected).abs() <= within), "{value:?} {expected}");
        };
        is(summary.friction_peak_nm, 3.6, 1e-12);
        is(summary.friction_settled_nm, 3.0, 1e-9);
        is(summary.friction_overshoot, 0.2, 1e-9);
        is(summary.friction_peak_time_s, 4.5, 1e-12);
        is(summary.normal_settled_n, 90.0, 1e-6);
        // The swing is below 4.5 N for good where 45 e^{−20 t}|cos| last passes 4.5: at 4.096…4.115 s.
        is(summary.normal_settled_time_s, 4.105, 0.012);
        // At 4.5 s the swing is 2e-3 N: within 2.5 % ever after, so settled over peak.
        is(summary.friction_ratio_at_same_normal, 1.0 / 1.2, 1e-9);
        is(summary.friction_coefficient_ratio, 1.0 / 1.2, 1e-4);
        assert_eq!((summary.loop_energy_j, summary.damping_ratio), (None, None));
    }

    #[test]
    fn friction_is_compared_where_the_normal_force_has_the_same_value_again() {
        // Triangle: the normal force rises to 5 s, falls to 6 s; friction peaks on the way up.
        let normal = |t: f64| if t < 4.0 { 0.0 } else { 100.0 - 50.0 * (t - 5.0).abs().min(1.0) };
        let friction = |t: f64| if t < 4.5 { 4.0 * (t - 4.0).max(0.0) } else { (2.0 - (t - 4.5)).max(1.0) };
        let summary = summarise(&fig18(), &log(friction, normal), RunFacts::default()).unwrap();
        // Peak of 2 at 4.5 s under 75 N; 75 N again at 5.5 s, friction is 1 there.
        assert!(summary.friction_ratio_at_same_normal.is_some_and(|x| (x - 0.5).abs() < 1e-9));
        let rising = |t: f64| if t < 4.0 { 0.0 } else { 10.0 * (t - 3.0) };
        let summary = summarise(&fig18(), &log(friction, rising), RunFacts::default()).unwrap();
        assert_eq!(summary.friction_ratio_at_same_normal, None);
    }

    #[test]
    fn every_figure_of_the_contract_is_in_the_json() {
        let summary = Summary { loop_energy_j: Some(1.0), damping_ratio: Some(0.3), ..Summary::default() };
        let json = serde_json::to_value(&summary).unwrap();
        for name in [
            "experiment",
            "friction_peak_nm",
            "friction_settled_nm",
            "friction_overshoot",
            "friction_peak_time_s",
            "normal_peak_n",
            "normal_settled_n",
            "normal_settled_time_s",
            "friction_ratio_at_same_normal",
            "friction_coefficient_ratio",
            "loop_energy_j",
            "damping_ratio",
            "wall_s",
            "simulated_s",
            "control_ticks",
            "deadline_misses",
        ] {
            assert!(json.get(name).is_some(), "{name}");
        }
    }
}
