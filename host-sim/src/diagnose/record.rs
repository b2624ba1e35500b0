//! A contact log made ready: what the models are driven with, smoothed; what they are compared to, raw.
//!
//! * Time starts at the log's first sample. Logs faster than [`FASTEST_HZ`] are averaged over whole
//!   groups of samples: 10 kHz tells nothing more about effects slower than the ring's mode.
//! * The disc's angle is unwrapped; where there is no angle it is the integral of the speed.
//! * The sliding speed is the slope of the angle (the speed column where that is quieter), smoothed so
//!   that jumps stay; likewise the normal force. Their noise would otherwise pass into the prediction.
//! * Samples at which a channel clips are marked.

use super::analysis::Role;
use super::{noise, saturation, smooth};
use crate::files::log::Log;
use crate::files::rig_file::RigFile;
use crate::files::signal::Signal;
use crate::input_error::InputError;
use crate::predict::BridgeModel;

/// Highest sampling rate that is analysed as it is.
pub const FASTEST_HZ: f64 = 2500.0;

/// A channel as measured, with its noise and where it clips.
#[derive(Debug, Clone, PartialEq)]
pub struct Measured {
    /// Values at the samples.
    pub values: Vec<f64>,
    /// Standard deviation of its noise.
    pub noise_std: f64,
    /// Where it clips.
    pub clipping: saturation::Clipping,
}

impl Measured {
    /// Whether a sample shows an end of the channel instead of the signal.
    pub fn clipped(&self, sample: usize) -> bool {
        self.clipping.holds(self.values[sample])
    }
}

/// What the sliding speed is taken from.
#[derive(Debug, Clone, PartialEq)]
pub enum Motion {
    /// The slope of the angle, whose noise has this standard deviation, rad.
    Angle(f64),
    /// A speed column and the standard deviation of its noise, rad/s.
    Speed(Vec<f64>, f64),
}

/// A contact log, ready for analysis.
#[derive(Debug, Clone, PartialEq)]
pub struct Record {
    /// Fitted or held out.
    pub role: Role,
    /// The log's name.
    pub source: String,
    /// Time since the first sample, s.
    pub time_s: Vec<f64>,
    /// Median step, s.
    pub step_s: f64,
    /// Disc angle, unwrapped, rad.
    pub angle_rad: Vec<f64>,
    /// Standard deviation of the angle's noise, rad.
    pub angle_noise_rad: f64,
    /// What the speed is taken from.
    pub motion: Motion,
    /// How late the normal bridge is, s.
    pub normal_late_s: f64,
    /// Friction torque.
    pub friction_nm: Measured,
    /// Normal force.
    pub normal_n: Measured,
    /// Torque of M1, where it was logged.
    pub m1_torque_nm: Option<Measured>,
    /// Demanded torque of M1.
    pub m1_torque_ref_nm: Option<Vec<f64>>,
    /// Angle of M1.
    pub m1_angle_rad: Option<Measured>,
    /// Torque of M2.
    pub m2_torque_nm: Option<Measured>,
    /// Demanded torque of M2.
    pub m2_torque_ref_nm: Option<Vec<f64>>,
}

impl Record {
    /// Prepares a log.
    pub fn new(log: &Log, role: Role, rig: &RigFile) -> Result<Self, InputError> {
        let contact = log.contact()?;
        let raw_time_s = contact.time_s;
        let group = group_size(raw_time_s);
        let start_s = raw_time_s.first().copied().unwrap_or(0.0);
        let time_s: Vec<f64> = averaged(raw_time_s, group).iter().map(|t| t - start_s).collect();
        let step_s = median_step(&time_s);

        let raw_angle_rad = match log.signal(Signal::M2Angle) {
            Some(angle) => unwrapped(angle),
            None => integral(raw_time_s, &contact.m2_speed_rad_s),
        };
        let angle_rad = averaged(&raw_angle_rad, group);
        let speed = averaged(&contact.m2_speed_rad_s, group);
        let (angle_noise, speed_noise) =
            (noise::standard_deviation(&angle_rad), noise::standard_deviation(&speed));
        let has_angle = log.signal(Signal::M2Angle).is_some();
        let slope_noise = angle_noise / (std::f64::consts::SQRT_2 * step_s);
        let motion = if has_angle && slope_noise < 2.0 * speed_noise {
            Motion::Angle(angle_noise)
        } else {
            Motion::Speed(speed, speed_noise)
        };

        let measured = |values: &[f64], reference: Option<&[f64]>| {
            let clipping = saturation::scan(values, reference);
            let values = averaged(values, group);
            // A clipped stretch has no noise.
            let open: Vec<f64> = values.iter().copied().filter(|x| !clipping.holds(*x)).collect();
            let noise_std = noise::standard_deviation(&open);
            Measured { values, noise_std, clipping }
        };
        let channel = |signal: Signal, reference: Option<Signal>| {
            log.signal(signal).map(|values| measured(values, reference.and_then(|r| log.signal(r))))
        };
        Ok(Self {
            role,
            source: log.source.clone(),
            angle_noise_rad: if has_angle { angle_noise } else { speed_noise * step_s },
            step_s,
            motion,
            normal_late_s: BridgeModel::delay_s(&rig.normal_bridge),
            friction_nm: measured(contact.friction_torque_nm, None),
            normal_n: measured(contact.normal_force_n, None),
            m1_torque_nm: channel(Signal::M1Torque, Some(Signal::M1TorqueRef)),
            m1_torque_ref_nm: log.signal(Signal::M1TorqueRef).map(|v| averaged(v, group)),
            m1_angle_rad: channel(Signal::M1Angle, None),
            m2_torque_nm: channel(Signal::M2Torque, Some(Signal::M2TorqueRef)),
            m2_torque_ref_nm: log.signal(Signal::M2TorqueRef).map(|v| averaged(v, group)),
            time_s,
            angle_rad,
        })
    }

