//! The numbers of the rig, in physical units. The paper prints none: every default here is assumed, except the
//! encoder (120 000 pulses a revolution) and the number and place of the elements.

use super::elements::ElementParameters;
use model_core::error::ParameterError;
use model_core::extension::Extensions;
use model_core::sensor::{DAMPING_RATIO, MODE_HZ};

/// Everything the plant is built from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlantParameters {
    /// What connects the motors to the contact.
    pub geometry: GeometryParameters,
    /// Drive of M1.
    pub m1: DriveParameters,
    /// Drive of M2.
    pub m2: DriveParameters,
    /// What M2 turns.
    pub disc: DiscParameters,
    /// Bearing of the disc.
    pub bearing: BearingParameters,
    /// Elastic shaft between M2 and disc; without it the shaft is rigid.
    pub shaft: Option<ShaftParameters>,
    /// Normal force.
    pub pressure: PressureParameters,
    /// Torque ring and its amplifier.
    pub friction_bridge: BridgeParameters,
    /// Frame and its amplifier; the frame's own mode is that of the pressure.
    pub normal_bridge: BridgeParameters,
    /// Counts of one revolution of either encoder.
    pub counts_per_rev: u32,
    /// Levels at the converter's pins.
    pub analogue: AnalogueParameters,
    /// Standard deviations of the noise of one sample.
    pub noise: NoiseParameters,
    /// The share of the normal force that each element bears; their sum is one.
    pub load_shares: [f64; 3],
    /// Sub-steps of a control period.
    pub substeps: Substeps,
    /// The friction of all three elements together.
    pub elements: ElementParameters,
    /// Effects on that friction, beyond the model.
    pub effects: Option<Extensions<f64>>,
}

/// How many sub-steps a control period is divided into. Stiff parts get more than asked for by themselves.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Substeps {
    /// Where nothing changes fast.
    pub calm: u32,
    /// Where the load or the tips' speed changes fast: at load steps, breaking loose, sticking again.
    pub busy: u32,
}

/// What connects the motors to the contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GeometryParameters {
    /// Distance of the elements from the disc's axis.
    pub friction_radius_m: f64,
    /// Normal force per torque of M1.
    pub lever_gain_n_per_nm: f64,
    /// Normal force per angle of M1.
    pub mechanism_stiffness_n_per_rad: f64,
}

/// A servo drive.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DriveParameters {
    /// Torque at full reference voltage.
    pub rated_torque_nm: f64,
    /// Time constant of the drive's own torque loop; below 1 µs it is taken as 1 µs.
    pub torque_lag_s: f64,
}

impl DriveParameters {
    pub(crate) fn lag_s(&self) -> f64 {
        self.torque_lag_s.max(1e-6)
    }
}

/// What M2 turns.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DiscParameters {
    /// Inertia of motor and asphalt disc.
    pub inertia_kg_m2: f64,
    /// Number of additional inertia discs.
    pub inertia_discs: u32,
    /// Inertia of one of them.
    pub inertia_disc_kg_m2: f64,
}

/// Bearing of the disc.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BearingParameters {
    /// Coulomb friction.
    pub coulomb_nm: f64,
    /// Viscous friction.
    pub viscous_nm_s: f64,
    /// Speed over which the Coulomb friction changes its sign.
    pub smoothing_speed_rad_s: f64,
}

/// Elastic shaft, with or without a backlash.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ShaftParameters {
    /// Torsional stiffness.
    pub stiffness_nm_per_rad: f64,
    /// Torsional damping.
    pub damping_nm_s: f64,
    /// Play between the flanks, 0 for none.
    pub backlash_rad: f64,
    /// The part of the inertia on the motor's side.
    pub motor_inertia_kg_m2: f64,
}

/// Normal force.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PressureParameters {
    /// Force of the foil springs that lift the elements off.
    pub preload_n: f64,
    /// Frequency of the normal-force mode.
    pub mode_hz: f64,
    /// Its damping ratio.
    pub damping_ratio: f64,
}

/// A strain gauge bridge with its amplifier; without both an ideal sensor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BridgeParameters {
    /// Mode of the part that carries the gauges; `None` is rigid.
    pub mode: Option<ModeParameters>,
    /// Corner of the amplifier's low-pass of second order; `None` is none.
    pub lowpass_hz: Option<f64>,
}

/// A mode of second order.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ModeParameters {
    /// Natural frequency.
    pub mode_hz: f64,
    /// Damping ratio.
    pub damping_ratio: f64,
}

/// Levels at the converter's pins.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AnalogueParameters {
    /// Friction torque at the upper end of the range; the lower end is its negative.
    pub friction_full_scale_nm: f64,
    /// Normal force at 0 V.
    pub normal_low_n: f64,
    /// Normal force at the upper end of the range.
    pub normal_high_n: f64,
    /// Motor torque at the upper end of the range; the lower end is its negative.
    pub monitor_full_scale_nm: f64,
    /// Supply of the drives.
    pub supply_v: f64,
    /// Ratio of the supply's divider.
    pub supply_divider: f64,
    /// Reference of the converter: the upper end of the range.
    pub reference_v: f64,
    /// Amplifiers clip within this share of either end of the range.
    pub clip_share: f64,
}

