//! Ranges of all settings, and the hard caps no setting can lift.
//!
//! One line a setting: its name, its range, its unit. The message of a refusal is made from the same line. The caps
//! are what the rig's mechanics and amplifiers bear (assumed, as the whole rig: see the settings' defaults).

use super::settings::{ControlSettings, DriveSettings};
use super::torque_watch::{MOST_OPEN_WIRE_S, open_wire_s};
use crate::error::{ParameterError, require};

/// Torque of a drive: rated torque and over-torque lie below it.
pub const HARD_TORQUE_NM: f32 = 10.0;
/// Speed of the disc: allowed speed and over-speed lie below it.
pub const HARD_SPEED_RAD_S: f32 = 36.0;
/// Normal force: allowed force and over-force lie below it.
pub const HARD_FORCE_N: f32 = 215.0;

macro_rules! within {
    ($settings:ident . $($field:ident).+, $low:literal ..= $high:literal, $unit:literal) => {
        require(
            concat_fields!($($field).+),
            $settings.$($field).+,
            ($low..=$high).contains(&$settings.$($field).+),
            concat!($low, " … ", $high, $unit),
        )?
    };
}

/// `a.b.c` as written.
macro_rules! concat_fields {
    ($first:ident $(. $rest:ident)*) => {
        concat!(stringify!($first) $(, ".", stringify!($rest))*)
    };
}

/// A relation between settings.
macro_rules! relation {
    ($settings:ident . $($field:ident).+, $ok:expr, $allowed:literal) => {
        require(concat_fields!($($field).+), f64::from($settings.$($field).+), $ok, $allowed)?
    };
}

macro_rules! drive {
    ($s:ident, $m:ident) => {
        within!($s.$m.rated_torque_nm, 0.1..=10.0, " N·m (hard cap)");
        within!($s.$m.torque_lag_s, 1e-5..=0.1, " s");
        within!($s.$m.torque_limit, 0.0..=1.0, "");
        within!($s.$m.slew_nm_per_s, 1.0..=100_000.0, " N·m/s");
        within!($s.$m.trim_bandwidth_hz, 0.0..=50.0, " Hz");
        within!($s.$m.trim_limit_nm, 0.0..=2.0, " N·m");
        within!($s.$m.monitor_zero_code, 0.0..=65535.0, "");
        let gain = $s.$m.monitor_nm_per_code;
        relation!($s.$m.monitor_nm_per_code, is_gain(gain, 1e-6, 1e-2), "1e-6 … 1e-2 N·m, or negative");
    };
}

macro_rules! encoder {
    ($s:ident, $m:ident) => {
        let counts = $s.$m.counts_per_rev;
        relation!($s.$m.counts_per_rev, (1000..=16_000_000).contains(&counts), "1000 … 16000000");
        relation!($s.$m.counter_bits, matches!($s.$m.counter_bits, 16 | 32), "16 or 32");
    };
}

macro_rules! bridge {
    ($s:ident, $b:ident) => {
        within!($s.$b.zero_code, 0.0..=65535.0, "");
        let gain = $s.$b.unit_per_code;
        relation!($s.$b.unit_per_code, is_gain(gain, 1e-6, 1.0), "1e-6 … 1 unit, or negative");
        relation!(
            $s.$b.saturated_low_code,
            $s.$b.saturated_low_code >= $s.$b.short_code,
            "not below short_code"
        );
        relation!(
            $s.$b.saturated_high_code,
            $s.$b.saturated_high_code > $s.$b.saturated_low_code,
            "above saturated_low_code"
        );
        relation!(
            $s.$b.open_code,
            $s.$b.open_code >= $s.$b.saturated_high_code,
            "not below saturated_high_code"
        );
        relation!($s.$b.persistence_ticks, (1..=100).contains(&$s.$b.persistence_ticks), "1 … 100");
        within!($s.$b.lowpass_hz, 10.0..=4000.0, " Hz");
        within!($s.$b.tare_limit, 0.0..=1000.0, " unit");
    };
}

fn is_gain(value: f32, low: f32, high: f32) -> bool {
    (low..=high).contains(&libm::fabsf(value))
}

