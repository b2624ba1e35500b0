//! A contact log as the pressure's analysis uses it: M1's torque, normal force, travel of the press.
//!
//! * The **travel** is the press's coordinate in newtons: M1's angle over its slope against the normal
//!   force where the angle is logged and follows the force, else the smooth normal force itself. The
//!   logs' encoders need not share their zero: each log's is where its own force would be zero.
//! * Left out (weight zero): elements off the disc, where the force no longer follows the torque; a
//!   channel at its end; and the time in which the press rings after a jump of M1's torque, whose shape
//!   between two samples is not known.
//! * Where M1's torque follows its demand within its noise, the demand behind the lag (by a straight
//!   line) stands for it: it is the same torque without the noise. Else the measured torque is taken and
//!   its noise passes the lever: slow residuals have the variance σ_N² + G² σ_τ².

use nalgebra::{Matrix2, Vector2};

use crate::diagnose::analysis::Role;
use crate::diagnose::drive::whitening::Whitener;
use crate::diagnose::{noise, saturation, smooth};
use crate::files::log::Log;
use crate::files::rig_file::RigFile;
use crate::files::signal::Signal;
use crate::fit::drive::butterworth::LowPass;
use crate::fit::drive::record::Grid;
use crate::predict::{BridgeModel, SecondOrder};

/// Errors are judged up to this frequency; above, the press's own mode colours the torque's noise.
const BAND_HZ: f64 = 30.0;
/// Highest share of the rate that is judged.
const LARGEST_BAND_SHARE: f64 = 0.1;
/// Smoothing of the travel, in multiples of the band.
const TRAVEL_BAND: f64 = 2.0;
/// Elements count as off the disc below this many standard deviations of the force.
const CONTACT_DEVIATIONS: f64 = 8.0;
/// A torque jumps where it changes by more than this many of its standard deviations within a sample.
const JUMP_DEVIATIONS: f64 = 10.0;
/// The press's ringing is waited for until it has fallen by this factor.
const RINGING: f64 = 100.0;
/// The torque follows its demand where they differ by less than this many standard deviations of its
/// noise (RMS).
const FOLLOWS_DEVIATIONS: f64 = 1.1;
/// Share of the angle's variance that the force must explain for the angle to be the press's.
const ANGLE_FOLLOWS: f64 = 0.5;

/// A conditioned log.
#[derive(Debug, Clone)]
pub struct PressureLog {
    /// Fitted or held out.
    pub role: Role,
    /// Time of the first sample, s.
    pub start_s: f64,
    /// Time between samples, s.
    pub step_s: f64,
    /// Torque of M1: the demanded one where the measured one follows it, else the measured one.
    pub torque_nm: Vec<f64>,
    /// Normal force as the bridge shows it.
    pub normal_n: Vec<f64>,
    /// Travel of the press in newtons of normal force.
    pub travel_n: Vec<f64>,
    /// Force that the torque asks for by the rig file's gain, free of noise, which would move a
    /// hysteresis on: smoothed so that jumps stay, where the torque is measured.
    pub asked_n: Vec<f64>,
    /// Radians of M1 per newton of travel; `None` where the travel is the force itself.
    pub rad_per_n: Option<f64>,
    /// 1 where a sample counts, else 0.
    pub weight: Vec<f64>,
    /// Noise of the normal force.
    pub normal_std_n: f64,
    /// Standard deviation of a sample's force error from both.
    pub sample_std_n: f64,
    /// Filter that brings the error to the judged band and to variance one.
    pub whitener: Whitener,
}

/// A log before its travel is known.
struct Raw {
    role: Role,
    grid: Grid,
    torque_nm: Vec<f64>,
    normal_n: Vec<f64>,
    angle_rad: Option<Vec<f64>>,
    demanded_nm: Option<Vec<f64>>,
    clipped: Vec<bool>,
}

impl Raw {
    fn new(log: &Log, role: Role) -> Result<Self, String> {
        let contact = log.contact().map_err(|e| e.to_string())?;
        let torque = log.require(Signal::M1Torque).map_err(|e| e.to_string())?;
        let short = || format!("{}: too short for the pressure's analysis", log.source);
        let grid = Grid::over(contact.time_s).filter(|grid| grid.count >= 200).ok_or_else(short)?;
        let even = |values: &[f64]| grid.resample(contact.time_s, values);
        let (torque_nm, normal_n) = (even(torque), even(contact.normal_force_n));
        let torque_ends = saturation::scan(torque, log.signal(Signal::M1TorqueRef));
        let normal_ends = saturation::scan(contact.normal_force_n, None);
        let clipped = torque_nm
            .iter()
            .zip(&normal_n)
            .map(|(torque, normal)| torque_ends.holds(*torque) || normal_ends.holds(*normal))
            .collect();
        let angle_rad = log.signal(Signal::M1Angle).map(even);
        let demanded_nm = log.signal(Signal::M1TorqueRef).map(even);
        Ok(Self { role, grid, torque_nm, normal_n, angle_rad, demanded_nm, clipped })
    }

