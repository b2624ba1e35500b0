//! Settings of the control core in physical units, with the assumed rig as default.
//!
//! [`ControlSettings::build`] checks them against their ranges and the hard caps and turns them into a
//! [`ControlConfig`](super::config::ControlConfig), once, outside the loop.
//!
//! Analogue levels follow a convention like NAMUR NE 43: the amplifiers clip inside the converter's range (beyond
//! `saturated_…`), and a broken or shorted wire is pulled outside that band (beyond `open_…`, `short_…`), so the
//! three can be told apart. All codes are of a 16 bit converter, 0 … 65535 for 0 … 3.3 V.

use super::observer::ModelParameters;
use crate::friction::{FrictionParameters, ModelKind};

/// Everything that can be set.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ControlSettings {
    /// Control period.
    pub tick_s: f32,
    /// What connects the motors to the contact.
    pub geometry: GeometrySettings,
    /// Drive and torque loop of M1.
    pub m1: DriveSettings,
    /// Drive and torque loop of M2.
    pub m2: DriveSettings,
    /// Speed loop of M2.
    pub speed_loop: SpeedLoopSettings,
    /// Encoder of M1.
    pub m1_encoder: EncoderSettings,
    /// Encoder of M2.
    pub m2_encoder: EncoderSettings,
    /// Friction bridge, N·m.
    pub friction_bridge: BridgeSettings,
    /// Normal force bridge, N.
    pub normal_bridge: BridgeSettings,
    /// Tare of both bridges.
    pub tare_time_s: f32,
    /// Supply check.
    pub supply: SupplySettings,
    /// Limits whose violation is a fault.
    pub limits: LimitSettings,
    /// Watch over encoders.
    pub encoder_watch: EncoderWatchSettings,
    /// Watch over the torques of both drives.
    pub torque_watch: TorqueWatchSettings,
    /// Time limits.
    pub timing: TimingSettings,
    /// Model observer.
    pub observer: ObserverSettings,
}

/// What connects the motors to the contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GeometrySettings {
    /// Distance of the elements from the disc's axis.
    pub friction_radius_m: f32,
    /// Normal force per torque of M1.
    pub lever_gain_n_per_nm: f32,
    /// Force of the foil springs that lift the elements off.
    pub preload_n: f32,
}

/// One drive with its torque loop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DriveSettings {
    /// Torque at full reference voltage.
    pub rated_torque_nm: f32,
    /// Time constant of the drive's own torque loop.
    pub torque_lag_s: f32,
    /// Largest commanded torque over the rated one, 0 … 1.
    pub torque_limit: f32,
    /// Fastest change of the commanded torque.
    pub slew_nm_per_s: f32,
    /// Bandwidth of the correction from the torque monitor; 0 turns it off.
    pub trim_bandwidth_hz: f32,
    /// Largest correction from the torque monitor.
    pub trim_limit_nm: f32,
    /// The drive turns the other way for a positive reference.
    pub reversed: bool,
    /// Torque monitor: code at zero torque.
    pub monitor_zero_code: f32,
    /// Torque monitor: torque per code; negative where its sign is turned.
    pub monitor_nm_per_code: f32,
}

/// Speed loop of M2.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpeedLoopSettings {
    /// Inertia of the motor and the disc.
    pub inertia_kg_m2: f32,
    /// Coulomb friction of the bearing.
    pub bearing_coulomb_nm: f32,
    /// Viscous friction of the bearing.
    pub bearing_viscous_nm_s: f32,
    /// Natural frequency of the closed loop.
    pub bandwidth_hz: f32,
    /// Damping ratio of the closed loop.
    pub damping_ratio: f32,
    /// Fastest change of the speed reference.
    pub slew_rad_s2: f32,
    /// Share of the measured friction torque that is fed forward, 0 … 1.
    pub friction_feed_forward: f32,
    /// Bandwidth of the speed estimator.
    pub estimator_bandwidth_hz: f32,
}

/// One encoder.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EncoderSettings {
    /// Counts of one revolution after quadrature.
    pub counts_per_rev: u32,
    /// Width of the hardware counter: 16 or 32.
    pub counter_bits: u32,
    /// The encoder counts down for a positive angle.
    pub reversed: bool,
}

