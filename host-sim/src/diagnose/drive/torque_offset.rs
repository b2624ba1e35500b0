//! `torque_offset`: the effort that reaches the drive differs from the logged one by a constant.
//!
//! Source: offset of the current loop's amplifier and of its monitor (identified as "offset" in robot
//! identification, Gautier and Khalil). Extension: u = … + offset.
//! Sets it apart: the same in both directions and at every speed. A difference of the two Coulomb
//! frictions is the same while the drive moves, so the two are told apart only by viscous friction
//! that differs as well ([`super::bearing_asymmetry`]).

use std::sync::Arc;

use super::conditioned::DriveLog;
use super::effect::{DriveEffect, Known, Prepared, Regressor, Seen};
use super::units::Units;
use crate::fit::bounds::Parameter;

/// The effect.
pub struct TorqueOffset;

struct Constant;

impl Prepared for Constant {
    fn shapes(&self) -> &[Parameter] {
        &[]
    }

    fn regressors(&self, _shape: &[f64], seen: &Seen<'_>) -> Vec<Regressor> {
        let name = Units::of(seen.log.motion).effort("offset");
        vec![Regressor { name, values: vec![1.0; seen.log.len()] }]
    }
}

impl DriveEffect for TorqueOffset {
    fn id(&self) -> &'static str {
        "torque_offset"
    }

    fn prepare(&self, _logs: &[&DriveLog], _known: &Known) -> Result<Arc<dyn Prepared>, String> {
        Ok(Arc::new(Constant))
    }
}
