//! Every setting out of its range is refused, with its name and its range.

use super::*;
use crate::error::ParameterError;
use crate::friction::{FrictionParameters, ModelKind};
use std::collections::BTreeSet;
use std::string::{String, ToString as _};

type Change = fn(&mut ControlSettings, f32);

/// (name, the field, values that must be refused)
const CASES: &[(&str, Change, &[f32])] = &[
    ("tick_s", |s, v| s.tick_s = v, &[1e-5, 2e-3, f32::NAN]),
    ("geometry.friction_radius_m", |s, v| s.geometry.friction_radius_m = v, &[0.0, 1.1, f32::NAN]),
    ("geometry.lever_gain_n_per_nm", |s, v| s.geometry.lever_gain_n_per_nm = v, &[0.0, 1001.0, -30.0]),
    ("geometry.preload_n", |s, v| s.geometry.preload_n = v, &[-1.0, 101.0]),
    ("m1.rated_torque_nm", |s, v| s.m1.rated_torque_nm = v, &[0.0, 10.1, f32::INFINITY]),
    ("m1.torque_lag_s", |s, v| s.m1.torque_lag_s = v, &[0.0, 0.2]),
    ("m1.torque_limit", |s, v| s.m1.torque_limit = v, &[-0.1, 1.1]),
    ("m1.slew_nm_per_s", |s, v| s.m1.slew_nm_per_s = v, &[0.0, 1e6]),
    ("m1.trim_bandwidth_hz", |s, v| s.m1.trim_bandwidth_hz = v, &[-1.0, 51.0]),
    ("m1.trim_limit_nm", |s, v| s.m1.trim_limit_nm = v, &[-0.1, 2.1]),
    ("m1.monitor_zero_code", |s, v| s.m1.monitor_zero_code = v, &[-1.0, 65536.0]),
    ("m1.monitor_nm_per_code", |s, v| s.m1.monitor_nm_per_code = v, &[0.0, 0.1, -0.1]),
    ("m2.rated_torque_nm", |s, v| s.m2.rated_torque_nm = v, &[0.0, 10.1]),
    ("m2.torque_lag_s", |s, v| s.m2.torque_lag_s = v, &[0.0, 0.2]),
    ("m2.torque_limit", |s, v| s.m2.torque_limit = v, &[-0.1, 1.1]),
    ("m2.slew_nm_per_s", |s, v| s.m2.slew_nm_per_s = v, &[0.0, 1e6]),
    ("m2.trim_bandwidth_hz", |s, v| s.m2.trim_bandwidth_hz = v, &[-1.0, 51.0]),
    ("m2.trim_limit_nm", |s, v| s.m2.trim_limit_nm = v, &[-0.1, 2.1]),
    ("m2.monitor_zero_code", |s, v| s.m2.monitor_zero_code = v, &[-1.0, 65536.0]),
    ("m2.monitor_nm_per_code", |s, v| s.m2.monitor_nm_per_code = v, &[0.0, 0.1, -0.1]),
    ("speed_loop.inertia_kg_m2", |s, v| s.speed_loop.inertia_kg_m2 = v, &[0.0, 11.0]),
    ("speed_loop.bearing_coulomb_nm", |s, v| s.speed_loop.bearing_coulomb_nm = v, &[-0.1, 5.1]),
    ("speed_loop.bearing_viscous_nm_s", |s, v| s.speed_loop.bearing_viscous_nm_s = v, &[-0.1, 1.1]),
    ("speed_loop.bandwidth_hz", |s, v| s.speed_loop.bandwidth_hz = v, &[0.0, 61.0]),
    ("speed_loop.damping_ratio", |s, v| s.speed_loop.damping_ratio = v, &[0.2, 3.1]),
    ("speed_loop.slew_rad_s2", |s, v| s.speed_loop.slew_rad_s2 = v, &[0.0, 5001.0]),
    ("speed_loop.friction_feed_forward", |s, v| s.speed_loop.friction_feed_forward = v, &[-0.1, 1.1]),
    ("speed_loop.estimator_bandwidth_hz", |s, v| s.speed_loop.estimator_bandwidth_hz = v, &[4.0, 1001.0]),
    ("m1_encoder.counts_per_rev", |s, v| s.m1_encoder.counts_per_rev = v as u32, &[0.0, 999.0, 1.7e7]),
    ("m1_encoder.counter_bits", |s, v| s.m1_encoder.counter_bits = v as u32, &[0.0, 24.0, 33.0]),
    ("m2_encoder.counts_per_rev", |s, v| s.m2_encoder.counts_per_rev = v as u32, &[0.0, 999.0, 1.7e7]),
    ("m2_encoder.counter_bits", |s, v| s.m2_encoder.counter_bits = v as u32, &[0.0, 24.0, 33.0]),
    ("friction_bridge.zero_code", |s, v| s.friction_bridge.zero_code = v, &[-1.0, 65536.0]),
    ("friction_bridge.unit_per_code", |s, v| s.friction_bridge.unit_per_code = v, &[0.0, 2.0]),
    ("friction_bridge.saturated_low_code", |s, v| s.friction_bridge.saturated_low_code = v as u16, &[100.0]),
    (
        "friction_bridge.saturated_high_code",
        |s, v| s.friction_bridge.saturated_high_code = v as u16,
        &[656.0, 0.0],
    ),
    ("friction_bridge.open_code", |s, v| s.friction_bridge.open_code = v as u16, &[64879.0]),
    (
        "friction_bridge.persistence_ticks",
        |s, v| s.friction_bridge.persistence_ticks = v as u32,
        &[0.0, 101.0],
    ),
    ("friction_bridge.lowpass_hz", |s, v| s.friction_bridge.lowpass_hz = v, &[9.0, 4001.0]),
    ("friction_bridge.tare_limit", |s, v| s.friction_bridge.tare_limit = v, &[-1.0, 1001.0]),
    ("normal_bridge.zero_code", |s, v| s.normal_bridge.zero_code = v, &[-1.0, 65536.0]),
    ("normal_bridge.unit_per_code", |s, v| s.normal_bridge.unit_per_code = v, &[0.0, 2.0]),
    ("normal_bridge.saturated_low_code", |s, v| s.normal_bridge.saturated_low_code = v as u16, &[100.0]),
    ("normal_bridge.saturated_high_code", |s, v| s.normal_bridge.saturated_high_code = v as u16, &[656.0]),
    ("normal_bridge.open_code", |s, v| s.normal_bridge.open_code = v as u16, &[64879.0]),
    ("normal_bridge.persistence_ticks", |s, v| s.normal_bridge.persistence_ticks = v as u32, &[0.0, 101.0]),
    ("normal_bridge.lowpass_hz", |s, v| s.normal_bridge.lowpass_hz = v, &[9.0, 4001.0]),
    ("normal_bridge.tare_limit", |s, v| s.normal_bridge.tare_limit = v, &[-1.0, 1001.0]),
    ("tare_time_s", |s, v| s.tare_time_s = v, &[0.0, 5.1]),
    ("supply.volt_per_code", |s, v| s.supply.volt_per_code = v, &[0.0, 0.02]),
    ("supply.low_v", |s, v| s.supply.low_v = v, &[-1.0, 61.0]),
    ("supply.high_v", |s, v| s.supply.high_v = v, &[61.0, 20.0]),
    ("supply.persistence_s", |s, v| s.supply.persistence_s = v, &[-1.0, 1.1]),
    ("limits.speed_rad_s", |s, v| s.limits.speed_rad_s = v, &[0.0, 36.1]),
    ("limits.over_speed_rad_s", |s, v| s.limits.over_speed_rad_s = v, &[36.1, 31.5]),
    ("limits.over_torque_nm", |s, v| s.limits.over_torque_nm = v, &[0.0, 10.1]),
    ("limits.normal_force_n", |s, v| s.limits.normal_force_n = v, &[0.0, 215.1]),
    ("limits.over_force_n", |s, v| s.limits.over_force_n = v, &[215.1, 160.0]),
    ("limits.persistence_ticks", |s, v| s.limits.persistence_ticks = v as u32, &[0.0, 101.0]),
    ("encoder_watch.m1_max_speed_rad_s", |s, v| s.encoder_watch.m1_max_speed_rad_s = v, &[0.0, 1001.0]),
    (
        "encoder_watch.m1_max_acceleration_rad_s2",
        |s, v| s.encoder_watch.m1_max_acceleration_rad_s2 = v,
        &[99.0, 1.1e6],
    ),
    ("encoder_watch.m2_max_speed_rad_s", |s, v| s.encoder_watch.m2_max_speed_rad_s = v, &[34.0, 1001.0]),
    (
        "encoder_watch.m2_max_acceleration_rad_s2",
        |s, v| s.encoder_watch.m2_max_acceleration_rad_s2 = v,
        &[99.0, 1.1e6],
    ),
    ("encoder_watch.m2_breakaway_nm", |s, v| s.encoder_watch.m2_breakaway_nm = v, &[0.0, 11.0]),
    ("encoder_watch.m1_breakaway_nm", |s, v| s.encoder_watch.m1_breakaway_nm = v, &[0.0, 11.0]),
    ("encoder_watch.m2_free_speed_rad_s", |s, v| s.encoder_watch.m2_free_speed_rad_s = v, &[0.0, 101.0]),
    ("encoder_watch.m1_free_angle_rad", |s, v| s.encoder_watch.m1_free_angle_rad = v, &[0.0, 1.1]),
    ("encoder_watch.window_s", |s, v| s.encoder_watch.window_s = v, &[0.0, 1.1]),
    ("torque_watch.offset_tolerance_nm", |s, v| s.torque_watch.offset_tolerance_nm = v, &[0.0, 2.1]),
    ("torque_watch.gain_tolerance", |s, v| s.torque_watch.gain_tolerance = v, &[-0.1, 0.6]),
    ("torque_watch.lag_tolerance", |s, v| s.torque_watch.lag_tolerance = v, &[-0.1, 1.1]),
    ("timing.boot_s", |s, v| s.timing.boot_s = v, &[-1.0, 10.1]),
    ("timing.adc_frozen_ticks", |s, v| s.timing.adc_frozen_ticks = v as u32, &[100_001.0]),
    ("timing.adc_stall_ticks", |s, v| s.timing.adc_stall_ticks = v as u32, &[0.0, 101.0]),
    ("timing.adc_overrun_budget", |s, v| s.timing.adc_overrun_budget = v as u32, &[1001.0]),
    ("timing.deadline_budget", |s, v| s.timing.deadline_budget = v as u32, &[1001.0]),
    ("timing.link_timeout_s", |s, v| s.timing.link_timeout_s = v, &[0.0, 10.1]),
    ("timing.stop_timeout_s", |s, v| s.timing.stop_timeout_s = v, &[0.0, 31.0]),
    ("timing.rest_speed_rad_s", |s, v| s.timing.rest_speed_rad_s = v, &[0.0, 1.1]),
    ("observer.bridge_lowpass_hz", |s, v| s.observer.bridge_lowpass_hz = v, &[-1.0, 4001.0, f32::NAN]),
    ("observer.residual_time_s", |s, v| s.observer.residual_time_s = v, &[0.0, 101.0]),
];

