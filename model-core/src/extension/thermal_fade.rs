//! Thermal fade: friction falls as the dissipated power heats the surface, and recovers as it cools.
//!
//! Ė₁ = P − E₁/τ₁,   Ė₂ = P − E₂/τ₂,   x = (f₁ E₁ + f₂ E₂)ⁿ,   µ = µ0 (1 − x/(1 + s x))
//!
//! P is the power that the sliding asperities dissipate. The surface layer and the body behind it are two
//! thermal nodes; seen from the surface their temperature is the sum of two first-order responses, whatever
//! their coupling (lumped models of rubber friction: Persson 2006). Measured laws differ in how they bend;
//! s spans them: 0 is a straight fall, 1/2 close to e^{−x}, 1 is 1/(1 + x), more ends at the floor 1 − 1/s.
//! Left out: the flash temperature of single asperities; it follows the speed within microseconds, so it is
//! part of g(v).

use crate::error::{ParameterError, require};
use crate::real::Real;

/// Thermal fade, prepared.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ThermalFade<T> {
    fade_per_j: [T; 2],
    cooling_rate: [T; 2],
    saturation: T,
    exponent: T,
}

/// Heat held by the two nodes, J.
pub type Heat<T> = [T; 2];

impl<T: Real> ThermalFade<T> {
    /// Names of the parameters: relative fall of friction per joule held and the time in which the heat
    /// falls to 1/e, for the fast and the slow node; bend s; exponent n.
    pub const NAMES: &'static [&'static str] =
        &["fade_per_j", "cooling_s", "slow_fade_per_j", "slow_cooling_s", "saturation", "exponent"];

    /// Prepares the effect from values in the order of [`Self::NAMES`].
    pub fn new(values: &[T; 6]) -> Result<Self, ParameterError> {
        let fade = |at: usize| {
            let allowed = values[at] >= T::ZERO && values[at] <= T::from_f64(10.0);
            require(Self::NAMES[at], values[at], allowed, "0 to 10 1/J")
        };
        let rate = |at: usize| {
            let allowed = values[at] >= T::from_f64(1e-2) && values[at] <= T::from_f64(1e5);
            require(Self::NAMES[at], values[at], allowed, "0.01 to 1e5 s").map(|seconds| T::ONE / seconds)
        };
        let bend_allowed = values[4] >= T::ZERO && values[4] <= T::from_f64(100.0);
        let n = values[5];
        let n_allowed = n >= T::from_f64(0.2) && n <= T::from_f64(5.0);
        Ok(Self {
            exponent: require("exponent", n, n_allowed, "0.2 to 5")?,
            fade_per_j: [fade(0)?, fade(2)?],
            cooling_rate: [rate(1)?, rate(3)?],
            saturation: require("saturation", values[4], bend_allowed, "0 to 100")?,
        })
    }

    /// What friction is multiplied with when the nodes hold this heat; not less than 1/20.
    #[inline]
    pub fn factor(&self, heat_j: &Heat<T>) -> T {
        let mut x = self.fade_per_j[0] * heat_j[0] + self.fade_per_j[1] * heat_j[1];
        if x <= T::ZERO {
            return T::ONE;
        }
        if self.exponent != T::ONE {
            x = (self.exponent * x.ln()).exp();
        }
        (T::ONE - x / (T::ONE + self.saturation * x)).at_least(T::from_f64(0.05))
    }

    /// Heat after a step of `step_s` with dissipated power `power_w`: exact for a held power.
    #[inline]
    pub fn advance(&self, heat_j: &mut Heat<T>, power_w: T, step_s: T) {
        let power = power_w.at_least(T::ZERO);
        for (heat, rate) in heat_j.iter_mut().zip(self.cooling_rate) {
            let gone = -(-step_s * rate).exp_m1();
            *heat += gone * (power / rate - *heat);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_surface_heats_to_power_times_cooling_time_and_cools_by_its_time_constants() {
        let effect = ThermalFade::new(&[1e-3f64, 2.0, 1e-4, 20.0, 1.0, 1.0]).unwrap();
        let mut heat = [0.0; 2];
        for _ in 0..400_000 {
            effect.advance(&mut heat, 50.0, 1e-3);
        }
        // e^{−20} of the slow node's way is missing.
        assert!((heat[0] - 100.0).abs() < 1e-6 && (heat[1] - 1000.0).abs() < 1e-5);
        // x = 0.1 + 0.1
        assert!((effect.factor(&heat) - (1.0 - 0.2 / 1.2)).abs() < 1e-8);
        let late = ThermalFade::new(&[1e-3f64, 2.0, 1e-4, 20.0, 1.0, 2.0]).unwrap();
        assert!((late.factor(&heat) - (1.0 - 0.04 / 1.04)).abs() < 1e-8);
        for _ in 0..2000 {
            effect.advance(&mut heat, 0.0, 1e-3);
        }
        assert!((heat[0] - 100.0 * (-1.0f64).exp()).abs() < 1e-6);
        assert!((heat[1] - 1000.0 * (-0.1f64).exp()).abs() < 1e-5);
    }
}
