//! A friction channel that clips: the amplifier or the converter ends before the torque does.
//!
//! T_measured = T + k ln(1 + e^((low − T)/k)) − k ln(1 + e^((T − high)/k))
//!
//! Between the ends the channel shows the torque, beyond them the end. Within some knees k of an end its slope falls from one to
//! nothing, as a logistic curve does: an output stage leaves its straight range before its supply. For k = 0 it cuts:
//! min(max(T, low), high).

use crate::error::{ParameterError, require};
use crate::real::Real;

/// Clipping, prepared.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AdcSaturation<T> {
    low: T,
    high: T,
    knee: T,
}

impl<T: Real> AdcSaturation<T> {
    /// Names of the parameters: lowest and highest torque that the channel can show, width of the knee before them, N·m.
    pub const NAMES: &'static [&'static str] = &["friction_low_nm", "friction_high_nm", "friction_knee_nm"];

    /// The knee may be left out: the channel cuts.
    pub const OPTIONAL: &'static [f64] = &[0.0];

    /// Size of an end that no torque reaches, N·m: the channel does not clip there.
    pub const NO_END_NM: f64 = 1e9;

    /// Prepares the effect from values in the order of [`Self::NAMES`]. A knee that is wider than a quarter of the range leaves no
    /// straight part of it: it is refused.
    pub fn new(values: &[T; 3]) -> Result<Self, ParameterError> {
        let [low, high, knee] = *values;
        let limit = T::from_f64(Self::NO_END_NM);
        let low = require("friction_low_nm", low, low >= -limit && low <= limit, "-1e9 to 1e9 N m")?;
        let high = require("friction_high_nm", high, high > low && high <= limit, "above friction_low_nm")?;
        let widest = (high - low) * T::from_f64(0.25);
        let allowed = "0 to a quarter of friction_high_nm - friction_low_nm";
        let knee = require("friction_knee_nm", knee, knee >= T::from_f64(0.0) && knee <= widest, allowed)?;
        Ok(Self { low, high, knee })
    }

    /// What the channel shows of a torque, N·m.
    #[inline]
    pub fn shown_nm(&self, torque_nm: T) -> T {
        Self::shown(&[self.low, self.high, self.knee], torque_nm)
    }

    /// The same for any values in the order of [`Self::NAMES`], as a search tries them; an end may be infinite.
    #[inline]
    pub fn shown(values: &[T; 3], torque_nm: T) -> T {
        let [low, high, knee] = *values;
        if knee <= T::ZERO { torque_nm.at_least(low).at_most(high) } else { Self::bent(values, torque_nm) }
    }

    /// The same where there is a knee. By itself: within each tick's observer it would take 1 KiB more of the memory that ticks run in.
    #[inline(never)]
    fn bent(&[low, high, knee]: &[T; 3], torque_nm: T) -> T {
        // What is beyond an end, softly: of a large excess that itself, so that no exponential grows.
        let beyond =
            |excess_nm: T| excess_nm.at_least(T::ZERO) + knee * (-(excess_nm / knee).abs()).exp().ln_1p();
        torque_nm + beyond(low - torque_nm) - beyond(torque_nm - high)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_channel_shows_nothing_beyond_its_ends() {
        let effect = AdcSaturation::new(&[-2.0f64, 3.0, 0.0]).unwrap();
        assert_eq!((effect.shown_nm(-5.0), effect.shown_nm(1.0), effect.shown_nm(5.0)), (-2.0, 1.0, 3.0));
        assert_eq!(AdcSaturation::new(&[1.0f64, 1.0, 0.0]).unwrap_err().name, "friction_high_nm");
    }

    #[test]
    fn a_knee_bends_to_its_end_and_is_straight_before_it() {
        let effect = AdcSaturation::new(&[-2.0f64, 3.0, 0.2]).unwrap();
        // At an end half of the way goes on, a knee times ln 2 below it.
        let at_end = 3.0 - 0.2 * core::f64::consts::LN_2;
        assert!((effect.shown_nm(3.0) - at_end).abs() < 1e-9);
        let slope = (effect.shown_nm(3.0 + 1e-5) - effect.shown_nm(3.0 - 1e-5)) / 2e-5;
        assert!((slope - 0.5).abs() < 1e-6, "{slope}");
        assert!((effect.shown_nm(0.5) - 0.5).abs() < 1e-5 && (effect.shown_nm(50.0) - 3.0).abs() < 1e-9);
        assert!((effect.shown_nm(-50.0) + 2.0).abs() < 1e-9);
        for wide in [-0.1, 1.3, f64::NAN] {
            assert_eq!(AdcSaturation::new(&[-2.0, 3.0, wide]).unwrap_err().name, "friction_knee_nm");
        }
    }

    #[test]
    fn single_precision_shows_the_same_over_many_ranges() {
        let (single, double) = (
            AdcSaturation::new(&[-2.0f32, 3.0, 0.2]).unwrap(),
            AdcSaturation::new(&[-2.0f64, 3.0, f64::from(0.2f32)]).unwrap(),
        );
        for step in -400..=400 {
            let torque_nm = 0.05f32 * step as f32;
            let off = f64::from(single.shown_nm(torque_nm)) - double.shown_nm(f64::from(torque_nm));
            // Some roundings of 20 N m.
            assert!(off.abs() < 4e-6, "{torque_nm}: {off}");
        }
    }
}
