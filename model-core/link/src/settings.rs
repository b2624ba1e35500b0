//! The settings a user can change: key, name, unit, and where each one lies in the control core's settings.
//!
//! A key is a setting's number in flash and on the wire. It never changes its meaning: a setting that
//! goes keeps its key reserved, so that an older firmware's records are never misread. Every value
//! travels as `f32`; counts and codes are whole numbers below 2²⁴, which `f32` holds exactly.
//! Left out on purpose: the control period and the width of the encoder counters, which belong to the board.

use model_core::control::ControlSettings;
use serde::{Deserialize, Serialize};

/// Version of this list, stored beside the settings. It rises when a key changes its unit or meaning,
/// and the firmware then converts old records or refuses them.
pub const SCHEMA_VERSION: u16 = 1;

/// A setting's place in the list.
#[derive(Clone, Copy)]
pub struct SettingInfo {
    /// Number in flash and on the wire.
    pub key: u16,
    /// Path of the setting, as shown and typed by a user.
    pub name: &'static str,
    /// Unit, empty for a pure number.
    pub unit: &'static str,
    read: fn(&ControlSettings) -> f32,
    write: fn(&mut ControlSettings, f32) -> Result<(), NotWhole>,
}

/// The setting is a whole number, and this is none in its range.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NotWhole;

impl SettingInfo {
    /// The value in `settings`.
    #[must_use]
    pub fn get(&self, settings: &ControlSettings) -> f32 {
        (self.read)(settings)
    }

    /// Puts the value into `settings`. Its range is checked by `ControlSettings::build`.
    ///
    /// # Errors
    /// The setting is a whole number or a switch (0 or 1), and the value is none.
    pub fn set(&self, settings: &mut ControlSettings, value: f32) -> Result<(), NotWhole> {
        (self.write)(settings, value)
    }
}

impl core::fmt::Debug for SettingInfo {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("SettingInfo")
            .field("key", &self.key)
            .field("name", &self.name)
            .finish_non_exhaustive()
    }
}

/// A setting as the rig has it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct SettingState {
    /// Its key.
    pub key: u16,
    /// The value in force.
    pub active: f32,
    /// The stored value, if there is one.
    pub stored: Option<f32>,
    /// The value without a stored one.
    pub default: f32,
}

/// A field of the settings as `f32`.
trait Field: Sized {
    fn read(&self) -> f32;
    fn from_value(value: f32) -> Result<Self, NotWhole>;
}

impl Field for f32 {
    fn read(&self) -> f32 {
        *self
    }
    fn from_value(value: f32) -> Result<Self, NotWhole> {
        Ok(value)
    }
}

impl Field for bool {
    fn read(&self) -> f32 {
        f32::from(u8::from(*self))
    }
    fn from_value(value: f32) -> Result<Self, NotWhole> {
        match u16::from_value(value)? {
            0 => Ok(false),
            1 => Ok(true),
            _ => Err(NotWhole),
        }
    }
}

impl Field for u16 {
    fn read(&self) -> f32 {
        f32::from(*self)
    }
    fn from_value(value: f32) -> Result<Self, NotWhole> {
        Self::try_from(u32::from_value(value)?).map_err(|_| NotWhole)
    }
}

impl Field for u32 {
    #[allow(clippy::cast_precision_loss)] // `from_value` takes only what f32 holds exactly
    fn read(&self) -> f32 {
        *self as f32
    }
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, clippy::cast_precision_loss)] // checked
    fn from_value(value: f32) -> Result<Self, NotWhole> {
        let whole = value as Self;
        let exact = (0.0..16_777_216.0).contains(&value) && (value - whole as f32) == 0.0;
        if exact { Ok(whole) } else { Err(NotWhole) }
    }
}

macro_rules! settings {
    ($($key:literal: $($path:ident).+ $(, $unit:literal)?;)+) => {
        /// Every setting, by rising key.
        pub const ALL: &[SettingInfo] = &[$(SettingInfo {
            key: $key,
            name: settings!(@name $($path).+),
            unit: settings!(@unit $($unit)?),
            read: |settings| Field::read(&settings.$($path).+),
            write: |settings, value| {
                settings.$($path).+ = Field::from_value(value)?;
                Ok(())
            },
        },)+];
    };
    (@name $first:ident $(. $rest:ident)*) => { concat!(stringify!($first) $(, ".", stringify!($rest))*) };
    (@unit $unit:literal) => { $unit };
    (@unit) => { "" };
}

