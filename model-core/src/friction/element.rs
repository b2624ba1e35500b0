//! What a friction model of one element declares and does: all that the rest of the project needs to know of it.
//!
//! A model is one file that implements [`Element`] and one line in the list of [`super`]. Model files, the observer on
//! the chip, the wire, the plant, fits and the self-check follow from the declaration.

use core::fmt::Debug;

use super::contact::{Contact, FrictionForce};
use super::stribeck::Stribeck;
use crate::error::ParameterError;
use crate::real::Real;

/// Most parameters that a model has.
pub const MOST_PARAMETERS: usize = 14;

/// A parameter of a model, declared once. Which values are allowed is checked by the model itself.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ParameterSpec {
    /// Name with unit, as in the model file.
    pub name: &'static str,
    /// Value where the file leaves it out; `None` must be there.
    pub default: Option<f64>,
    /// Value of the assumed rubber, all elements together.
    pub typical: f64,
    /// Range in which a fit searches it, logarithmically where the lower end is above zero; `None` is not fitted.
    pub search: Option<(f64, f64)>,
    /// Whether it grows with the size of the contact (stiffness, damping): an element that is a third of the
    /// contact has a third of it.
    pub extensive: bool,
}

impl ParameterSpec {
    /// A parameter that a file must give.
    #[must_use]
    pub const fn required(name: &'static str, typical: f64) -> Self {
        Self { name, default: None, typical, search: None, extensive: false }
    }

    /// A parameter that a file may leave out.
    #[must_use]
    pub const fn optional(name: &'static str, default: f64) -> Self {
        Self { name, default: Some(default), typical: default, search: None, extensive: false }
    }

    /// Searched by a fit in this range.
    #[must_use]
    pub const fn searched(self, low: f64, high: f64) -> Self {
        Self { search: Some((low, high)), ..self }
    }

    /// Grows with the size of the contact.
    #[must_use]
    pub const fn extensive(self) -> Self {
        Self { extensive: true, ..self }
    }

    /// The same with another value for the assumed rubber.
    #[must_use]
    pub const fn with_typical(self, typical: f64) -> Self {
        Self { typical, ..self }
    }
}

/// A friction model of one element, prepared for a step size.
pub trait Element<T: Real>: Copy + Debug + PartialEq {
    /// What it remembers from step to step.
    type State: Copy + Debug + PartialEq;

    /// Its parameters, in the order in which [`Self::build`] takes their values.
    const PARAMETERS: &'static [ParameterSpec];

    /// Prepares the model for a step of `step_s` seconds from one value for each parameter, or names the parameter
    /// out of range.
    fn build(values: &[T], step_s: T) -> Result<Self, ParameterError>;

    /// The undeformed state.
    fn rest(&self) -> Self::State;

    /// The state that carries `force_n` at rest, limited to what the load can carry.
    fn holding(&self, force_n: T, contact: &Contact<T>) -> Self::State;

    /// Changes the step size, s. The caller keeps it positive.
    fn set_step_s(&mut self, step_s: T);

    /// Advances the element by one step and returns the friction force.
    fn step(&self, state: &mut Self::State, contact: &Contact<T>) -> FrictionForce<T>;

    /// Deformation of the rubber, or of the asperities where the model has no rubber, m.
    fn deformation_m(state: &Self::State) -> T;

    /// Largest friction coefficient that the model can show.
    fn largest_coefficient(&self) -> T;

    /// Stiffness against a small motion while the element sticks under `load_n`, N/m.
    fn sticking_stiffness_n_per_m(&self, load_n: T) -> T;

    /// What a user should know who runs the model with these parameters.
    fn warning(&self) -> Option<&'static str> {
        None
    }

    /// The curve of steady sliding, where it is a Stribeck curve: how finely a motion must be cut depends on it.
    fn stribeck(&self) -> Option<&Stribeck<T>> {
        None
    }

    /// Shortest time constant of the rubber that a step should resolve, s.
    fn block_time_s(&self) -> Option<T> {
        None
    }

    /// Distance over which asperities wind up that are stepped in first order and must be resolved, m.
    fn winding_reach_m(&self, _load_n: T) -> Option<T> {
        None
    }
}

/// What a model has from a part of it that is a model, too: the curve, and the stiffness while it sticks.
macro_rules! curve_and_stiffness_of {
    ($part:tt) => {
        fn largest_coefficient(&self) -> T {
            Element::largest_coefficient(&self.$part)
        }

        fn sticking_stiffness_n_per_m(&self, load_n: T) -> T {
            Element::sticking_stiffness_n_per_m(&self.$part, load_n)
        }

        fn stribeck(&self) -> Option<&Stribeck<T>> {
            Element::stribeck(&self.$part)
        }
    };
}

/// All that a model does once it is built, where it is another one with other parameters.
macro_rules! does_what {
    ($part:tt does, with $state:ty) => {
        fn rest(&self) -> $state {
            Element::rest(&self.$part)
        }

        fn holding(&self, force_n: T, contact: &Contact<T>) -> $state {
            Element::holding(&self.$part, force_n, contact)
        }

        fn set_step_s(&mut self, step_s: T) {
            Element::set_step_s(&mut self.$part, step_s);
        }

        fn step(&self, state: &mut $state, contact: &Contact<T>) -> FrictionForce<T> {
            Element::step(&self.$part, state, contact)
        }

        fn deformation_m(state: &$state) -> T {
            state.deformation_m()
        }

        fn block_time_s(&self) -> Option<T> {
            Element::block_time_s(&self.$part)
        }

        fn winding_reach_m(&self, load_n: T) -> Option<T> {
            Element::winding_reach_m(&self.$part, load_n)
        }

        $crate::friction::element::curve_and_stiffness_of!($part);
    };
}

pub(super) use {curve_and_stiffness_of, does_what};

/// The values as many as there are parameters.
pub(super) fn exactly<T: Real, const N: usize>(values: &[T]) -> Result<[T; N], ParameterError> {
    values.try_into().map_err(|_| ParameterError {
        name: "parameters",
        value: values.len() as f64,
        allowed: "one value for each parameter of the model",
    })
}
