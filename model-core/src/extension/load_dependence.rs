//! A friction coefficient that falls with normal force: F = µ0 F_N^{1−n}, and its kin.
//!
//! µ = µ0 ((F_N + F_o)/(F_ref + F_o))^{−m},   m = n (F_ref + F_o)/F_ref
//!
//! Contact of elastic bodies grows slower than load. n is the local exponent at the reference load, where the
//! other parameters keep their meaning. The offset F_o tells one law from another: 0 is the power law (Hertz
//! n = 1/3; rubber on asphalt 0.05 … 0.3), n = F_ref/(F_ref + F_o) makes 1/µ linear in load (Thirion 1946), and an
//! offset far above the load an exponential fall.

use crate::error::{ParameterError, require};
use crate::real::Real;

/// Load dependence, prepared.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LoadDependence<T> {
    exponent: T,
    offset: T,
    least: T,
    inverse_reference: T,
}

impl<T: Real> LoadDependence<T> {
    /// Names of the parameters: n; load at which the coefficient is that of the model, N; F_o, N.
    pub const NAMES: &'static [&'static str] = &["exponent", "reference_n", "offset_n"];

    /// Prepares the effect from values in the order of [`Self::NAMES`].
    pub fn new(values: &[T; 3]) -> Result<Self, ParameterError> {
        let [exponent, reference, offset] = *values;
        let exponent = require("exponent", exponent, exponent.abs() <= T::from_f64(2.0), "-2 to 2")?;
        let reference_allowed = reference >= T::from_f64(1e-3) && reference <= T::from_f64(1e6);
        let reference = require("reference_n", reference, reference_allowed, "1e-3 to 1e6 N")?;
        let offset_allowed = offset >= T::ZERO && offset <= T::from_f64(1e3) * reference;
        let offset = require("offset_n", offset, offset_allowed, "0 to 1000 times the reference")?;
        Ok(Self {
            exponent: exponent * (reference + offset) / reference,
            offset,
            least: T::from_f64(0.01) * reference,
            inverse_reference: T::ONE / (reference + offset),
        })
    }

    /// What friction is multiplied with at a normal force; below 1/100 of the reference as there.
    #[inline]
    pub fn factor(&self, normal_force_n: T) -> T {
        let load = (normal_force_n.at_least(self.least) + self.offset) * self.inverse_reference;
        (-self.exponent * load.ln()).exp()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_power_law_and_thirions_law_are_members_of_the_family() {
        let power = LoadDependence::new(&[0.2f64, 50.0, 0.0]).unwrap();
        assert!((power.factor(100.0) - 2f64.powf(-0.2)).abs() < 1e-12);
        // 1/µ = (1 + N/150)/(1 + 50/150).
        let thirion = LoadDependence::new(&[50.0 / 200.0, 50.0, 150.0]).unwrap();
        assert!((thirion.factor(100.0) - 200.0 / 250.0).abs() < 1e-12);
        assert_eq!(thirion.factor(50.0), 1.0);
        assert!(power.factor(0.0).is_finite());
    }
}