    fn smooth(&self, values: &[f64]) -> Vec<f64> {
        let rate_hz = 1.0 / self.grid.step_s;
        let cutoff_hz = (TRAVEL_BAND * BAND_HZ).min(0.25 * rate_hz);
        LowPass::new(cutoff_hz, rate_hz).zero_phase(values)
    }
}

/// Conditions logs together: they share the slope of M1's angle.
pub fn condition(rig: &RigFile, logs: &[(&Log, Role)]) -> Result<Vec<PressureLog>, String> {
    let raw = logs.iter().map(|(log, role)| Raw::new(log, *role)).collect::<Result<Vec<_>, _>>()?;
    let rad_per_n = angle_slope(&raw);
    Ok(raw.into_iter().map(|raw| finish(rig, raw, rad_per_n)).collect())
}

/// Slope of angle over force within the logs; `None` where the angle is missing or does not follow.
fn angle_slope(logs: &[Raw]) -> Option<f64> {
    let (mut cross, mut force, mut angle) = (0.0, 0.0, 0.0);
    for log in logs {
        let (q, f) = (log.smooth(log.angle_rad.as_ref()?), log.smooth(&log.normal_n));
        let (q_mean, f_mean) = (mean(&q), mean(&f));
        for (q, f) in q.iter().zip(&f) {
            cross += (q - q_mean) * (f - f_mean);
            force += (f - f_mean).powi(2);
            angle += (q - q_mean).powi(2);
        }
    }
    (cross * cross > ANGLE_FOLLOWS * force * angle).then(|| cross / force)
}

fn finish(rig: &RigFile, raw: Raw, rad_per_n: Option<f64>) -> PressureLog {
    let step_s = raw.grid.step_s;
    let rate_hz = 1.0 / step_s;
    let smooth_n = raw.smooth(&raw.normal_n);
    let torque_std_nm = noise::standard_deviation(&raw.torque_nm);
    let normal_std_n = noise::standard_deviation(&raw.normal_n);
    let weight = weights(rig, &raw, &smooth_n, torque_std_nm, normal_std_n);
    let travel_n = match (rad_per_n, &raw.angle_rad) {
        (Some(slope), Some(angle)) => {
            let travel: Vec<f64> = angle.iter().map(|q| q / slope).collect();
            let used = |values: &[f64]| -> f64 { values.iter().zip(&weight).map(|(x, w)| x * w).sum() };
            let zero = (used(&travel) - used(&smooth_n)) / weight.iter().sum::<f64>().max(1.0);
            travel.iter().map(|x| x - zero).collect()
        }
        _ => smooth_n,
    };
    // Demanded torque that the measured one follows has its value and none of its noise.
    let followed = raw.demanded_nm.as_ref().and_then(|demanded| {
        let lagged = lagged(demanded, rig.m1.torque_lag_s, step_s);
        follow(&raw.torque_nm, &lagged, &weight, torque_std_nm)
    });
    let (torque_nm, asked_nm, input_n) = match followed {
        Some(torque_nm) => (torque_nm.clone(), torque_nm, 0.0),
        None => {
            let asked = settled(&smooth::signal(&raw.torque_nm, torque_std_nm));
            (raw.torque_nm, asked, rig.lever_gain_n_per_nm * torque_std_nm)
        }
    };
    let band_hz = BAND_HZ.min(LARGEST_BAND_SHARE * rate_hz);
    PressureLog {
        role: raw.role,
        start_s: raw.grid.start_s,
        step_s,
        travel_n,
        asked_n: asked_nm.iter().map(|torque| rig.lever_gain_n_per_nm * torque).collect(),
        rad_per_n,
        weight,
        normal_std_n,
        sample_std_n: normal_std_n.hypot(input_n * noise_gain(rig, step_s)),
        whitener: Whitener::new(rate_hz, band_hz, normal_std_n.hypot(input_n), 0.0, 0.0),
        torque_nm,
        normal_n: raw.normal_n,
    }
}

