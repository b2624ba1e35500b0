//! Standard deviations of fitted parameters from the sensitivities of the residuals.
//!
//! The sandwich over blocks of neighbouring samples ([`crate::fit::covariance`]) of all training channels, one
//! after another; masked residuals count nothing. Left out: what a parameter that is held could have been.

use nalgebra::{DMatrix, DVector};

use super::analysis::{Channel, Estimate};
use crate::fit::covariance;

/// Whether a parameter, by its position, changes any of the channels.
pub fn has_influence(train: &[&Channel], parameter: usize) -> bool {
    train.iter().any(|channel| channel.sensitivity[parameter].iter().any(|x| *x != 0.0))
}

/// Sets the standard deviations of the parameters `free`, by their positions; all others keep theirs.
pub fn set_std(parameters: &mut [Estimate], train: &[&Channel], free: &[usize]) {
    let rows: usize = train.iter().map(|channel| channel.residual.len()).sum();
    let (mut jacobian, mut residual) = (DMatrix::zeros(rows, free.len()), DVector::zeros(rows));
    let samples = train.iter().flat_map(|channel| (0..channel.residual.len()).map(move |k| (channel, k)));
    for (row, (channel, k)) in samples.enumerate() {
        if channel.residual[k].is_finite() {
            residual[row] = channel.residual[k];
            for (column, &p) in free.iter().enumerate() {
                jacobian[(row, column)] = channel.sensitivity[p].get(k).copied().unwrap_or(0.0);
            }
        }
    }
    if let Some(covariance) = covariance::sandwich(&jacobian, &residual) {
        for (column, &p) in free.iter().enumerate() {
            parameters[p].std = covariance[(column, column)].max(0.0).sqrt();
        }
    }
}
