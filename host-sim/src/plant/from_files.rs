//! The plant that a rig file and a model file describe.

use super::effects;
use super::elements::ElementParameters;
use super::parameters::{
    AnalogueParameters, BearingParameters, BridgeParameters, DiscParameters, DriveParameters,
    GeometryParameters, ModeParameters, NoiseParameters, PlantParameters, PressureParameters,
    ShaftParameters, Substeps,
};
use crate::files::experiment_file::PlantOptions;
use crate::files::model_file::ModelFile;
use crate::files::rig_file::{Bridge, Motor, RigFile};
use crate::files::strain_gauges::{FRICTION_ZERO, NORMAL_ZERO};

impl PlantParameters {
    /// The plant of a rig with elements of a model. What neither file names keeps its assumed value.
    #[must_use]
    pub fn from_files(rig: &RigFile, model: &ModelFile, options: &PlantOptions) -> Self {
        let assumed = Self::default();
        let motor =
            |m: &Motor| DriveParameters { rated_torque_nm: m.rated_torque_nm, torque_lag_s: m.torque_lag_s };
        let bridge = |b: &Bridge| BridgeParameters {
            mode: b.mode.map(|m| ModeParameters { mode_hz: m.mode_hz, damping_ratio: m.damping_ratio }),
            lowpass_hz: b.lowpass_hz,
        };
        Self {
            geometry: GeometryParameters {
                friction_radius_m: rig.friction_radius_m,
                lever_gain_n_per_nm: rig.lever_gain_n_per_nm,
                mechanism_stiffness_n_per_rad: rig.m1_stiffness_n_per_rad,
            },
            m1: motor(&rig.m1),
            m2: motor(&rig.m2),
            disc: DiscParameters { inertia_kg_m2: rig.m2_inertia_kg_m2, ..assumed.disc },
            bearing: BearingParameters {
                coulomb_nm: rig.bearing_coulomb_nm,
                viscous_nm_s: rig.bearing_viscous_nm_s_per_rad,
                ..assumed.bearing
            },
            shaft: rig.shaft.map(|s| ShaftParameters {
                stiffness_nm_per_rad: s.stiffness_nm_per_rad,
                damping_nm_s: s.damping_nm_s_per_rad,
                backlash_rad: s.backlash_rad,
                motor_inertia_kg_m2: s.motor_inertia_kg_m2,
            }),
            pressure: PressureParameters {
                preload_n: rig.preload_n,
                mode_hz: rig.pressure.mode_hz,
                damping_ratio: rig.pressure.damping_ratio,
            },
            friction_bridge: bridge(&rig.friction_bridge),
            normal_bridge: bridge(&rig.normal_bridge),
            analogue: analogue(rig, assumed.analogue),
            counts_per_rev: rig.counts_per_rev(),
            noise: if options.sensor_noise { assumed.noise } else { NoiseParameters::none() },
            substeps: Substeps { busy: options.substeps, ..assumed.substeps },
            elements: ElementParameters::from_file(model),
            effects: effects::of_contact(model),
            ..assumed
        }
    }
}

/// Ranges of both bridges, where the rig file says what their amplifiers give.
fn analogue(rig: &RigFile, assumed: AnalogueParameters) -> AnalogueParameters {
    let mut analogue = assumed;
    if let Some(bridge) = rig.friction_bridge.sensitivity {
        analogue.friction_full_scale_nm = bridge.range(FRICTION_ZERO).1;
    }
    if let Some(bridge) = rig.normal_bridge.sensitivity {
        (analogue.normal_low_n, analogue.normal_high_n) = bridge.range(NORMAL_ZERO);
    }
    analogue
}

impl ElementParameters {
    /// The parameters of a model file, without its extensions.
    #[must_use]
    pub fn from_file(model: &ModelFile) -> Self {
        Self::Elements(model.friction())
    }
}
