//! Friction that differs between the two directions of sliding: cut or worn rubber, a combed road.
//!
//! µ = µ0 (1 + d(v) sgn F),   d(v) = d_f + (d_s − d_f)/(1 + (|v|/v_d)^p)
//!
//! The part of friction that falls with speed (adhesion) and the part that stays (hysteresis on the texture)
//! need not differ by the same share, so slow and fast sliding each have their own; p is near the δ of g(v)
//! or above it. The direction is that of
//! the force: a stuck element breaks away in the direction in which it is pulled.

use crate::error::{ParameterError, require};
use crate::real::Real;

/// Asymmetry, prepared.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DirectionAsymmetry<T> {
    fast: T,
    more_when_slow: T,
    inverse_speed: T,
    sharpness: T,
}

impl<T: Real> DirectionAsymmetry<T> {
    /// Names of the parameters: half the relative difference in slow and in fast sliding; speed between
    /// the two, m/s; p.
    pub const NAMES: &'static [&'static str] =
        &["asymmetry_slow", "asymmetry_fast", "between_m_s", "sharpness"];

    /// Prepares the effect from values in the order of [`Self::NAMES`].
    pub fn new(values: &[T; 4]) -> Result<Self, ParameterError> {
        let share = |at: usize| {
            let allowed = values[at].abs() <= T::from_f64(0.95);
            require(Self::NAMES[at], values[at], allowed, "-0.95 to 0.95")
        };
        let (slow, fast) = (share(0)?, share(1)?);
        let speed_allowed = values[2] >= T::from_f64(1e-6) && values[2] <= T::from_f64(1e3);
        let speed = require("between_m_s", values[2], speed_allowed, "1e-6 to 1e3 m/s")?;
        let sharpness_allowed = values[3] >= T::from_f64(0.1) && values[3] <= T::from_f64(4.0);
        let sharpness = require("sharpness", values[3], sharpness_allowed, "0.1 to 4")?;
        Ok(Self { fast, more_when_slow: slow - fast, inverse_speed: T::ONE / speed, sharpness })
    }

    /// What friction is multiplied with at a force and a speed of the tip.
    #[inline]
    pub fn factor(&self, force_n: T, tip_speed_m_s: T) -> T {
        let ratio = tip_speed_m_s.abs() * self.inverse_speed;
        let power = if ratio > T::from_f64(1e-12) { (self.sharpness * ratio.ln()).exp() } else { T::ZERO };
        let slow = T::ONE / (T::ONE + power);
        T::ONE + (self.fast + self.more_when_slow * slow) * force_n.sign()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directions_differ_by_twice_the_share_of_the_speed() {
        let law = DirectionAsymmetry::new(&[0.2f64, 0.1, 0.5, 1.0]).unwrap();
        let difference = |speed: f64| law.factor(1.0, speed) - law.factor(-1.0, -speed);
        assert!((difference(0.0) - 0.4).abs() < 1e-12);
        assert!((difference(0.5) - 0.3).abs() < 1e-12);
        assert!((difference(1e6) - 0.2).abs() < 1e-6);
    }
}
