//! LuGre friction, eqs. 12–14.
//!
//! ż = v − σ0 |v| z / (F_N g(v)),   F = σ0 z + σ1 ż + F_N a2 v
//!
//! With 5 µm bristles the equation is stiff: at 1 m/s the time constant is 5 µs, so explicit Euler
//! diverges at 100 µs. For v held over the step the solution is known:
//! z⁺ = e^{−λ} z + (1 − e^{−λ})/λ · vΔt, λ = Δt σ0|v|/(F_N g). It is written with expm1 because in
//! f32 1 − e^{−λ} is 1 % wrong at λ = 1e-6 and zero at 2e-8: slow creep would vanish.
//!
//! Left out: wear, temperature and everything else that changes g in time; see
//! [`Contact::road_factor`]. Without load the bristles spring back at once (z = 0).

use super::FrictionModel;
use super::contact::{Contact, FrictionForce};
use super::element::{Element, ParameterSpec, exactly};
use super::stribeck::{Stribeck, StribeckParameters};
use crate::error::{ParameterError, require};
use crate::real::Real;

/// LuGre parameters, in physical units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LugreParameters<T> {
    /// Bristle stiffness σ0, N/m, > 0.
    pub sigma0_n_per_m: T,
    /// Bristle damping σ1, N·s/m, ≥ 0.
    pub sigma1_n_s_per_m: T,
    /// Viscous coefficient a2, s/m, ≥ 0 (times normal force times speed).
    pub a2_s_per_m: T,
    /// The curve of steady sliding.
    pub stribeck: StribeckParameters<T>,
}

/// How the bristle equation is integrated over a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Scheme {
    /// Exact for a speed held over the step.
    #[default]
    ExactHold,
    /// First order, bounded for every step.
    BackwardEuler,
    /// First order, diverges for Δt σ0|v|/(F_N g) > 2. Kept to show that; do not use.
    ExplicitEuler,
}

/// Whether the model can give back more energy than it stored.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Passivity<T> {
    /// a2 F_N ≥ σ1 (g_max − g_min)/g_min: passive at this normal force.
    Guaranteed,
    /// Not guaranteed; it would be with a viscous coefficient of at least this, s/m.
    NeedsViscous {
        /// The least a2 that guarantees passivity, s/m.
        a2_s_per_m: T,
    },
}

impl<T: Real> LugreParameters<T> {
    /// The sufficient condition for passivity at one normal force (N).
    pub fn passivity(&self, normal_force_n: T) -> Passivity<T> {
        let g_min = self.stribeck.a0;
        let needed = self.sigma1_n_s_per_m * self.stribeck.a1 / g_min / normal_force_n;
        if self.a2_s_per_m >= needed {
            Passivity::Guaranteed
        } else {
            Passivity::NeedsViscous { a2_s_per_m: needed }
        }
    }
}

/// LuGre model, prepared for a step size.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lugre<T> {
    pub(crate) stribeck: Stribeck<T>,
    pub(crate) sigma0: T,
    pub(crate) inverse_sigma0: T,
    pub(crate) sigma1: T,
    pub(crate) a2: T,
    pub(crate) step_s: T,
    scheme: Scheme,
}

/// State of the LuGre model.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct LugreState<T> {
    /// Bristle deflection z, m.
    pub deflection_m: T,
}

/// Accepts a step size from 1 ns to 0.1 s.
pub(crate) fn require_step<T: Real>(step_s: T) -> Result<T, ParameterError> {
    let ok = step_s >= T::from_f64(1e-9) && step_s <= T::from_f64(0.1);
    require("step_s", step_s, ok, "1e-9 to 0.1 s")
}

impl<T: Real> Lugre<T> {
    /// Prepares the model for a step of `step_s` seconds, or names the parameter out of range.
    pub fn new(p: &LugreParameters<T>, step_s: T) -> Result<Self, ParameterError> {
        let s0 = p.sigma0_n_per_m;
        let s0_allowed = s0 >= T::ONE && s0 <= T::from_f64(1e10);
        let sigma0 = require("sigma0_n_per_m", s0, s0_allowed, "1 to 1e10 N/m")?;
        let s1 = p.sigma1_n_s_per_m;
        let s1_allowed = s1 >= T::ZERO && s1 <= T::from_f64(1e6);
        let sigma1 = require("sigma1_n_s_per_m", s1, s1_allowed, "0 to 1e6 N s/m")?;
        let a2_allowed = p.a2_s_per_m >= T::ZERO && p.a2_s_per_m <= T::from_f64(100.0);
        let a2 = require("a2_s_per_m", p.a2_s_per_m, a2_allowed, "0 to 100 s/m")?;
        Ok(Self {
            stribeck: Stribeck::new(&p.stribeck)?,
            sigma0,
            inverse_sigma0: T::ONE / sigma0,
            sigma1,
            a2,
            step_s: require_step(step_s)?,
            scheme: Scheme::ExactHold,
        })
    }

    /// The same model with another integration scheme.
    #[must_use]
    pub fn with_scheme(self, scheme: Scheme) -> Self {
        Self { scheme, ..self }
    }

    /// Changes the step size, s, for unevenly sampled inputs. The caller keeps it positive.
    #[inline]
    pub fn set_step_s(&mut self, step_s: T) {
        self.step_s = step_s;
    }

    /// Largest bristle deflection that the load allows, m: F_N g_max/σ0.
    pub fn largest_deflection_m(&self, normal_force_n: T) -> T {
        normal_force_n.at_least(T::ZERO) * self.stribeck.largest() * self.inverse_sigma0
    }

    /// The curve of steady sliding.
    pub fn stribeck(&self) -> &Stribeck<T> {
        &self.stribeck
    }

