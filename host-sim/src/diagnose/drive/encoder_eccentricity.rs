//! `encoder_eccentricity`: the encoder's scale runs out of centre, an error of angle once per turn.
//!
//! Source: eccentric mounting of a scale, θ_measured = θ + a sin(θ + φ) with a the offset over the scale's
//! radius. As a function of the measured angle the error is a series of its harmonics, the second a²/2;
//! two are taken. Extension: u = M (q̈ + δ̈) + Fv (q̇ + δ̇) + …, δ = Σ_n A_n cos n(q − q₀) + B_n sin n(q − q₀),
//! with M and Fv of slow motion; q₀ is one origin per log.
//! Sets it apart: the torque that a true ripple needs is the same at any speed ([`super::m2_ripple`]); the
//! torque that follows a controller fooled by the encoder grows with the square of the speed.

use std::sync::Arc;

use nalgebra::{Matrix2, Vector2};

use super::conditioned::DriveLog;
use super::effect::{DriveEffect, Known, Origins, Prepared, Regressor, Seen, Slow};
use crate::fit::bounds::Parameter;
use crate::fit::drive::inverse::Motion;

/// The effect.
pub struct EncoderEccentricity;

/// Harmonics of the error.
const WAVES: [f64; 2] = [1.0, 2.0];
const NAMES: [[&str; 2]; 2] = [["cos_1_rad", "sin_1_rad"], ["cos_2_rad", "sin_2_rad"]];
/// Step of the search for a log's origin.
const STEP_RAD: f64 = std::f64::consts::PI / 20.0;

struct RunOut {
    slow: Slow,
    starts: Vec<f64>,
}

/// Torque per radian of a cosine and of a sine with `wave` periods a turn.
fn torque_of_error(slow: Slow, log: &DriveLog, wave: f64, origin: f64) -> [Vec<f64>; 2] {
    let (mut of_cos, mut of_sin) = (Vec::with_capacity(log.len()), Vec::with_capacity(log.len()));
    for ((q, v), a) in log.position.iter().zip(&log.speed).zip(&log.acceleration) {
        let (sin, cos) = (wave * (q - origin)).sin_cos();
        let (turning, speeding) = (slow.inertia * (wave * v).powi(2), slow.inertia * a + slow.viscous * v);
        of_cos.push(-turning * cos - wave * speeding * sin);
        of_sin.push(-turning * sin + wave * speeding * cos);
    }
    [of_cos, of_sin]
}

impl Prepared for RunOut {
    fn shapes(&self) -> &[Parameter] {
        &[]
    }

    fn regressors(&self, _shape: &[f64], seen: &Seen<'_>) -> Vec<Regressor> {
        let of_wave = |(wave, names): (&f64, &[&str; 2])| {
            let [of_cos, of_sin] = torque_of_error(self.slow, seen.log, *wave, seen.origin);
            let regressor = |name: &str, values| Regressor { name: name.into(), values };
            [regressor(names[0], of_cos), regressor(names[1], of_sin)]
        };
        WAVES.iter().zip(&NAMES).flat_map(of_wave).collect()
    }

    fn disc_offset(&self, _shape: &[f64], sizes: &[f64], seen: &Seen<'_>) -> Option<Vec<f64>> {
        let at = |q: &f64| {
            WAVES
                .iter()
                .zip(sizes.chunks_exact(2))
                .map(|(wave, size)| {
                    let (sin, cos) = (wave * (q - seen.origin)).sin_cos();
                    size[0] * cos + size[1] * sin
                })
                .sum()
        };
        Some(seen.log.position.iter().map(at).collect())
    }

    fn origins(&self) -> Option<Origins<'_>> {
        let span = 2.0 * std::f64::consts::PI;
        Some(Origins { span, step: STEP_RAD, starts: &self.starts, waves: &WAVES })
    }
}

