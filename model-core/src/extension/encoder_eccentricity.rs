//! An encoder that sits off centre: measured angle and speed err once per revolution.
//!
//! φ_measured = φ + e sin(φ_measured − φ0)   and so   ω = ω_measured (1 − e cos(φ_measured − φ0))

use crate::error::{ParameterError, require};
use crate::real::Real;

/// Eccentricity, prepared.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EncoderEccentricity<T> {
    amplitude: T,
    origin_rad: T,
}

impl<T: Real> EncoderEccentricity<T> {
    /// Names of the parameters: amplitude e, rad; measured angle at which speed is shown highest, rad.
    pub const NAMES: &'static [&'static str] = &["amplitude_rad", "origin_rad"];

    /// Prepares the effect from values in the order of [`Self::NAMES`].
    pub fn new(values: &[T; 2]) -> Result<Self, ParameterError> {
        let [amplitude, origin] = *values;
        let amplitude_allowed = amplitude.abs() <= T::from_f64(0.5);
        let origin_allowed = origin.abs() <= T::from_f64(1e6);
        Ok(Self {
            amplitude: require("amplitude_rad", amplitude, amplitude_allowed, "-0.5 to 0.5 rad")?,
            origin_rad: require("origin_rad", origin, origin_allowed, "-1e6 to 1e6 rad")?,
        })
    }

    /// What a measured speed is to be multiplied with to be the true one.
    #[inline]
    pub fn speed_factor(&self, measured_angle_rad: T) -> T {
        T::ONE - self.amplitude * (measured_angle_rad - self.origin_rad).cos()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_corrected_speed_integrates_to_the_corrected_angle() {
        let effect = EncoderEccentricity::new(&[0.02f64, 0.4]).unwrap();
        let (mut angle, mut measured) = (0.0f64, 0.0f64);
        for _ in 0..100_000 {
            // Midpoint rule at a measured speed of 10 rad/s.
            angle += 1e-4 * 10.0 * effect.speed_factor(measured + 0.5e-3);
            measured += 1e-3;
        }
        let shift = 0.02 * ((measured - 0.4).sin() - (-0.4f64).sin());
        assert!((angle - (measured - shift)).abs() < 1e-6);
    }
}
