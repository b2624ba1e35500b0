//! What an effect of the drive adds to the inverse model.
//!
//! The model is u(t − τ) = Σ θ_i φ_i(t; ξ): linear in the sizes θ, nonlinear in the shapes ξ (a speed,
//! a length, a frequency). An effect gives its shapes with bounds and start values, its regressors φ,
//! and may replace the direction of motion that Coulomb friction follows, or delay the effort.

use std::sync::Arc;

use super::conditioned::DriveLog;
use super::resonance::Resonance;
use crate::fit::bounds::Parameter;

/// Inertia and friction in slow motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Slow {
    /// Inertia or mass.
    pub inertia: f64,
    /// Viscous friction.
    pub viscous: f64,
    /// Coulomb friction.
    pub coulomb: f64,
}

/// What is known before an effect is added.
#[derive(Debug, Clone)]
pub struct Known {
    /// The drive as one mass in slow motion, where a shaft does not twist.
    pub slow: Slow,
    /// Force that the fit so far leaves unexplained, per training log, on the log's samples.
    pub residual: Vec<Vec<f64>>,
    /// Effects in the fit, with the one that asks.
    pub effects: Vec<&'static str>,
}

/// What the regressors of a log share.
#[derive(Debug, Clone, Copy)]
pub struct Seen<'a> {
    /// The log.
    pub log: &'a DriveLog,
    /// Direction of motion, −1 to 1: what Coulomb friction is proportional to.
    pub direction: &'a [f64],
    /// Where position-locked effects have their origin in this log, in position units.
    pub origin: f64,
}

/// A regressor on a log's samples.
#[derive(Debug, Clone)]
pub struct Regressor {
    /// Name of its coefficient, with unit.
    pub name: String,
    /// Values.
    pub values: Vec<f64>,
}

/// An effect with its shapes set up for a set of training logs.
pub trait Prepared: Send + Sync {
    /// Nonlinear parameters, with bounds and start.
    fn shapes(&self) -> &[Parameter];

    /// Other start values to try.
    fn starts(&self) -> &[Vec<f64>] {
        &[]
    }

    /// Direction of motion that replaces the sign of the speed.
    fn direction(&self, _shape: &[f64], _log: &DriveLog) -> Option<Vec<f64>> {
        None
    }

    /// Delay of motion behind effort, s.
    fn delay_s(&self, _shape: &[f64]) -> Option<f64> {
        None
    }

    /// A resonance that the measured friction passes on its way to the motor.
    fn resonance(&self, _shape: &[f64]) -> Option<Resonance> {
        None
    }

    /// Regressors on a log.
    fn regressors(&self, shape: &[f64], seen: &Seen<'_>) -> Vec<Regressor>;

    /// Where the disc is against the encoder's angle, on a log: for an effect that takes them apart. `sizes`
    /// are the coefficients of [`Self::regressors`].
    fn disc_offset(&self, _shape: &[f64], _sizes: &[f64], _seen: &Seen<'_>) -> Option<Vec<f64>> {
        None
    }

    /// What was fixed when the effect was set up and belongs to it in a model file.
    fn constants(&self) -> Vec<(String, f64)> {
        Vec::new()
    }

    /// For an effect that is locked to position: where its origin may lie in a log, since logs need
    /// not share the encoder's zero.
    fn origins(&self) -> Option<Origins<'_>> {
        None
    }
}

/// The search for a log's origin.
#[derive(Debug, Clone, Copy)]
pub struct Origins<'a> {
    /// Origins lie within plus and minus half of this, in position units.
    pub span: f64,
    /// Step of the search.
    pub step: f64,
    /// Start value for each training log; the first log's stays.
    pub starts: &'a [f64],
    /// Radians per position unit of each pair of a cosine and a sine column.
    pub waves: &'a [f64],
}

/// An effect of the library.
pub trait DriveEffect: Sync {
    /// Id of the contract.
    fn id(&self) -> &'static str;

    /// Sets it up for the training logs; the error says why they cannot show it.
    fn prepare(&self, logs: &[&DriveLog], known: &Known) -> Result<Arc<dyn Prepared>, String>;
}
