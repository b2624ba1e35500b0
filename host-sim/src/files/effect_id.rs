//! The effects that `diagnose` can name: their ids and the subsystem each belongs to.

/// Which part of the rig an effect sits in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Subsystem {
    /// The contact itself.
    Friction,
    /// Bridges, encoder, converters.
    Measurement,
    /// M1 and the pressing mechanism.
    Pressure,
    /// M2, shaft, disc, bearing; or a drive on its own.
    Drive,
}

impl Subsystem {
    /// Name in result files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Friction => "friction",
            Self::Measurement => "measurement",
            Self::Pressure => "pressure",
            Self::Drive => "drive",
        }
    }
}

/// All effect ids with their subsystem.
pub const EFFECTS: [(&str, Subsystem); 27] = {
    use Subsystem::{Drive, Friction, Measurement, Pressure};
    [
        ("element_compliance", Friction),
        ("thermal_fade", Friction),
        ("wear_drift", Friction),
        ("disc_angle", Friction),
        ("load_dependence", Friction),
        ("static_ageing", Friction),
        ("direction_asymmetry", Friction),
        ("bell_curve", Friction),
        ("rubber_relaxation", Friction),
        ("viscous_film", Friction),
        ("bridge_crosstalk", Measurement),
        ("bridge_drift", Measurement),
        ("friction_delay", Measurement),
        ("ring_resonance", Measurement),
        ("encoder_eccentricity", Measurement),
        ("adc_saturation", Measurement),
        ("lever_hysteresis", Pressure),
        ("foil_hardening", Pressure),
        ("m1_ripple", Pressure),
        ("shaft_torsion", Drive),
        ("backlash", Drive),
        ("m2_ripple", Drive),
        ("bearing_asymmetry", Drive),
        ("torque_offset", Drive),
        ("bearing_stribeck", Drive),
        ("presliding", Drive),
        ("drive_delay", Drive),
    ]
};

/// The subsystem of an effect; `None` for an id that is none.
pub fn subsystem_of(id: &str) -> Option<Subsystem> {
    EFFECTS.iter().find(|(known, _)| *known == id).map(|(_, subsystem)| *subsystem)
}
