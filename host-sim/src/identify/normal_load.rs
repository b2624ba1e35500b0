//! The normal-load actuator's balance: torque of M1 against normal force, springs and the mechanism's mode.
//!
//! T1 = N/G + F0/G + d₁ Ṅ + d₂ N̈ + lateness
//!
//! all terms through one Gaussian. The measured normal force is known better than the torque, so the torque is the response.
//! Rows where the elements are lifted off are left out.

use super::balance::{Balance, LogRows};
use super::bridge_zero;
use super::contact::log::{ContactLog, END_NOISES};
use super::effects::coordinates::TIME;
use super::filters::{
    adaptively_smoothed, derivative_of_motion, gaussian, largest_change, local_maximum, rms,
    smoothed_together, white_share,
};
use super::noise;
use super::term::Parameter;
use crate::files::rig_file::RigFile;
use crate::predict::Mechanism;

/// Width of the filter, samples.
pub const WIDTH: f64 = 4.0;
/// What no model of the normal-load actuator is more accurate than, relative to its torque.
const LEAST_NOISE: f64 = 5e-4;
/// Share of the filtered change a sample that is not known.
const BETWEEN_SAMPLES: f64 = 0.05;
/// Share of the filtered second difference that the mode's two terms leave open: what the springs do between them.
const BEND: f64 = 0.6;
/// The elements touch where the normal force is more than this share of its usual size.
const TOUCHING: f64 = 0.04;
/// Gain and preload of the rig file are known within 10 %, the mode's coefficients within half.
const KNOWN: f64 = 0.1;

/// Within this time springs and levels are steady but for a parabola, s.
const STEADY_S: f64 = 0.25;

/// Places of the gain's inverse and of the torque's lateness among the base's parameters.
const GAIN: usize = 0;
const LATENESS: usize = 4;

/// Signals of the normal-load actuator in a log.
#[derive(Debug, Clone)]
pub struct NormalLoadLog {
    /// Step, s.
    pub step_s: f64,
    /// Torque of M1, N m.
    pub torque_nm: Vec<f64>,
    /// Angle of M1, rad.
    pub angle_rad: Option<Vec<f64>>,
    /// What the encoder does not tell of it: a count or its noise, rad.
    pub angle_within_rad: f64,
    /// Normal force, N.
    pub normal_n: Vec<f64>,
    /// Both without their noise and with their peaks.
    pub smoothed_torque_nm: Vec<f64>,
    /// As [`Self::smoothed_torque_nm`].
    pub smoothed_n: Vec<f64>,
    /// Force that the mechanism's mode makes of the torque, N: it rings as the force does, and has the torque's noise.
    pub carried_n: Vec<f64>,
    /// Normal force without its noise, through the filter.
    pub filtered_n: Vec<f64>,
    /// Time since the log's start, s.
    pub time_s: Vec<f64>,
    /// Points that take part.
    pub usable: Vec<bool>,
    /// Noise of the torque, N m.
    pub torque_noise_nm: f64,
    /// Noise of the normal force, N.
    pub normal_noise_n: f64,
}

impl NormalLoadLog {
    /// The normal-load actuator of a contact log; `None` where M1's torque is not logged.
    pub fn new(log: &ContactLog, rig: &RigFile) -> Option<Self> {
        let torque_nm = log.m1_torque_nm.clone()?;
        let torque_noise_nm = noise::standard_deviation(&torque_nm);
        let normal_noise_n = noise::standard_deviation(&log.normal_n);
        // Its noise would make a smaller gain look better where levels do not tell it, and pay for what makes up for that.
        let smoothed_n = smoothed_together([(&log.normal_n, normal_noise_n), (&torque_nm, torque_noise_nm)]);
        let smoothed_torque_nm = adaptively_smoothed(&torque_nm, torque_noise_nm);
        let count_rad = std::f64::consts::TAU / f64::from(rig.counts_per_rev());
        let angle_noise_rad = log.m1_angle_rad.as_deref().map_or(0.0, noise::standard_deviation);
        let angle_within_rad = count_rad.max(END_NOISES * angle_noise_rad);
        let mut mechanism = Mechanism::settled(rig, smoothed_torque_nm.first().copied().unwrap_or(0.0));
        let carried_n = smoothed_torque_nm.iter().map(|nm| mechanism.step(log.grid.step_s, *nm)).collect();
        Some(Self {
            step_s: log.grid.step_s,
            torque_noise_nm,
            normal_noise_n,
            carried_n,
            smoothed_torque_nm,
            torque_nm,
            angle_within_rad,
            angle_rad: log.m1_angle_rad.clone(),
            filtered_n: gaussian(&smoothed_n, WIDTH, 0),
            smoothed_n,
            normal_n: log.normal_n.clone(),
            time_s: log.grid.time_s.clone(),
            usable: log.usable.clone(),
        })
    }

    /// Points of the grid.
    pub fn len(&self) -> usize {
        self.normal_n.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.normal_n.is_empty()
    }

