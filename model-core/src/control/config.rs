//! The prepared configuration: settings turned into coefficients per tick.

use super::bridge::{Bridge, Tare};
use super::caps::RawCaps;
use super::encoder::Encoder;
use super::encoder_watch::{FreeWatch, SprungWatch};
use super::guard::Guard;
use super::inputs::PERMISSION_S;
use super::m1::M1;
use super::m2::M2;
use super::observer::{Observer, ObserverModel};
use super::outputs::{DAC_MAX, DAC_ZERO};
use super::settings::{ControlSettings, DriveSettings};
use super::speed::SpeedEstimator;
use super::supervisor::Timing;
use super::torque_watch::TorqueWatch;
use super::validate::validate;
use crate::error::ParameterError;

/// How long the disc must be still before it is at rest.
const REST_TIME_S: f32 = 0.05;

/// What the step reads. Built by [`ControlSettings::build`] and swapped whole.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ControlConfig {
    pub(crate) settings: ControlSettings,
    pub(crate) m1_encoder: Encoder,
    pub(crate) m2_encoder: Encoder,
    pub(crate) speed: SpeedEstimator,
    pub(crate) friction_bridge: Bridge,
    pub(crate) normal_bridge: Bridge,
    pub(crate) tare: Tare,
    pub(crate) m1: M1,
    pub(crate) m2: M2,
    pub(crate) m1_dac: Dac,
    pub(crate) m2_dac: Dac,
    pub(crate) m1_watch: SprungWatch,
    pub(crate) m2_watch: FreeWatch,
    pub(crate) m1_torque_watch: TorqueWatch,
    pub(crate) m2_torque_watch: TorqueWatch,
    pub(crate) guard: Guard,
    pub(crate) timing: Timing,
    pub(crate) observer: Observer,
}

impl ControlSettings {
    /// Checks every setting and prepares the coefficients.
    ///
    /// # Errors
    /// The first setting outside its range, with the range.
    pub fn build(&self) -> Result<ControlConfig, ParameterError> {
        self.build_within(&RawCaps::FULL_SCALE)
    }

    /// The same for a board with caps of its own.
    ///
    /// # Errors
    /// As [`Self::build`]; or a limit lies beyond a cap of the board.
    pub fn build_within(&self, caps: &RawCaps) -> Result<ControlConfig, ParameterError> {
        validate(self)?;
        caps.check(self)?;
        let dt = self.tick_s;
        let ticks = |time_s: f32| (time_s / dt) as u32;
        let w = &self.encoder_watch;
        let m1_encoder =
            Encoder::new(&self.m1_encoder, w.m1_max_speed_rad_s, w.m1_max_acceleration_rad_s2, dt);
        let m2_encoder =
            Encoder::new(&self.m2_encoder, w.m2_max_speed_rad_s, w.m2_max_acceleration_rad_s2, dt);
        Ok(ControlConfig {
            settings: *self,
            m1_encoder,
            m2_encoder,
            speed: SpeedEstimator::new(
                self.speed_loop.estimator_bandwidth_hz,
                m2_encoder.rad_per_count(),
                dt,
            ),
            friction_bridge: Bridge::new(&self.friction_bridge, dt),
            normal_bridge: Bridge::new(&self.normal_bridge, dt),
            tare: Tare::new(self),
            m1: M1::new(self),
            m2: M2::new(self),
            m1_dac: Dac::new(&self.m1, caps.dac_codes[0]),
            m2_dac: Dac::new(&self.m2, caps.dac_codes[1]),
            m1_watch: SprungWatch::new(self, m1_encoder.rad_per_count()),
            m2_watch: FreeWatch::new(self),
            m1_torque_watch: TorqueWatch::new(&self.m1, &self.torque_watch, dt),
            m2_torque_watch: TorqueWatch::new(&self.m2, &self.torque_watch, dt),
            guard: Guard::new(self),
            timing: Timing {
                boot_ticks: ticks(self.timing.boot_s),
                stop_ticks: ticks(self.timing.stop_timeout_s),
                rest_ticks: ticks(REST_TIME_S),
                permission_ticks: ticks(PERMISSION_S).max(1),
            },
            observer: Observer::new(&self.observer, self.geometry.friction_radius_m, dt)?,
        })
    }
}

impl ControlConfig {
    /// The settings it was built from. A model set later by command is not among them.
    #[must_use]
    pub fn settings(&self) -> &ControlSettings {
        &self.settings
    }

    /// Puts a prepared model, extended or not, in the place of the one in the settings.
    pub fn set_model(&mut self, model: &ObserverModel) {
        self.observer.set_model(model);
    }
}

/// Torque to DAC code: mid-scale is zero, 2048 codes are the rated torque.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Dac {
    codes_per_nm: f32,
    nm_per_code: f32,
    lowest: u16,
    highest: u16,
}

impl Dac {
    /// With codes no further than `reach` from zero.
    fn new(drive: &DriveSettings, reach: u16) -> Self {
        let rated_torque_nm = if drive.reversed { -drive.rated_torque_nm } else { drive.rated_torque_nm };
        let codes = f32::from(DAC_ZERO);
        Self {
            codes_per_nm: codes / rated_torque_nm,
            nm_per_code: rated_torque_nm / codes,
            lowest: DAC_ZERO.saturating_sub(reach),
            highest: DAC_ZERO.saturating_add(reach).min(DAC_MAX),
        }
    }

    /// The torque a code asks for.
    pub(crate) fn torque_nm(&self, code: u16) -> f32 {
        (f32::from(code) - f32::from(DAC_ZERO)) * self.nm_per_code
    }

    /// The nearest code; what is no number is zero torque.
    pub(crate) fn code(&self, torque_nm: f32) -> u16 {
        let code = f32::from(DAC_ZERO) + torque_nm * self.codes_per_nm + 0.5;
        if code.is_nan() {
            return DAC_ZERO;
        }
        // `as` rounds towards zero and saturates at both ends.
        (code as u16).min(self.highest).max(self.lowest)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_dac_has_its_zero_at_mid_scale_and_its_ends_at_the_rated_torque() {
        let plain = Dac::new(&ControlSettings::default().m1, DAC_ZERO);
        let turned = Dac::new(&DriveSettings { reversed: true, ..ControlSettings::default().m1 }, DAC_ZERO);
        for (torque_nm, code) in
            [(0.0, 2048), (4.0, 3072), (-4.0, 1024), (8.0, 4095), (-8.0, 0), (1e9, 4095), (-1e9, 0)]
        {
            assert_eq!(plain.code(torque_nm), code, "{torque_nm}");
        }
        assert_eq!((turned.code(4.0), turned.code(-4.0)), (1024, 3072));
        assert_eq!(
            (plain.torque_nm(3072), turned.torque_nm(3072), plain.torque_nm(DAC_ZERO)),
            (4.0, -4.0, 0.0)
        );
        // Half a step of 3.9 mN·m rounds to the nearest code.
        assert_eq!(
            (plain.code(0.0019), plain.code(0.0020), plain.code(-0.0019), plain.code(-0.0021)),
            (2048, 2049, 2048, 2047)
        );
        assert_eq!(plain.code(f32::NAN), DAC_ZERO);
        assert_eq!(Dac { codes_per_nm: f32::INFINITY, ..plain }.code(0.0), DAC_ZERO);
    }
}
