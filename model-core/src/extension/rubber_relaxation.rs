//! Relaxation of the rubber: creep under load, and stiffness that depends on rate.
//!
//! ε̇ᵢ = (F/kᵢ − εᵢ)/τᵢ,   the contact is driven with v_r − Σ ε̇ᵢ,   i = 1 … 3
//!
//! Kelvin–Voigt elements in series with the contact. With the elastic block of the series model they are the
//! generalised linear solid (the same solids as Maxwell branches beside the block's spring): stiff for fast
//! motion, softer for slower motion. Rubber relaxes over decades of time, and three times cover those that
//! a record of some ten seconds can show. A branch that is not needed has a stiffness of 1e12 N/m.

use crate::error::{ParameterError, require};
use crate::real::Real;

/// Branches.
pub const BRANCHES: usize = 3;

/// Creep of each branch, m.
pub type Creep<T> = [T; BRANCHES];

/// Relaxation, prepared.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RubberRelaxation<T> {
    compliance: [T; BRANCHES],
    rate: [T; BRANCHES],
}

impl<T: Real> RubberRelaxation<T> {
    /// Names of the parameters: stiffness of each creeping branch, N/m; its time constant, s.
    pub const NAMES: &'static [&'static str] = &[
        "creep_stiffness_n_per_m",
        "relaxation_s",
        "creep_stiffness_2_n_per_m",
        "relaxation_2_s",
        "creep_stiffness_3_n_per_m",
        "relaxation_3_s",
    ];

    /// Prepares the effect from values in the order of [`Self::NAMES`].
    pub fn new(values: &[T; 2 * BRANCHES]) -> Result<Self, ParameterError> {
        let (mut compliance, mut rate) = ([T::ZERO; BRANCHES], [T::ZERO; BRANCHES]);
        for branch in 0..BRANCHES {
            let (at, next) = (2 * branch, 2 * branch + 1);
            let (stiffness, relaxation) = (values[at], values[next]);
            let stiffness_allowed = stiffness >= T::ONE && stiffness <= T::from_f64(1e13);
            let relaxation_allowed = relaxation >= T::from_f64(1e-3) && relaxation <= T::from_f64(1e4);
            let stiffness = require(Self::NAMES[at], stiffness, stiffness_allowed, "1 to 1e13 N/m")?;
            let relaxation = require(Self::NAMES[next], relaxation, relaxation_allowed, "1e-3 to 1e4 s")?;
            compliance[branch] = T::ONE / stiffness;
            rate[branch] = T::ONE / relaxation;
        }
        Ok(Self { compliance, rate })
    }

    /// Mean creep speed over a step under the force of the step before, m/s.
    #[inline]
    pub fn advance(&self, creep_m: &mut Creep<T>, force_n: T, step_s: T) -> T {
        let mut changes = T::ZERO;
        for ((creep, rate), compliance) in creep_m.iter_mut().zip(self.rate).zip(self.compliance) {
            let gone = -(-step_s * rate).exp_m1();
            let change = gone * (force_n * compliance - *creep);
            *creep += change;
            changes += change;
        }
        changes / step_s
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_held_force_creeps_to_the_compliance_of_all_branches() {
        let effect = RubberRelaxation::new(&[1e5f64, 0.2, 2e5, 0.02, 1e12, 1.0]).unwrap();
        let mut creep = [0.0; BRANCHES];
        for _ in 0..200 {
            effect.advance(&mut creep, 50.0, 1e-3);
        }
        assert!((creep[0] - 5e-4 * (1.0 - (-1.0f64).exp())).abs() < 1e-12);
        assert!((creep[1] - 2.5e-4 * (1.0 - (-10.0f64).exp())).abs() < 1e-12);
        assert!(creep[2] < 1e-10);
    }
}