/// Standard deviations of the noise of one sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NoiseParameters {
    /// Friction bridge.
    pub friction_nm: f64,
    /// Normal force bridge.
    pub normal_n: f64,
    /// Torque monitors.
    pub torque_nm: f64,
    /// Supply.
    pub supply_v: f64,
}

impl Default for PlantParameters {
    fn default() -> Self {
        Self {
            geometry: GeometryParameters::default(),
            m1: DriveParameters::default(),
            m2: DriveParameters::default(),
            disc: DiscParameters::default(),
            bearing: BearingParameters::default(),
            shaft: None,
            pressure: PressureParameters::default(),
            friction_bridge: BridgeParameters::default(),
            normal_bridge: BridgeParameters { mode: None, lowpass_hz: Some(1000.0) },
            counts_per_rev: 480_000,
            analogue: AnalogueParameters::default(),
            noise: NoiseParameters::default(),
            load_shares: [1.0 / 3.0; 3],
            substeps: Substeps { calm: 1, busy: 16 },
            elements: ElementParameters::default(),
            effects: None,
        }
    }
}

impl Default for GeometryParameters {
    fn default() -> Self {
        Self { friction_radius_m: 0.06, lever_gain_n_per_nm: 30.0, mechanism_stiffness_n_per_rad: 3000.0 }
    }
}

impl Default for DriveParameters {
    fn default() -> Self {
        Self { rated_torque_nm: 8.0, torque_lag_s: 1e-3 }
    }
}

impl Default for DiscParameters {
    fn default() -> Self {
        Self { inertia_kg_m2: 0.02, inertia_discs: 0, inertia_disc_kg_m2: 0.01 }
    }
}

impl Default for BearingParameters {
    fn default() -> Self {
        Self { coulomb_nm: 0.15, viscous_nm_s: 0.005, smoothing_speed_rad_s: 0.01 }
    }
}

impl Default for ShaftParameters {
    fn default() -> Self {
        Self {
            stiffness_nm_per_rad: 400.0,
            damping_nm_s: 0.05,
            backlash_rad: 0.0,
            motor_inertia_kg_m2: 0.002,
        }
    }
}

impl Default for PressureParameters {
    fn default() -> Self {
        Self { preload_n: 8.0, mode_hz: 120.0, damping_ratio: 0.25 }
    }
}

impl Default for BridgeParameters {
    fn default() -> Self {
        Self { mode: Some(ModeParameters { mode_hz: 600.0, damping_ratio: 0.02 }), lowpass_hz: Some(1000.0) }
    }
}

impl BridgeParameters {
    /// Neither mode nor low-pass.
    pub const IDEAL: Self = Self { mode: None, lowpass_hz: None };
}

impl Default for AnalogueParameters {
    fn default() -> Self {
        Self {
            friction_full_scale_nm: 12.0,
            normal_low_n: -20.0,
            normal_high_n: 220.0,
            monitor_full_scale_nm: 10.0,
            supply_v: 24.0,
            supply_divider: 11.0,
            reference_v: 3.3,
            clip_share: 0.01,
        }
    }
}

impl Default for NoiseParameters {
    fn default() -> Self {
        Self { friction_nm: 0.004, normal_n: 0.05, torque_nm: 0.005, supply_v: 0.01 }
    }
}

impl NoiseParameters {
    /// No noise at all.
    #[must_use]
    pub fn none() -> Self {
        Self { friction_nm: 0.0, normal_n: 0.0, torque_nm: 0.0, supply_v: 0.0 }
    }
}

impl PlantParameters {
    /// Inertia of everything that turns.
    #[must_use]
    pub fn total_inertia_kg_m2(&self) -> f64 {
        self.disc.inertia_kg_m2 + f64::from(self.disc.inertia_discs) * self.disc.inertia_disc_kg_m2
    }

