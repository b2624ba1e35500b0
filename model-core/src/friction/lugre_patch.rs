//! LuGre contact patch, eqs. 15–16: bristles spread over the contact length and carried along.
//!
//! ∂u/∂t = v_r − σ0 u |v_r|/g(v_r) − rω ∂u/∂s,   u(0, t) = 0,   F = F_N/L ∫ σ0 u ds + F_N a2 v_r
//!
//! Here, as in eq. 15, σ0 is per unit load (1/m). Upwind differences in s; the step is divided so
//! that Δt < Δs/|rω| (eq. 8) always holds. The relaxation term is taken implicitly, so stiffness
//! sets no limit, and the steady state is that of the differences whatever the step.
//!
//! For uniform load the steady state has a closed form:
//! F/F_N = g (1 − Z/L (1 − e^{−L/Z})), Z = g |rω|/(σ0 |v_r|); the upwind differences reach it with
//! an error of order 1/N.
//!
//! Other distributions of the load than a uniform one: [`super::pressure`].
//!
//! [`ModifiedLugrePatch`] is the same patch with eqs. 17–19 in each element.

use super::contact::Contact;
use super::lugre::{LugreParameters, require_step};
use super::modified_lugre::{ModifiedLugre, ModifiedLugreState, Scheme};
use super::stribeck::{Stribeck, StribeckParameters};
use crate::error::{ParameterError, require};
use crate::real::Real;

/// Parameters of the patch, in physical units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PatchParameters<T> {
    /// Bristle stiffness per unit load σ0, 1/m, > 0.
    pub sigma0_per_m: T,
    /// Viscous coefficient a2, s/m, ≥ 0.
    pub a2_s_per_m: T,
    /// The curve of steady sliding.
    pub stribeck: StribeckParameters<T>,
    /// Patch length L, m, > 0.
    pub length_m: T,
    /// Largest transport speed |rω| to be met, m/s: bounds the number of sub-steps.
    pub largest_transport_speed_m_s: T,
}

/// Most sub-steps that a patch may need in one step.
pub const MOST_SUBSTEPS: u32 = 1000;

/// Splits a step so that the Courant number stays below one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Transport<T> {
    inverse_spacing: T,
    step_s: T,
    most: u32,
}

impl<T: Real> Transport<T> {
    pub(crate) fn new(n: usize, length: T, fastest: T, step_s: T) -> Result<Self, ParameterError> {
        let length_ok = length >= T::from_f64(1e-4) && length <= T::from_f64(10.0);
        require("length_m", length, length_ok, "1e-4 to 10 m")?;
        #[allow(clippy::cast_precision_loss)]
        let inverse_spacing = T::from_f64(n as f64) / length;
        let courant = (fastest * step_s * inverse_spacing).to_f64();
        let fits = fastest >= T::ZERO && courant < f64::from(MOST_SUBSTEPS);
        require("largest_transport_speed_m_s", fastest, fits, ">= 0 and below 1000 element lengths a step")?;
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
        let most = courant as u32 + 1;
        Ok(Self { inverse_spacing, step_s: require_step(step_s)?, most })
    }

    /// Number of sub-steps, their length and their Courant number for a transport speed.
    ///
    /// Faster than the largest speed the patch was built for, the Courant number is held at one:
    /// transport is then slower than it should be, and stable.
    #[inline]
    pub(crate) fn split(&self, transport_speed_m_s: T) -> (u32, T, T) {
        let courant = transport_speed_m_s.abs() * self.step_s * self.inverse_spacing;
        let mut substeps = 1;
        let mut count = T::ONE;
        while count < courant && substeps < self.most {
            substeps += 1;
            count += T::ONE;
        }
        (substeps, self.step_s / count, (courant / count).at_most(T::ONE))
    }
}

/// LuGre patch of `N` elements, prepared for a step size.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LugrePatch<T, const N: usize> {
    stribeck: Stribeck<T>,
    sigma0: T,
    a2: T,
    transport: Transport<T>,
    share: T,
}

/// Deflections u of the elements, m, in the order of the path coordinate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PatchState<T, const N: usize> {
    /// Deflection of each element, m.
    pub deflection_m: [T; N],
}

impl<T: Real, const N: usize> Default for PatchState<T, N> {
    fn default() -> Self {
        Self { deflection_m: [T::ZERO; N] }
    }
}

impl<T: Real, const N: usize> LugrePatch<T, N> {
    /// Prepares the patch for a step of `step_s` seconds, or names the parameter out of range.
    pub fn new(p: &PatchParameters<T>, step_s: T) -> Result<Self, ParameterError> {
        let s0_ok = p.sigma0_per_m > T::ZERO && p.sigma0_per_m <= T::from_f64(1e9);
        let a2_ok = p.a2_s_per_m >= T::ZERO && p.a2_s_per_m <= T::from_f64(100.0);
        #[allow(clippy::cast_precision_loss)]
        let share = T::ONE / T::from_f64(N as f64);
        Ok(Self {
            stribeck: Stribeck::new(&p.stribeck)?,
            sigma0: require("sigma0_per_m", p.sigma0_per_m, s0_ok, "above 0 and up to 1e9 1/m")?,
            a2: require("a2_s_per_m", p.a2_s_per_m, a2_ok, "0 to 100 s/m")?,
            transport: Transport::new(N, p.length_m, p.largest_transport_speed_m_s, step_s)?,
            share,
        })
    }

