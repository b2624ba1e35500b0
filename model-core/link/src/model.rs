//! The observer's friction model on the wire and in flash: the model file's numbers, nothing else.
//!
//! Kinds and effects travel under their names and not by number, because a record in flash outlives the
//! firmware that wrote it.

use heapless::{String, Vec};
use model_core::control::{ControlSettings, ModelParameters, ObserverModel};
use model_core::error::ParameterError;
use model_core::extension::{Extension, Extensions, MOST_VALUES};
use model_core::friction::lugre_patch::PatchParameters;
use model_core::friction::stribeck::StribeckParameters;
use model_core::friction::{FrictionParameters, MOST_PARAMETERS, ModelKind};
use serde::{Deserialize, Serialize};

/// The most effects of an uploaded model.
pub const MOST_EFFECTS: usize = 4;

/// A model: its kind with parameters, and the effects around it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ModelRecord {
    /// The friction model.
    pub friction: FrictionRecord,
    /// What extends it.
    pub effects: Vec<EffectRecord, MOST_EFFECTS>,
}

/// An effect of the library with its values, in the order of its names.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct EffectRecord {
    /// Id in the model file.
    pub id: String<24>,
    /// Values of its parameters.
    pub values: Vec<f32, MOST_VALUES>,
}

/// A friction model by kind, with the values of the model file in its order.
///
/// The kind is `"lugre_patch"` for the patch that the observer can run though no model file names it; its values are
/// `sigma0_per_m, length_m, a0, a1, a2_s_per_m, v0_m_s, delta, theta`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FrictionRecord {
    /// Name in the model file.
    pub kind: String<20>,
    /// One value for each of its parameters.
    pub values: Vec<f32, MOST_PARAMETERS>,
}

/// The patch that model files do not have.
const PATCH: &str = "lugre_patch";

/// Fastest transport a patch is prepared for: the rig's over-speed limit at its radius.
const PATCH_SPEED_M_S: f32 = 3.0;

impl FrictionRecord {
    fn new(kind: &str, values: &[f32]) -> Self {
        // Both have room for the longest; a test holds them to it.
        Self {
            kind: String::try_from(kind).unwrap_or_default(),
            values: Vec::from_slice(values).unwrap_or_default(),
        }
    }

    /// A patch with the bristles of an element, as stiff under `load_n`; `None` where the element has none.
    #[must_use]
    pub fn patch_like(&self, length_m: f32, load_n: f32) -> Option<Self> {
        let ModelParameters::Elements(element) = self.parameters().ok()? else { return None };
        let p = element.bristles()?;
        Some(Self::from(&ModelParameters::LugrePatch(PatchParameters {
            sigma0_per_m: p.sigma0_n_per_m / load_n,
            a2_s_per_m: p.a2_s_per_m,
            stribeck: p.stribeck,
            length_m,
            largest_transport_speed_m_s: PATCH_SPEED_M_S,
        })))
    }

    /// The parameters of the observer.
    ///
    /// # Errors
    /// A kind that this firmware does not have, or a wrong number of values.
    pub fn parameters(&self) -> Result<ModelParameters, ParameterError> {
        if self.kind == PATCH {
            let [sigma0_per_m, length_m, a0, a1, a2_s_per_m, v0_m_s, delta, theta] = self
                .values
                .as_slice()
                .try_into()
                .map_err(|_| refusal(self.values.len() as f64, "eight values of a patch"))?;
            return Ok(ModelParameters::LugrePatch(PatchParameters {
                sigma0_per_m,
                a2_s_per_m,
                stribeck: StribeckParameters { a0, a1, v0_m_s, delta, theta },
                length_m,
                largest_transport_speed_m_s: PATCH_SPEED_M_S,
            }));
        }
        let kind = ModelKind::with_name(&self.kind)
            .ok_or(refusal(f64::NAN, "the name of a friction model that this firmware has"))?;
        FrictionParameters::new(kind, &self.values).map(ModelParameters::Elements)
    }
}

const fn refusal(value: f64, allowed: &'static str) -> ParameterError {
    ParameterError { name: "kind", value, allowed }
}

impl From<&FrictionParameters<f32>> for FrictionRecord {
    fn from(p: &FrictionParameters<f32>) -> Self {
        Self::new(p.kind().name(), p.values())
    }
}

impl From<&ModelParameters> for FrictionRecord {
    fn from(model: &ModelParameters) -> Self {
        match model {
            ModelParameters::Elements(p) => p.into(),
            ModelParameters::LugrePatch(p) => {
                let s = &p.stribeck;
                let (stiffness, length) = (p.sigma0_per_m, p.length_m);
                Self::new(PATCH, &[stiffness, length, s.a0, s.a1, p.a2_s_per_m, s.v0_m_s, s.delta, s.theta])
            }
        }
    }
}

impl Default for ModelRecord {
    /// The model in the observer of a rig nobody has identified yet.
    fn default() -> Self {
        Self { friction: (&ControlSettings::default().observer.model).into(), effects: Vec::new() }
    }
}

impl ModelRecord {
    /// A record as flash has it, where this firmware understands it and can run it with `settings`. A record outlives the
    /// firmware that wrote it: another one may know its kind by no name, or with other parameters.
    ///
    /// # Errors
    /// What is wrong with it: then the model alone is not in force, the other settings are.
    pub fn from_stored(bytes: &[u8], settings: &ControlSettings) -> Result<Self, ParameterError> {
        let (record, _): (Self, _) = postcard::take_from_bytes(bytes).map_err(|_| ParameterError {
            name: "model",
            value: bytes.len() as f64,
            allowed: "a record that this firmware understands",
        })?;
        record.prepare(settings).map(|_| record)
    }

    /// The model as the observer runs it, with the geometry and the control period of `settings`.
    ///
    /// # Errors
    /// The parameter that is out of range, or an id that is no effect.
    pub fn prepare(&self, settings: &ControlSettings) -> Result<ObserverModel, ParameterError> {
        let mut effects = Extensions::none(settings.tick_s);
        for record in &self.effects {
            let effect = Extension::with_id(&record.id).ok_or(ParameterError {
                name: "extension.id",
                value: f64::NAN,
                allowed: "the id of an effect that extends the friction model",
            })?;
            effects.set(effect, &record.values)?;
        }
        ObserverModel::extended(&self.friction.parameters()?, effects, settings.geometry.friction_radius_m)
    }
}