    /// Checks every number against its range; the friction parameters are checked where their model is built.
    ///
    /// # Errors
    /// The first number out of range, by its name in the file, and what is allowed.
    pub fn check(&self) -> Result<(), ParameterError> {
        let within = |name: &'static str, value: f64, low: f64, high: f64, allowed: &'static str| {
            if value >= low && value <= high { Ok(()) } else { Err(ParameterError { name, value, allowed }) }
        };
        let g = &self.geometry;
        within("geometry.friction_radius_m", g.friction_radius_m, 1e-3, 10.0, "0.001 to 10 m")?;
        within("geometry.lever_gain_n_per_nm", g.lever_gain_n_per_nm, 0.1, 1e4, "0.1 to 1e4 N/(N m)")?;
        within(
            "geometry.mechanism_stiffness_n_per_rad",
            g.mechanism_stiffness_n_per_rad,
            1.0,
            1e9,
            "1 to 1e9 N/rad",
        )?;
        for (drive, rated, lag) in [
            (&self.m1, "m1.rated_torque_nm", "m1.torque_lag_s"),
            (&self.m2, "m2.rated_torque_nm", "m2.torque_lag_s"),
        ] {
            within(rated, drive.rated_torque_nm, 0.01, 1e4, "0.01 to 1e4 N m")?;
            within(lag, drive.torque_lag_s, 0.0, 1.0, "0 to 1 s")?;
        }
        let d = &self.disc;
        within("disc.inertia_kg_m2", d.inertia_kg_m2, 1e-5, 100.0, "1e-5 to 100 kg m2")?;
        within("disc.inertia_discs", f64::from(d.inertia_discs), 0.0, 100.0, "0 to 100")?;
        within("disc.inertia_disc_kg_m2", d.inertia_disc_kg_m2, 0.0, 100.0, "0 to 100 kg m2")?;
        let b = &self.bearing;
        within("bearing.coulomb_nm", b.coulomb_nm, 0.0, 100.0, "0 to 100 N m")?;
        within("bearing.viscous_nm_s", b.viscous_nm_s, 0.0, 10.0, "0 to 10 N m s")?;
        within("bearing.smoothing_speed_rad_s", b.smoothing_speed_rad_s, 1e-4, 1.0, "1e-4 to 1 rad/s")?;
        if let Some(s) = &self.shaft {
            within("shaft.stiffness_nm_per_rad", s.stiffness_nm_per_rad, 1.0, 1e5, "1 to 1e5 N m/rad")?;
            within("shaft.damping_nm_s", s.damping_nm_s, 0.0, 10.0, "0 to 10 N m s")?;
            within("shaft.backlash_rad", s.backlash_rad, 0.0, 0.5, "0 to 0.5 rad")?;
            let most = self.total_inertia_kg_m2() - 1e-5;
            let motor = s.motor_inertia_kg_m2;
            within(
                "shaft.motor_inertia_kg_m2",
                motor,
                1e-5,
                most,
                "at least 1e-5 kg m2, less than the disc",
            )?;
        }
        let p = &self.pressure;
        within("pressure.preload_n", p.preload_n, 0.0, 1e4, "0 to 1e4 N")?;
        within("pressure.mode_hz", p.mode_hz, 1.0, 2000.0, "1 to 2000 Hz")?;
        within("pressure.damping_ratio", p.damping_ratio, 0.0, 10.0, "0 to 10")?;
        for (bridge, names) in [
            (
                &self.friction_bridge,
                ["friction_bridge.mode_hz", "friction_bridge.damping_ratio", "friction_bridge.lowpass_hz"],
            ),
            (
                &self.normal_bridge,
                ["normal_bridge.mode_hz", "normal_bridge.damping_ratio", "normal_bridge.lowpass_hz"],
            ),
        ] {
            if let Some(mode) = &bridge.mode {
                MODE_HZ.check(names[0], mode.mode_hz)?;
                DAMPING_RATIO.check(names[1], mode.damping_ratio)?;
            }
            if let Some(lowpass_hz) = bridge.lowpass_hz {
                within(names[2], lowpass_hz, 1.0, 1e5, "1 to 1e5 Hz")?;
            }
        }
        within("counts_per_rev", f64::from(self.counts_per_rev), 4.0, 1e8, "4 to 1e8")?;
        let a = &self.analogue;
        within("analogue.friction_full_scale_nm", a.friction_full_scale_nm, 1e-3, 1e5, "0.001 to 1e5 N m")?;
        within("analogue.normal_high_n", a.normal_high_n - a.normal_low_n, 1e-3, 1e6, "above normal_low_n")?;
        within("analogue.monitor_full_scale_nm", a.monitor_full_scale_nm, 1e-3, 1e5, "0.001 to 1e5 N m")?;
        within("analogue.supply_v", a.supply_v, 0.0, 100.0, "0 to 100 V")?;
        within("analogue.supply_divider", a.supply_divider, 1.0, 1000.0, "1 to 1000")?;
        within("analogue.reference_v", a.reference_v, 0.1, 10.0, "0.1 to 10 V")?;
        within("analogue.clip_share", a.clip_share, 0.0, 0.2, "0 to 0.2")?;
        let n = &self.noise;
        within("noise.friction_nm", n.friction_nm, 0.0, 1e3, "0 to 1000 N m")?;
        within("noise.normal_n", n.normal_n, 0.0, 1e4, "0 to 1e4 N")?;
        within("noise.torque_nm", n.torque_nm, 0.0, 1e3, "0 to 1000 N m")?;
        within("noise.supply_v", n.supply_v, 0.0, 10.0, "0 to 10 V")?;
        for share in self.load_shares {
            within("load_shares", share, 0.0, 1.0, "three numbers from 0 to 1 whose sum is 1")?;
        }
        let sum = self.load_shares.iter().sum::<f64>();
        within("load_shares", sum, 1.0 - 1e-9, 1.0 + 1e-9, "three numbers from 0 to 1 whose sum is 1")?;
        within("substeps.calm", f64::from(self.substeps.calm), 1.0, 1e4, "1 to 10000")?;
        within("substeps.busy", f64::from(self.substeps.busy), 1.0, 1e4, "1 to 10000")
    }
}
