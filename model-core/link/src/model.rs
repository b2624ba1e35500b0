//! The observer's friction model on the wire and in flash: the model file's numbers, nothing else.

use model_core::error::ParameterError;
use model_core::friction::FrictionModel;
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

impl BristleRecord {
    fn parameters(&self) -> LugreParameters<f32> {
        LugreParameters {
            sigma0_n_per_m: self.sigma0_n_per_m,
            sigma1_n_s_per_m: self.sigma1_n_s_per_m,
            a2_s_per_m: self.a2_s_per_m,
            stribeck: StribeckParameters {
                a0: self.a0,
                a1: self.a1,
                v0_m_s: self.v0_m_s,
                delta: self.delta,
                theta: self.theta,
            },
        }
    }
}

impl ModelRecord {
    /// The model in the observer of a rig nobody has identified yet: the series element with assumed
    /// values (all three elements together, 5 µm bristles at 88 N).
    pub const ASSUMED: Self = Self::Series {
        k_u_n_per_m: 3e4,
        c_u_n_s_per_m: 160.0,
        bristles: BristleRecord {
            sigma0_n_per_m: 1.76e7,
            sigma1_n_s_per_m: 0.0,
            a0: 0.5,
            a1: 0.7,
            a2_s_per_m: 0.0,
            v0_m_s: 0.5,
            delta: 0.5,
            theta: 1.0,
        },
    };

    /// The model, checked and prepared for a step size.
    ///
    /// # Errors
    /// The parameter that is out of range.
    pub fn prepare(&self, step_s: f32) -> Result<FrictionModel<f32>, ParameterError> {
        match *self {
            Self::Brush { c_n_per_m, mu_s, mu_c } => {
                FrictionModel::brush(&BrushParameters { c_n_per_m, mu_s, mu_c }, step_s)
            }
            Self::Lugre(bristles) => FrictionModel::lugre(&bristles.parameters(), step_s),
            Self::ModifiedLugre(bristles) => FrictionModel::modified_lugre(&bristles.parameters(), step_s),
            Self::Series { k_u_n_per_m, c_u_n_s_per_m, bristles } => {
                let bristles = bristles.parameters();
                FrictionModel::series(&SeriesParameters { k_u_n_per_m, c_u_n_s_per_m, bristles }, step_s)
            }
        }
    }
}
