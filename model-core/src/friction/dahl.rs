//! Dahl friction: an elastic contact that yields towards the Coulomb force, with nothing that falls with speed.
//!
//! dF/dx = σ0 |q|^α sign(q) · sign(v),  q = 1 − F sign(v)/(F_N µ)
//!
//! Source: P. Dahl, "A solid friction model", Aerospace Corporation TOR-0158(3107–18)-1 (1968). α = 1 is LuGre with
//! a1 = σ1 = a2 = 0. **Step**: exact for a held speed and load, whatever α: |q|^{1−α} falls or rises straight over the
//! distance slid. Small distances are expanded, because in f32 the difference of two powers would lose creep.
//!
//! Left out: any dependence on speed, so the steady force is F_N µ at every speed and there is no overshoot.

use super::contact::{Contact, FrictionForce};
use super::element::{Element, ParameterSpec, exactly};
use super::lugre::require_step;
use crate::error::{ParameterError, require};
use crate::real::Real;

/// Dahl model, prepared for a step size.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dahl<T> {
    sigma0: T,
    mu: T,
    alpha: T,
    step_s: T,
}

/// State of the Dahl model.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct DahlState<T> {
    /// Elastic deflection F/σ0, m.
    pub deflection_m: T,
}

impl<T: Real> Dahl<T> {
    /// Change of q over `reach` = σ0|Δx|/(F_N µ): dq/dX = −sign(q)|q|^α.
    fn change(&self, q: T, reach: T) -> T {
        if self.alpha == T::ONE || q == T::ZERO {
            return q * (-reach).exp_m1();
        }
        let size = q.abs();
        // Rate of the relative change; where it is small the series to second order is closer than two powers.
        let relative = size.powf(self.alpha - T::ONE) * reach;
        let left = if relative < T::from_f64(1e-3) {
            -relative * (T::ONE - T::HALF * self.alpha * relative)
        } else {
            let base = T::ONE + (self.alpha - T::ONE) * relative;
            if base <= T::ZERO { -T::ONE } else { base.powf(T::ONE / (T::ONE - self.alpha)) - T::ONE }
        };
        q * left
    }
}

impl<T: Real> Element<T> for Dahl<T> {
    type State = DahlState<T>;

    const PARAMETERS: &'static [ParameterSpec] = &[
        ParameterSpec::required("sigma0_n_per_m", 3e4).searched(1e3, 1e9).extensive(),
        ParameterSpec::required("mu", 0.9).searched(0.02, 5.0),
        ParameterSpec::optional("alpha", 1.0).searched(0.2, 5.0),
    ];

    fn build(values: &[T], step_s: T) -> Result<Self, ParameterError> {
        let [sigma0, mu, alpha] = exactly(values)?;
        let sigma0_allowed = sigma0 >= T::ONE && sigma0 <= T::from_f64(1e10);
        let alpha_allowed = alpha >= T::from_f64(0.1) && alpha <= T::from_f64(10.0);
        Ok(Self {
            sigma0: require("sigma0_n_per_m", sigma0, sigma0_allowed, "1 to 1e10 N/m")?,
            mu: require("mu", mu, mu > T::ZERO && mu <= T::from_f64(10.0), "0 < mu <= 10")?,
            alpha: require("alpha", alpha, alpha_allowed, "0.1 to 10")?,
            step_s: require_step(step_s)?,
        })
    }

    fn rest(&self) -> DahlState<T> {
        DahlState::default()
    }

    fn holding(&self, force_n: T, contact: &Contact<T>) -> DahlState<T> {
        DahlState { deflection_m: force_n.within(contact.load_n() * self.mu) / self.sigma0 }
    }

    fn set_step_s(&mut self, step_s: T) {
        self.step_s = step_s;
    }

    fn step(&self, state: &mut DahlState<T>, contact: &Contact<T>) -> FrictionForce<T> {
        let v = contact.sliding_speed_m_s;
        let limit_n = contact.load_n() * self.mu;
        if limit_n <= T::ZERO {
            *state = DahlState::default();
            return FrictionForce { force_n: T::ZERO, tip_speed_m_s: v };
        }
        let reach_m = limit_n / self.sigma0;
        let q = T::ONE - state.deflection_m * v.sign() / reach_m;
        let gone = self.change(q, self.step_s * v.abs() / reach_m);
        state.deflection_m -= gone * reach_m * v.sign();
        FrictionForce { force_n: self.sigma0 * state.deflection_m, tip_speed_m_s: v }
    }

    fn deformation_m(state: &DahlState<T>) -> T {
        state.deflection_m
    }

    fn largest_coefficient(&self) -> T {
        self.mu
    }

    fn sticking_stiffness_n_per_m(&self, _load_n: T) -> T {
        self.sigma0
    }
}
