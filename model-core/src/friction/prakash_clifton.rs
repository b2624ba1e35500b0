//! Prakash–Clifton friction: LuGre whose asperities feel a change of the normal force only over a distance of sliding.
//!
//! Ṅ = (|v| + V₊)/L · (F_N − N),  ż = v − σ0 |v| z/(N g(v)),  F = σ0 z + σ1 ż + N a2 v
//!
//! N is the load that the contact feels, L the `memory_length_m` of sliding over which it follows, V₊ the `creep_speed_m_s`
//! that lets it follow at rest, too. After a step of the load at constant speed friction has no jump: it goes to its new value
//! as e^{−x/L} of the way slid, where the memory of rate and state ([`super::rate_state`], Linker and Dieterich) keeps a part
//! of the jump.
//!
//! Sources: V. Prakash, R. Clifton, "Time resolved dynamic friction measurements in pressure-shear", ASME AMD 165 (1993)
//! 33–48; V. Prakash, J. Tribology 120 (1998) 97–102; with the speed V₊, without which a standing contact would never feel its
//! load: A. Cochard, J. Rice, J. Geophysical Research 105 (2000) 25891–25907. Measured on metals: for rubber L is assumed.
//!
//! **Step**: N exact for held speed and a load that changes linearly, z exact for the mean of N over the step: second
//! order. A contact is born with the load at the end of the step in which it touches (at the next step size another one:
//! it is forgotten after L of sliding); without load the bristles spring back at once and all is forgotten. Overshoot at
//! constant speed and load: none, as LuGre.

use super::contact::{Contact, FrictionForce};
use super::element::{Element, ParameterSpec, curve_and_stiffness_of};
use super::lugre::{Lugre, LugreState, and_bristles, bristles_and};
use super::stribeck::Stribeck;
use crate::error::{ParameterError, require};
use crate::real::Real;

/// LuGre with a memory of its load, prepared for a step size.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PrakashClifton<T> {
    bristles: Lugre<T>,
    inverse_length: T,
    creep_speed_m_s: T,
}

/// State of the model.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct PrakashCliftonState<T> {
    /// Bristle deflection z, m.
    pub deflection_m: T,
    /// Load N that the contact feels, N; 0 without contact.
    pub felt_n: T,
    /// Load at the end of the last step, N.
    pub load_n: T,
}

impl<T: Real> Element<T> for PrakashClifton<T> {
    type State = PrakashCliftonState<T>;

    const PARAMETERS: &'static [ParameterSpec] = &and_bristles::<2, 10>([
        ParameterSpec::required("memory_length_m", 1e-3).searched(1e-6, 1e-1),
        ParameterSpec::optional("creep_speed_m_s", 1e-6),
    ]);

    fn build(values: &[T], step_s: T) -> Result<Self, ParameterError> {
        let (bristles, [length, creep]) = bristles_and(values)?;
        let length_ok = length >= T::from_f64(1e-7) && length <= T::from_f64(10.0);
        let creep_ok = creep >= T::from_f64(1e-9) && creep <= T::ONE;
        Ok(Self {
            bristles: Lugre::new(&bristles, step_s)?,
            inverse_length: T::ONE / require("memory_length_m", length, length_ok, "1e-7 to 10 m")?,
            creep_speed_m_s: require("creep_speed_m_s", creep, creep_ok, "1e-9 to 1 m/s")?,
        })
    }

    fn rest(&self) -> PrakashCliftonState<T> {
        PrakashCliftonState::default()
    }

    fn holding(&self, force_n: T, contact: &Contact<T>) -> PrakashCliftonState<T> {
        let load_n = contact.normal_force_n.at_least(T::ZERO);
        let LugreState { deflection_m } = Element::holding(&self.bristles, force_n, contact);
        PrakashCliftonState { deflection_m, felt_n: load_n, load_n }
    }

    fn set_step_s(&mut self, step_s: T) {
        self.bristles.set_step_s(step_s);
    }

    fn step(&self, state: &mut PrakashCliftonState<T>, contact: &Contact<T>) -> FrictionForce<T> {
        let v = contact.sliding_speed_m_s;
        let load_n = contact.normal_force_n;
        if contact.load_n() <= T::ZERO {
            *state = PrakashCliftonState::default();
            return FrictionForce { force_n: T::ZERO, tip_speed_m_s: v };
        }
        let b = &self.bristles;
        let (last_n, before_n) =
            if state.felt_n <= T::ZERO { (load_n, load_n) } else { (state.load_n, state.felt_n) };
        let reach = b.step_s * (v.abs() + self.creep_speed_m_s) * self.inverse_length;
        let followed = -(-reach).exp_m1();
        // As a sum of changes, so that slow creep is not lost beside the load in f32.
        let felt_n =
            before_n + followed * (last_n - before_n) + (load_n - last_n) * (T::ONE - followed / reach);
        let mean_n = T::HALF * (before_n + felt_n) * contact.road_factor;
        let limit_m = mean_n * b.stribeck.coefficient(v) * b.inverse_sigma0;
        let rate = v.abs() / limit_m;
        let gone = -(-(b.step_s * rate)).exp_m1();
        let z = state.deflection_m;
        let deflection_m = z - gone * z + gone * limit_m.copysign(v);
        *state = PrakashCliftonState { deflection_m, felt_n, load_n };
        let deflection_rate = v - rate * deflection_m;
        FrictionForce {
            force_n: b.sigma0 * deflection_m + b.sigma1 * deflection_rate + felt_n * b.a2 * v,
            tip_speed_m_s: v,
        }
    }

    fn deformation_m(state: &PrakashCliftonState<T>) -> T {
        state.deflection_m
    }

    curve_and_stiffness_of!(bristles);
}
