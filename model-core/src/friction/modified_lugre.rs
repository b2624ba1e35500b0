//! The modified LuGre model as printed, eqs. 17–19.
//!
//! u̇ = v_r − σ0 |v_r| u / (F_N g(s)) − rω ∂u/∂s_path,   s = v_r − u̇
//!
//! g is evaluated at s, which holds u̇ itself, so a step is an implicit equation. Eq. 18 as typeset
//! is ambiguous; it is read as exp(−(|v_r − u̇|/v0)^δ), consistent with eq. 13. Eqs. 15 and 19 drop
//! F_N; here σ0 is in N/m and F_N is kept, so that the parameters are those of the LuGre model.
//!
//! **One root, no overshoot.** Without convection s·g(s) = (σ0/F_N) u |v_r|. Where
//! a0 > a1 δ exp(−(1 + 1/δ)) the left side rises strictly, so s is a function of u, and
//! u̇ = v_r − s(u) is scalar and autonomous: u rises monotonically to F_N g(v_r)/σ0. The paper's
//! overshoot appears when g is taken at the previous step's u̇ ([`Scheme::Lagged`]) with a coarse
//! step; it is a property of that integrator, not of the model.

use super::contact::{Contact, FrictionForce};
use super::element::{Element, ParameterSpec};
use super::lugre::{self, LugreParameters, require_step};
use super::registry::FrictionModel;
use super::stribeck::Stribeck;
use crate::error::{ParameterError, require};
use crate::real::Real;

/// How the implicit equation is treated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Scheme {
    /// Backward Euler with the implicit equation solved for its one root.
    #[default]
    Implicit,
    /// g at the previous step's u̇, explicit. Kept to show the overshoot it makes; do not use.
    Lagged,
}

/// Modified LuGre model, prepared for a step size.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ModifiedLugre<T> {
    stribeck: Stribeck<T>,
    sigma0: T,
    pub(crate) inverse_sigma0: T,
    sigma1: T,
    a2: T,
    step_s: T,
    inverse_step: T,
    scheme: Scheme,
}

/// State of the modified LuGre model.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ModifiedLugreState<T> {
    /// Deflection u, m.
    pub deflection_m: T,
    /// Its last rate u̇, m/s.
    pub rate_m_s: T,
}

/// Newton or bisection steps of the scalar equation; eight are usual at most.
const MOST_ITERATIONS: u32 = 40;

impl<T: Real> ModifiedLugre<T> {
    /// Prepares the model for a step of `step_s` seconds, or names the parameter out of range.
    ///
    /// Parameters for which the implicit equation could have several roots are refused under the
    /// name `a0`.
    pub fn new(p: &LugreParameters<T>, step_s: T) -> Result<Self, ParameterError> {
        let lugre = lugre::Lugre::new(p, step_s)?;
        let one_root = lugre.stribeck.momentum_rises();
        require("a0", p.stribeck.a0, one_root, "a0 > a1 delta exp(-(1 + 1/delta)), else several roots")?;
        let mut model = Self {
            stribeck: lugre.stribeck,
            sigma0: lugre.sigma0,
            inverse_sigma0: lugre.inverse_sigma0,
            sigma1: lugre.sigma1,
            a2: lugre.a2,
            step_s,
            inverse_step: T::ONE,
            scheme: Scheme::Implicit,
        };
        model.set_step_s(require_step(step_s)?);
        Ok(model)
    }

    /// The same model with another treatment of the implicit equation.
    #[must_use]
    pub fn with_scheme(self, scheme: Scheme) -> Self {
        Self { scheme, ..self }
    }

    /// Changes the step size, s, for unevenly sampled inputs. The caller keeps it positive.
    #[inline]
    pub fn set_step_s(&mut self, step_s: T) {
        self.step_s = step_s;
        self.inverse_step = T::ONE / step_s;
    }

    /// Largest deflection that the load allows, m.
    pub fn largest_deflection_m(&self, normal_force_n: T) -> T {
        normal_force_n.at_least(T::ZERO) * self.stribeck.largest() * self.inverse_sigma0
    }

    /// The curve of steady sliding.
    pub fn stribeck(&self) -> &Stribeck<T> {
        &self.stribeck
    }

    /// Advances the deflection by one step and returns the friction force.
    #[inline]
    pub fn step(&self, state: &mut ModifiedLugreState<T>, contact: &Contact<T>) -> FrictionForce<T> {
        self.step_convected(state, contact, T::ZERO, T::ZERO)
    }

