//! Caps in raw counts and codes, which no setting can lift whatever it claims.
//!
//! The ranges of the settings are in physical units, and what a count or a code is worth is a setting itself: with
//! `counts_per_rev` or `rated_torque_nm` wrong by a factor every limit in rad/s, N·m or N would move with it. So the
//! board says what its converters and counters may show, in their own units, and settings whose limits come out beyond
//! that are refused. The torque references are held to their cap at the converter itself.

use super::settings::ControlSettings;
use crate::error::{ParameterError, require};
use core::f32::consts::TAU;

/// What the board allows, in units of its converters and counters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RawCaps {
    /// Counts of M2's encoder in a control period at over-speed.
    pub m2_counts_per_tick: f32,
    /// Largest distance of M1's and M2's DAC codes from zero torque.
    pub dac_codes: [u16; 2],
    /// Codes of the torque monitors at over-torque, from their zero.
    pub monitor_codes: f32,
    /// Largest distance of a monitor's zero from mid-scale, in codes.
    pub monitor_zero_codes: f32,
    /// Below this code the normal-force bridge must count as saturated.
    pub normal_low_code: u16,
    /// Above this code the normal-force bridge must count as saturated.
    pub normal_high_code: u16,
}

impl RawCaps {
    /// What the converters and counters can show at all: for rigs without a board.
    pub const FULL_SCALE: Self = Self {
        m2_counts_per_tick: 32_767.0,
        dac_codes: [2048; 2],
        monitor_codes: 1e9,
        monitor_zero_codes: 32_768.0,
        normal_low_code: 0,
        normal_high_code: u16::MAX,
    };

    pub(crate) fn check(&self, s: &ControlSettings) -> Result<(), ParameterError> {
        let speed = s.limits.over_speed_rad_s;
        let counts = speed * s.m2_encoder.counts_per_rev as f32 / TAU * s.tick_s;
        require(
            "limits.over_speed_rad_s",
            speed,
            counts <= self.m2_counts_per_tick,
            "less: by m2_encoder.counts_per_rev it is more counts a tick than the board's cap",
        )?;
        let torque = s.limits.over_torque_nm;
        for (drive, zero_name) in [(&s.m1, "m1.monitor_zero_code"), (&s.m2, "m2.monitor_zero_code")] {
            require(
                "limits.over_torque_nm",
                torque,
                torque <= self.monitor_codes * libm::fabsf(drive.monitor_nm_per_code),
                "less: by monitor_nm_per_code it is more codes than the board's cap",
            )?;
            let zero = drive.monitor_zero_code;
            let off = libm::fabsf(zero - 32_768.0);
            require(
                zero_name,
                zero,
                off <= self.monitor_zero_codes,
                "nearer to mid-scale, 32768 (board's cap)",
            )?;
        }
        let (low, high) = (s.normal_bridge.saturated_low_code, s.normal_bridge.saturated_high_code);
        require(
            "normal_bridge.saturated_low_code",
            f64::from(low),
            low >= self.normal_low_code,
            "more (board's cap)",
        )?;
        require(
            "normal_bridge.saturated_high_code",
            f64::from(high),
            high <= self.normal_high_code,
            "less (board's cap)",
        )?;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Caps of the assumed rig: 36 rad/s, rated torque, 9.6 N·m of the monitor, 217 N.
    const CAPS: RawCaps = RawCaps {
        m2_counts_per_tick: 275.0,
        dac_codes: [1903, 2048],
        monitor_codes: 31_457.0,
        monitor_zero_codes: 1_000.0,
        normal_low_code: 656,
        normal_high_code: 64_880,
    };

    fn refused(change: impl Fn(&mut ControlSettings)) -> Option<&'static str> {
        let mut settings = ControlSettings::default();
        change(&mut settings);
        assert!(settings.build().is_ok(), "without the board's caps nothing stands in its way");
        settings.build_within(&CAPS).err().map(|error| error.name)
    }

    #[test]
    fn a_scale_that_is_wrong_by_a_factor_lifts_no_limit() {
        assert_eq!(refused(|_| ()), None);
        // Four times the counts that the encoder has: 34 rad/s would be 136.
        assert_eq!(refused(|s| s.m2_encoder.counts_per_rev = 1_920_000), Some("limits.over_speed_rad_s"));
        // A fourth of them only stops earlier.
        assert_eq!(refused(|s| s.m2_encoder.counts_per_rev = 120_000), None);
        for factor in [0.5, -0.5] {
            assert_eq!(refused(|s| s.m1.monitor_nm_per_code *= factor), Some("limits.over_torque_nm"));
            assert_eq!(refused(|s| s.m2.monitor_nm_per_code *= factor), Some("limits.over_torque_nm"));
        }
        assert_eq!(refused(|s| s.m2.monitor_zero_code = 20_000.0), Some("m2.monitor_zero_code"));
        // Whatever a code is worth, at this one the bridge is saturated.
        assert_eq!(
            refused(|s| (s.normal_bridge.saturated_high_code, s.normal_bridge.open_code) = (65_500, 65_535)),
            Some("normal_bridge.saturated_high_code")
        );
        assert_eq!(
            refused(|s| (s.normal_bridge.short_code, s.normal_bridge.saturated_low_code) = (0, 100)),
            Some("normal_bridge.saturated_low_code")
        );
    }

    #[test]
    fn no_torque_however_scaled_makes_a_code_beyond_the_cap() {
        for rated_torque_nm in [0.1, 8.0, 10.0] {
            let mut settings = ControlSettings::default();
            settings.m1.rated_torque_nm = rated_torque_nm;
            // Else it is too wide for the smallest drive.
            settings.torque_watch.offset_tolerance_nm = 0.01;
            let config = settings.build_within(&CAPS).unwrap();
            assert_eq!((config.m1_dac.code(1e9), config.m1_dac.code(-1e9)), (2048 + 1903, 2048 - 1903));
            assert_eq!((config.m2_dac.code(1e9), config.m2_dac.code(-1e9)), (4095, 0));
        }
    }
}
