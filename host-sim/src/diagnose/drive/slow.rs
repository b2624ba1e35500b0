//! The drive as one mass: M, Fv, Fc from slow motion only.
//!
//! Behind a strong low-pass a twisting shaft and a gap are too fast to be seen: both masses move as
//! one. Effort and regressors go through the same filter; linear least squares on every tenth sample.

use nalgebra::{Matrix3, Vector3};

use super::conditioned::DriveLog;
use super::effect::Slow;
use crate::fit::drive::butterworth::LowPass;

/// Cut-off, Hz.
const SLOW_HZ: f64 = 3.0;
/// Every how many samples.
const STRIDE: usize = 10;

/// Fits the logs; falls back on the sizes of a fast fit where slow motion does not determine them.
pub fn fit(logs: &[&DriveLog], fast: &[f64]) -> Slow {
    let mut normal = Matrix3::zeros();
    let mut right = Vector3::zeros();
    for log in logs {
        let filter = LowPass::new(SLOW_HZ, log.record.rate_hz());
        let slow = |signal: &[f64]| filter.zero_phase(signal);
        let effort = slow(&log.record.effort);
        let columns = [slow(&log.acceleration), slow(&log.speed), slow(&log.direction)];
        for at in (0..log.len()).step_by(STRIDE).filter(|at| log.weight[*at] > 0.0) {
            let row = Vector3::new(columns[0][at], columns[1][at], columns[2][at]);
            normal += row * row.transpose();
            right += row * effort[at];
        }
    }
    let scale = normal.diagonal().map(|x| 1.0 / x.sqrt().max(f64::MIN_POSITIVE));
    let scaled = Matrix3::from_fn(|i, j| normal[(i, j)] * scale[i] * scale[j]);
    let solved = scaled.cholesky().map(|c| c.solve(&right.component_mul(&scale)).component_mul(&scale));
    match solved {
        Some(x) if x[0] > 0.0 && x.iter().all(|x| x.is_finite()) => {
            Slow { inertia: x[0], viscous: x[1].max(0.0), coulomb: x[2].max(0.0) }
        }
        _ => Slow { inertia: fast[0].max(1e-12), viscous: fast[1].max(0.0), coulomb: fast[2].max(0.0) },
    }
}