    /// As [`Self::step`] for one element of a patch: `courant` = rωΔt/Δs times the difference to
    /// the element before it is carried along; `upstream_m` is that element's deflection.
    #[inline]
    pub(crate) fn step_convected(
        &self,
        state: &mut ModifiedLugreState<T>,
        contact: &Contact<T>,
        courant: T,
        upstream_m: T,
    ) -> FrictionForce<T> {
        let v = contact.sliding_speed_m_s;
        let load = contact.load_n();
        if load <= T::ZERO {
            *state = ModifiedLugreState::default();
            return FrictionForce { force_n: T::ZERO, tip_speed_m_s: v };
        }
        let u = state.deflection_m;
        let carried = u - courant * (u - upstream_m);
        let gain = self.sigma0 * v.abs() / load;
        let next = match self.scheme {
            // u⁺ = carried + Δt (v − s),  s g(s) = gain u⁺
            Scheme::Implicit => {
                let free = carried + self.step_s * v;
                let held = gain * self.step_s;
                let s = self.root(gain * free, held);
                // Two forms of the same number; each is free of cancellation where it is used.
                if held > T::ONE { s * self.stribeck.coefficient(s) / gain } else { free - self.step_s * s }
            }
            Scheme::Lagged => {
                let g = self.stribeck.coefficient(v - state.rate_m_s);
                carried + self.step_s * (v - gain * u / g)
            }
        };
        let rate = (next - u) * self.inverse_step;
        *state = ModifiedLugreState { deflection_m: next, rate_m_s: rate };
        FrictionForce {
            force_n: self.sigma0 * next + self.sigma1 * rate + load * self.a2 * v,
            tip_speed_m_s: v - rate,
        }
    }

    /// The root of s g(s) + b s = r; the left side rises strictly for b ≥ 0.
    #[inline]
    fn root(&self, r: T, b: T) -> T {
        let size = r.abs();
        if size == T::ZERO {
            return T::ZERO;
        }
        let mut low = size / (self.stribeck.largest() + b);
        let mut high = size / (self.stribeck.smallest() + b);
        let mut s = low;
        for _ in 0..MOST_ITERATIONS {
            let (g, slope) = self.stribeck.coefficient_and_slope(s);
            let value = s * (g + b) - size;
            if value > T::ZERO {
                high = s;
            } else {
                low = s;
            }
            let newton = s - value / (g + slope + b);
            let next = if newton >= low && newton <= high { newton } else { T::HALF * (low + high) };
            let moved = (next - s).abs();
            s = next;
            if moved <= T::from_f64(2.0) * T::EPSILON * s {
                break;
            }
        }
        s.copysign(r)
    }
}

impl<T: Real> FrictionModel<T> {
    /// A modified LuGre element.
    pub fn modified_lugre(p: &LugreParameters<T>, step_s: T) -> Result<Self, ParameterError> {
        ModifiedLugre::new(p, step_s).map(Self::ModifiedLugre)
    }
}

impl<T: Real> Element<T> for ModifiedLugre<T> {
    type State = ModifiedLugreState<T>;

    const PARAMETERS: &'static [ParameterSpec] = lugre::PARAMETERS;

    fn build(values: &[T], step_s: T) -> Result<Self, ParameterError> {
        Self::new(&LugreParameters::from_values(values)?, step_s)
    }

    fn rest(&self) -> ModifiedLugreState<T> {
        ModifiedLugreState::default()
    }

    fn holding(&self, force_n: T, contact: &Contact<T>) -> ModifiedLugreState<T> {
        let most_m = self.largest_deflection_m(contact.load_n());
        ModifiedLugreState { deflection_m: (force_n * self.inverse_sigma0).within(most_m), rate_m_s: T::ZERO }
    }

    #[inline]
    fn set_step_s(&mut self, step_s: T) {
        self.set_step_s(step_s);
    }

    #[inline]
    fn step(&self, state: &mut ModifiedLugreState<T>, contact: &Contact<T>) -> FrictionForce<T> {
        self.step(state, contact)
    }

    fn deformation_m(state: &ModifiedLugreState<T>) -> T {
        state.deflection_m
    }

    fn largest_coefficient(&self) -> T {
        self.stribeck.largest()
    }

    fn sticking_stiffness_n_per_m(&self, _load_n: T) -> T {
        self.sigma0
    }

    fn stribeck(&self) -> Option<&Stribeck<T>> {
        Some(&self.stribeck)
    }

    fn winding_reach_m(&self, load_n: T) -> Option<T> {
        Some(self.largest_deflection_m(load_n))
    }
}
