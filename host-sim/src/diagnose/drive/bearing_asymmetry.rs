//! `bearing_asymmetry`: Coulomb and viscous friction of the bearing differ per direction.
//!
//! Source: Janot, Gautier and Brunot (2019) on EMPS; Kermani, Patel and Moallem (2007). Extension:
//! u = … + ΔFv |q̇| + ΔFc |d|: half the differences between forward and backward.
//! Sets it apart: a part of the residual that is even in speed and grows with it. The constant part
//! alone would be a [`super::torque_offset`]; with an offset in the model it belongs to that.

use std::sync::Arc;

use super::conditioned::DriveLog;
use super::effect::{DriveEffect, Known, Prepared, Regressor, Seen};
use super::units::Units;
use crate::fit::bounds::Parameter;

/// The effect.
pub struct BearingAsymmetry;

struct EvenParts {
    with_constant: bool,
}

impl Prepared for EvenParts {
    fn shapes(&self) -> &[Parameter] {
        &[]
    }

    fn regressors(&self, _shape: &[f64], seen: &Seen<'_>) -> Vec<Regressor> {
        let units = Units::of(seen.log.motion);
        let each = |values: &[f64]| values.iter().map(|x| x.abs()).collect();
        let viscous = Regressor { name: units.viscous("viscous_difference"), values: each(&seen.log.speed) };
        let mut all = vec![viscous];
        if self.with_constant {
            all.push(Regressor { name: units.effort("coulomb_difference"), values: each(seen.direction) });
        }
        all
    }
}

impl DriveEffect for BearingAsymmetry {
    fn id(&self) -> &'static str {
        "bearing_asymmetry"
    }

    fn prepare(&self, _logs: &[&DriveLog], known: &Known) -> Result<Arc<dyn Prepared>, String> {
        Ok(Arc::new(EvenParts { with_constant: !known.effects.contains(&"torque_offset") }))
    }
}
