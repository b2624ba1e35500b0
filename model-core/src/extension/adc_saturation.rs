//! A friction channel that clips: the amplifier or the converter ends before the torque does.
//!
//! T_measured = min(max(T, low), high)

use crate::error::{ParameterError, require};
use crate::real::Real;

/// Clipping, prepared.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AdcSaturation<T> {
    low: T,
    high: T,
}

impl<T: Real> AdcSaturation<T> {
    /// Names of the parameters: lowest and highest torque that the channel can show, N·m.
    pub const NAMES: &'static [&'static str] = &["friction_low_nm", "friction_high_nm"];

    /// Size of an end that no torque reaches, N·m: the channel does not clip there.
    pub const NO_END_NM: f64 = 1e9;

    /// Prepares the effect from values in the order of [`Self::NAMES`].
    pub fn new(values: &[T; 2]) -> Result<Self, ParameterError> {
        let [low, high] = *values;
        let limit = T::from_f64(Self::NO_END_NM);
        Ok(Self {
            low: require("friction_low_nm", low, low >= -limit && low <= limit, "-1e9 to 1e9 N m")?,
            high: require("friction_high_nm", high, high > low && high <= limit, "above friction_low_nm")?,
        })
    }

    /// What the channel shows of a torque, N·m.
    #[inline]
    pub fn shown_nm(&self, torque_nm: T) -> T {
        torque_nm.at_least(self.low).at_most(self.high)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_channel_shows_nothing_beyond_its_ends() {
        let effect = AdcSaturation::new(&[-2.0f64, 3.0]).unwrap();
        assert_eq!((effect.shown_nm(-5.0), effect.shown_nm(1.0), effect.shown_nm(5.0)), (-2.0, 1.0, 3.0));
        assert_eq!(AdcSaturation::new(&[1.0f64, 1.0]).unwrap_err().name, "friction_high_nm");
    }
}
