//! A Zener block (standard linear solid) in series with LuGre bristles: the series element whose damper is elastic.
//!
//! F = k_u u + c_u u̇ + f_1,  ḟ_1 = k_1 u̇ − f_1/τ_1,  F = σ0 z + σ1 ż + F_N a2 v,  u̇ = v_r − v
//!
//! k_u is the stiffness at rest, k_u + k_1 that against a quick motion. The loss has one maximum, at ω = 1/τ_1 √(k_u/(k_u +
//! k_1)), and falls on both sides of it: right for unfilled rubber near one frequency. A small c_u, which real rubber
//! has from its fastest relaxations, keeps the tip's speed unique where the block alone cannot follow.
//!
//! **Step**: as [`super::series`], the branch exact for a rate held over the step.

use super::contact::{Contact, FrictionForce};
use super::element::{Element, ParameterSpec, does_what, exactly};
use super::lugre::{LugreParameters, and_bristles};
use super::series::{Series, SeriesParameters, SeriesState};
use super::stribeck::Stribeck;
use crate::error::{ParameterError, require};
use crate::real::Real;

/// Zener block with bristles, prepared for a step size.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SeriesZener<T>(Series<T, 1>);

impl<T: Real> Element<T> for SeriesZener<T> {
    type State = SeriesState<T, 1>;

    const PARAMETERS: &'static [ParameterSpec] = &and_bristles::<4, 12>([
        ParameterSpec::required("k_u_n_per_m", 3e4).searched(1e3, 1e6).extensive(),
        ParameterSpec::optional("c_u_n_s_per_m", 5.0).searched(0.1, 1e4).extensive(),
        ParameterSpec::required("k_1_n_per_m", 6e4).searched(1e2, 1e7).extensive(),
        ParameterSpec::required("tau_1_s", 3e-3).searched(1e-4, 10.0),
    ]);

    fn build(values: &[T], step_s: T) -> Result<Self, ParameterError> {
        let [bristles @ .., k_u_n_per_m, c_u_n_s_per_m, k_1, tau_1] = exactly::<T, 12>(values)?;
        let bristles = LugreParameters::from_values(&bristles)?;
        let k_ok = k_1 >= T::ZERO && k_1 <= T::from_f64(1e9);
        let k_1 = require("k_1_n_per_m", k_1, k_ok, "0 to 1e9 N/m")?;
        let tau_ok = tau_1 >= T::from_f64(1e-5) && tau_1 <= T::from_f64(1e3);
        let tau_1 = require("tau_1_s", tau_1, tau_ok, "1e-5 to 1e3 s")?;
        let block = SeriesParameters { k_u_n_per_m, c_u_n_s_per_m, bristles };
        Series::with_branches(&block, [(k_1, tau_1)], step_s).map(Self)
    }

    does_what!(0 does, with SeriesState<T, 1>);
}
