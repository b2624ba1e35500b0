//! Generalised Maxwell slip: elastic elements in parallel, each of which sticks until its share of the load is used up and
//! then slides with a lag behind the Stribeck curve.
//!
//! stick: Ḟ_i = k_i v while |F_i| < α_i F_N g(v);
//! slip: Ḟ_i = sign(v) C F_N (α_i − |F_i|/(F_N g(v))) until the direction changes.
//!
//! Source: F. Al-Bender, V. Lampaert, J. Swevers, "The generalized Maxwell-slip model", IEEE Trans. Automatic Control 50
//! (2005) 1883–1887, eqs. 9–11; C is taken per load here, so that two elements in parallel are one. [`ELEMENTS`] equal
//! shares α_i = 1/4 with stiffnesses that fall by `spread` from one to the next and add up to σ0: the presliding curve is
//! then a polygon like that of a rough contact.
//!
//! **Step**: exact for held speed and load. At constant speed from rest an element slides at α_i F_N g(v) and stays
//! there: no overshoot. The attraction C lets friction lag a changing speed.

use super::contact::{Contact, FrictionForce};
use super::element::{Element, ParameterSpec, exactly};
use super::lugre::require_step;
use super::stribeck::{Stribeck, StribeckParameters};
use crate::error::{ParameterError, require};
use crate::real::Real;

/// Elements in parallel.
pub const ELEMENTS: usize = 4;

/// Generalised Maxwell slip, prepared for a step size.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MaxwellSlip<T> {
    stribeck: Stribeck<T>,
    stiffness: [T; ELEMENTS],
    attraction: T,
    step_s: T,
}

/// State of the elements.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct MaxwellSlipState<T> {
    /// Elastic deflection of each, m.
    pub deflection_m: [T; ELEMENTS],
    /// Direction in which each slides; 0 where it sticks.
    pub slipping: [T; ELEMENTS],
}

impl<T: Real> Element<T> for MaxwellSlip<T> {
    type State = MaxwellSlipState<T>;

    const PARAMETERS: &'static [ParameterSpec] = &[
        ParameterSpec::required("sigma0_n_per_m", 3e4).searched(1e3, 1e9).extensive(),
        ParameterSpec::optional("spread", 2.0).searched(1.0, 6.0),
        ParameterSpec::required("attraction_per_s", 100.0).searched(0.1, 1e5),
        ParameterSpec::required("a0", 0.5).searched(0.02, 5.0),
        ParameterSpec::required("a1", 0.7).searched(0.0, 4.0),
        ParameterSpec::required("v0_m_s", 0.5).searched(2e-3, 10.0),
        ParameterSpec::optional("delta", 0.5),
        ParameterSpec::optional("theta", 1.0),
    ];

    fn build(values: &[T], step_s: T) -> Result<Self, ParameterError> {
        let [sigma0, spread, attraction, a0, a1, v0_m_s, delta, theta] = exactly(values)?;
        let sigma0_allowed = sigma0 >= T::ONE && sigma0 <= T::from_f64(1e10);
        let sigma0 = require("sigma0_n_per_m", sigma0, sigma0_allowed, "1 to 1e10 N/m")?;
        let spread_allowed = spread >= T::ONE && spread <= T::from_f64(10.0);
        let spread = require("spread", spread, spread_allowed, "1 to 10")?;
        let attraction_allowed = attraction > T::ZERO && attraction <= T::from_f64(1e6);
        let mut stiffness = [T::ONE; ELEMENTS];
        for k in 1..ELEMENTS {
            stiffness[k] = stiffness[k - 1] / spread;
        }
        let sum = stiffness.iter().fold(T::ZERO, |sum, k| sum + *k);
        Ok(Self {
            stiffness: stiffness.map(|k| sigma0 * k / sum),
            attraction: require(
                "attraction_per_s",
                attraction,
                attraction_allowed,
                "above 0 and up to 1e6 1/s",
            )?,
            stribeck: Stribeck::new(&StribeckParameters { a0, a1, v0_m_s, delta, theta })?,
            step_s: require_step(step_s)?,
        })
    }

    fn rest(&self) -> MaxwellSlipState<T> {
        MaxwellSlipState { deflection_m: [T::ZERO; ELEMENTS], slipping: [T::ZERO; ELEMENTS] }
    }

    fn holding(&self, force_n: T, contact: &Contact<T>) -> MaxwellSlipState<T> {
        let share = T::from_f64(1.0 / ELEMENTS as f64);
        let held = share * force_n.within(contact.load_n() * self.stribeck.largest());
        MaxwellSlipState { deflection_m: self.stiffness.map(|k| held / k), slipping: [T::ZERO; ELEMENTS] }
    }

    fn set_step_s(&mut self, step_s: T) {
        self.step_s = step_s;
    }

    fn step(&self, state: &mut MaxwellSlipState<T>, contact: &Contact<T>) -> FrictionForce<T> {
        let v = contact.sliding_speed_m_s;
        let load_n = contact.load_n();
        if load_n <= T::ZERO {
            *state = self.rest();
            return FrictionForce { force_n: T::ZERO, tip_speed_m_s: v };
        }
        let g = self.stribeck.coefficient(v);
        let limit_n = T::from_f64(1.0 / ELEMENTS as f64) * load_n * g;
        let approach = -(-(self.step_s * self.attraction / g)).exp_m1();
        let mut sum = T::ZERO;
        let elements = self.stiffness.iter().zip(&mut state.deflection_m).zip(&mut state.slipping);
        for ((k, deflection_m), slipping) in elements {
            let mut force_n = *k * *deflection_m;
            if *slipping != T::ZERO && *slipping == v.sign() {
                force_n += approach * (limit_n.copysign(v) - force_n);
            } else {
                force_n += *k * self.step_s * v;
                let beyond = force_n.abs() >= limit_n;
                // Beyond its limit against the motion it is unloading that let it go: it sticks on at the limit.
                *slipping = if beyond && force_n.sign() == v.sign() { v.sign() } else { T::ZERO };
                force_n = force_n.within(limit_n);
            }
            *deflection_m = force_n / *k;
            sum += force_n;
        }
        FrictionForce { force_n: sum, tip_speed_m_s: v }
    }

    fn deformation_m(state: &MaxwellSlipState<T>) -> T {
        state.deflection_m[0]
    }

    fn largest_coefficient(&self) -> T {
        self.stribeck.largest()
    }

    fn sticking_stiffness_n_per_m(&self, _load_n: T) -> T {
        self.stiffness.iter().fold(T::ZERO, |sum, k| sum + *k)
    }

    fn stribeck(&self) -> Option<&Stribeck<T>> {
        Some(&self.stribeck)
    }
}
