//! Friction that first rises with speed and then falls (Fig. 27).
//!
//! µ(v) = g(v) (1 + h exp(−(ln(|v|/v_m)/w)²))
//!
//! A hump over the logarithm of speed, as in the master curves of rubber friction (Grosch 1963). The
//! falling g(v) below it remains. Whether the product has its maximum at a speed above zero follows from
//! the numbers.

use crate::error::{ParameterError, require};
use crate::real::Real;

/// Hump over speed, prepared.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BellCurve<T> {
    height: T,
    inverse_peak: T,
    inverse_width: T,
}

impl<T: Real> BellCurve<T> {
    /// Names of the parameters: relative height; speed of the hump, m/s; width in e-folds of speed.
    pub const NAMES: &'static [&'static str] = &["height", "peak_m_s", "width"];

    /// Prepares the effect from values in the order of [`Self::NAMES`].
    pub fn new(values: &[T; 3]) -> Result<Self, ParameterError> {
        let [height, peak, width] = *values;
        let height_allowed = height >= T::ZERO && height <= T::from_f64(20.0);
        let peak_allowed = peak >= T::from_f64(1e-6) && peak <= T::from_f64(100.0);
        let width_allowed = width >= T::from_f64(0.1) && width <= T::from_f64(10.0);
        Ok(Self {
            height: require("height", height, height_allowed, "0 to 20")?,
            inverse_peak: T::ONE / require("peak_m_s", peak, peak_allowed, "1e-6 to 100 m/s")?,
            inverse_width: T::ONE / require("width", width, width_allowed, "0.1 to 10")?,
        })
    }

    /// What friction is multiplied with at a speed of the tip.
    #[inline]
    pub fn factor(&self, tip_speed_m_s: T) -> T {
        let ratio = tip_speed_m_s.abs() * self.inverse_peak;
        if ratio <= T::from_f64(1e-12) {
            return T::ONE;
        }
        let x = ratio.ln() * self.inverse_width;
        T::ONE + self.height * (-x * x).exp()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_hump_stands_at_its_speed_in_both_directions() {
        let effect = BellCurve::new(&[0.5f64, 0.1, 1.5]).unwrap();
        assert_eq!(effect.factor(0.0), 1.0);
        assert!((effect.factor(0.1) - 1.5).abs() < 1e-12 && (effect.factor(-0.1) - 1.5).abs() < 1e-12);
        let side = 1.0 + 0.5 * (-1.0f64).exp();
        assert!((effect.factor(0.1 * 1.5f64.exp()) - side).abs() < 1e-12);
    }
}
