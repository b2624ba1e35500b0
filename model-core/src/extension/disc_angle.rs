//! Friction that varies with the angle of the disc: stones, joints, a worn spot.
//!
//! µ = µ0 (1 + Σ_k a_k cos k(φ − φ0) + b_k sin k(φ − φ0)),   k = 1 … 10
//!
//! φ is the measured angle of the disc. The encoder is incremental, so its origin φ0 differs from one
//! record to the next while the pattern on the disc stays.
//! Left out: patterns finer than a tenth of a revolution, and different patterns under three elements.

use crate::error::{ParameterError, require};
use crate::real::Real;

/// Highest order per revolution.
pub const ORDERS: usize = 10;

/// Variation with the disc's angle, prepared.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DiscAngle<T> {
    origin_rad: T,
    cosines: [T; ORDERS],
    sines: [T; ORDERS],
}

impl<T: Real> DiscAngle<T> {
    /// Names of the parameters: angle of the pattern's origin, then a_k and b_k in turn.
    pub const NAMES: &'static [&'static str] = &[
        "origin_rad",
        "cos1",
        "sin1",
        "cos2",
        "sin2",
        "cos3",
        "sin3",
        "cos4",
        "sin4",
        "cos5",
        "sin5",
        "cos6",
        "sin6",
        "cos7",
        "sin7",
        "cos8",
        "sin8",
        "cos9",
        "sin9",
        "cos10",
        "sin10",
    ];

    /// Prepares the effect from values in the order of [`Self::NAMES`].
    pub fn new(values: &[T; 1 + 2 * ORDERS]) -> Result<Self, ParameterError> {
        let origin_rad =
            require("origin_rad", values[0], values[0].abs() <= T::from_f64(1e6), "-1e6 to 1e6 rad")?;
        let (mut cosines, mut sines) = ([T::ZERO; ORDERS], [T::ZERO; ORDERS]);
        for order in 0..ORDERS {
            for (slot, at) in [(&mut cosines, 1 + 2 * order), (&mut sines, 2 + 2 * order)] {
                let value = values[at];
                slot[order] = require(Self::NAMES[at], value, value.abs() <= T::ONE, "-1 to 1")?;
            }
        }
        Ok(Self { origin_rad, cosines, sines })
    }

    /// What friction is multiplied with at a disc angle; not less than 1/20.
    #[inline]
    pub fn factor(&self, disc_angle_rad: T) -> T {
        let angle = disc_angle_rad - self.origin_rad;
        let (cosine, sine) = (angle.cos(), angle.sin());
        let (mut c, mut s) = (cosine, sine);
        let mut sum = T::ONE;
        for order in 0..ORDERS {
            sum += self.cosines[order] * c + self.sines[order] * s;
            (c, s) = (c * cosine - s * sine, s * cosine + c * sine);
        }
        sum.at_least(T::from_f64(0.05))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn orders_are_those_of_the_angle_and_turn_with_the_origin() {
        let mut values = [0.0f64; 21];
        values[0] = 0.3;
        values[5] = 0.1;
        values[12] = -0.2;
        let effect = DiscAngle::new(&values).unwrap();
        for angle in [-2.0f64, 0.0, 1.0, 7.0] {
            let turned = angle - 0.3;
            let expected = 1.0 + 0.1 * (3.0 * turned).cos() - 0.2 * (6.0 * turned).sin();
            assert!((effect.factor(angle) - expected).abs() < 1e-14);
        }
    }
}
