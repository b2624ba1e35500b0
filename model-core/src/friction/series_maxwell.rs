//! Filled rubber in series with LuGre bristles: the series element with a spectrum of Maxwell branches in its block.
//!
//! F = k_u u + c_u u̇ + Σ f_i,  ḟ_i = k_i u̇ − f_i/τ_i,  F = σ0 z + σ1 ż + F_N a2 v,  u̇ = v_r − v
//!
//! Kelvin–Voigt, k_u and c_u alone, has tan δ = ω c_u/k_u: with the assumed numbers 0.03 at 1 Hz and 3.4 at 100 Hz, where
//! filled tread rubber has 0.1 to 0.3 throughout (C. Wrana, "Polymerphysik", Springer 2014; A. Gent, "Engineering with
//! Rubber", Hanser 2012). [`BRANCHES`] branches, one a decade from 1 ms to 1 s, with k_i = `branch_ratio` k_u (τ_i/1 s)^−β
//! give a loss that hardly depends on frequency: the discrete form of a fractional element (spring-pot) of order β.
//!
//! **Temperature** shifts time by Williams–Landel–Ferry, log₁₀ a_T = −C1 (T − T_s)/(C2 + T − T_s) with the universal
//! C1 = 8.86, C2 = 101.6 K for T_s = T_g + 50 K (J. Amer. Chem. Soc. 77 (1955) 3701), T_g = −50 °C assumed; it shifts the
//! branches and, after Grosch (Proc. Royal Soc. A 274 (1963) 21), the speed scale of the friction curve alike. Relative to
//! 20 °C, where the parameters hold.
//!
//! **Step**: as [`super::series`], the branches exact for a rate held over the step. Left out: the strain dependence of
//! filled rubber (Payne), self-heating (the effect `thermal_fade` has it).

use super::contact::{Contact, FrictionForce};
use super::element::{Element, ParameterSpec, does_what, exactly};
use super::lugre::{LugreParameters, and_bristles};
use super::series::{Series, SeriesParameters, SeriesState};
use super::stribeck::Stribeck;
use crate::error::{ParameterError, require};
use crate::real::Real;

/// Branches of the spectrum.
pub const BRANCHES: usize = 4;

/// Relaxation times at 20 °C, s.
const TIMES_S: [f64; BRANCHES] = [1e-3, 1e-2, 1e-1, 1.0];

/// Filled rubber in series with bristles, prepared for a step size.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SeriesMaxwell<T>(Series<T, BRANCHES>);

/// log₁₀ a_T relative to 20 °C.
pub fn shift_decades(temperature_c: f64) -> f64 {
    let at = |c: f64| -8.86 * c / (101.6 + c);
    at(temperature_c) - at(20.0)
}

/// Loss tangent of a block with these Maxwell branches (stiffness N/m, time s) at a frequency.
#[must_use]
pub fn loss_tangent(k_u_n_per_m: f64, c_u_n_s_per_m: f64, branches: &[(f64, f64)], frequency_hz: f64) -> f64 {
    let omega = core::f64::consts::TAU * frequency_hz;
    let (mut storage, mut loss) = (k_u_n_per_m, c_u_n_s_per_m * omega);
    for (k, time_s) in branches {
        let x = omega * time_s;
        storage += k * x * x / (1.0 + x * x);
        loss += k * x / (1.0 + x * x);
    }
    loss / storage
}

/// Stiffness (N/m) and relaxation time (s) of each branch.
#[must_use]
pub fn branches(
    k_u_n_per_m: f64,
    branch_ratio: f64,
    beta: f64,
    temperature_c: f64,
) -> [(f64, f64); BRANCHES] {
    let slower = libm::exp(core::f64::consts::LN_10 * shift_decades(temperature_c));
    TIMES_S.map(|t| (k_u_n_per_m * branch_ratio * libm::exp(-beta * libm::log(t)), t * slower))
}

impl<T: Real> Element<T> for SeriesMaxwell<T> {
    type State = SeriesState<T, BRANCHES>;

    const PARAMETERS: &'static [ParameterSpec] = &and_bristles::<5, 13>([
        ParameterSpec::required("k_u_n_per_m", 3e4).searched(1e3, 1e6).extensive(),
        ParameterSpec::optional("c_u_n_s_per_m", 5.0).searched(0.1, 1e4).extensive(),
        ParameterSpec::required("branch_ratio", 0.2).searched(1e-3, 5.0),
        ParameterSpec::optional("beta", 0.1).searched(0.0, 0.5),
        ParameterSpec::optional("temperature_c", 20.0),
    ]);

    fn build(values: &[T], step_s: T) -> Result<Self, ParameterError> {
        let all: [T; 13] = exactly(values)?;
        let [bristles @ .., k_u_n_per_m, c_u_n_s_per_m, ratio, beta, temperature_c] = all;
        let mut bristles = LugreParameters::from_values(&bristles)?;
        let number = |value: T| value.to_f64();
        let ratio_ok = ratio >= T::ZERO && ratio <= T::from_f64(100.0);
        require("branch_ratio", ratio, ratio_ok, "0 to 100 of k_u_n_per_m")?;
        require("beta", beta, beta >= T::ZERO && beta <= T::ONE, "0 to 1")?;
        let warm = temperature_c >= T::from_f64(-20.0) && temperature_c <= T::from_f64(150.0);
        require("temperature_c", temperature_c, warm, "-20 to 150 °C")?;
        Series::new(&SeriesParameters { k_u_n_per_m, c_u_n_s_per_m, bristles }, step_s)?;
        // Warm rubber is fast rubber: the same friction at a higher speed.
        let slower = libm::exp(core::f64::consts::LN_10 * shift_decades(number(temperature_c)));
        bristles.stribeck.v0_m_s = bristles.stribeck.v0_m_s / T::from_f64(slower);
        let branches = branches(number(k_u_n_per_m), number(ratio), number(beta), number(temperature_c));
        let branches = branches.map(|(k, t)| (T::from_f64(k), T::from_f64(t)));
        let block = SeriesParameters { k_u_n_per_m, c_u_n_s_per_m, bristles };
        Series::with_branches(&block, branches, step_s).map(Self)
    }

    does_what!(0 does, with SeriesState<T, BRANCHES>);
}