    /// A signal through the balance's filter.
    pub fn filtered(&self, values: &[f64]) -> Vec<f64> {
        gaussian(values, WIDTH, 0)
    }
}

/// Usual sizes over the training logs.
#[derive(Debug, Clone, Copy)]
pub struct NormalLoadScales {
    /// Normal force, N.
    pub load_n: f64,
    /// Torque, N m.
    pub torque_nm: f64,
    /// Longest log, s.
    pub time_s: f64,
}

impl NormalLoadScales {
    /// Of the training logs.
    pub fn new(logs: &[NormalLoadLog]) -> Self {
        let usual =
            |of: &dyn Fn(&NormalLoadLog) -> f64| rms(&logs.iter().map(of).collect::<Vec<_>>()).max(1e-12);
        Self {
            load_n: usual(&|log| rms(&log.normal_n)),
            torque_nm: usual(&|log| rms(&log.torque_nm)),
            time_s: logs.iter().filter_map(|log| log.time_s.last().copied()).fold(1e-9, f64::max),
        }
    }
}

/// What effects in the normal-load actuator may follow, with units, all logs on end.
pub fn coordinates(logs: &[NormalLoadLog]) -> Vec<(String, Vec<f64>)> {
    let all = |of: &dyn Fn(&NormalLoadLog) -> Vec<f64>| logs.iter().flat_map(of).collect::<Vec<f64>>();
    let rate =
        |log: &NormalLoadLog| gaussian(&log.normal_n, WIDTH, 1).iter().map(|d| d / log.step_s).collect();
    let mut out = vec![
        ("normal force, N".into(), all(&|log| log.filtered_n.clone())),
        ("rate of the normal force, N/s".into(), all(&rate)),
        (TIME.into(), all(&|log| log.time_s.clone())),
    ];
    if logs.iter().all(|log| log.angle_rad.is_some()) {
        out.push(("angle of M1, rad".into(), all(&|log| log.angle_rad.clone().unwrap_or_default())));
    }
    out
}

/// The balance of these logs.
pub fn balance(logs: &[NormalLoadLog], rig: &RigFile, scales: &NormalLoadScales) -> Balance {
    let concat = |of: &dyn Fn(&NormalLoadLog) -> Vec<f64>| logs.iter().flat_map(of).collect::<Vec<f64>>();
    let derivative = |log: &NormalLoadLog, order: usize| -> Vec<f64> {
        let per = log.step_s.powi(order as i32);
        derivative_of_motion(&log.normal_n, WIDTH, order, log.normal_noise_n)
            .iter()
            .map(|d| d / per)
            .collect()
    };
    let gain = rig.lever_gain_n_per_nm;
    let omega = std::f64::consts::TAU * rig.pressure.mode_hz;
    let known = |name: &str, mean: f64, sd: f64| Parameter {
        amplitude: false,
        mean,
        ..Parameter::amplitude(name, sd)
    };
    let base = vec![
        (known("inverse_gain", 1.0 / gain, KNOWN / gain), concat(&|log| log.filtered_n.clone())),
        (
            known(
                "preload_nm",
                rig.preload_n / gain,
                (KNOWN * rig.preload_n / gain).max(0.02 * scales.torque_nm),
            ),
            vec![1.0; logs.iter().map(NormalLoadLog::len).sum()],
        ),
        (
            known("damping_nm_s_per_n", 2.0 * rig.pressure.damping_ratio / omega / gain, 1.0 / omega / gain),
            concat(&|log| derivative(log, 1)),
        ),
        (
            known("mass_nm_s2_per_n", 1.0 / (omega * omega * gain), 0.5 / (omega * omega * gain)),
            concat(&|log| derivative(log, 2)),
        ),
        (
            known("torque_late_s", 0.0, 1e-3),
            concat(&|log| {
                let slope = derivative_of_motion(&log.torque_nm, WIDTH, 1, log.torque_noise_nm);
                slope.iter().map(|d| -d / log.step_s).collect()
            }),
        ),
    ];
    let rows: Vec<LogRows<'_>> = logs.iter().map(|log| rows(log, gain, scales)).collect();
    let zero_nm = bridge_zero::standard_deviations(rig)[1] / gain;
    let torque_nm: Vec<Vec<f64>> = logs.iter().map(|log| log.filtered(&log.torque_nm)).collect();
    let noise_nm = noise_of_both(logs, &torque_nm, gain);
    Balance::new(torque_nm.concat(), base, &rows, scales.torque_nm)
        .with_sensors(LATENESS, zero_nm)
        .with_noise_in(GAIN, noise_nm)
}