    /// Disc speed (rad/s) and normal force (N) for a model: smoothed, the force taken ahead by its
    /// bridge's delay. With a seed the noise is put on once more before smoothing, so that the change of
    /// a prediction shows what the noise of its inputs does to it.
    pub fn inputs(&self, noise_seed: Option<u64>) -> (Vec<f64>, Vec<f64>) {
        let mut noise = noise_seed.map(noise::White::new);
        let mut noisy = |values: &[f64], std: f64| -> Vec<f64> {
            match &mut noise {
                Some(noise) => values.iter().map(|x| x + std * noise.next()).collect(),
                None => values.to_vec(),
            }
        };
        let speed = match &self.motion {
            Motion::Angle(std) => smooth::slope(&self.time_s, &noisy(&self.angle_rad, *std), *std),
            Motion::Speed(values, std) => smooth::signal(&noisy(values, *std), *std),
        };
        let load = &self.normal_n;
        let load = smooth::signal(&noisy(&load.values, load.noise_std), load.noise_std);
        (speed.values, ahead(&self.time_s, &load.values, self.normal_late_s))
    }

    /// Number of samples.
    pub fn len(&self) -> usize {
        self.time_s.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.time_s.is_empty()
    }
}

/// Samples averaged into one.
fn group_size(time_s: &[f64]) -> usize {
    let step_s = median_step(time_s);
    if step_s > 0.0 { (1.0 / (FASTEST_HZ * step_s)).ceil().max(1.0) as usize } else { 1 }
}

fn median_step(time_s: &[f64]) -> f64 {
    let mut steps: Vec<f64> = time_s.windows(2).map(|t| t[1] - t[0]).collect();
    if steps.is_empty() {
        return 0.0;
    }
    let middle = steps.len() / 2;
    *steps.select_nth_unstable_by(middle, f64::total_cmp).1
}

fn averaged(values: &[f64], group: usize) -> Vec<f64> {
    values.chunks_exact(group).map(|chunk| chunk.iter().sum::<f64>() / group as f64).collect()
}

/// Takes out jumps by a revolution.
fn unwrapped(angle_rad: &[f64]) -> Vec<f64> {
    use std::f64::consts::{PI, TAU};
    let (mut turns, mut last) = (0.0, angle_rad.first().copied().unwrap_or(0.0));
    let unwrap = |angle: &f64| {
        let jump = angle - last;
        last = *angle;
        if jump.abs() > PI {
            turns -= (jump / TAU).round();
        }
        angle + turns * TAU
    };
    angle_rad.iter().map(unwrap).collect()
}

/// Running integral by trapezia.
fn integral(time_s: &[f64], values: &[f64]) -> Vec<f64> {
    let mut sum = 0.0;
    let mut sums = Vec::with_capacity(values.len());
    for i in 0..values.len() {
        if i > 0 {
            sum += 0.5 * (values[i] + values[i - 1]) * (time_s[i] - time_s[i - 1]);
        }
        sums.push(sum);
    }
    sums
}

/// The signal at t + `delay_s`, by straight lines; its last value where it has ended.
fn ahead(time_s: &[f64], values: &[f64], delay_s: f64) -> Vec<f64> {
    let last = time_s.len().saturating_sub(1);
    let mut after = 0;
    let shifted = time_s.iter().map(|t| {
        let wanted_s = t + delay_s;
        while after < last && time_s[after] < wanted_s {
            after += 1;
        }
        if after == 0 || time_s[after] <= wanted_s {
            return values[after];
        }
        let part = (wanted_s - time_s[after - 1]) / (time_s[after] - time_s[after - 1]);
        values[after - 1] + part * (values[after] - values[after - 1])
    });
    shifted.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wrapped_angle_is_unwrapped_in_both_directions() {
        let true_angle: Vec<f64> = (0..400).map(|i| 12.0 * (0.02 * f64::from(i)).sin()).collect();
        let wrapped: Vec<f64> = true_angle.iter().map(|a| a.rem_euclid(std::f64::consts::TAU)).collect();
        for (found, expected) in unwrapped(&wrapped).iter().zip(&true_angle) {
            assert!((found - expected).abs() < 1e-12);
        }
    }

    #[test]
    fn fast_logs_are_averaged_in_whole_groups() {
        let time_s: Vec<f64> = (0..100).map(|i| f64::from(i) * 1e-4).collect();
        assert_eq!(group_size(&time_s), 4);
        let averages = averaged(&time_s, 4);
        assert_eq!(averages.len(), 25);
        assert!((averages[1] - 5.5e-4).abs() < 1e-15);
        assert_eq!(group_size(&[0.0, 1e-3, 2e-3]), 1);
    }
}
