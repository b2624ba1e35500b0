//! The observer's friction model on the wire and in flash: the model file's numbers, nothing else.

use model_core::control::{ControlSettings, ModelParameters};
use model_core::friction::brush::BrushParameters;
use model_core::friction::lugre::LugreParameters;
use model_core::friction::series::SeriesParameters;
use model_core::friction::stribeck::StribeckParameters;
use serde::{Deserialize, Serialize};

/// A model by kind, with the parameters of the model file under their names there.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum ModelRecord {
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
}

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

impl From<&ModelParameters> for ModelRecord {
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
        }
    }
}

impl From<&ModelRecord> for ModelParameters {
    fn from(record: &ModelRecord) -> Self {
        match *record {
            ModelRecord::Brush { c_n_per_m, mu_s, mu_c } => {
                Self::Brush(BrushParameters { c_n_per_m, mu_s, mu_c })
            }
            ModelRecord::Lugre(bristles) => Self::Lugre((&bristles).into()),
            ModelRecord::ModifiedLugre(bristles) => Self::ModifiedLugre((&bristles).into()),
            ModelRecord::Series { k_u_n_per_m, c_u_n_s_per_m, bristles } => {
                let bristles = (&bristles).into();
                Self::Series(SeriesParameters { k_u_n_per_m, c_u_n_s_per_m, bristles })
            }
        }
    }
}

impl Default for ModelRecord {
    /// The model in the observer of a rig nobody has identified yet.
    fn default() -> Self {
        (&ControlSettings::default().observer.model).into()
    }
}