fn weights(rig: &RigFile, raw: &Raw, smooth_n: &[f64], torque_std_nm: f64, normal_std_n: f64) -> Vec<f64> {
    let count = raw.normal_n.len();
    let decay_per_s = std::f64::consts::TAU * rig.pressure.mode_hz * rig.pressure.damping_ratio;
    let ringing_s = RINGING.ln() / decay_per_s + BridgeModel::delay_s(&rig.normal_bridge);
    let ringing = (ringing_s / raw.grid.step_s).ceil() as usize;
    let mut weight = vec![1.0; count];
    let mut silence = |from: usize, to: usize| weight[from..to.min(count)].fill(0.0);
    // The press and its bridge are started settled; they need not have been.
    silence(0, ringing);
    for (at, smooth) in smooth_n.iter().enumerate() {
        let off_disc = smooth.min(raw.normal_n[at] + 3.0 * normal_std_n) < CONTACT_DEVIATIONS * normal_std_n;
        if raw.clipped[at] || off_disc {
            silence(at.saturating_sub(2), at + ringing);
        }
        if at > 0 && (raw.torque_nm[at] - raw.torque_nm[at - 1]).abs() > JUMP_DEVIATIONS * torque_std_nm {
            silence(at - 1, at + ringing);
        }
    }
    weight
}

/// What the press does to the standard deviation of white noise in M1's torque, at the log's rate.
fn noise_gain(rig: &RigFile, step_s: f64) -> f64 {
    let mut press = SecondOrder::new(rig.pressure.mode_hz, rig.pressure.damping_ratio, 0.0);
    let mut bridge = BridgeModel::new(&rig.normal_bridge, 0.0);
    let mut energy = 0.0;
    for i in 0..2000 {
        let pulse = if i == 0 { 1.0 } else { 0.0 };
        energy += bridge.step(step_s, press.step(step_s, pulse)).powi(2);
    }
    f64::sqrt(energy)
}

/// A first-order lag behind a demand that is held from sample to sample.
fn lagged(demanded_nm: &[f64], lag_s: f64, step_s: f64) -> Vec<f64> {
    let kept = if lag_s > 0.0 { (-step_s / lag_s).exp() } else { 0.0 };
    let (mut held, mut value) = (demanded_nm[0], demanded_nm[0]);
    let follow = |demanded: &f64| {
        value = held + (value - held) * kept;
        held = *demanded;
        value
    };
    demanded_nm.iter().map(follow).collect()
}

/// The torque as a straight line of the lagged demand; `None` where it differs from that by more than
/// its noise.
fn follow(torque_nm: &[f64], lagged_nm: &[f64], weight: &[f64], std_nm: f64) -> Option<Vec<f64>> {
    let (mut normal, mut right, mut square) = (Matrix2::zeros(), Vector2::zeros(), 0.0);
    for ((torque, lagged), w) in torque_nm.iter().zip(lagged_nm).zip(weight) {
        let row = Vector2::new(1.0, *lagged) * *w;
        normal += row * row.transpose();
        right += row * *torque;
        square += w * torque * torque;
    }
    let line = normal.cholesky()?.solve(&right);
    let left = (square - line.dot(&right)) / normal[(0, 0)];
    let follows = left < (FOLLOWS_DEVIATIONS * std_nm).powi(2);
    follows.then(|| lagged_nm.iter().map(|x| line[0] + line[1] * x).collect())
}

/// Takes the noise that smoothing left out of the turning points: the value follows the signal only
/// once that has moved by more than three standard deviations of what noise quiet stretches keep.
fn settled(signal: &smooth::Smoothed) -> Vec<f64> {
    let least = signal.std.iter().copied().fold(f64::INFINITY, f64::min);
    let play = 3.0 * least;
    let mut held = signal.values.first().copied().unwrap_or(0.0);
    let follow = |x: &f64| {
        held = held.clamp(x - play, x + play);
        held
    };
    signal.values.iter().map(follow).collect()
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len().max(1) as f64
}

impl PressureLog {
    /// Number of samples.
    pub fn len(&self) -> usize {
        self.normal_n.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.normal_n.is_empty()
    }

    /// Least and greatest travel among the samples that count.
    pub fn travel_range(&self) -> (f64, f64) {
        let used = || self.travel_n.iter().zip(&self.weight).filter(|(_, w)| **w > 0.0).map(|(x, _)| *x);
        (used().fold(f64::INFINITY, f64::min), used().fold(f64::NEG_INFINITY, f64::max))
    }
}