/// One strain gauge bridge. `unit` is N·m or N.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BridgeSettings {
    /// Code at zero.
    pub zero_code: f32,
    /// Unit per code; negative where the sign is turned.
    pub unit_per_code: f32,
    /// At or below this code the wire is short.
    pub short_code: u16,
    /// At or below this code the amplifier is saturated.
    pub saturated_low_code: u16,
    /// At or above this code the amplifier is saturated.
    pub saturated_high_code: u16,
    /// At or above this code the wire is open.
    pub open_code: u16,
    /// Ticks in a row before open, short or saturated counts.
    pub persistence_ticks: u32,
    /// Corner of the light filter in front of control and limits; the record is not filtered.
    pub lowpass_hz: f32,
    /// Largest zero a tare may set, in unit.
    pub tare_limit: f32,
}

/// Supply check.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SupplySettings {
    /// Supply voltage per code, divider included.
    pub volt_per_code: f32,
    /// Below this it is too low.
    pub low_v: f32,
    /// Above this it is too high.
    pub high_v: f32,
    /// How long it must be outside.
    pub persistence_s: f32,
}

/// Limits whose violation is a fault.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LimitSettings {
    /// Largest speed an experiment may ask for; from here on the torque is folded back.
    pub speed_rad_s: f32,
    /// Over-speed.
    pub over_speed_rad_s: f32,
    /// Over-torque of M1 and M2.
    pub over_torque_nm: f32,
    /// Largest normal force an experiment may ask for in rest.
    pub normal_force_n: f32,
    /// Over-force.
    pub over_force_n: f32,
    /// Ticks in a row before over-torque and over-force count.
    pub persistence_ticks: u32,
}

/// Watch over encoders.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EncoderWatchSettings {
    /// Fastest motion of M1 there can be; faster is a jump.
    pub m1_max_speed_rad_s: f32,
    /// Strongest acceleration of M1 there can be; more is a jump.
    pub m1_max_acceleration_rad_s2: f32,
    /// Fastest motion of M2 there can be; faster is a jump.
    pub m2_max_speed_rad_s: f32,
    /// Strongest acceleration of M2 there can be; more is a jump.
    pub m2_max_acceleration_rad_s2: f32,
    /// Torque beyond friction that surely turns M2.
    pub m2_breakaway_nm: f32,
    /// Change of torque that surely moves M1.
    pub m1_breakaway_nm: f32,
    /// Speed that M2 may gain in one window without a torque.
    pub m2_free_speed_rad_s: f32,
    /// Angle that M1 may move in one window without a torque.
    pub m1_free_angle_rad: f32,
    /// Length of a window.
    pub window_s: f32,
}

/// Watch over the torques: how far what a drive gives may be from what it is asked for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TorqueWatchSettings {
    /// Offsets of drive and monitor together.
    pub offset_tolerance_nm: f32,
    /// Gain errors of drive and monitor together, as a share of the torque.
    pub gain_tolerance: f32,
    /// How well the drive's lag is known, as a share of it.
    pub lag_tolerance: f32,
}

/// Time limits.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TimingSettings {
    /// Length of the self-check after the start.
    pub boot_s: f32,
    /// Ticks without a new scan before the converter counts as stalled.
    pub adc_stall_ticks: u32,
    /// Ticks of a window in which each analogue input must move by its noise; 0 where it has none. The board decides it.
    pub adc_frozen_ticks: u32,
    /// Scans lost before that is a fault; one is forgiven every second.
    pub adc_overrun_budget: u32,
    /// Late ticks before that is a fault; one is forgiven every second.
    pub deadline_budget: u32,
    /// Silence of the host that is a fault while an experiment runs.
    pub link_timeout_s: f32,
    /// Longest time to bring the motors to rest.
    pub stop_timeout_s: f32,
    /// Below this speed the disc is at rest.
    pub rest_speed_rad_s: f32,
}

/// Model observer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ObserverSettings {
    /// Model of the whole contact.
    pub model: ModelParameters,
    /// Low-pass of the friction bridge's amplifier, second order, which the prediction passes too; 0: none.
    pub bridge_lowpass_hz: f32,
    /// Time constant of the residual's running mean square.
    pub residual_time_s: f32,
}

/// Codes of the whole converter range.
const ADC_CODES: f32 = 65536.0;

