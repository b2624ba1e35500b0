//! The observer's friction model on the wire and in flash: the model file's numbers, nothing else.
//!
//! Effects travel under their ids and not by number, because a record in flash outlives the firmware
//! that wrote it.

use heapless::{String, Vec};
use model_core::control::{ControlSettings, ModelParameters, ObserverModel};
use model_core::error::ParameterError;
use model_core::extension::{Extension, Extensions, MOST_VALUES};
use model_core::friction::brush::BrushParameters;
use model_core::friction::lugre::LugreParameters;
use model_core::friction::lugre_patch::PatchParameters;
use model_core::friction::series::SeriesParameters;
use model_core::friction::stribeck::StribeckParameters;
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

/// A friction model by kind, with the parameters of the model file under their names there.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum FrictionRecord {
    /// Brush with reset.
    Brush {
        /// Stiffness.
        c_n_per_m: f32,
        /// Static coefficient.
        mu_s: f32,
        /// Sliding coefficient.
        mu_c: f32,
    },
    /// LuGre.
    Lugre(BristleRecord),
    /// Modified LuGre as printed.
    ModifiedLugre(BristleRecord),
    /// Rubber block in series with bristles.
    Series {
        /// Block stiffness.
        k_u_n_per_m: f32,
        /// Block damping.
        c_u_n_s_per_m: f32,
        /// The bristles.
        bristles: BristleRecord,
    },
    /// LuGre contact patch, for its cost on the chip: model files have no such kind.
    LugrePatch {
        /// Stiffness of the bristles per load.
        sigma0_per_m: f32,
        /// Length of the patch.
        length_m: f32,
        /// The curve of sliding; its stiffness and damping are not used.
        bristles: BristleRecord,
    },
}

/// Fastest transport a patch is prepared for: the rig's over-speed limit at its radius.
const PATCH_SPEED_M_S: f32 = 3.0;

/// Parameters of the bristles.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct BristleRecord {
    /// Bristle stiffness.
    pub sigma0_n_per_m: f32,
    /// Bristle damping.
    pub sigma1_n_s_per_m: f32,
    /// Coulomb coefficient.
    pub a0: f32,
    /// Static less Coulomb coefficient.
    pub a1: f32,
    /// Viscous coefficient.
    pub a2_s_per_m: f32,
    /// Stribeck speed.
    pub v0_m_s: f32,
    /// Exponent.
    pub delta: f32,
    /// Road factor.
    pub theta: f32,
}

impl From<&LugreParameters<f32>> for BristleRecord {
    fn from(p: &LugreParameters<f32>) -> Self {
        Self {
            sigma0_n_per_m: p.sigma0_n_per_m,
            sigma1_n_s_per_m: p.sigma1_n_s_per_m,
            a0: p.stribeck.a0,
            a1: p.stribeck.a1,
            a2_s_per_m: p.a2_s_per_m,
            v0_m_s: p.stribeck.v0_m_s,
            delta: p.stribeck.delta,
            theta: p.stribeck.theta,
        }
    }
}

impl From<&BristleRecord> for LugreParameters<f32> {
    fn from(record: &BristleRecord) -> Self {
        Self {
            sigma0_n_per_m: record.sigma0_n_per_m,
            sigma1_n_s_per_m: record.sigma1_n_s_per_m,
            a2_s_per_m: record.a2_s_per_m,
            stribeck: StribeckParameters {
                a0: record.a0,
                a1: record.a1,
                v0_m_s: record.v0_m_s,
                delta: record.delta,
                theta: record.theta,
            },
        }
    }
}

impl From<&ModelParameters> for FrictionRecord {
    fn from(model: &ModelParameters) -> Self {
        match model {
            ModelParameters::Brush(p) => Self::Brush { c_n_per_m: p.c_n_per_m, mu_s: p.mu_s, mu_c: p.mu_c },
            ModelParameters::Lugre(p) => Self::Lugre(p.into()),
            ModelParameters::ModifiedLugre(p) => Self::ModifiedLugre(p.into()),
            ModelParameters::Series(p) => Self::Series {
                k_u_n_per_m: p.k_u_n_per_m,
                c_u_n_s_per_m: p.c_u_n_s_per_m,
                bristles: (&p.bristles).into(),
            },
            ModelParameters::LugrePatch(p) => Self::LugrePatch {
                sigma0_per_m: p.sigma0_per_m,
                length_m: p.length_m,
                bristles: BristleRecord::from(&LugreParameters {
                    sigma0_n_per_m: 0.0,
                    sigma1_n_s_per_m: 0.0,
                    a2_s_per_m: p.a2_s_per_m,
                    stribeck: p.stribeck,
                }),
            },
        }
    }
}

impl From<&FrictionRecord> for ModelParameters {
    fn from(record: &FrictionRecord) -> Self {
        match *record {
            FrictionRecord::Brush { c_n_per_m, mu_s, mu_c } => {
                Self::Brush(BrushParameters { c_n_per_m, mu_s, mu_c })
            }
            FrictionRecord::Lugre(bristles) => Self::Lugre((&bristles).into()),
            FrictionRecord::ModifiedLugre(bristles) => Self::ModifiedLugre((&bristles).into()),
            FrictionRecord::Series { k_u_n_per_m, c_u_n_s_per_m, bristles } => {
                let bristles = (&bristles).into();
                Self::Series(SeriesParameters { k_u_n_per_m, c_u_n_s_per_m, bristles })
            }
            FrictionRecord::LugrePatch { sigma0_per_m, length_m, bristles } => {
                let LugreParameters { a2_s_per_m, stribeck, .. } = (&bristles).into();
                Self::LugrePatch(PatchParameters {
                    sigma0_per_m,
                    a2_s_per_m,
                    stribeck,
                    length_m,
                    largest_transport_speed_m_s: PATCH_SPEED_M_S,
                })
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
        ObserverModel::extended(&(&self.friction).into(), effects, settings.geometry.friction_radius_m)
    }
}