settings! {
    10: geometry.friction_radius_m, "m";
    11: geometry.lever_gain_n_per_nm, "N/(N m)";
    12: geometry.preload_n, "N";

    100: m1.rated_torque_nm, "N m";
    101: m1.torque_lag_s, "s";
    102: m1.torque_limit;
    103: m1.slew_nm_per_s, "N m/s";
    104: m1.trim_bandwidth_hz, "Hz";
    105: m1.trim_limit_nm, "N m";
    106: m1.reversed, "0 or 1";
    107: m1.monitor_zero_code, "code";
    108: m1.monitor_nm_per_code, "N m/code";

    120: m2.rated_torque_nm, "N m";
    121: m2.torque_lag_s, "s";
    122: m2.torque_limit;
    123: m2.slew_nm_per_s, "N m/s";
    124: m2.trim_bandwidth_hz, "Hz";
    125: m2.trim_limit_nm, "N m";
    126: m2.reversed, "0 or 1";
    127: m2.monitor_zero_code, "code";
    128: m2.monitor_nm_per_code, "N m/code";

    140: speed_loop.inertia_kg_m2, "kg m2";
    141: speed_loop.bearing_coulomb_nm, "N m";
    142: speed_loop.bearing_viscous_nm_s, "N m s";
    143: speed_loop.bandwidth_hz, "Hz";
    144: speed_loop.damping_ratio;
    145: speed_loop.slew_rad_s2, "rad/s2";
    146: speed_loop.friction_feed_forward;
    147: speed_loop.estimator_bandwidth_hz, "Hz";

    160: m1_encoder.counts_per_rev, "counts";
    161: m1_encoder.reversed, "0 or 1";
    170: m2_encoder.counts_per_rev, "counts";
    171: m2_encoder.reversed, "0 or 1";

    200: friction_bridge.zero_code, "code";
    201: friction_bridge.unit_per_code, "N m/code";
    202: friction_bridge.short_code, "code";
    203: friction_bridge.saturated_low_code, "code";
    204: friction_bridge.saturated_high_code, "code";
    205: friction_bridge.open_code, "code";
    206: friction_bridge.persistence_ticks, "ticks";
    207: friction_bridge.lowpass_hz, "Hz";
    208: friction_bridge.tare_limit, "N m";

    220: normal_bridge.zero_code, "code";
    221: normal_bridge.unit_per_code, "N/code";
    222: normal_bridge.short_code, "code";
    223: normal_bridge.saturated_low_code, "code";
    224: normal_bridge.saturated_high_code, "code";
    225: normal_bridge.open_code, "code";
    226: normal_bridge.persistence_ticks, "ticks";
    227: normal_bridge.lowpass_hz, "Hz";
    228: normal_bridge.tare_limit, "N";

    240: tare_time_s, "s";

    260: supply.volt_per_code, "V/code";
    261: supply.low_v, "V";
    262: supply.high_v, "V";
    263: supply.persistence_s, "s";

    280: limits.speed_rad_s, "rad/s";
    281: limits.over_speed_rad_s, "rad/s";
    282: limits.over_torque_nm, "N m";
    283: limits.normal_force_n, "N";
    284: limits.over_force_n, "N";
    285: limits.persistence_ticks, "ticks";

    300: encoder_watch.m1_max_speed_rad_s, "rad/s";
    301: encoder_watch.m1_max_acceleration_rad_s2, "rad/s2";
    302: encoder_watch.m2_max_speed_rad_s, "rad/s";
    303: encoder_watch.m2_max_acceleration_rad_s2, "rad/s2";
    304: encoder_watch.m2_breakaway_nm, "N m";
    305: encoder_watch.m1_breakaway_nm, "N m";
    306: encoder_watch.m2_free_speed_rad_s, "rad/s";
    307: encoder_watch.m1_free_angle_rad, "rad";
    308: encoder_watch.window_s, "s";

    320: timing.boot_s, "s";
    321: timing.adc_stall_ticks, "ticks";
    322: timing.adc_overrun_budget, "scans";
    323: timing.deadline_budget, "ticks";
    324: timing.link_timeout_s, "s";
    325: timing.stop_timeout_s, "s";
    326: timing.rest_speed_rad_s, "rad/s";

    340: observer.bridge_lowpass_hz, "Hz";
    341: observer.residual_time_s, "s";

    360: torque_watch.offset_tolerance_nm, "N m";
    361: torque_watch.gain_tolerance;
    362: torque_watch.lag_tolerance;
}

/// The setting with this key.
#[must_use]
pub fn by_key(key: u16) -> Option<&'static SettingInfo> {
    ALL.iter().find(|setting| setting.key == key)
}

/// The setting with this name.
#[must_use]
pub fn by_name(name: &str) -> Option<&'static SettingInfo> {
    ALL.iter().find(|setting| setting.name == name)
}
