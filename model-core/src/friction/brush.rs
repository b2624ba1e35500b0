//! Brush element with reset, eqs. 4–6 (Figs. 2–3).
//!
//! stick: u̇ = v_r while |c u| < F_N µ_s;   slip: c u = F_N µ_c · sign(v_r), u̇ = 0.
//!
//! The fall from µ_s to µ_c is a discontinuity of the force. What the paper leaves open is settled
//! so:
//! * **re-stick**: an element that slips sticks again when the sliding speed reverses or is zero; it
//!   starts from the deformation it had while slipping.
//! * **reversal**: the deformation then unwinds elastically through zero to −F_N µ_s/c.
//! * **unloading**: when the normal force falls so far that F_N µ_s < |c u|, a sticking element
//!   breaks loose at once; without load the deformation is zero.
//! * **loading while slipping**: slip goes on at the new F_N µ_c.
//!
//! The force needs no damping term: the block is massless, and eq. 4 has none.

use super::FrictionModel;
use super::contact::{Contact, FrictionForce};
use super::element::{Element, ParameterSpec, exactly};
use super::lugre::require_step;
use crate::error::{ParameterError, require};
use crate::real::Real;

/// Brush parameters, in physical units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BrushParameters<T> {
    /// Stiffness c of the element, N/m, > 0.
    pub c_n_per_m: T,
    /// Static friction coefficient µ_s, ≥ µ_c.
    pub mu_s: T,
    /// Sliding friction coefficient µ_c, > 0.
    pub mu_c: T,
}

/// Brush element, prepared for a step size.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Brush<T> {
    pub(crate) stiffness: T,
    pub(crate) compliance: T,
    pub(crate) mu_s: T,
    pub(crate) mu_c: T,
    step_s: T,
}

/// State of a brush element.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct BrushState<T> {
    /// Deformation u of the element, m.
    pub deformation_m: T,
    /// Whether the element slips.
    pub slipping: bool,
}

impl<T: Real> Brush<T> {
    /// Prepares the element for a step of `step_s` seconds, or names the parameter out of range.
    pub fn new(p: &BrushParameters<T>, step_s: T) -> Result<Self, ParameterError> {
        let c_allowed = p.c_n_per_m >= T::ONE && p.c_n_per_m <= T::from_f64(1e10);
        let stiffness = require("c_n_per_m", p.c_n_per_m, c_allowed, "1 to 1e10 N/m")?;
        let mu_c =
            require("mu_c", p.mu_c, p.mu_c > T::ZERO && p.mu_c <= T::from_f64(10.0), "0 < mu_c <= 10")?;
        let mu_s =
            require("mu_s", p.mu_s, p.mu_s >= mu_c && p.mu_s <= T::from_f64(10.0), "mu_c <= mu_s <= 10")?;
        Ok(Self { stiffness, compliance: T::ONE / stiffness, mu_s, mu_c, step_s: require_step(step_s)? })
    }

    /// Changes the step size, s, for unevenly sampled inputs. The caller keeps it positive.
    #[inline]
    pub fn set_step_s(&mut self, step_s: T) {
        self.step_s = step_s;
    }

    /// Advances the element by one step and returns the friction force.
    #[inline]
    pub fn step(&self, state: &mut BrushState<T>, contact: &Contact<T>) -> FrictionForce<T> {
        let v = contact.sliding_speed_m_s;
        self.advance(state, v, self.step_s * v, contact.load_n());
        let tip_speed_m_s = if state.slipping { v } else { T::ZERO };
        FrictionForce { force_n: self.stiffness * state.deformation_m, tip_speed_m_s }
    }

    /// Moves the root by `travel` at speed `v` under `load`.
    #[inline]
    pub(crate) fn advance(&self, state: &mut BrushState<T>, v: T, travel: T, load: T) {
        if load <= T::ZERO {
            *state = BrushState::default();
            return;
        }
        if state.slipping && (v == T::ZERO || v.sign() != state.deformation_m.sign()) {
            state.slipping = false;
        }
        if !state.slipping {
            state.deformation_m += travel;
            let breakaway = load * self.mu_s * self.compliance;
            state.slipping = state.deformation_m.abs() >= breakaway;
        }
        if state.slipping {
            // A standing element that unloading broke loose keeps the side it leaned to.
            let side = if v == T::ZERO { state.deformation_m } else { v };
            state.deformation_m = (load * self.mu_c * self.compliance).copysign(side);
        }
    }
}

impl<T: Real> BrushParameters<T> {
    /// In the order of [`Element::PARAMETERS`].
    pub(super) fn values(&self) -> [T; 3] {
        [self.c_n_per_m, self.mu_s, self.mu_c]
    }

    /// From as many values in that order.
    pub(super) fn from_values(values: &[T]) -> Result<Self, ParameterError> {
        let [c_n_per_m, mu_s, mu_c] = exactly(values)?;
        Ok(Self { c_n_per_m, mu_s, mu_c })
    }
}

impl<T: Real> FrictionModel<T> {
    /// A brush element.
    pub fn brush(p: &BrushParameters<T>, step_s: T) -> Result<Self, ParameterError> {
        Brush::new(p, step_s).map(Self::Brush)
    }
}

impl<T: Real> Element<T> for Brush<T> {
    type State = BrushState<T>;

    const PARAMETERS: &'static [ParameterSpec] = &[
        ParameterSpec::required("c_n_per_m", 3e4).searched(1e3, 1e9).extensive(),
        ParameterSpec::required("mu_s", 1.2).searched(0.02, 5.0),
        ParameterSpec::required("mu_c", 0.9).searched(0.02, 5.0),
    ];

    fn build(values: &[T], step_s: T) -> Result<Self, ParameterError> {
        Self::new(&BrushParameters::from_values(values)?, step_s)
    }

    fn rest(&self) -> BrushState<T> {
        BrushState::default()
    }

    fn holding(&self, force_n: T, contact: &Contact<T>) -> BrushState<T> {
        let most_n = contact.load_n() * self.mu_s;
        BrushState {
            deformation_m: (force_n * self.compliance).within(most_n * self.compliance),
            slipping: force_n.abs() >= most_n,
        }
    }

    #[inline]
    fn set_step_s(&mut self, step_s: T) {
        self.set_step_s(step_s);
    }

    #[inline]
    fn step(&self, state: &mut BrushState<T>, contact: &Contact<T>) -> FrictionForce<T> {
        self.step(state, contact)
    }

    fn deformation_m(state: &BrushState<T>) -> T {
        state.deformation_m
    }

    fn largest_coefficient(&self) -> T {
        self.mu_s
    }

    fn sticking_stiffness_n_per_m(&self, _load_n: T) -> T {
        self.stiffness
    }
}
