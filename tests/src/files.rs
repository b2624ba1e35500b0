//! Rig and model files as a user would have them.

use std::fmt::Write as _;

use crate::random::{Stream, rounded};
use crate::rig::{Friction, Rig, kind};
use crate::scenario::Base;

/// The rig file; each number but the radius, the rated torque and the pulses is off by `error` (relative
/// standard deviation).
#[must_use]
pub fn rig_toml(rig: &Rig, error: f64, s: &mut Stream) -> String {
    let mut off = |value: f64| {
        let wrong = value * (error * s.normal()).exp();
        if error > 0.0 { rounded(wrong, 4) } else { value }
    };
    let mut text = String::new();
    let _ = writeln!(text, "[geometry]\nfriction_radius_m = {:?}", rig.friction_radius_m);
    let _ = writeln!(text, "lever_gain_n_per_nm = {:?}", off(rig.lever_gain_n_per_nm));
    let _ = writeln!(text, "\n[m1]\nrated_torque_nm = {:?}", rig.rated_torque_nm);
    let _ = writeln!(text, "torque_lag_s = {:?}", off(rig.m1_lag_s));
    let _ = writeln!(text, "\n[m2]\nrated_torque_nm = {:?}", rig.rated_torque_nm);
    let _ = writeln!(text, "torque_lag_s = {:?}", off(rig.m2_lag_s));
    let _ = writeln!(text, "inertia_kg_m2 = {:?}", off(rig.inertia_kg_m2));
    let _ = writeln!(text, "\n[encoder]\npulses_per_rev = {}", rig.pulses_per_rev);
    let _ = writeln!(text, "\n[pressure]\npreload_n = {:?}", off(rig.preload_n));
    let _ = writeln!(text, "mode_hz = {:?}", off(rig.pressure_mode_hz));
    let _ = writeln!(text, "damping_ratio = {:?}", off(rig.pressure_damping));
    for (name, bridge) in [("friction_bridge", rig.friction_bridge), ("normal_bridge", rig.normal_bridge)] {
        if let Some(bridge) = bridge {
            let _ = writeln!(text, "\n[{name}]\nmode_hz = {:?}", off(bridge.mode_hz));
            let _ = writeln!(text, "damping_ratio = {:?}", off(bridge.damping_ratio));
            let _ = writeln!(text, "lowpass_hz = {:?}", off(bridge.lowpass_hz));
        }
    }
    text
}

/// The model file.
#[must_use]
pub fn model_toml(friction: &Friction) -> String {
    let mut text = format!("kind = \"{}\"\n\n[parameters]\n", kind(friction.base));
    let mut put = |name: &str, value: f64| {
        let _ = writeln!(text, "{name} = {value:?}");
    };
    put("sigma0_n_per_m", friction.sigma0_n_per_m);
    put("sigma1_n_s_per_m", friction.sigma1_n_s_per_m);
    put("a0", friction.a0);
    put("a1", friction.a1);
    put("a2_s_per_m", friction.a2_s_per_m);
    put("v0_m_s", friction.v0_m_s);
    put("delta", friction.delta);
    put("theta", 1.0);
    if friction.base == Base::Series {
        put("k_u_n_per_m", friction.k_u_n_per_m);
        put("c_u_n_s_per_m", friction.c_u_n_s_per_m);
    }
    text
}