/// Noise of normal force and torque in the balance, N m, from the logs and their filtered torques. That of the force is not white:
/// all counts that the torque does not have, faster than what springs make slowly.
fn noise_of_both(logs: &[NormalLoadLog], torque_nm: &[Vec<f64>], gain: f64) -> [f64; 2] {
    let of_log = |(log, torque_nm): (&NormalLoadLog, &Vec<f64>)| {
        let apart: Vec<f64> = torque_nm.iter().zip(&log.filtered_n).map(|(nm, n)| nm - n / gain).collect();
        let all = noise::usual_deviation(&apart, (STEADY_S / log.step_s).ceil() as usize);
        let of_torque = white_share(WIDTH) * log.torque_noise_nm;
        [(all * all - of_torque * of_torque).max(0.0).sqrt(), of_torque]
    };
    let each: Vec<[f64; 2]> = logs.iter().zip(torque_nm).map(of_log).collect();
    [0, 1].map(|which| rms(&each.iter().map(|log| log[which]).collect::<Vec<_>>()))
}

/// Rows of a log: noise from named sources; lifted off, the stop carries what the springs do not.
fn rows<'l>(log: &'l NormalLoadLog, gain: f64, scales: &NormalLoadScales) -> LogRows<'l> {
    let change = largest_change(&log.torque_nm, WIDTH);
    let bend =
        local_maximum(&gaussian(&log.normal_n, WIDTH, 2).iter().map(|d| d.abs()).collect::<Vec<_>>(), 4);
    let white = white_share(WIDTH) * log.torque_noise_nm.hypot(log.normal_noise_n / gain);
    let noise = move |i: usize| vec![white, LEAST_NOISE * log.torque_nm[i]];
    let guessed = move |i: usize| vec![BETWEEN_SAMPLES * change[i], BEND * bend[i] / gain];
    let touching = TOUCHING * scales.load_n;
    let left_out = log.filtered_n.iter().zip(&log.usable).map(|(n, used)| *n < touching || !used).collect();
    LogRows {
        width: WIDTH,
        step_s: log.step_s,
        left_out,
        noise: Box::new(noise),
        guessed: Box::new(guessed),
        least: Vec::new(),
        most: [vec![white_share(WIDTH).powi(-2), 1.0], Vec::new()],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::files::log::Log;
    use crate::files::signal::Signal;
    use crate::identify::balance::Alternative;
    use crate::identify::noise::tests::white;
    use crate::identify::table::LOG_PRIOR;

    /// Two levels, held in turn, and a cause that could make up for any gain between them: what its evidence gains, where so much of the
    /// force's noise is kept from sample to sample, and what it would if that noise were not counted.
    fn gained_by_a_step(kept: f64) -> [f64; 2] {
        const COUNT: usize = 8000;
        let rig = RigFile::assumed_rig(&[]).unwrap();
        let high = |i: usize| (i / 2000).is_multiple_of(2);
        let torque = |i: usize| if high(i) { 3.2 } else { 0.5 };
        let series = |of: &dyn Fn(usize) -> f64| (0..COUNT).map(of).collect::<Vec<f64>>();
        let noise = [1, 2].map(|seed| white(COUNT, seed));
        let slow = noise[1].iter().scan(0.0, |slow, new| {
            *slow = kept * *slow + (1.0 - kept * kept).sqrt() * new;
            Some(*slow)
        });
        let slow: Vec<f64> = slow.collect();
        let mut log = Log::default();
        log.set_signal(Signal::Time, series(&|i| 1e-3 * i as f64));
        log.set_signal(Signal::M2Speed, vec![5.0; COUNT]);
        log.set_signal(Signal::M1Torque, series(&|i| torque(i) + 0.007 * noise[0][i]));
        let force = |i: usize| rig.lever_gain_n_per_nm * torque(i) - rig.preload_n;
        log.set_signal(Signal::NormalForce, series(&|i| force(i) + 0.25 * slow[i]));
        log.set_signal(Signal::FrictionTorque, vec![2.0; COUNT]);
        let logs = [NormalLoadLog::new(&ContactLog::new(&log, &rig).unwrap(), &rig).unwrap()];
        let balance = balance(&logs, &rig, &NormalLoadScales::new(&logs));
        let step = logs[0].filtered(&series(&|i| f64::from(u8::from(high(i)))));
        let apart =
            Alternative::columns("foil_hardening", vec![Parameter::amplitude("step", 2.0)], vec![step]);
        let gained = |balance: &Balance| {
            let [none, with] = [&[][..], &[&apart][..]].map(|forms| balance.solve_forms(forms));
            with.log_evidence - none.log_evidence
        };
        [gained(&balance), gained(&balance.clone().with_noise_in(GAIN, [0.0; 2]))]
    }

    #[test]
    fn noise_of_the_normal_force_is_no_reason_for_a_smaller_gain() {
        // It gains less than a cause's prior asks for.
        let [white, _] = gained_by_a_step(0.0);
        assert!(white < -LOG_PRIOR, "{white}");
        // Of a converter that averages the balance knows less; most of what it would hide is no gain.
        let [slow, not_counted] = gained_by_a_step(0.86);
        assert!(not_counted > 100.0 && slow < 0.2 * not_counted, "{slow} {not_counted}");
    }
}
