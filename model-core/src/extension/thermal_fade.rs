//! Thermal fade: friction falls as the dissipated power heats the surface, and recovers as it cools.
//!
//! Ė = P − E/τ,   µ = µ0 / (1 + x + c x²),   x = f E
//!
//! P is the power that the sliding asperities dissipate and E the heat that the surface layer holds: one
//! thermal node, as in the lumped surface models of Persson (2006) for rubber. The measured laws differ
//! in how they bend; c spans them: 0 is 1/(1 + x), 1/2 is close to e^{−x}, 1 is close to 1 − x.
//! Left out: the flash temperature of single asperities (it follows the speed within microseconds, so
//! it is part of g(v)) and the slow heating of the disc's body.

use crate::error::{ParameterError, require};
use crate::real::Real;

/// Thermal fade, prepared.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ThermalFade<T> {
    fade_per_j: T,
    cooling_rate: T,
    curvature: T,
}

impl<T: Real> ThermalFade<T> {
    /// Names of the parameters: relative fall of friction per joule held; time in which the heat falls
    /// to 1/e, s; bend c.
    pub const NAMES: &'static [&'static str] = &["fade_per_j", "cooling_s", "curvature"];

    /// Prepares the effect from values in the order of [`Self::NAMES`].
    pub fn new(values: &[T; 3]) -> Result<Self, ParameterError> {
        let [fade, cooling_s, curvature] = *values;
        let fade_allowed = fade >= T::ZERO && fade <= T::from_f64(10.0);
        let cooling_allowed = cooling_s >= T::from_f64(1e-2) && cooling_s <= T::from_f64(1e5);
        let curvature_allowed = curvature >= T::ZERO && curvature <= T::from_f64(2.0);
        Ok(Self {
            fade_per_j: require("fade_per_j", fade, fade_allowed, "0 to 10 1/J")?,
            cooling_rate: T::ONE / require("cooling_s", cooling_s, cooling_allowed, "0.01 to 1e5 s")?,
            curvature: require("curvature", curvature, curvature_allowed, "0 to 2")?,
        })
    }

    /// What friction is multiplied with when the surface holds `heat_j`.
    #[inline]
    pub fn factor(&self, heat_j: T) -> T {
        let x = self.fade_per_j * heat_j;
        T::ONE / (T::ONE + x * (T::ONE + self.curvature * x))
    }

    /// Heat after a step of `step_s` with dissipated power `power_w`: exact for a held power.
    #[inline]
    pub fn advance(&self, heat_j: &mut T, power_w: T, step_s: T) {
        let gone = -(-step_s * self.cooling_rate).exp_m1();
        *heat_j += gone * (power_w.at_least(T::ZERO) / self.cooling_rate - *heat_j);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_surface_heats_to_power_times_cooling_time_and_cools_by_its_time_constant() {
        let effect = ThermalFade::new(&[1e-3f64, 2.0, 0.5]).unwrap();
        let mut heat = 0.0;
        for _ in 0..40_000 {
            effect.advance(&mut heat, 50.0, 1e-3);
        }
        // e^{−20} of the way is missing.
        assert!((heat - 100.0).abs() < 1e-6);
        for _ in 0..2000 {
            effect.advance(&mut heat, 0.0, 1e-3);
        }
        assert!((heat - 100.0 / 1f64.exp()).abs() < 1e-6);
        assert!((effect.factor(100.0) - 1.0 / 1.105).abs() < 1e-12);
    }
}
