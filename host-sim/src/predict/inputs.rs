//! What a friction model is driven with, taken from a log.

use super::bridge::BridgeModel;
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
    /// signals; of a mode at 120 Hz behind a low-pass of 1 kHz, 1.5 % of the amplitude is left wrong.
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
            normal_force_n: ahead(signals.time_s, signals.normal_force_n, delay_s),
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

/// The signal at t + `ahead_s` for each t, by straight lines; its first and last value outside the log.
pub(super) fn ahead(time_s: &[f64], values: &[f64], ahead_s: f64) -> Vec<f64> {
    if ahead_s == 0.0 {
        return values.to_vec();
    }
    let mut after = 0;
    let at = |t: f64| {
        while after < time_s.len() && time_s[after] <= t {
            after += 1;
        }
        match after {
            0 => values[0],
            after if after == time_s.len() => values[after - 1],
            after => {
                let (t0, t1) = (time_s[after - 1], time_s[after]);
                values[after - 1] + (values[after] - values[after - 1]) * (t - t0) / (t1 - t0)
            }
        }
    };
    time_s.iter().map(|t| t + ahead_s).map(at).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_straight_line_is_moved_in_time_exactly_and_held_at_its_ends() {
        let time_s = [0.0, 0.1, 0.3, 0.35];
        let values = time_s.map(|t| 2.0 * t);
        let shifted = ahead(&time_s, &values, 0.04);
        for (value, t) in shifted.iter().zip([0.04, 0.14, 0.34, 0.35]) {
            // One rounding of each of three operations.
            assert!((value - 2.0 * t).abs() < 1e-15, "{value} {t}");
        }
        let shifted = ahead(&time_s, &values, -0.2);
        for (value, t) in shifted.iter().zip([0.0, 0.0, 0.1, 0.15]) {
            assert!((value - 2.0 * t).abs() < 1e-15, "{value} {t}");
        }
    }
}
