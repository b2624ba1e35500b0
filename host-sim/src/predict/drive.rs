//! Torque of M2 from the motion of the disc and the friction torque.
//!
//! τ2 = J ω̇ + T + τ_c sign(ω) + c ω, every term as its mean over 10 ms around the sample. The mean of
//! ω̇ is the change of ω over that time divided by it, so no noise is differentiated; it is a zero-phase
//! filter that needs no even sampling. The friction torque is the measured one, so that its model's
//! error stays out. Near a standstill sign(ω) is not known: the bearing then carries what is left over,
//! up to its Coulomb torque.
//! Left out: torsion, backlash and ripple; they are for `diagnose` to find.

use super::Comparison;
use super::inputs::integral;
use crate::files::log::ContactSignals;
use crate::files::rig_file::RigFile;

/// Time over which means are taken.
const WINDOW_S: f64 = 10e-3;
/// Below this speed the disc may stand: a few counts of the encoder in the window.
const STANDSTILL_RAD_S: f64 = 5e-3;

/// Predicts M2's torque of a log, both sides as means over 10 ms.
pub fn predict_drive(rig: &RigFile, signals: &ContactSignals<'_>, m2_torque_nm: &[f64]) -> Comparison {
    let speed = &signals.m2_speed_rad_s;
    let mut windows = Windows::new(signals.time_s);
    let torque = integral(signals.time_s, m2_torque_nm);
    let friction = integral(signals.time_s, signals.friction_torque_nm);
    let angle = integral(signals.time_s, speed);
    let mut comparison = Comparison::default();
    for i in 0..signals.time_s.len() {
        let (from, to) = windows.around(i);
        let span_s = signals.time_s[to] - signals.time_s[from];
        let mean = |integral: &[f64]| (integral[to] - integral[from]) / span_s;
        let measured = mean(&torque);
        let mean_speed = mean(&angle);
        let smooth = rig.m2_inertia_kg_m2 * (speed[to] - speed[from]) / span_s
            + mean(&friction)
            + rig.bearing_viscous_nm_s_per_rad * mean_speed;
        let coulomb = rig.bearing_coulomb_nm;
        let bearing = if mean_speed.abs() > STANDSTILL_RAD_S {
            coulomb.copysign(mean_speed)
        } else {
            (measured - smooth).clamp(-coulomb, coulomb)
        };
        comparison.measured.push(measured);
        comparison.predicted.push(smooth + bearing);
    }
    comparison
}

/// Samples half a window before and after a sample, at least one each way where there is one.
struct Windows<'a> {
    time_s: &'a [f64],
    from: usize,
    to: usize,
}

impl<'a> Windows<'a> {
    fn new(time_s: &'a [f64]) -> Self {
        Self { time_s, from: 0, to: 0 }
    }

    /// Called with rising `i`.
    fn around(&mut self, i: usize) -> (usize, usize) {
        let t = self.time_s;
        // A hair more than half, so that rounding of even time stamps does not change the count.
        let half_s = 0.5 * WINDOW_S * (1.0 + 1e-9);
        while t[i] - t[self.from] > half_s {
            self.from += 1;
        }
        while self.to + 1 < t.len() && t[self.to + 1] - t[i] <= half_s {
            self.to += 1;
        }
        (self.from.min(i.saturating_sub(1)), self.to.max((i + 1).min(t.len() - 1)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::borrow::Cow;

    #[test]
    fn the_torque_of_a_known_motion_is_found() {
        let rig = RigFile::assumed_rig(&[]).unwrap();
        let time_s: Vec<f64> = (0..2000).map(|i| f64::from(i) * 1e-3).collect();
        let speed: Vec<f64> = time_s.iter().map(|t| 4.0 + (2.0 * t).sin()).collect();
        let friction = vec![2.5; time_s.len()];
        let torque: Vec<f64> = time_s
            .iter()
            .zip(&speed)
            .map(|(t, w)| 0.02 * 2.0 * (2.0 * t).cos() + 2.5 + 0.15 + 0.005 * w)
            .collect();
        let signals = ContactSignals {
            time_s: &time_s,
            m2_speed_rad_s: Cow::Borrowed(&speed),
            m2_angle_rad: None,
            normal_force_n: &friction,
            friction_torque_nm: &friction,
        };
        let comparison = predict_drive(&rig, &signals, &torque);
        // Trapezia of 1 ms on 2 rad/s: relative error (2e-3)²/12 of terms below 0.04 N·m.
        assert!(comparison.nrmse().is_some_and(|x| x < 1e-8), "{:?}", comparison.nrmse());
    }
}