    /// Advances the bristles by one step and returns the friction force.
    #[inline]
    pub fn step(&self, state: &mut LugreState<T>, contact: &Contact<T>) -> FrictionForce<T> {
        let v = contact.sliding_speed_m_s;
        let load = contact.load_n();
        if load <= T::ZERO {
            state.deflection_m = T::ZERO;
            return FrictionForce { force_n: T::ZERO, tip_speed_m_s: v };
        }
        let z = state.deflection_m;
        let sliding_limit = load * self.stribeck.coefficient(v) * self.inverse_sigma0;
        let rate = v.abs() / sliding_limit;
        let lambda = self.step_s * rate;
        let next = match self.scheme {
            Scheme::ExactHold => {
                let steady = sliding_limit.copysign(v);
                let gone = -(-lambda).exp_m1();
                z - gone * z + gone * steady
            }
            Scheme::BackwardEuler => (z + self.step_s * v) / (T::ONE + lambda),
            Scheme::ExplicitEuler => z + self.step_s * v - lambda * z,
        };
        state.deflection_m = next;
        let deflection_rate = v - rate * next;
        FrictionForce {
            force_n: self.sigma0 * next + self.sigma1 * deflection_rate + contact.viscous_n(self.a2, v),
            tip_speed_m_s: v,
        }
    }
}

/// Parameters of LuGre's bristles, which other models have too.
pub(super) const PARAMETERS: &[ParameterSpec] = &BRISTLES;

/// What a model slides with: the Stribeck curve and the viscous part.
const CURVE: [ParameterSpec; 6] = [
    ParameterSpec::required("a0", 0.5).searched(0.02, 5.0),
    ParameterSpec::required("a1", 0.7).searched(0.0, 4.0),
    ParameterSpec::optional("a2_s_per_m", 0.0).searched(0.0, 3.0),
    ParameterSpec::required("v0_m_s", 0.5).searched(2e-3, 10.0),
    ParameterSpec::optional("delta", 0.5),
    ParameterSpec::optional("theta", 1.0),
];

const BRISTLES: [ParameterSpec; 8] = and_curve([
    ParameterSpec::required("sigma0_n_per_m", 1.76e7).searched(1e4, 1e9).extensive(),
    ParameterSpec::optional("sigma1_n_s_per_m", 0.0).extensive(),
]);

/// What sticks, two parameters, followed by the curve that it slides with.
pub(super) const fn and_curve(first: [ParameterSpec; 2]) -> [ParameterSpec; 8] {
    let [a, b] = first;
    let [c, d, e, f, g, h] = CURVE;
    [a, b, c, d, e, f, g, h]
}

/// The bristles' parameters followed by those of what carries them; `N` is the number of all.
pub(super) const fn and_bristles<const M: usize, const N: usize>(
    more: [ParameterSpec; M],
) -> [ParameterSpec; N] {
    let mut all = [BRISTLES[0]; N];
    let mut k = 0;
    while k < N {
        all[k] = if k < BRISTLES.len() { BRISTLES[k] } else { more[k - BRISTLES.len()] };
        k += 1;
    }
    all
}

/// The bristles and the `M` values that follow them.
pub(super) fn bristles_and<T: Real, const M: usize>(
    values: &[T],
) -> Result<(LugreParameters<T>, [T; M]), ParameterError> {
    let (bristles, more) = values.split_at(values.len().min(BRISTLES.len()));
    Ok((LugreParameters::from_values(bristles)?, exactly(more)?))
}

impl<T: Real> LugreParameters<T> {
    /// In the order of [`Element::PARAMETERS`].
    pub(super) fn values(&self) -> [T; 8] {
        let s = &self.stribeck;
        let (sigma0, sigma1, a2) = (self.sigma0_n_per_m, self.sigma1_n_s_per_m, self.a2_s_per_m);
        [sigma0, sigma1, s.a0, s.a1, a2, s.v0_m_s, s.delta, s.theta]
    }

    /// From as many values in that order.
    pub(super) fn from_values(values: &[T]) -> Result<Self, ParameterError> {
        let [sigma0_n_per_m, sigma1_n_s_per_m, a0, a1, a2_s_per_m, v0_m_s, delta, theta] = exactly(values)?;
        let stribeck = StribeckParameters { a0, a1, v0_m_s, delta, theta };
        Ok(Self { sigma0_n_per_m, sigma1_n_s_per_m, a2_s_per_m, stribeck })
    }
}

impl<T: Real> FrictionModel<T> {
    /// A LuGre element.
    pub fn lugre(p: &LugreParameters<T>, step_s: T) -> Result<Self, ParameterError> {
        Lugre::new(p, step_s).map(Self::Lugre)
    }
}

impl<T: Real> Element<T> for Lugre<T> {
    type State = LugreState<T>;

    const PARAMETERS: &'static [ParameterSpec] = PARAMETERS;

    fn build(values: &[T], step_s: T) -> Result<Self, ParameterError> {
        Self::new(&LugreParameters::from_values(values)?, step_s)
    }

    fn rest(&self) -> LugreState<T> {
        LugreState::default()
    }

    fn holding(&self, force_n: T, contact: &Contact<T>) -> LugreState<T> {
        let most_m = self.largest_deflection_m(contact.load_n());
        LugreState { deflection_m: (force_n * self.inverse_sigma0).within(most_m) }
    }

    #[inline]
    fn set_step_s(&mut self, step_s: T) {
        self.set_step_s(step_s);
    }

    #[inline]
    fn step(&self, state: &mut LugreState<T>, contact: &Contact<T>) -> FrictionForce<T> {
        self.step(state, contact)
    }

    fn deformation_m(state: &LugreState<T>) -> T {
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
}
