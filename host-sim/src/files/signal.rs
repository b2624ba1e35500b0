//! The columns of a log that the tool knows: names with their units, meanings, and look-alikes.

/// A known column.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Signal {
    /// Time.
    Time,
    /// Torque demanded of M1, the pressing motor.
    M1TorqueRef,
    /// Torque of M1 as its monitor reports it.
    M1Torque,
    /// Angle of M1.
    M1Angle,
    /// Torque demanded of M2, the motor that turns the disc.
    M2TorqueRef,
    /// Torque of M2 as its monitor reports it.
    M2Torque,
    /// Angle of the disc.
    M2Angle,
    /// Speed of the disc.
    M2Speed,
    /// Normal force on all three elements together, > 0 presses.
    NormalForce,
    /// Friction torque, > 0 resists m2_speed > 0.
    FrictionTorque,
    /// Temperature of the rubbing surface, where there is a sensor.
    SurfaceTemperature,
    /// Driving force of a linear stage.
    Force,
    /// Position of a linear stage.
    Position,
}

/// All known columns in the order in which the tool writes them.
pub const SIGNALS: [Signal; 13] = [
    Signal::Time,
    Signal::M1TorqueRef,
    Signal::M1Torque,
    Signal::M1Angle,
    Signal::M2TorqueRef,
    Signal::M2Torque,
    Signal::M2Angle,
    Signal::M2Speed,
    Signal::NormalForce,
    Signal::FrictionTorque,
    Signal::SurfaceTemperature,
    Signal::Force,
    Signal::Position,
];

impl Signal {
    /// Name of the quantity without its unit.
    const fn stem(self) -> &'static str {
        match self {
            Self::Time => "time",
            Self::M1TorqueRef => "m1_torque_ref",
            Self::M1Torque => "m1_torque",
            Self::M1Angle => "m1_angle",
            Self::M2TorqueRef => "m2_torque_ref",
            Self::M2Torque => "m2_torque",
            Self::M2Angle => "m2_angle",
            Self::M2Speed => "m2_speed",
            Self::NormalForce => "normal_force",
            Self::FrictionTorque => "friction_torque",
            Self::SurfaceTemperature => "surface_temperature",
            Self::Force => "force",
            Self::Position => "position",
        }
    }

    /// Name of the column.
    pub const fn column(self) -> &'static str {
        match self {
            Self::Time => "time_s",
            Self::M1TorqueRef => "m1_torque_ref_nm",
            Self::M1Torque => "m1_torque_nm",
            Self::M1Angle => "m1_angle_rad",
            Self::M2TorqueRef => "m2_torque_ref_nm",
            Self::M2Torque => "m2_torque_nm",
            Self::M2Angle => "m2_angle_rad",
            Self::M2Speed => "m2_speed_rad_s",
            Self::NormalForce => "normal_force_n",
            Self::FrictionTorque => "friction_torque_nm",
            Self::SurfaceTemperature => "surface_temperature_c",
            Self::Force => "force_n",
            Self::Position => "position_m",
        }
    }

    /// The unit in words, for error messages.
    pub const fn unit(self) -> &'static str {
        match self {
            Self::Time => "seconds",
            Self::M1TorqueRef
            | Self::M1Torque
            | Self::M2TorqueRef
            | Self::M2Torque
            | Self::FrictionTorque => "newton metres",
            Self::M1Angle | Self::M2Angle => "radians",
            Self::M2Speed => "radians per second",
            Self::NormalForce | Self::Force => "newtons",
            Self::SurfaceTemperature => "degrees Celsius",
            Self::Position => "metres",
        }
    }

    /// The known column with exactly this name.
    pub fn named(name: &str) -> Option<Self> {
        SIGNALS.into_iter().find(|signal| signal.column() == name)
    }

    /// The known column that was meant by a name with another unit, no unit, or another spelling.
    pub fn meant_by(name: &str) -> Option<Self> {
        let plain = plain(name);
        if Self::named(name).is_some() {
            return None;
        }
        SIGNALS.into_iter().find(|signal| {
            plain == signal.column()
                || plain == signal.stem()
                || plain
                    .strip_prefix(signal.stem())
                    .and_then(|rest| rest.strip_prefix('_'))
                    .is_some_and(|unit| UNITS.contains(&unit))
        })
    }
}

/// Lower case, everything but letters and digits as one `_`: `Time [ms]` is `time_ms`.
fn plain(name: &str) -> String {
    let mut plain = String::with_capacity(name.len());
    for c in name.chars() {
        if c.is_ascii_alphanumeric() {
            plain.push(c.to_ascii_lowercase());
        } else if !plain.is_empty() && !plain.ends_with('_') {
            plain.push('_');
        }
    }
    plain.trim_end_matches('_').into()
}

/// Endings that are units of something.
const UNITS: [&str; 54] = [
    "s", "sec", "seconds", "ms", "us", "ns", "min", "h", "ticks", "n", "kn", "mn", "newton", "newtons",
    "lbf", "kgf", "kg", "g", "nm", "n_m", "mnm", "knm", "ncm", "n_cm", "n_mm", "nmm", "lbft", "lbf_ft",
    "rad", "mrad", "deg", "degrees", "rev", "revs", "turns", "counts", "rad_s", "rads", "deg_s", "rpm",
    "rps", "rev_s", "rev_min", "hz", "m", "mm", "um", "cm", "km", "in", "inch", "c", "k", "f",
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_with_another_unit_or_spelling_are_told_apart_from_unknown_ones() {
        for (name, meant) in [
            ("normal_force_kn", Signal::NormalForce),
            ("normal_force", Signal::NormalForce),
            ("time_ms", Signal::Time),
            ("m2_speed_rpm", Signal::M2Speed),
            ("m1_torque_ref_mnm", Signal::M1TorqueRef),
            ("m1_torque_n_m", Signal::M1Torque),
            ("Time [s]", Signal::Time),
            ("position_mm", Signal::Position),
            ("M2_Speed_rad/s", Signal::M2Speed),
        ] {
            assert_eq!(Signal::meant_by(name), Some(meant), "{name}");
        }
        for name in ["friction_torque_true_nm", "force_sensor_v", "note", "time_s", "m1_torque_monitor_v"] {
            assert_eq!(Signal::meant_by(name), None, "{name}");
        }
    }

    #[test]
    fn every_column_name_is_its_stem_and_a_unit() {
        for signal in SIGNALS {
            let unit = signal.column().strip_prefix(signal.stem()).and_then(|u| u.strip_prefix('_'));
            assert!(unit.is_some_and(|unit| UNITS.contains(&unit)), "{signal:?}");
            assert_eq!(Signal::named(signal.column()), Some(signal));
        }
    }
}
