//! Model observer: what friction should be by the model, from measured speed and normal force, and what is left.
//!
//! Three elements touch the disc at 120°, so the model of the whole contact is split into [`N_ELEMENTS`] equal ones:
//! each has a third of the load, of the stiffnesses and of the dampings; coefficients of friction stay. Each has a
//! state of its own, so effects that differ between them (the road's angle) have a place.
//!
//! predicted = r·Σ F_i, passed through a second order Butterworth low-pass like the bridge's amplifier, so that
//! measurement and prediction are late by the same time. residual = measured − predicted, with a running mean
//! square (one pole; its root is taken by whoever shows it).
//!
//! Left out: the torque ring's own mode (600 Hz), which is fast against anything the model predicts.

use super::settings::ObserverSettings;
use crate::error::ParameterError;
use crate::friction::brush::BrushParameters;
use crate::friction::lugre::LugreParameters;
use crate::friction::series::SeriesParameters;
use crate::friction::{Contact, FrictionModel, FrictionState};
use core::f32::consts::PI;

/// Elements on the disc.
pub const N_ELEMENTS: usize = 3;

/// Parameters of a friction model of the whole contact, all elements together.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ModelParameters {
    /// Brush with reset.
    Brush(BrushParameters<f32>),
    /// LuGre.
    Lugre(LugreParameters<f32>),
    /// Modified LuGre as printed.
    ModifiedLugre(LugreParameters<f32>),
    /// Rubber block in series with LuGre bristles.
    Series(SeriesParameters<f32>),
}

/// A model prepared for the observer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ObserverModel {
    element: FrictionModel<f32>,
}

impl ObserverModel {
    /// Splits the model of the whole contact into elements and prepares them.
    ///
    /// # Errors
    /// The parameter of an element that is out of its range.
    pub fn new(whole: &ModelParameters, tick_s: f32) -> Result<Self, ParameterError> {
        let share = 1.0 / N_ELEMENTS as f32;
        let bristles = |p: &LugreParameters<f32>| LugreParameters {
            sigma0_n_per_m: p.sigma0_n_per_m * share,
            sigma1_n_s_per_m: p.sigma1_n_s_per_m * share,
            ..*p
        };
        let element = match whole {
            ModelParameters::Brush(p) => {
                FrictionModel::brush(&BrushParameters { c_n_per_m: p.c_n_per_m * share, ..*p }, tick_s)
            }
            ModelParameters::Lugre(p) => FrictionModel::lugre(&bristles(p), tick_s),
            ModelParameters::ModifiedLugre(p) => FrictionModel::modified_lugre(&bristles(p), tick_s),
            ModelParameters::Series(p) => FrictionModel::series(
                &SeriesParameters {
                    k_u_n_per_m: p.k_u_n_per_m * share,
                    c_u_n_s_per_m: p.c_u_n_s_per_m * share,
                    bristles: bristles(&p.bristles),
                },
                tick_s,
            ),
        }?;
        Ok(Self { element })
    }
}

/// Coefficients of the observer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Observer {
    model: ObserverModel,
    friction_radius_m: f32,
    lowpass: Lowpass,
    averaging: f32,
}

/// What the observer remembers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ObserverState {
    elements: [FrictionState<f32>; N_ELEMENTS],
    lowpass: LowpassState,
    mean_square: f32,
}

/// Result of one tick.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Observed {
    pub(crate) predicted_nm: f32,
    pub(crate) residual_nm: f32,
    pub(crate) mean_square_nm2: f32,
}

impl Observer {
    pub(crate) fn new(
        settings: &ObserverSettings,
        friction_radius_m: f32,
        tick_s: f32,
    ) -> Result<Self, ParameterError> {
        Ok(Self {
            model: ObserverModel::new(&settings.model, tick_s)?,
            friction_radius_m,
            lowpass: Lowpass::new(settings.bridge_lowpass_hz, tick_s),
            averaging: -libm::expm1f(-tick_s / settings.residual_time_s),
        })
    }

    pub(crate) fn set_model(&mut self, model: &ObserverModel) {
        self.model = *model;
    }

    pub(crate) fn fresh(&self) -> ObserverState {
        ObserverState {
            elements: [self.model.element.rest(); N_ELEMENTS],
            lowpass: LowpassState::default(),
            mean_square: 0.0,
        }
    }

    /// One tick from measured speed of the disc, normal force and friction torque.
    pub(crate) fn step(
        &self,
        state: &mut ObserverState,
        speed_rad_s: f32,
        normal_force_n: f32,
        friction_torque_nm: f32,
    ) -> Observed {
        let contact =
            Contact::new(speed_rad_s * self.friction_radius_m, normal_force_n * (1.0 / N_ELEMENTS as f32));
        let mut force_n = 0.0;
        for element in &mut state.elements {
            force_n += self.model.element.step(element, &contact).force_n;
        }
        let predicted_nm = self.lowpass.step(&mut state.lowpass, force_n * self.friction_radius_m);
        let residual_nm = friction_torque_nm - predicted_nm;
        state.mean_square += self.averaging * (residual_nm * residual_nm - state.mean_square);
        if !state.mean_square.is_finite() {
            // Parameters may drive a model out of the range of f32; it then starts again from rest.
            *state = self.fresh();
            return Observed::default();
        }
        Observed { predicted_nm, residual_nm, mean_square_nm2: state.mean_square }
    }
}

/// Second order Butterworth low-pass by the bilinear rule with the corner kept; transposed direct form.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Lowpass {
    b0: f32,
    b1: f32,
    a1: f32,
    a2: f32,
}

#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct LowpassState {
    s1: f32,
    s2: f32,
}

impl Lowpass {
    /// A corner of 0 lets everything through.
    fn new(corner_hz: f32, tick_s: f32) -> Self {
        if corner_hz <= 0.0 {
            return Self { b0: 1.0, b1: 0.0, a1: 0.0, a2: 0.0 };
        }
        let k = libm::tanf(PI * corner_hz * tick_s);
        let damping = core::f32::consts::SQRT_2 * k;
        let norm = 1.0 / (1.0 + damping + k * k);
        let b0 = k * k * norm;
        Self { b0, b1: 2.0 * b0, a1: 2.0 * (k * k - 1.0) * norm, a2: (1.0 - damping + k * k) * norm }
    }

    fn step(&self, state: &mut LowpassState, x: f32) -> f32 {
        let y = self.b0 * x + state.s1;
        state.s1 = self.b1 * x - self.a1 * y + state.s2;
        // The numerator is b0(1 + z⁻¹)², or 1 where everything passes.
        state.s2 = 0.5 * self.b1 * x - self.a2 * y;
        y
    }
}
