//! Brush contact patch, eqs. 7–11: brush elements spread over the contact length and carried along.
//!
//! ∂u/∂t = v_r − rω ∂u/∂s where the element sticks; u = F_N µ_c/c where it slips; u(0, t) = 0.
//!
//! Transport is upwind with the step divided so that Δt < Δs/|rω| (eq. 8). Rules for reversal,
//! unloading and re-stick are those of the single element, [`super::brush`]; an element that enters
//! the patch sticks.

use super::brush::{Brush, BrushParameters, BrushState};
use super::contact::Contact;
use super::lugre_patch::Transport;
use crate::error::ParameterError;
use crate::real::Real;

/// Brush patch of `N` elements, prepared for a step size.
///
/// The parameters are those of all elements together.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BrushPatch<T, const N: usize> {
    brush: Brush<T>,
    transport: Transport<T>,
    share: T,
}

/// State of a brush patch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BrushPatchState<T, const N: usize> {
    /// Each element, in the order of the path coordinate.
    pub element: [BrushState<T>; N],
    /// Share of each element's length that slips, 0 to 1: carried along like the deformation, it
    /// moves the border between stick and slip by less than an element a step.
    pub slipping_share: [T; N],
}

impl<T: Real, const N: usize> Default for BrushPatchState<T, N> {
    fn default() -> Self {
        Self { element: [BrushState::default(); N], slipping_share: [T::ZERO; N] }
    }
}

impl<T: Real, const N: usize> BrushPatch<T, N> {
    /// Prepares the patch for a step of `step_s` seconds, or names the parameter out of range.
    pub fn new(
        p: &BrushParameters<T>,
        length_m: T,
        largest_transport_speed_m_s: T,
        step_s: T,
    ) -> Result<Self, ParameterError> {
        #[allow(clippy::cast_precision_loss)]
        let share = T::ONE / T::from_f64(N as f64);
        Ok(Self {
            brush: Brush::new(p, step_s)?,
            transport: Transport::new(N, length_m, largest_transport_speed_m_s, step_s)?,
            share,
        })
    }

    /// Advances the patch by one step; returns the friction force, N.
    pub fn step(&self, state: &mut BrushPatchState<T, N>, contact: &Contact<T>, transport_speed_m_s: T) -> T {
        let v = contact.sliding_speed_m_s;
        let load = contact.load_n();
        let (substeps, dt, courant) = self.transport.split(transport_speed_m_s);
        let travel = dt * v;
        let advance = |(e, share): (&mut BrushState<T>, &mut T), before: &mut (T, T)| {
            let (upstream, upstream_share) = core::mem::replace(before, (e.deformation_m, *share));
            e.deformation_m -= courant * (e.deformation_m - upstream);
            *share -= courant * (*share - upstream_share);
            e.slipping = *share >= T::HALF;
            let slipped = e.slipping;
            self.brush.advance(e, v, travel, load);
            if e.slipping {
                *share = T::ONE;
            } else if slipped {
                *share = T::ZERO;
            }
        };
        for _ in 0..substeps {
            let mut before = (T::ZERO, T::ZERO);
            let elements = state.element.iter_mut().zip(&mut state.slipping_share);
            if transport_speed_m_s >= T::ZERO {
                elements.for_each(|e| advance(e, &mut before));
            } else {
                elements.rev().for_each(|e| advance(e, &mut before));
            }
        }
        let sum = state.element.iter().fold(T::ZERO, |sum, e| sum + e.deformation_m);
        self.brush.stiffness * sum * self.share
    }
}
