//! Elasto-plastic friction: LuGre whose bristles are purely elastic up to a breakaway deflection, so they do not drift.
//!
//! ż = v (1 − α(z, v) z/z_ss),  z_ss = F_N g(v)/σ0 · sign(v),  F = σ0 z + σ1 ż + F_N a2 v
//!
//! α = 0 where z and v have opposite signs or |z| ≤ z_ba; 1 where |z| ≥ |z_ss|; between them
//! ½ + ½ sin(π (|z| − (z_ba + |z_ss|)/2)/(|z_ss| − z_ba)). z_ba is a share of |z_ss|.
//!
//! Source: P. Dupont, V. Hayward, B. Armstrong, F. Altpeter, "Single state elastoplastic friction models", IEEE Trans.
//! Automatic Control 47 (2002) 787–792. **Step**: LuGre's exact step with α at the middle, found by a half step: second
//! order, and it goes to z_ss however stiff the bristles.

use super::contact::{Contact, FrictionForce};
use super::element::{Element, ParameterSpec, curve_and_stiffness_of};
use super::lugre::{Lugre, LugreState, and_bristles, bristles_and};
use super::stribeck::Stribeck;
use crate::error::{ParameterError, require};
use crate::real::Real;

/// Elasto-plastic model, prepared for a step size.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ElastoPlastic<T> {
    bristles: Lugre<T>,
    breakaway: T,
}

impl<T: Real> ElastoPlastic<T> {
    /// How plastic the bristles are at deflection z under steady deflection `steady`, of v's sign.
    fn plasticity(&self, z: T, steady: T) -> T {
        let share = z / steady;
        if share <= self.breakaway {
            T::ZERO
        } else if share >= T::ONE {
            T::ONE
        } else {
            let middle = T::HALF * (T::ONE + self.breakaway);
            let phase = T::from_f64(core::f64::consts::PI) * (share - middle) / (T::ONE - self.breakaway);
            T::HALF + T::HALF * phase.sin()
        }
    }

    /// LuGre's exact step over the travel with a plasticity held.
    fn travelled(z: T, travel: T, steady: T, plasticity: T) -> T {
        let lambda = plasticity * travel / steady;
        if lambda <= T::ZERO {
            return z + travel;
        }
        let gone = -(-lambda).exp_m1();
        z - gone * z + gone * steady / plasticity
    }
}

impl<T: Real> Element<T> for ElastoPlastic<T> {
    type State = LugreState<T>;

    const PARAMETERS: &'static [ParameterSpec] =
        &and_bristles::<1, 9>([ParameterSpec::optional("breakaway_share", 0.5).searched(0.0, 0.95)]);

    fn build(values: &[T], step_s: T) -> Result<Self, ParameterError> {
        let (bristles, [breakaway]) = bristles_and(values)?;
        let allowed = breakaway >= T::ZERO && breakaway <= T::from_f64(0.99);
        Ok(Self {
            bristles: Lugre::new(&bristles, step_s)?,
            breakaway: require("breakaway_share", breakaway, allowed, "0 to 0.99 of the steady deflection")?,
        })
    }

    fn rest(&self) -> LugreState<T> {
        LugreState::default()
    }

    fn holding(&self, force_n: T, contact: &Contact<T>) -> LugreState<T> {
        Element::holding(&self.bristles, force_n, contact)
    }

    fn set_step_s(&mut self, step_s: T) {
        self.bristles.set_step_s(step_s);
    }

    fn step(&self, state: &mut LugreState<T>, contact: &Contact<T>) -> FrictionForce<T> {
        let v = contact.sliding_speed_m_s;
        let load_n = contact.load_n();
        if load_n <= T::ZERO {
            *state = LugreState::default();
            return FrictionForce { force_n: T::ZERO, tip_speed_m_s: v };
        }
        let b = &self.bristles;
        let steady = (load_n * b.stribeck.coefficient(v) * b.inverse_sigma0).copysign(v);
        let z = state.deflection_m;
        let travel = b.step_s * v;
        let middle = Self::travelled(z, T::HALF * travel, steady, self.plasticity(z, steady));
        let plasticity = self.plasticity(middle, steady);
        let mut next = Self::travelled(z, travel, steady, plasticity);
        // Held below one, plasticity would end beyond the steady deflection, which nothing reaches from inside.
        if plasticity < T::ONE && next.abs() > steady.abs() && next.sign() == v.sign() {
            next = steady.abs().at_least(z * v.sign()).at_most(next.abs()).copysign(v);
        }
        state.deflection_m = next;
        let rate = v - v.abs() * self.plasticity(next, steady) * next / steady.abs();
        FrictionForce {
            force_n: b.sigma0 * next + b.sigma1 * rate + contact.viscous_n(b.a2, v),
            tip_speed_m_s: v,
        }
    }

    fn deformation_m(state: &LugreState<T>) -> T {
        state.deflection_m
    }

    curve_and_stiffness_of!(bristles);
}
