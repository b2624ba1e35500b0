//! Settings of the control core for a rig: what a technician would enter for it.
//!
//! Only what the rig file knows is taken over; loops, limits and scales keep the core's defaults. The controller is
//! told the nominal rig. It never reads the plant's parameters, so a plant that differs from its rig file stays a
//! surprise to it.

use crate::files::model_file::ModelFile;
use crate::files::rig_file::{Bridge, Motor, RigFile};
use crate::files::strain_gauges::{FRICTION_ZERO, NORMAL_ZERO};
use model_core::control::ControlSettings;
use model_core::control::observer::ModelParameters;
use model_core::control::settings::{BridgeSettings, DriveSettings};

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
    settings.m1_encoder.counts_per_rev = rig.counts_per_rev();
    settings.m2_encoder.counts_per_rev = rig.counts_per_rev();
    let spanning = |to: &mut BridgeSettings, bridge: &Bridge, zero_share: f64| {
        if let Some((low, high)) = bridge.sensitivity.map(|s| s.range(zero_share)) {
            let tare_limit = to.tare_limit;
            *to = BridgeSettings { tare_limit, ..BridgeSettings::spanning(low as f32, high as f32) };
        }
    };
    spanning(&mut settings.friction_bridge, &rig.friction_bridge, FRICTION_ZERO);
    spanning(&mut settings.normal_bridge, &rig.normal_bridge, NORMAL_ZERO);
    settings.observer.bridge_lowpass_hz = rig.friction_bridge.lowpass_hz.unwrap_or(0.0) as f32;
    settings.observer.model = ModelParameters::Elements(observer.friction().cast());
    settings
}
