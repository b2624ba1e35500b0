//! Static friction curves of Fig. 27: what LuGre can show in steady sliding, and the measured bell.
//!
//! LuGre in steady sliding gives g(v) + a2 v, largest at v = 0. The measured curve is a bell with its
//! maximum at v_m > 0. The bell here is Savkoor's (1966) for rubber:
//!
//! µ(v) = µ0 + (µ_m − µ0) exp(−h² log10²(|v|/v_m))
//!
//! Valid for steady sliding at constant temperature; µ(0) = µ0 by continuity.

use super::stribeck::{Stribeck, StribeckParameters};
use crate::error::{ParameterError, require};
use crate::real::Real;

/// Steady-state friction coefficient of LuGre over speed: g(v) + a2 |v|.
pub fn lugre_coefficient<T: Real>(stribeck: &Stribeck<T>, a2_s_per_m: T, speed_m_s: T) -> T {
    stribeck.coefficient(speed_m_s) + a2_s_per_m * speed_m_s.abs()
}

/// Parameters of the bell.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BellParameters<T> {
    /// Friction coefficient µ0 far from the maximum, > 0.
    pub mu_0: T,
    /// Largest friction coefficient µ_m, ≥ µ0.
    pub mu_m: T,
    /// Speed of the maximum v_m, m/s, > 0.
    pub v_m_m_s: T,
    /// Narrowness h, per decade of speed, > 0.
    pub h_per_decade: T,
}

/// Savkoor's bell, prepared for evaluation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bell<T> {
    base: T,
    rise: T,
    inverse_v_m: T,
    /// (h/ln 10)²
    narrowness: T,
}

impl<T: Real> Bell<T> {
    /// Prepares the curve, or names the parameter out of range.
    pub fn new(p: &BellParameters<T>) -> Result<Self, ParameterError> {
        let base =
            require("mu_0", p.mu_0, p.mu_0 > T::ZERO && p.mu_0 <= T::from_f64(10.0), "0 < mu_0 <= 10")?;
        let top =
            require("mu_m", p.mu_m, p.mu_m >= base && p.mu_m <= T::from_f64(10.0), "mu_0 <= mu_m <= 10")?;
        let v_ok = p.v_m_m_s >= T::from_f64(1e-6) && p.v_m_m_s <= T::from_f64(100.0);
        let v_m = require("v_m_m_s", p.v_m_m_s, v_ok, "1e-6 to 100 m/s")?;
        let h_ok = p.h_per_decade > T::ZERO && p.h_per_decade <= T::from_f64(100.0);
        let h = require("h_per_decade", p.h_per_decade, h_ok, "above 0 and up to 100 per decade")?;
        let h_e = h / T::from_f64(core::f64::consts::LN_10);
        Ok(Self { base, rise: top - base, inverse_v_m: T::ONE / v_m, narrowness: h_e * h_e })
    }

    /// µ(v).
    pub fn coefficient(&self, speed_m_s: T) -> T {
        let x = speed_m_s.abs() * self.inverse_v_m;
        if x <= T::ZERO {
            return self.base;
        }
        let l = x.ln();
        self.base + self.rise * (-(self.narrowness * l * l)).exp()
    }
}

/// Stribeck curve that follows the bell above its maximum as well as it can: for the comparison of
/// Fig. 27. `a0` is the bell's base, `a1` its rise; δ and v0 fit the falling side.
pub fn stribeck_beside<T: Real>(bell: &BellParameters<T>) -> StribeckParameters<T> {
    StribeckParameters {
        a0: bell.mu_0,
        a1: bell.mu_m - bell.mu_0,
        v0_m_s: bell.v_m_m_s * T::from_f64(10.0).powf(T::ONE / bell.h_per_decade),
        delta: T::ONE,
        theta: T::ONE,
    }
}
