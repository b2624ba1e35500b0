//! A friction coefficient that falls with normal force: F = µ0 F_N^{1−n}.
//!
//! Contact of elastic bodies grows slower than load (Hertz: n = 1/3; rubber on asphalt: 0.05 … 0.3; Thirion
//! 1946 has the same trend as 1/µ linear in pressure). Written relative to a reference load so that the
//! other parameters keep their meaning there: µ = µ0 (F_N/F_ref)^{−n}.

use crate::error::{ParameterError, require};
use crate::real::Real;

/// Load dependence, prepared.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LoadDependence<T> {
    exponent: T,
    inverse_reference: T,
}

impl<T: Real> LoadDependence<T> {
    /// Names of the parameters: n; load at which the coefficient is that of the model, N.
    pub const NAMES: &'static [&'static str] = &["exponent", "reference_n"];

    /// Prepares the effect from values in the order of [`Self::NAMES`].
    pub fn new(values: &[T; 2]) -> Result<Self, ParameterError> {
        let [exponent, reference] = *values;
        let exponent = require("exponent", exponent, exponent.abs() <= T::ONE, "-1 to 1")?;
        let reference_allowed = reference >= T::from_f64(1e-3) && reference <= T::from_f64(1e6);
        let reference = require("reference_n", reference, reference_allowed, "1e-3 to 1e6 N")?;
        Ok(Self { exponent, inverse_reference: T::ONE / reference })
    }

    /// What friction is multiplied with at a normal force; below 1/100 of the reference as there.
    #[inline]
    pub fn factor(&self, normal_force_n: T) -> T {
        let load = (normal_force_n * self.inverse_reference).at_least(T::from_f64(0.01));
        (-self.exponent * load.ln()).exp()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_coefficient_falls_by_the_power_of_the_load() {
        let effect = LoadDependence::new(&[0.2f64, 80.0]).unwrap();
        assert!((effect.factor(80.0) - 1.0).abs() < 1e-15);
        assert!((effect.factor(160.0) - 2f64.powf(-0.2)).abs() < 1e-14);
        assert!(effect.factor(0.0).is_finite() && effect.factor(-5.0).is_finite());
    }
}
