//! Settings of the control core for a rig: what a technician would enter for it.
//!
//! Only what the rig file knows is taken over; loops, limits and scales keep the core's defaults. The controller is
//! told the nominal rig. It never reads the plant's parameters, so a plant that differs from its rig file stays a
//! surprise to it.

use crate::files::model_file::ModelFile;
use crate::files::rig_file::{Motor, RigFile};
use crate::plant::ElementParameters;
use model_core::control::ControlSettings;
use model_core::control::observer::ModelParameters;
use model_core::control::settings::DriveSettings;
use model_core::friction::brush::BrushParameters;
use model_core::friction::lugre::LugreParameters;
use model_core::friction::series::SeriesParameters;
use model_core::friction::stribeck::StribeckParameters;

/// Settings for a rig, with the observer on a model.
#[must_use]
#[allow(clippy::cast_possible_truncation)]
pub fn control_settings(rig: &RigFile, observer: &ModelFile) -> ControlSettings {
    let mut settings = ControlSettings::default();
    settings.geometry.friction_radius_m = rig.friction_radius_m as f32;
    settings.geometry.lever_gain_n_per_nm = rig.lever_gain_n_per_nm as f32;
    settings.geometry.preload_n = rig.preload_n as f32;
    let drive = |to: &mut DriveSettings, from: &Motor| {
        to.rated_torque_nm = from.rated_torque_nm as f32;
        to.torque_lag_s = from.torque_lag_s as f32;
    };
    drive(&mut settings.m1, &rig.m1);
    drive(&mut settings.m2, &rig.m2);
    settings.speed_loop.inertia_kg_m2 = rig.m2_inertia_kg_m2 as f32;
    settings.speed_loop.bearing_coulomb_nm = rig.bearing_coulomb_nm as f32;
    settings.speed_loop.bearing_viscous_nm_s = rig.bearing_viscous_nm_s_per_rad as f32;
    settings.m1_encoder.counts_per_rev = rig.pulses_per_rev.saturating_mul(4);
    settings.m2_encoder.counts_per_rev = rig.pulses_per_rev.saturating_mul(4);
    settings.observer.bridge_lowpass_hz = rig.friction_bridge.lowpass_hz.unwrap_or(0.0) as f32;
    if let Some(model) = single_precision(&ElementParameters::from_file(observer)) {
        settings.observer.model = model;
    }
    settings
}

#[allow(clippy::cast_possible_truncation)]
/// The observer's parameters; it knows no patch, which no model file can name either.
fn single_precision(p: &ElementParameters) -> Option<ModelParameters> {
    let lugre = |p: &LugreParameters<f64>| LugreParameters {
        sigma0_n_per_m: p.sigma0_n_per_m as f32,
        sigma1_n_s_per_m: p.sigma1_n_s_per_m as f32,
        a2_s_per_m: p.a2_s_per_m as f32,
        stribeck: StribeckParameters {
            a0: p.stribeck.a0 as f32,
            a1: p.stribeck.a1 as f32,
            v0_m_s: p.stribeck.v0_m_s as f32,
            delta: p.stribeck.delta as f32,
            theta: p.stribeck.theta as f32,
        },
    };
    Some(match p {
        ElementParameters::Brush(p) => ModelParameters::Brush(BrushParameters {
            c_n_per_m: p.c_n_per_m as f32,
            mu_s: p.mu_s as f32,
            mu_c: p.mu_c as f32,
        }),
        ElementParameters::Lugre(p) => ModelParameters::Lugre(lugre(p)),
        ElementParameters::ModifiedLugre(p) => ModelParameters::ModifiedLugre(lugre(p)),
        ElementParameters::Series(p) => ModelParameters::Series(SeriesParameters {
            k_u_n_per_m: p.k_u_n_per_m as f32,
            c_u_n_s_per_m: p.c_u_n_s_per_m as f32,
            bristles: lugre(&p.bristles),
        }),
        ElementParameters::LugrePatch(_) => return None,
    })
}