    /// Advances the patch by one step; returns the friction force, N.
    pub fn step(&self, state: &mut PatchState<T, N>, contact: &Contact<T>, transport_speed_m_s: T) -> T {
        let v = contact.sliding_speed_m_s;
        let load = contact.load_n();
        if load <= T::ZERO {
            *state = PatchState::default();
            return T::ZERO;
        }
        let (substeps, dt, courant) = self.transport.split(transport_speed_m_s);
        let relaxation = T::ONE / (T::ONE + dt * self.sigma0 * v.abs() / self.stribeck.coefficient(v));
        let travel = dt * v;
        let advance = |u: &mut T, before: &mut T| {
            let carried = *u - courant * (*u - *before);
            *before = *u;
            *u = (carried + travel) * relaxation;
        };
        for _ in 0..substeps {
            let mut before = T::ZERO;
            if transport_speed_m_s >= T::ZERO {
                state.deflection_m.iter_mut().for_each(|u| advance(u, &mut before));
            } else {
                state.deflection_m.iter_mut().rev().for_each(|u| advance(u, &mut before));
            }
        }
        let sum = state.deflection_m.iter().fold(T::ZERO, |sum, u| sum + *u);
        load * (self.sigma0 * sum * self.share) + contact.viscous_n(self.a2, v)
    }

    /// Bristle stiffness per unit load σ0, 1/m.
    pub(super) fn stiffness_per_m(&self) -> T {
        self.sigma0
    }

    /// Viscous coefficient a2, s/m.
    pub(super) fn viscous_s_per_m(&self) -> T {
        self.a2
    }

    /// Friction coefficient of the steady state by the closed form (uniform load).
    pub fn steady_coefficient(&self, sliding_speed_m_s: T, transport_speed_m_s: T, length_m: T) -> T {
        let g = self.stribeck.coefficient(sliding_speed_m_s);
        let viscous = self.a2 * sliding_speed_m_s;
        let reach = g * transport_speed_m_s.abs() / (self.sigma0 * sliding_speed_m_s.abs() * length_m);
        if reach <= T::ZERO {
            return g.copysign(sliding_speed_m_s) + viscous;
        }
        let filled = T::ONE + reach * (-(T::ONE / reach)).exp_m1();
        (g * filled).copysign(sliding_speed_m_s) + viscous
    }
}

/// Patch of `N` modified LuGre elements (eq. 19), prepared for a step size.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ModifiedLugrePatch<T, const N: usize> {
    element: ModifiedLugre<T>,
    transport: Transport<T>,
    share: T,
}

/// State of a patch of modified LuGre elements.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ModifiedPatchState<T, const N: usize> {
    /// State of each element in the order of the path coordinate.
    pub element: [ModifiedLugreState<T>; N],
}

impl<T: Real, const N: usize> Default for ModifiedPatchState<T, N> {
    fn default() -> Self {
        Self { element: [ModifiedLugreState::default(); N] }
    }
}

impl<T: Real, const N: usize> ModifiedLugrePatch<T, N> {
    /// Prepares the patch; `p` is for all elements together, with σ0 in N/m at the given load.
    pub fn new(
        p: &LugreParameters<T>,
        length_m: T,
        largest_transport_speed_m_s: T,
        step_s: T,
    ) -> Result<Self, ParameterError> {
        #[allow(clippy::cast_precision_loss)]
        let share = T::ONE / T::from_f64(N as f64);
        Ok(Self {
            element: ModifiedLugre::new(p, step_s)?,
            transport: Transport::new(N, length_m, largest_transport_speed_m_s, step_s)?,
            share,
        })
    }

    /// The same patch with another reading of the rate in eq. 17, or another treatment of the implicit equation.
    #[must_use]
    pub fn with_scheme(self, scheme: Scheme) -> Self {
        Self { element: self.element.with_scheme(scheme), ..self }
    }

    /// Advances the patch by one step; returns the friction force, N.
    pub fn step(
        &self,
        state: &mut ModifiedPatchState<T, N>,
        contact: &Contact<T>,
        transport_speed_m_s: T,
    ) -> T {
        let (substeps, dt, courant) = self.transport.split(transport_speed_m_s);
        let mut element = self.element;
        element.set_step_s(dt);
        let mut sum = T::ZERO;
        for _ in 0..substeps {
            sum = T::ZERO;
            let mut before = T::ZERO;
            let mut advance = |e: &mut ModifiedLugreState<T>| {
                let upstream = before;
                before = e.deflection_m;
                sum += element.step_convected(e, contact, courant, upstream).force_n;
            };
            if transport_speed_m_s >= T::ZERO {
                state.element.iter_mut().for_each(&mut advance);
            } else {
                state.element.iter_mut().rev().for_each(&mut advance);
            }
        }
        sum * self.share
    }
}