impl Default for ControlSettings {
    fn default() -> Self {
        Self {
            tick_s: 1e-4,
            geometry: GeometrySettings { friction_radius_m: 0.06, lever_gain_n_per_nm: 30.0, preload_n: 8.0 },
            // Slow enough that a step of 35 % excites the 120 Hz mode by a quarter less: the normal force is then within
            // 5 % before the friction peaks at 30 rpm.
            m1: DriveSettings { slew_nm_per_s: 800.0, ..DriveSettings::default() },
            m2: DriveSettings::default(),
            speed_loop: SpeedLoopSettings {
                inertia_kg_m2: 0.02,
                bearing_coulomb_nm: 0.15,
                bearing_viscous_nm_s: 0.005,
                bandwidth_hz: 25.0,
                damping_ratio: 1.0,
                slew_rad_s2: 100.0,
                friction_feed_forward: 0.9,
                estimator_bandwidth_hz: 150.0,
            },
            m1_encoder: EncoderSettings::default(),
            m2_encoder: EncoderSettings::default(),
            // ±12 N·m around mid-scale.
            friction_bridge: BridgeSettings { tare_limit: 1.0, ..BridgeSettings::spanning(-12.0, 12.0) },
            // −20 … +220 N.
            normal_bridge: BridgeSettings { tare_limit: 15.0, ..BridgeSettings::spanning(-20.0, 220.0) },
            tare_time_s: 0.5,
            // 24 V through 1:11.
            supply: SupplySettings {
                volt_per_code: 3.3 * 11.0 / ADC_CODES,
                low_v: 20.0,
                high_v: 28.0,
                persistence_s: 0.01,
            },
            limits: LimitSettings {
                speed_rad_s: 31.5,
                over_speed_rad_s: 34.0,
                over_torque_nm: 9.2,
                normal_force_n: 160.0,
                over_force_n: 210.0,
                persistence_ticks: 2,
            },
            encoder_watch: EncoderWatchSettings {
                // A step to the rated torque: 80 mrad with 120 Hz give 60 rad/s and 45 000 rad/s².
                m1_max_speed_rad_s: 100.0,
                m1_max_acceleration_rad_s2: 80_000.0,
                // (8 + 12) N·m on 0.02 kg·m² are 1000 rad/s².
                m2_max_speed_rad_s: 60.0,
                m2_max_acceleration_rad_s2: 5000.0,
                m2_breakaway_nm: 2.0,
                m1_breakaway_nm: 0.8,
                m2_free_speed_rad_s: 1.0,
                m1_free_angle_rad: 0.02,
                window_s: 0.02,
            },
            // 2 % of the monitor's 20 N·m, and 10 %, as much as the trim may have to make up for at rated torque.
            torque_watch: TorqueWatchSettings {
                offset_tolerance_nm: 0.4,
                gain_tolerance: 0.1,
                lag_tolerance: 0.2,
            },
            timing: TimingSettings {
                boot_s: 0.1,
                adc_stall_ticks: 2,
                adc_frozen_ticks: 0,
                adc_overrun_budget: 3,
                deadline_budget: 5,
                link_timeout_s: 0.5,
                stop_timeout_s: 3.0,
                rest_speed_rad_s: 0.05,
            },
            observer: ObserverSettings {
                model: default_model(),
                bridge_lowpass_hz: 1000.0,
                residual_time_s: 0.1,
            },
        }
    }
}

/// The assumed contact: rubber block in series with LuGre bristles.
fn default_model() -> ModelParameters {
    ModelParameters::Elements(FrictionParameters::typical(ModelKind::Series))
}

impl Default for DriveSettings {
    fn default() -> Self {
        Self {
            rated_torque_nm: 8.0,
            torque_lag_s: 1e-3,
            torque_limit: 1.0,
            slew_nm_per_s: 4000.0,
            trim_bandwidth_hz: 5.0,
            trim_limit_nm: 0.8,
            reversed: false,
            // ±10 N·m around mid-scale.
            monitor_zero_code: 0.5 * ADC_CODES,
            monitor_nm_per_code: 20.0 / ADC_CODES,
        }
    }
}

impl Default for EncoderSettings {
    fn default() -> Self {
        Self { counts_per_rev: 480_000, counter_bits: 32, reversed: false }
    }
}

impl BridgeSettings {
    /// A bridge whose amplifier maps `low` … `high` to the converter's range, with the usual thresholds: the
    /// amplifier clips at 1 % and 99 % of the range, wires fail beyond 0.2 % and 99.8 %.
    #[must_use]
    pub fn spanning(low: f32, high: f32) -> Self {
        let unit_per_code = (high - low) / ADC_CODES;
        Self {
            zero_code: -low / unit_per_code,
            unit_per_code,
            short_code: 131,
            saturated_low_code: 656,
            saturated_high_code: 64880,
            open_code: 65404,
            persistence_ticks: 2,
            lowpass_hz: 1500.0,
            tare_limit: 0.1 * (high - low),
        }
    }
}
