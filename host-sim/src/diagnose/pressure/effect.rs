//! What an effect of the press adds to F_N = P[G τ − F0 − Σ θ_i φ_i(t; ξ)], P the press's mode.
//!
//! Linear in the sizes θ, nonlinear in the shapes ξ. Beside them an effect may have one value per log
//! that logs do not share: a state at the start, an origin of the encoder.

use std::sync::Arc;

use super::conditioned::PressureLog;
use crate::fit::bounds::Parameter;

/// What the effect takes from the force that M1 presses with, per unit of its coefficient.
#[derive(Debug, Clone)]
pub struct Column {
    /// Name of the coefficient, with unit.
    pub name: &'static str,
    /// Values at the log's samples.
    pub values: Vec<f64>,
    /// A negative coefficient would be another effect.
    pub not_negative: bool,
}

/// A value that each log has for itself.
#[derive(Debug, Clone, Copy)]
pub struct OwnValue {
    /// Name with unit.
    pub name: &'static str,
    /// It lies within plus and minus this.
    pub half_span: f64,
    /// Whether sizes absorb that of the first log, which then stays at 0.
    pub first_stays: bool,
}

/// An effect set up for a set of training logs.
pub trait Prepared: Send + Sync {
    /// Nonlinear parameters, with bounds and start.
    fn shapes(&self) -> &[Parameter];

    /// Other start values to try.
    fn starts(&self) -> &[Vec<f64>];

    /// The value that each log has for itself.
    fn own_value(&self) -> Option<OwnValue>;

    /// Columns on a log.
    fn columns(&self, shape: &[f64], own: f64, log: &PressureLog) -> Vec<Column>;

    /// What was fixed when the effect was set up and belongs to it in a model file.
    fn constants(&self) -> Vec<(&'static str, f64)>;
}

/// An effect of the library.
pub trait PressureEffect: Sync {
    /// Id of the contract.
    fn id(&self) -> &'static str;

    /// Sets it up; `residual_n` is what the fit so far leaves of each training log. The error says why
    /// the logs cannot show it.
    fn prepare(&self, logs: &[&PressureLog], residual_n: &[Vec<f64>]) -> Result<Arc<dyn Prepared>, String>;
}

/// Least and greatest travel of all logs.
pub fn travel_range(logs: &[&PressureLog]) -> Result<(f64, f64), String> {
    let (low, high) = logs
        .iter()
        .map(|log| log.travel_range())
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), (least, greatest)| {
            (low.min(least), high.max(greatest))
        });
    let noise = logs.iter().map(|log| log.normal_std_n).fold(0.0, f64::max);
    if high - low > 10.0 * noise { Ok((low, high)) } else { Err("the normal force hardly varies".into()) }
}
