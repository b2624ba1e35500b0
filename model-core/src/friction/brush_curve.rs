//! Brush element whose sliding coefficient depends on speed, as eqs. 4 and 10 have it.
//!
//! stick: u̇ = v_r while |c u| < F_N µ_s;   slip: c u = F_N µ_c(v_r) · sign(v_r),  µ_c(v) = g(v) + a2 |v|
//!
//! The paper writes µ_c(v_r) and gives no curve; here it is g of eq. 13 with a viscous term, so one set of numbers fits every
//! speed, where [`super::brush`] needs its µ_c set anew for each. Rules for reversal, unloading and re-stick are those of that
//! element; after a reversal it sticks from F_N g(0), whatever the step. At constant speed and load the force drops by µ_s/µ_c(v) − 1 when it breaks loose: an overshoot that grows with
//! speed, is put in by hand as µ_s, and is a discontinuity.
//!
//! **Step**: exact for a held speed. Left out: any state between sticking and slipping.

use super::brush::{Brush, BrushParameters, BrushState};
use super::contact::{Contact, FrictionForce};
use super::element::{Element, ParameterSpec, exactly};
use super::lugre::and_curve;
use super::stribeck::{Stribeck, StribeckParameters};
use crate::error::{ParameterError, require};
use crate::real::Real;

/// Brush with a curve, prepared for a step size.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BrushCurve<T> {
    brush: Brush<T>,
    stribeck: Stribeck<T>,
    a2: T,
}

impl<T: Real> Element<T> for BrushCurve<T> {
    type State = BrushState<T>;

    const PARAMETERS: &'static [ParameterSpec] = &and_curve([
        ParameterSpec::required("c_n_per_m", 3e4).searched(1e3, 1e9).extensive(),
        ParameterSpec::optional("static_excess", 0.0).searched(0.0, 2.0),
    ]);

    /// µ_s = g(0) + `static_excess`: never below what it slides with from rest.
    fn build(values: &[T], step_s: T) -> Result<Self, ParameterError> {
        let [c_n_per_m, excess, a0, a1, a2, v0_m_s, delta, theta] = exactly(values)?;
        let stribeck = Stribeck::new(&StribeckParameters { a0, a1, v0_m_s, delta, theta })?;
        let excess_ok = excess >= T::ZERO && excess <= T::from_f64(10.0);
        let excess = require("static_excess", excess, excess_ok, "0 to 10")?;
        let a2_ok = a2 >= T::ZERO && a2 <= T::from_f64(100.0);
        let a2 = require("a2_s_per_m", a2, a2_ok, "0 to 100 s/m")?;
        // A static coefficient beyond what a brush allows is the fault of the curve that it stands on.
        let mu_s = stribeck.largest() + excess;
        require("a0", a0, mu_s <= T::from_f64(10.0), "theta (a0 + a1) + static_excess up to 10")?;
        let brush = Brush::new(&BrushParameters { c_n_per_m, mu_s, mu_c: stribeck.smallest() }, step_s)?;
        Ok(Self { brush, stribeck, a2 })
    }

    fn rest(&self) -> BrushState<T> {
        BrushState::default()
    }

    fn holding(&self, force_n: T, contact: &Contact<T>) -> BrushState<T> {
        Element::holding(&self.brush, force_n, contact)
    }

    fn set_step_s(&mut self, step_s: T) {
        self.brush.set_step_s(step_s);
    }

    fn step(&self, state: &mut BrushState<T>, contact: &Contact<T>) -> FrictionForce<T> {
        let v = contact.sliding_speed_m_s;
        if state.slipping && v.sign() != state.deformation_m.sign() {
            // The speed went through zero: it sticks from what it slid with there, wherever in the step that was.
            let held_m = contact.load_n() * self.stribeck.largest() * self.brush.compliance;
            state.deformation_m = held_m.copysign(state.deformation_m);
        }
        // The brush multiplies all of µ_c with F_N θ, of which the viscous part has no θ (eqs. 13–14).
        let mu_c = self.stribeck.coefficient(v) + self.a2 * v.abs() / contact.road_factor;
        let mut brush = self.brush;
        brush.mu_c = mu_c;
        brush.step(state, contact)
    }

    fn deformation_m(state: &BrushState<T>) -> T {
        state.deformation_m
    }

    fn largest_coefficient(&self) -> T {
        self.brush.mu_s
    }

    fn sticking_stiffness_n_per_m(&self, _load_n: T) -> T {
        self.brush.stiffness
    }

    fn stribeck(&self) -> Option<&Stribeck<T>> {
        Some(&self.stribeck)
    }
}
