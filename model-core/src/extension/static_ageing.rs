//! Ageing of a resting contact: breakaway grows with dwell time, about with its logarithm.
//!
//! µ = µ0 (1 + b ln(1 + φ/τ)),   φ̇ = 1 − |v| φ/D
//!
//! The state is the age φ of the contact (Dieterich's ageing law, 1979; for rubber and polymers Baumberger
//! and Caroli 2006): at rest it is the dwell time, and sliding over the memory length D renews the contact.
//! At the start of a record it is what the record does not show: a parameter.
//! In steady sliding φ = D/|v|, a slow fall with speed that g(v) takes up.

use crate::error::{ParameterError, require};
use crate::real::Real;

/// Ageing, prepared.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StaticAgeing<T> {
    growth: T,
    inverse_onset: T,
    inverse_memory: T,
    first_age_s: T,
}

impl<T: Real> StaticAgeing<T> {
    /// Names of the parameters: relative growth of friction per e-fold of age; age at which it sets in,
    /// s; memory length, m; age at the start, s.
    pub const NAMES: &'static [&'static str] = &["growth", "onset_s", "memory_m", "first_age_s"];

    /// Prepares the effect from values in the order of [`Self::NAMES`].
    pub fn new(values: &[T; 4]) -> Result<Self, ParameterError> {
        let [growth, onset, memory, first_age] = *values;
        let growth_allowed = growth >= T::ZERO && growth <= T::from_f64(10.0);
        let onset_allowed = onset >= T::from_f64(1e-4) && onset <= T::from_f64(1e4);
        let memory_allowed = memory >= T::from_f64(1e-6) && memory <= T::ONE;
        let first_age_allowed = first_age >= T::ZERO && first_age <= T::from_f64(1e7);
        Ok(Self {
            first_age_s: require("first_age_s", first_age, first_age_allowed, "0 to 1e7 s")?,
            growth: require("growth", growth, growth_allowed, "0 to 10")?,
            inverse_onset: T::ONE / require("onset_s", onset, onset_allowed, "1e-4 to 1e4 s")?,
            inverse_memory: T::ONE / require("memory_m", memory, memory_allowed, "1e-6 to 1 m")?,
        })
    }

    /// Age at the start, s.
    pub fn first_age_s(&self) -> T {
        self.first_age_s
    }

    /// What friction is multiplied with at an age.
    #[inline]
    pub fn factor(&self, age_s: T) -> T {
        T::ONE + self.growth * (age_s * self.inverse_onset).ln_1p()
    }

    /// Age after a step at a held speed of the tip.
    #[inline]
    pub fn advance(&self, age_s: &mut T, tip_speed_m_s: T, step_s: T) {
        let lambda = tip_speed_m_s.abs() * self.inverse_memory * step_s;
        let kept = (-lambda).exp();
        let gained = if lambda > T::from_f64(1e-6) { -(-lambda).exp_m1() / lambda } else { T::ONE };
        *age_s = *age_s * kept + step_s * gained;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_contact_ages_at_rest_and_is_renewed_over_the_memory_length() {
        let effect = StaticAgeing::new(&[0.1f64, 0.01, 1e-3, 0.0]).unwrap();
        let mut age = 0.0;
        for _ in 0..10_000 {
            effect.advance(&mut age, 0.0, 1e-3);
        }
        assert!((age - 10.0).abs() < 1e-9);
        assert!((effect.factor(age) - (1.0 + 0.1 * 1001f64.ln())).abs() < 1e-9);
        for _ in 0..10_000 {
            effect.advance(&mut age, -0.05, 1e-3);
        }
        assert!((age - 1e-3 / 0.05).abs() < 1e-9);
    }
}
