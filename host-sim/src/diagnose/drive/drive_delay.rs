//! `drive_delay`: motion follows the logged effort after a pure delay.
//!
//! Source: field bus and current loop between the logged command and the force. Extension:
//! u(t − τ) on the left side. A difference in time up to [`super::model::TIMING_S`] is the channels'
//! timing and belongs to the baseline.
//! Sets it apart: the residual follows the rate of change of the whole effort, at every speed, in steps
//! and in slow motion alike; friction effects show at reversals only.

use std::sync::Arc;

use super::conditioned::DriveLog;
use super::effect::{DriveEffect, Known, Prepared, Regressor, Seen};
use super::model::TIMING_S;
use crate::fit::bounds::Parameter;

/// The longest delay looked for, s.
const LONGEST_S: f64 = 0.1;

/// The effect.
pub struct DriveDelay;

struct Delay {
    shapes: [Parameter; 1],
    starts: Vec<Vec<f64>>,
}

impl Prepared for Delay {
    fn shapes(&self) -> &[Parameter] {
        &self.shapes
    }

    fn starts(&self) -> &[Vec<f64>] {
        &self.starts
    }

    fn delay_s(&self, shape: &[f64]) -> Option<f64> {
        Some(shape[0])
    }

    fn regressors(&self, _shape: &[f64], _seen: &Seen<'_>) -> Vec<Regressor> {
        Vec::new()
    }
}

impl DriveEffect for DriveDelay {
    fn id(&self) -> &'static str {
        "drive_delay"
    }

    fn prepare(&self, _logs: &[&DriveLog], _known: &Known) -> Result<Arc<dyn Prepared>, String> {
        let shapes = [Parameter::linear("delay_s", 2.0 * TIMING_S, TIMING_S, LONGEST_S)];
        // Steps of a quarter of the time in which a force at the band's edge turns.
        let starts =
            (0..40).map(|i| vec![TIMING_S * (LONGEST_S / TIMING_S).powf(f64::from(i) / 39.0)]).collect();
        Ok(Arc::new(Delay { shapes, starts }))
    }
}