/// Where in the turn a log's error has its crest, from the residual of a fit without it.
fn crest(slow: Slow, log: &DriveLog, residual: &[f64]) -> f64 {
    let [of_cos, of_sin] = torque_of_error(slow, log, 1.0, 0.0);
    let (mut normal, mut right) = (Matrix2::zeros(), Vector2::zeros());
    for at in (0..log.len()).filter(|at| log.weight[*at] > 0.0) {
        let row = Vector2::new(of_cos[at], of_sin[at]);
        normal += row * row.transpose();
        right += row * residual[at];
    }
    normal.cholesky().map_or(0.0, |c| {
        let sizes = c.solve(&right);
        sizes[1].atan2(sizes[0])
    })
}

impl DriveEffect for EncoderEccentricity {
    fn id(&self) -> &'static str {
        "encoder_eccentricity"
    }

    fn prepare(&self, logs: &[&DriveLog], known: &Known) -> Result<Arc<dyn Prepared>, String> {
        let Some(first) = logs.first() else { return Err("no training log".into()) };
        if first.motion == Motion::Linear {
            return Err("a linear scale has no turn".into());
        }
        let crests: Vec<f64> =
            logs.iter().zip(&known.residual).map(|(log, left)| crest(known.slow, log, left)).collect();
        let starts = crests.iter().map(|crest| wrapped(crest - crests[0])).collect();
        Ok(Arc::new(RunOut { slow: known.slow, starts }))
    }
}

/// An angle within half a turn of zero.
fn wrapped(angle: f64) -> f64 {
    angle - std::f64::consts::TAU * (angle / std::f64::consts::TAU).round()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::analysis::Role;
    use crate::fit::drive::record::DriveRecord;

    #[test]
    fn the_discs_offset_takes_the_error_away() {
        let step_s = 1e-3;
        let (shown, origin, [cos, sin]) = (|t: f64| 4.0 * t, 0.7, [0.03, -0.02]);
        let position: Vec<f64> = (0..4000).map(|i| shown(step_s * f64::from(i))).collect();
        let record = DriveRecord { start_s: 0.0, step_s, effort: vec![0.0; 4000], position };
        let log = DriveLog::from_record(record, None, Motion::Rotary, Role::Train);
        let run_out = RunOut { slow: Slow { inertia: 0.02, viscous: 0.0, coulomb: 0.1 }, starts: vec![0.0] };
        let seen = Seen { log: &log, direction: &log.direction, origin };
        let offset = run_out.disc_offset(&[], &[cos, sin, 0.0, 0.0], &seen).unwrap();
        for i in (200..3800).step_by(211) {
            let phase = shown(step_s * i as f64) - origin;
            assert!((offset[i] - cos * phase.cos() - sin * phase.sin()).abs() < 1e-6);
        }
    }

    #[test]
    fn the_torque_of_the_error_is_that_of_its_derivatives() {
        let step_s = 1e-3;
        let angle = |t: f64| 3.0 * t + 2.0 * (1.3 * t).sin();
        let position: Vec<f64> = (0..8000).map(|i| angle(step_s * f64::from(i))).collect();
        let record = DriveRecord { start_s: 0.0, step_s, effort: vec![0.0; 8000], position };
        let log = DriveLog::from_record(record, None, Motion::Rotary, Role::Train);
        let slow = Slow { inertia: 0.02, viscous: 0.3, coulomb: 0.0 };
        let columns = torque_of_error(slow, &log, 2.0, 0.4);
        let error = |t: f64, column: usize| {
            let phase = 2.0 * (angle(t) - 0.4);
            if column == 0 { phase.cos() } else { phase.sin() }
        };
        for (column, values) in columns.iter().enumerate() {
            for i in (200..7800).step_by(97) {
                let (t, h) = (step_s * i as f64, 1e-4);
                let (before, here, after) = (error(t - h, column), error(t, column), error(t + h, column));
                let expected =
                    0.02 * (after - 2.0 * here + before) / (h * h) + 0.3 * (after - before) / (2.0 * h);
                // The largest value is 2.6; the smoothing of the position leaves 1e-4 of it.
                assert!((values[i] - expected).abs() < 2e-3, "{i} {} {expected}", values[i]);
            }
        }
    }
}