fn build(change: impl Fn(&mut ControlSettings)) -> Result<ControlConfig, ParameterError> {
    let mut settings = ControlSettings::default();
    change(&mut settings);
    settings.build()
}

#[test]
fn every_setting_out_of_its_range_is_refused_by_its_name() {
    for (name, change, values) in CASES {
        for &value in *values {
            let error = build(|s| change(s, value)).expect_err(name);
            assert_eq!(&error.name, name, "{value}: {error}");
            assert!(
                !error.allowed.is_empty() && (error.value as f32 == value || value.is_nan()),
                "{error:?}"
            );
        }
    }
}

#[test]
fn every_setting_is_in_that_table() {
    // Leaves of the settings, by their names in the debug form: braces open a table, commas end a leaf.
    let text = std::format!("{:#?}", ControlSettings::default());
    let mut path = std::vec::Vec::new();
    let mut leaves = BTreeSet::new();
    for line in text.lines().skip(1).map(str::trim) {
        if let Some((name, rest)) = line.split_once(": ") {
            if rest.ends_with(['{', '(']) {
                path.push(name);
            } else {
                leaves.insert(path.iter().chain([&name]).copied().collect::<std::vec::Vec<_>>().join("."));
            }
        } else if line.starts_with('}') || line.starts_with(')') {
            path.pop();
        } else {
            path.push("");
        }
    }
    let known: BTreeSet<String> = CASES.iter().map(|case| case.0.to_string()).collect();
    let unchecked: std::vec::Vec<_> = leaves
        .difference(&known)
        // Either value of a switch is allowed, short_code is bounded by its neighbour, the model checks itself.
        .filter(|l| {
            !l.ends_with("reversed") && !l.ends_with("short_code") && !l.starts_with("observer.model")
        })
        .collect();
    assert!(unchecked.is_empty(), "{unchecked:?}");
    assert!(known.is_subset(&leaves), "{:?}", known.difference(&leaves));
}

