//! Relaxation of the rubber: creep under load, and stiffness that depends on rate.
//!
//! ε̇ = (F/k − ε)/τ,   the contact is driven with v_r − ε̇
//!
//! A Kelvin–Voigt element in series with the contact. With the elastic block of the series model this is
//! the standard linear solid (the same solid as a Maxwell branch beside the block's spring): stiff for
//! motion faster than τ, softer for slower motion. Left out: a spectrum of relaxation times.

use crate::error::{ParameterError, require};
use crate::real::Real;

/// Relaxation, prepared.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RubberRelaxation<T> {
    compliance: T,
    rate: T,
}

impl<T: Real> RubberRelaxation<T> {
    /// Names of the parameters: stiffness of the creeping branch, N/m; its time constant, s.
    pub const NAMES: &'static [&'static str] = &["creep_stiffness_n_per_m", "relaxation_s"];

    /// Prepares the effect from values in the order of [`Self::NAMES`].
    pub fn new(values: &[T; 2]) -> Result<Self, ParameterError> {
        let [stiffness, relaxation] = *values;
        let stiffness_allowed = stiffness >= T::ONE && stiffness <= T::from_f64(1e10);
        let relaxation_allowed = relaxation >= T::from_f64(1e-3) && relaxation <= T::from_f64(1e4);
        let stiffness = require("creep_stiffness_n_per_m", stiffness, stiffness_allowed, "1 to 1e10 N/m")?;
        let relaxation = require("relaxation_s", relaxation, relaxation_allowed, "1e-3 to 1e4 s")?;
        Ok(Self { compliance: T::ONE / stiffness, rate: T::ONE / relaxation })
    }

    /// Mean creep speed over a step under the force of the step before, m/s.
    #[inline]
    pub fn advance(&self, creep_m: &mut T, force_n: T, step_s: T) -> T {
        let gone = -(-step_s * self.rate).exp_m1();
        let change = gone * (force_n * self.compliance - *creep_m);
        *creep_m += change;
        change / step_s
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_held_force_creeps_to_its_compliance() {
        let effect = RubberRelaxation::new(&[1e5f64, 0.2]).unwrap();
        let mut creep = 0.0;
        for _ in 0..200 {
            effect.advance(&mut creep, 50.0, 1e-3);
        }
        assert!((creep - 5e-4 * (1.0 - (-1.0f64).exp())).abs() < 1e-12);
    }
}
