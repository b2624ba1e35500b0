//! Effects of the contact that a model file adds to the elements: heat, wear, dwell, a film …
//!
//! The core's laws around the core's friction model, for all three elements together: an effect of the whole
//! surface does not differ from element to element. Effects of sensors, normal-load actuator and drive are not the plant's; a
//! caller that is given some should say so ([`crate::predict::effects_elsewhere`] and [`left_out`]).

use model_core::error::ParameterError;
use model_core::extension::{ExtendedFriction, ExtendedInput, ExtendedState, Extension, Extensions};

use super::elements::{ElementModel, ElementParameters};
use crate::files::effect_id::{Subsystem, subsystem_of};
use crate::files::model_file::{ModelFile, SOME_STEP_S};

/// The model's effects that change friction itself; `None` where it has none.
pub(super) fn of_contact(model: &ModelFile) -> Option<Extensions<f64>> {
    let mut effects = Extensions::none(SOME_STEP_S);
    let mut any = false;
    for extension in &model.extensions {
        let Some(effect) = contact_effect(&extension.id) else { continue };
        let values: Vec<f64> = extension.parameters.iter().map(|(_, value)| *value).collect();
        // The file was checked when it was read.
        any |= effects.set(effect, &values).is_ok();
    }
    any.then_some(effects)
}

/// Ids of the model's effects that the plant does not have.
#[must_use]
pub fn left_out(model: &ModelFile) -> Vec<&str> {
    let ids = model.extensions.iter().map(|extension| extension.id.as_str());
    ids.filter(|id| contact_effect(id).is_none()).collect()
}

fn contact_effect(id: &str) -> Option<Extension> {
    Extension::with_id(id).filter(|_| subsystem_of(id) == Some(Subsystem::Friction))
}

/// Elements with effects, prepared for a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Affected {
    model: ExtendedFriction<f64>,
    radius_m: f64,
}

impl Affected {
    pub(super) fn new(
        p: &ElementParameters,
        effects: Extensions<f64>,
        radius_m: f64,
        step_s: f64,
    ) -> Result<Option<Self>, ParameterError> {
        let ElementModel::Single(friction) = p.model(step_s)? else { return Ok(None) };
        let mut model = ExtendedFriction::new(friction, effects, radius_m)?;
        model.set_step_s(step_s);
        Ok(Some(Self { model, radius_m }))
    }

    pub(super) fn rest(&self) -> ExtendedState<f64> {
        self.model.holding(0.0, &ExtendedInput::default())
    }

    /// Friction force of all elements.
    #[inline]
    pub(super) fn step(
        &self,
        state: &mut ExtendedState<f64>,
        speed_m_s: f64,
        disc_angle_rad: f64,
        normal_force_n: f64,
    ) -> f64 {
        let disc_speed_rad_s = speed_m_s / self.radius_m;
        let input = ExtendedInput { disc_speed_rad_s, disc_angle_rad, normal_force_n };
        self.model.step(state, &input).torque_nm / self.radius_m
    }
}