#[test]
fn a_refusal_names_the_setting_the_value_and_the_range() {
    let message = |change: fn(&mut ControlSettings)| build(change).unwrap_err().to_string();
    assert_eq!(
        message(|s| s.m1.rated_torque_nm = 12.5),
        "m1.rated_torque_nm = 12.5 is not allowed; allowed: 0.1 … 10.0 N·m (hard cap)"
    );
    assert_eq!(
        message(|s| s.limits.over_speed_rad_s = 30.1),
        "limits.over_speed_rad_s = 30.1 is not allowed; allowed: above limits.speed_rad_s"
    );
    assert_eq!(
        message(|s| s.m2_encoder.counter_bits = 24),
        "m2_encoder.counter_bits = 24 is not allowed; allowed: 16 or 32"
    );
    assert_eq!(
        message(|s| s.observer.bridge_lowpass_hz = 5000.0),
        "observer.bridge_lowpass_hz = 5000 is not allowed; allowed: 0.0 … 4000.0 Hz"
    );
    let p = FrictionParameters::typical(ModelKind::Series).with("k_u_n_per_m", -1.0);
    let error = build(|s| s.observer.model = ModelParameters::Elements(p)).unwrap_err();
    assert_eq!(error.name, "k_u_n_per_m");
}

#[test]
fn the_hard_caps_are_what_the_ranges_say() {
    use super::validate::{HARD_FORCE_N, HARD_SPEED_RAD_S, HARD_TORQUE_NM};
    let at = |f: fn(&mut ControlSettings, f32), cap: f32| {
        assert!(build(|s| f(s, cap)).is_ok(), "{cap}");
        let error = build(|s| f(s, cap * 1.000_001)).unwrap_err();
        assert!(error.allowed.ends_with("(hard cap)"), "{error}");
    };
    at(|s, v| s.m1.rated_torque_nm = v, HARD_TORQUE_NM);
    at(|s, v| s.m2.rated_torque_nm = v, HARD_TORQUE_NM);
    at(|s, v| s.limits.over_torque_nm = v, HARD_TORQUE_NM);
    at(|s, v| s.limits.over_speed_rad_s = v, HARD_SPEED_RAD_S);
    at(|s, v| s.limits.over_force_n = v, HARD_FORCE_N);
}
