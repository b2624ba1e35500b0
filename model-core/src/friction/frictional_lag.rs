//! Frictional lag: LuGre whose coefficient follows its curve with a delay, so that friction at a rising speed is higher
//! than at the same speed when it falls.
//!
//! τ µ̇ = g(v) − µ,  ż = v − σ0 |v| z/(F_N µ),  F = σ0 z + σ1 ż + F_N a2 v
//!
//! Source: D. Hess, A. Soom, "Friction at a lubricated line contact operating at oscillating sliding velocities", J.
//! Tribology 112 (1990) 147–152, who measured a constant delay; a first-order lag in its place is the simplest law with
//! a state. After a step of speed from rest µ starts at g(0): where τ is longer than the wind-up the force overshoots, and
//! it does so after a constant *time*, where the series element's overshoot has a constant *distance* about it.
//!
//! **Step**: µ exact for a held speed; z exact for the mean of µ over the step: second order.

use super::contact::{Contact, FrictionForce};
use super::element::{Element, ParameterSpec, curve_and_stiffness_of};
use super::lugre::{Lugre, LugreState, and_bristles, bristles_and};
use super::stribeck::Stribeck;
use crate::error::{ParameterError, require};
use crate::real::Real;

/// LuGre with a lagging coefficient, prepared for a step size.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrictionalLag<T> {
    bristles: Lugre<T>,
    inverse_lag: T,
    follows: T,
}

/// State of the model.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct FrictionalLagState<T> {
    /// Bristle deflection z, m.
    pub deflection_m: T,
    /// How far the coefficient is below that of standstill: g(0) − µ.
    pub fallen: T,
}

impl<T: Real> Element<T> for FrictionalLag<T> {
    type State = FrictionalLagState<T>;

    const PARAMETERS: &'static [ParameterSpec] =
        &and_bristles::<1, 9>([ParameterSpec::required("lag_s", 5e-3).searched(1e-4, 1.0)]);

    fn build(values: &[T], step_s: T) -> Result<Self, ParameterError> {
        let (bristles, [lag_s]) = bristles_and(values)?;
        let allowed = lag_s >= T::from_f64(1e-5) && lag_s <= T::from_f64(100.0);
        let lag_s = require("lag_s", lag_s, allowed, "1e-5 to 100 s")?;
        let bristles = Lugre::new(&bristles, step_s)?;
        let mut model = Self { bristles, inverse_lag: T::ONE / lag_s, follows: T::ZERO };
        model.set_step_s(step_s);
        Ok(model)
    }

    fn rest(&self) -> FrictionalLagState<T> {
        FrictionalLagState::default()
    }

    fn holding(&self, force_n: T, contact: &Contact<T>) -> FrictionalLagState<T> {
        let LugreState { deflection_m } = Element::holding(&self.bristles, force_n, contact);
        let curve = &self.bristles.stribeck;
        let fallen = curve.largest() - curve.coefficient(contact.sliding_speed_m_s);
        FrictionalLagState { deflection_m, fallen }
    }

    fn set_step_s(&mut self, step_s: T) {
        self.bristles.set_step_s(step_s);
        self.follows = -(-(step_s * self.inverse_lag)).exp_m1();
    }

    fn step(&self, state: &mut FrictionalLagState<T>, contact: &Contact<T>) -> FrictionForce<T> {
        let v = contact.sliding_speed_m_s;
        let load_n = contact.load_n();
        let b = &self.bristles;
        let largest = b.stribeck.largest();
        let before = state.fallen;
        state.fallen += self.follows * (largest - b.stribeck.coefficient(v) - before);
        if load_n <= T::ZERO {
            state.deflection_m = T::ZERO;
            return FrictionForce { force_n: T::ZERO, tip_speed_m_s: v };
        }
        let mu = largest - T::HALF * (before + state.fallen);
        let limit_m = load_n * mu * b.inverse_sigma0;
        let rate = v.abs() / limit_m;
        let gone = -(-(b.step_s * rate)).exp_m1();
        let z = state.deflection_m;
        state.deflection_m = z - gone * z + gone * limit_m.copysign(v);
        let deflection_rate = v - rate * state.deflection_m;
        FrictionForce {
            force_n: b.sigma0 * state.deflection_m + b.sigma1 * deflection_rate + contact.viscous_n(b.a2, v),
            tip_speed_m_s: v,
        }
    }

    fn deformation_m(state: &FrictionalLagState<T>) -> T {
        state.deflection_m
    }

    curve_and_stiffness_of!(bristles);
}