/// Checks every setting of its own and against others.
pub(crate) fn validate(s: &ControlSettings) -> Result<(), ParameterError> {
    within!(s.tick_s, 2e-5..=1e-3, " s");
    within!(s.geometry.friction_radius_m, 0.001..=1.0, " m");
    within!(s.geometry.lever_gain_n_per_nm, 0.1..=1000.0, " N/(N·m)");
    within!(s.geometry.preload_n, 0.0..=100.0, " N");
    drive!(s, m1);
    drive!(s, m2);
    within!(s.speed_loop.inertia_kg_m2, 1e-4..=10.0, " kg·m²");
    within!(s.speed_loop.bearing_coulomb_nm, 0.0..=5.0, " N·m");
    within!(s.speed_loop.bearing_viscous_nm_s, 0.0..=1.0, " N·m·s");
    within!(s.speed_loop.bandwidth_hz, 0.1..=60.0, " Hz");
    within!(s.speed_loop.damping_ratio, 0.3..=3.0, "");
    within!(s.speed_loop.slew_rad_s2, 0.1..=5000.0, " rad/s²");
    within!(s.speed_loop.friction_feed_forward, 0.0..=1.0, "");
    within!(s.speed_loop.estimator_bandwidth_hz, 5.0..=1000.0, " Hz");
    encoder!(s, m1_encoder);
    encoder!(s, m2_encoder);
    bridge!(s, friction_bridge);
    bridge!(s, normal_bridge);
    within!(s.tare_time_s, 0.001..=5.0, " s");
    within!(s.supply.volt_per_code, 1e-6..=0.01, " V");
    within!(s.supply.low_v, 0.0..=60.0, " V");
    within!(s.supply.high_v, 0.0..=60.0, " V");
    relation!(s.supply.high_v, s.supply.high_v > s.supply.low_v, "above supply.low_v");
    within!(s.supply.persistence_s, 0.0..=1.0, " s");
    limits(s)?;
    within!(s.encoder_watch.m1_max_speed_rad_s, 1.0..=1000.0, " rad/s");
    within!(s.encoder_watch.m1_max_acceleration_rad_s2, 100.0..=1e6, " rad/s²");
    within!(s.encoder_watch.m2_max_speed_rad_s, 1.0..=1000.0, " rad/s");
    within!(s.encoder_watch.m2_max_acceleration_rad_s2, 100.0..=1e6, " rad/s²");
    within!(s.encoder_watch.m2_breakaway_nm, 0.01..=10.0, " N·m");
    within!(s.encoder_watch.m1_breakaway_nm, 0.01..=10.0, " N·m");
    within!(s.encoder_watch.m2_free_speed_rad_s, 0.01..=100.0, " rad/s");
    within!(s.encoder_watch.m1_free_angle_rad, 1e-4..=1.0, " rad");
    within!(s.encoder_watch.window_s, 0.001..=1.0, " s");
    within!(s.torque_watch.offset_tolerance_nm, 0.01..=2.0, " N·m");
    within!(s.torque_watch.gain_tolerance, 0.0..=0.5, "");
    within!(s.torque_watch.lag_tolerance, 0.0..=1.0, "");
    let shows = |drive: &DriveSettings| {
        open_wire_s(drive, &s.torque_watch, s.tick_s).is_some_and(|time_s| time_s <= MOST_OPEN_WIRE_S)
    };
    relation!(
        s.m1.torque_lag_s,
        shows(&s.m1),
        "less, or less of torque_watch: an open wire must show in 20 ms"
    );
    relation!(
        s.m2.torque_lag_s,
        shows(&s.m2),
        "less, or less of torque_watch: an open wire must show in 20 ms"
    );
    within!(s.timing.boot_s, 0.0..=10.0, " s");
    relation!(s.timing.adc_frozen_ticks, s.timing.adc_frozen_ticks <= 100_000, "0 … 100000");
    relation!(s.timing.adc_stall_ticks, (1..=100).contains(&s.timing.adc_stall_ticks), "1 … 100");
    relation!(s.timing.adc_overrun_budget, s.timing.adc_overrun_budget <= 1000, "0 … 1000");
    relation!(s.timing.deadline_budget, s.timing.deadline_budget <= 1000, "0 … 1000");
    within!(s.timing.link_timeout_s, 0.01..=10.0, " s");
    within!(s.timing.stop_timeout_s, 0.1..=30.0, " s");
    within!(s.timing.rest_speed_rad_s, 0.001..=1.0, " rad/s");
    within!(s.observer.bridge_lowpass_hz, 0.0..=4000.0, " Hz");
    let corner = s.observer.bridge_lowpass_hz * s.tick_s;
    relation!(s.observer.bridge_lowpass_hz, corner <= 0.4, "below 0.4 of the control rate");
    within!(s.observer.residual_time_s, 0.001..=100.0, " s");
    Ok(())
}

fn limits(s: &ControlSettings) -> Result<(), ParameterError> {
    within!(s.limits.speed_rad_s, 0.1..=36.0, " rad/s (hard cap)");
    within!(s.limits.over_speed_rad_s, 0.1..=36.0, " rad/s (hard cap)");
    let over_speed = s.limits.over_speed_rad_s;
    relation!(s.limits.over_speed_rad_s, over_speed > s.limits.speed_rad_s, "above limits.speed_rad_s");
    within!(s.limits.over_torque_nm, 0.1..=10.0, " N·m (hard cap)");
    within!(s.limits.normal_force_n, 1.0..=215.0, " N (hard cap)");
    within!(s.limits.over_force_n, 1.0..=215.0, " N (hard cap)");
    let over_force = s.limits.over_force_n;
    relation!(s.limits.over_force_n, over_force > s.limits.normal_force_n, "above limits.normal_force_n");
    relation!(s.limits.persistence_ticks, (1..=100).contains(&s.limits.persistence_ticks), "1 … 100");
    let jump = s.encoder_watch.m2_max_speed_rad_s;
    relation!(s.encoder_watch.m2_max_speed_rad_s, jump > over_speed, "above limits.over_speed_rad_s");
    Ok(())
}
