//! Friction that first rises with speed and then falls (Fig. 27).
//!
//! µ(v) = g(v) (1 + h H(x)),   x = ln(|v|/v_m)/w,   H = exp(−q (√(1 + 2x²/q) − 1))
//!
//! w is the width w_r below v_m and w_f above it. A hump over the logarithm of speed, as in the master curves of
//! rubber friction (Grosch 1963). With large q it is Gaussian (relaxation times spread log-normally), with
//! q near 1 its flanks are powers of speed, as those of a single relaxation are. The falling g(v) below it
//! remains. Whether the product has its maximum at a speed above zero follows from the numbers.

use crate::error::{ParameterError, require};
use crate::real::Real;

/// Hump over speed, prepared.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BellCurve<T> {
    height: T,
    inverse_peak: T,
    inverse_rise: T,
    inverse_fall: T,
    tail: T,
    two_over_tail: T,
}

impl<T: Real> BellCurve<T> {
    /// Names of the parameters: relative height; speed of the hump, m/s; widths below and above it in e-folds
    /// of speed; q.
    pub const NAMES: &'static [&'static str] = &["height", "peak_m_s", "rise_width", "fall_width", "tail"];

    /// Prepares the effect from values in the order of [`Self::NAMES`].
    pub fn new(values: &[T; 5]) -> Result<Self, ParameterError> {
        let [height, peak, rise, fall, tail] = *values;
        let height_allowed = height >= T::ZERO && height <= T::from_f64(20.0);
        let peak_allowed = peak >= T::from_f64(1e-6) && peak <= T::from_f64(100.0);
        let width_allowed = |width: T| width >= T::from_f64(0.1) && width <= T::from_f64(20.0);
        let tail_allowed = tail >= T::from_f64(0.1) && tail <= T::from_f64(100.0);
        let rise = require("rise_width", rise, width_allowed(rise), "0.1 to 20")?;
        let fall = require("fall_width", fall, width_allowed(fall), "0.1 to 20")?;
        let tail = require("tail", tail, tail_allowed, "0.1 to 100")?;
        Ok(Self {
            height: require("height", height, height_allowed, "0 to 20")?,
            inverse_peak: T::ONE / require("peak_m_s", peak, peak_allowed, "1e-6 to 100 m/s")?,
            inverse_rise: T::ONE / rise,
            inverse_fall: T::ONE / fall,
            tail,
            two_over_tail: (T::ONE + T::ONE) / tail,
        })
    }

    /// What friction is multiplied with at a speed of the tip.
    #[inline]
    pub fn factor(&self, tip_speed_m_s: T) -> T {
        let ratio = tip_speed_m_s.abs() * self.inverse_peak;
        if ratio <= T::from_f64(1e-12) {
            return T::ONE;
        }
        let log = ratio.ln();
        let x = log * if log < T::ZERO { self.inverse_rise } else { self.inverse_fall };
        let root = (T::ONE + self.two_over_tail * x * x).sqrt();
        T::ONE + self.height * (-self.tail * (root - T::ONE)).exp()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_hump_stands_at_its_speed_and_is_gaussian_without_a_tail() {
        let hump = BellCurve::new(&[0.5f64, 0.2, 1.0, 2.0, 100.0]).unwrap();
        assert_eq!(hump.factor(0.2), 1.5);
        assert_eq!(hump.factor(0.0), 1.0);
        // One width below and above: 1/e of the height; the tail of q = 100 adds half a percent.
        let at = |folds: f64| (hump.factor(0.2 * folds.exp()) - 1.0) / 0.5;
        assert!((at(-1.0) - (-1.0f64).exp()).abs() < 5e-3);
        assert!((at(2.0) - at(-1.0)).abs() < 1e-12);
    }
}
