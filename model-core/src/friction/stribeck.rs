//! The Stribeck curve, eq. 13: g(v) = θ (a0 + a1 exp(−(|v|/v0)^δ)).
//!
//! The paper has δ = 0.5; 0.5 to 1, 2 and far more have been fitted elsewhere (Armstrong-Hélouvry, Dupont and
//! Canudas de Wit 1994), so δ is a parameter, limited to [0.1, 4]. With δ < 1 the slope g′ is infinite at v = 0, but v·g′(v) is finite everywhere, so solvers use that.
//! Monotonically falling by construction; the measured bell (Fig. 27) is in [`super::static_curve`].

use crate::error::{ParameterError, require};
use crate::real::Real;

/// Parameters of g(v), in physical units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StribeckParameters<T> {
    /// Coulomb friction coefficient a0, > 0.
    pub a0: T,
    /// Static minus Coulomb friction coefficient a1, ≥ 0.
    pub a1: T,
    /// Stribeck speed v0, m/s, > 0.
    pub v0_m_s: T,
    /// Exponent δ, 0.1 to 4.
    pub delta: T,
    /// Road factor θ, > 0.
    pub theta: T,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Exponent<T> {
    Half,
    One,
    Two,
    Any(T),
}

/// g(v), prepared for evaluation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stribeck<T> {
    coulomb: T,
    excess: T,
    inverse_v0: T,
    exponent: Exponent<T>,
    delta: T,
}

impl<T: Real> Stribeck<T> {
    /// Prepares the curve, or names the parameter that is out of range.
    pub fn new(p: &StribeckParameters<T>) -> Result<Self, ParameterError> {
        let a0 = require("a0", p.a0, p.a0 > T::ZERO && p.a0 <= T::from_f64(10.0), "0 < a0 <= 10")?;
        let a1 = require("a1", p.a1, p.a1 >= T::ZERO && p.a1 <= T::from_f64(10.0), "0 <= a1 <= 10")?;
        let v0_allowed = p.v0_m_s >= T::from_f64(1e-6) && p.v0_m_s <= T::from_f64(100.0);
        let v0 = require("v0_m_s", p.v0_m_s, v0_allowed, "1e-6 to 100 m/s")?;
        let delta_allowed = p.delta >= T::from_f64(0.1) && p.delta <= T::from_f64(4.0);
        let delta = require("delta", p.delta, delta_allowed, "0.1 to 4")?;
        let theta_allowed = p.theta > T::ZERO && p.theta <= T::from_f64(10.0);
        let theta = require("theta", p.theta, theta_allowed, "0 < theta <= 10")?;
        let exponent = if delta == T::HALF {
            Exponent::Half
        } else if delta == T::ONE {
            Exponent::One
        } else if delta == T::from_f64(2.0) {
            Exponent::Two
        } else {
            Exponent::Any(delta)
        };
        Ok(Self { coulomb: theta * a0, excess: theta * a1, inverse_v0: T::ONE / v0, exponent, delta })
    }

    /// (|v|/v0)^δ
    #[inline]
    fn power(&self, speed_m_s: T) -> T {
        let x = speed_m_s.abs() * self.inverse_v0;
        match self.exponent {
            Exponent::Half => x.sqrt(),
            Exponent::One => x,
            Exponent::Two => x * x,
            Exponent::Any(delta) => x.powf(delta),
        }
    }

    /// g(v), the friction coefficient of steady sliding at `speed_m_s`.
    #[inline]
    pub fn coefficient(&self, speed_m_s: T) -> T {
        self.coulomb + self.excess * (-self.power(speed_m_s)).exp()
    }

    /// (g(v), v·g′(v)); the second is ≤ 0 and finite for every δ.
    #[inline]
    pub fn coefficient_and_slope(&self, speed_m_s: T) -> (T, T) {
        let q = self.power(speed_m_s);
        let falling = self.excess * (-q).exp();
        (self.coulomb + falling, -(self.delta * q * falling))
    }

    /// Largest coefficient, g(0).
    pub fn largest(&self) -> T {
        self.coulomb + self.excess
    }

    /// Smallest coefficient, the limit of g at high speed.
    pub fn smallest(&self) -> T {
        self.coulomb
    }

    /// Whether v·g(v) rises strictly: a0 > a1·δ·exp(−(1 + 1/δ)).
    ///
    /// Derivation: (v g)′ = a0 + a1 e^{−q}(1 − δq) with q = (v/v0)^δ is least at q = 1 + 1/δ.
    pub fn momentum_rises(&self) -> bool {
        let bound = self.excess * self.delta * (-(T::ONE + T::ONE / self.delta)).exp();
        self.coulomb > bound
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parameters() -> StribeckParameters<f64> {
        StribeckParameters { a0: 0.5, a1: 0.7, v0_m_s: 0.5, delta: 0.5, theta: 1.0 }
    }

    #[test]
    fn the_curve_falls_from_a0_plus_a1_to_a0() {
        let g = Stribeck::new(&parameters()).unwrap();
        assert_eq!(g.coefficient(0.0), 1.2);
        assert!((g.coefficient(0.5) - (0.5 + 0.7 * (-1.0f64).exp())).abs() < 1e-15);
        assert!((g.coefficient(1e6) - 0.5).abs() < 1e-12);
        assert_eq!(g.coefficient(-0.3), g.coefficient(0.3));
    }

    #[test]
    fn every_exponent_has_the_slope_of_its_difference_quotient() {
        for delta in [0.1, 0.25, 0.5, 0.7, 1.0, 1.5, 2.0, 3.0, 4.0] {
            let g = Stribeck::new(&StribeckParameters { delta, ..parameters() }).unwrap();
            for v in [1e-3, 0.02, 0.4, 3.0] {
                let h = v * 1e-6;
                let slope = (g.coefficient(v + h) - g.coefficient(v - h)) / (2.0 * h) * v;
                let (_, exact) = g.coefficient_and_slope(v);
                assert!((slope - exact).abs() < 1e-8, "delta {delta}, v {v}: {slope} against {exact}");
            }
        }
    }

    #[test]
    fn the_bound_for_a_rising_momentum_is_the_one_found_by_search() {
        for delta in [0.5, 1.0, 2.0, 4.0] {
            let bound = delta * (-(1.0f64 + 1.0 / delta)).exp();
            for (a0, expected) in [(bound * 1.01, true), (bound * 0.99, false)] {
                let g = Stribeck::new(&StribeckParameters { a0, a1: 1.0, delta, ..parameters() }).unwrap();
                let mut rises = true;
                let mut last = 0.0;
                for k in 1..20_000 {
                    let v = 0.5 * f64::from(k) * 1e-3;
                    let h = v * g.coefficient(v);
                    rises &= h > last;
                    last = h;
                }
                assert_eq!((g.momentum_rises(), rises), (expected, expected), "delta {delta}, a0 {a0}");
            }
        }
    }

    #[test]
    fn each_parameter_out_of_range_is_named_with_what_is_allowed() {
        let p = parameters();
        for (bad, name) in [
            (StribeckParameters { a0: 0.0, ..p }, "a0"),
            (StribeckParameters { a1: -0.1, ..p }, "a1"),
            (StribeckParameters { v0_m_s: -1.0, ..p }, "v0_m_s"),
            (StribeckParameters { delta: 0.05, ..p }, "delta"),
            (StribeckParameters { delta: 4.1, ..p }, "delta"),
            (StribeckParameters { theta: f64::NAN, ..p }, "theta"),
        ] {
            let error = Stribeck::new(&bad).unwrap_err();
            assert_eq!(error.name, name);
            assert!(!error.allowed.is_empty());
        }
    }
}
