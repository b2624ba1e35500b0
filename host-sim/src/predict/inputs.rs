//! What a friction model is driven with, taken from a log.

use super::bridge::BridgeModel;
use super::curve::shifted;
use crate::files::log::ContactSignals;
use crate::files::rig_file::RigFile;

/// Motion and load of the contact at the samples of a log.
///
/// Made once from a log and used for any number of runs; the fields may be replaced by smoothed ones.
#[derive(Debug, Clone, PartialEq)]
pub struct ContactInputs {
    /// Time, strictly increasing.
    pub time_s: Vec<f64>,
    /// Sliding speed of the element's root over the road.
    pub sliding_speed_m_s: Vec<f64>,
    /// Angle of the disc, as logged or integrated from its speed.
    pub disc_angle_rad: Vec<f64>,
    /// Normal force.
    pub normal_force_n: Vec<f64>,
    /// Friction force at the first sample: what the element holds when the log begins.
    pub initial_friction_n: f64,
}

impl ContactInputs {
    /// Speed from the disc's speed, load from the normal bridge.
    ///
    /// The normal bridge shows the load late. What it shows is taken ahead by its delay for slow
    /// signals; what the bridge does to a signal's size is left.
    pub fn new(signals: &ContactSignals<'_>, rig: &RigFile) -> Self {
        let radius_m = rig.friction_radius_m;
        let delay_s = BridgeModel::delay_s(&rig.normal_bridge);
        let first = |values: &[f64]| values.first().copied().unwrap_or(0.0);
        Self {
            time_s: signals.time_s.to_vec(),
            sliding_speed_m_s: signals.m2_speed_rad_s.iter().map(|speed| speed * radius_m).collect(),
            disc_angle_rad: match signals.m2_angle_rad {
                Some(angle) => angle.to_vec(),
                None => integral(signals.time_s, &signals.m2_speed_rad_s),
            },
            normal_force_n: shifted(signals.time_s, signals.normal_force_n, delay_s),
            initial_friction_n: first(signals.friction_torque_nm) / radius_m,
        }
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

/// Running integral by trapezia, zero at the first sample.
pub(crate) fn integral(time_s: &[f64], values: &[f64]) -> Vec<f64> {
    let mut sum = 0.0;
    let mut sums = Vec::with_capacity(time_s.len());
    sums.extend(time_s.first().map(|_| 0.0));
    for (t, x) in time_s.windows(2).zip(values.windows(2)) {
        sum += 0.5 * (x[0] + x[1]) * (t[1] - t[0]);
        sums.push(sum);
    }
    sums
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::files::rig_file::{Bridge, Mode};
    use std::borrow::Cow;

    #[test]
    fn the_delay_of_the_normal_bridge_is_taken_back() {
        let mut rig = RigFile::assumed_rig(&[]).unwrap();
        let mode = Some(Mode { mode_hz: 900.0, damping_ratio: 0.5 });
        rig.normal_bridge = Bridge { mode, lowpass_hz: Some(1000.0), sensitivity: None };
        let time_s: Vec<f64> = (0..1000).map(|i| f64::from(i) * 1e-3).collect();
        let load = |t: f64| 80.0 + 20.0 * (std::f64::consts::TAU * 60.0 * t).sin();
        let mut bridge = BridgeModel::new(&rig.normal_bridge, 80.0);
        let mut shown = vec![80.0];
        for i in 1..time_s.len() {
            for part in 1..=20 {
                shown.push(bridge.step(5e-5, load(time_s[i - 1] + f64::from(part) * 5e-5)));
            }
            shown.drain(i..i + 19);
        }
        let zeros = vec![0.0; time_s.len()];
        let signals = ContactSignals {
            time_s: &time_s,
            m2_speed_rad_s: Cow::Borrowed(&zeros),
            m2_angle_rad: None,
            normal_force_n: &shown,
            friction_torque_nm: &zeros,
        };
        let inputs = ContactInputs::new(&signals, &rig);
        let largest = |values: &[f64]| {
            let errors = time_s.iter().zip(values).map(|(t, x)| (x - load(*t)).abs());
            errors.skip(50).take(900).fold(0.0, f64::max)
        };
        // The bridge is late by 0.40 ms: 15 % of the amplitude at 60 Hz. Of that the interpolation between
        // samples of 1 ms leaves 0.5 %, and the gain of the mode 0.5 %.
        assert!(largest(&shown) > 2.5, "{}", largest(&shown));
        assert!(largest(&inputs.normal_force_n) < 0.2, "{}", largest(&inputs.normal_force_n));
    }
}
