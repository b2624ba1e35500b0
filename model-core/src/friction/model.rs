//! One friction model out of several, chosen at run time: for a model file, the observer, the tool.

use super::brush::{Brush, BrushParameters, BrushState};
use super::contact::{Contact, FrictionForce};
use super::lugre::{Lugre, LugreParameters, LugreState};
use super::modified_lugre::{ModifiedLugre, ModifiedLugreState};
use super::series::{Series, SeriesParameters, SeriesState};
use crate::error::ParameterError;
use crate::real::Real;

/// A friction model, prepared for a step size.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum FrictionModel<T> {
    /// Brush with reset.
    Brush(Brush<T>),
    /// LuGre.
    Lugre(Lugre<T>),
    /// Modified LuGre as printed.
    ModifiedLugre(ModifiedLugre<T>),
    /// Rubber block in series with LuGre bristles.
    Series(Series<T>),
}

/// State of a [`FrictionModel`], of the same kind as the model.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum FrictionState<T> {
    /// Brush with reset.
    Brush(BrushState<T>),
    /// LuGre.
    Lugre(LugreState<T>),
    /// Modified LuGre as printed.
    ModifiedLugre(ModifiedLugreState<T>),
    /// Rubber block in series with LuGre bristles.
    Series(SeriesState<T>),
}

impl<T: Real> FrictionModel<T> {
    /// A brush element.
    pub fn brush(p: &BrushParameters<T>, step_s: T) -> Result<Self, ParameterError> {
        Brush::new(p, step_s).map(Self::Brush)
    }

    /// A LuGre element.
    pub fn lugre(p: &LugreParameters<T>, step_s: T) -> Result<Self, ParameterError> {
        Lugre::new(p, step_s).map(Self::Lugre)
    }

    /// A modified LuGre element.
    pub fn modified_lugre(p: &LugreParameters<T>, step_s: T) -> Result<Self, ParameterError> {
        ModifiedLugre::new(p, step_s).map(Self::ModifiedLugre)
    }

    /// A series element.
    pub fn series(p: &SeriesParameters<T>, step_s: T) -> Result<Self, ParameterError> {
        Series::new(p, step_s).map(Self::Series)
    }

    /// The undeformed state.
    pub fn rest(&self) -> FrictionState<T> {
        match self {
            Self::Brush(_) => FrictionState::Brush(BrushState::default()),
            Self::Lugre(_) => FrictionState::Lugre(LugreState::default()),
            Self::ModifiedLugre(_) => FrictionState::ModifiedLugre(ModifiedLugreState::default()),
            Self::Series(_) => FrictionState::Series(SeriesState::default()),
        }
    }

    /// The state that carries `force_n` at rest, limited to what the load can carry: where a record
    /// begins with the element already deformed.
    pub fn holding(&self, force_n: T, contact: &Contact<T>) -> FrictionState<T> {
        let load = contact.load_n();
        match self {
            Self::Brush(m) => {
                let deformation_m = (force_n * m.compliance).within(load * m.mu_s * m.compliance);
                let slipping = force_n.abs() >= load * m.mu_s;
                FrictionState::Brush(BrushState { deformation_m, slipping })
            }
            Self::Lugre(m) => {
                let deflection_m = (force_n * m.inverse_sigma0).within(m.largest_deflection_m(load));
                FrictionState::Lugre(LugreState { deflection_m })
            }
            Self::ModifiedLugre(m) => {
                let deflection_m = (force_n * m.inverse_sigma0).within(m.largest_deflection_m(load));
                FrictionState::ModifiedLugre(ModifiedLugreState { deflection_m, rate_m_s: T::ZERO })
            }
            Self::Series(m) => {
                let held = force_n.within(load * m.bristles().stribeck().largest());
                FrictionState::Series(SeriesState {
                    deformation_m: held / m.stiffness_n_per_m(),
                    deflection_m: held * m.bristles().inverse_sigma0,
                    tip_speed_m_s: contact.sliding_speed_m_s,
                    mean_tip_speed_m_s: contact.sliding_speed_m_s,
                    mean_root_speed_m_s: contact.sliding_speed_m_s,
                    deflection_rate_m_s: T::ZERO,
                    last_step_s: T::ZERO,
                })
            }
        }
    }

    /// Changes the step size, s, for unevenly sampled inputs. The caller keeps it positive.
    #[inline]
    pub fn set_step_s(&mut self, step_s: T) {
        match self {
            Self::Brush(m) => m.set_step_s(step_s),
            Self::Lugre(m) => m.set_step_s(step_s),
            Self::ModifiedLugre(m) => m.set_step_s(step_s),
            Self::Series(m) => m.set_step_s(step_s),
        }
    }

    /// Advances the element by one step and returns the friction force. A state of another kind is
    /// first replaced by the undeformed state of this kind.
    #[inline]
    pub fn step(&self, state: &mut FrictionState<T>, contact: &Contact<T>) -> FrictionForce<T> {
        match (self, &mut *state) {
            (Self::Brush(m), FrictionState::Brush(s)) => m.step(s, contact),
            (Self::Lugre(m), FrictionState::Lugre(s)) => m.step(s, contact),
            (Self::ModifiedLugre(m), FrictionState::ModifiedLugre(s)) => m.step(s, contact),
            (Self::Series(m), FrictionState::Series(s)) => m.step(s, contact),
            _ => {
                *state = self.rest();
                FrictionForce::default()
            }
        }
    }
}
