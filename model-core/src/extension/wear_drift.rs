//! Wear: friction changes with the distance slid and does not come back.
//!
//! µ = µ0 (1 + c s0 (1 − e^{−s/s0})),   ṡ = |v|
//!
//! s is the distance slid by the tip. A scale s0 much longer than the record is a steady change of c per
//! metre; a short one is running-in that ends. Left out: wear in proportion to load (Archard), which a
//! record at one load cannot tell from this.

use crate::error::{ParameterError, require};
use crate::real::Real;

/// Wear, prepared.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WearDrift<T> {
    most: T,
    inverse_scale: T,
}

/// Distance slid, with what rounding has left out of it: a step adds micrometres to hundreds of metres.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Distance<T> {
    /// Distance, m.
    pub metres: T,
    missing: T,
}

impl<T: Real> Distance<T> {
    /// Adds a piece (compensated sum of Kahan).
    #[inline]
    pub fn add(&mut self, metres: T) {
        let piece = metres + self.missing;
        let sum = self.metres + piece;
        self.missing = piece - (sum - self.metres);
        self.metres = sum;
    }
}

impl<T: Real> WearDrift<T> {
    /// Names of the parameters: relative change of friction per metre at first; distance over which the
    /// change runs out, m.
    pub const NAMES: &'static [&'static str] = &["change_per_m", "scale_m"];

    /// Prepares the effect from values in the order of [`Self::NAMES`].
    pub fn new(values: &[T; 2]) -> Result<Self, ParameterError> {
        let [change, scale] = *values;
        let change_allowed = change.abs() <= T::from_f64(100.0);
        let scale_allowed = scale >= T::from_f64(1e-3) && scale <= T::from_f64(1e6);
        let change = require("change_per_m", change, change_allowed, "-100 to 100 1/m")?;
        let scale = require("scale_m", scale, scale_allowed, "1e-3 to 1e6 m")?;
        Ok(Self { most: change * scale, inverse_scale: T::ONE / scale })
    }

    /// What friction is multiplied with after `distance`; not less than 1/20.
    #[inline]
    pub fn factor(&self, distance: &Distance<T>) -> T {
        let share = -(-distance.metres * self.inverse_scale).exp_m1();
        (T::ONE + self.most * share).at_least(T::from_f64(0.05))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_scale_is_a_steady_change_and_a_short_one_runs_out() {
        let steady = WearDrift::new(&[0.01f64, 1e6]).unwrap();
        let runs_out = WearDrift::new(&[0.01f64, 5.0]).unwrap();
        let far = Distance { metres: 10.0, missing: 0.0 };
        // (s/s0)/2 = 5e-6 of the change.
        assert!((steady.factor(&far) - 1.1).abs() < 1e-6);
        assert!((runs_out.factor(&far) - (1.0 + 0.05 * (1.0 - (-2.0f64).exp()))).abs() < 1e-15);
    }

    #[test]
    fn micrometres_are_not_lost_in_single_precision() {
        let mut distance = Distance::<f32>::default();
        for _ in 0..10_000_000 {
            distance.add(1e-5);
        }
        // 100 m to one unit in the last place; a plain sum ends 1 % off.
        assert!((distance.metres - 100.0).abs() < 1e-5, "{}", distance.metres);
    }
}
