//! Names of the effects a log can hide.
//!
//! The first 27 are those a diagnosis is asked to name. The others are outside that list on purpose:
//! the right answer to them is that nothing known explains the log.

use serde::{Serialize, Serializer};

use crate::random::Stream;

/// Part of the rig that an effect sits in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Subsystem {
    /// Elements on the disc.
    Friction,
    /// Sensors and their electronics.
    Measurement,
    /// M1, lever, foil springs.
    Pressure,
    /// M2, shaft, bearing.
    Drive,
}

macro_rules! effects {
    ($($(#[$doc:meta])* $name:ident, $id:literal, $subsystem:ident, $known:literal;)*) => {
        /// An effect.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
        pub enum Effect { $($(#[$doc])* $name,)* }

        impl Effect {
            /// Every effect, the nameable ones first.
            pub const ALL: &'static [Self] = &[$(Self::$name,)*];

            /// Its name in files.
            #[must_use]
            pub fn id(self) -> &'static str {
                match self { $(Self::$name => $id,)* }
            }

            /// Where it sits.
            #[must_use]
            pub fn subsystem(self) -> Subsystem {
                match self { $(Self::$name => Subsystem::$subsystem,)* }
            }

            /// Whether it is one of the effects a diagnosis is asked to name.
            #[must_use]
            pub fn is_known(self) -> bool {
                match self { $(Self::$name => $known,)* }
            }
        }
    };
}

effects! {
    /// An elastic block in series with the bristles that the baseline lacks.
    ElementCompliance, "element_compliance", Friction, true;
    /// µ falls with the heat of sliding.
    ThermalFade, "thermal_fade", Friction, true;
    /// µ changes with the distance slid.
    WearDrift, "wear_drift", Friction, true;
    /// µ varies round the disc.
    DiscAngle, "disc_angle", Friction, true;
    /// µ varies with the normal force.
    LoadDependence, "load_dependence", Friction, true;
    /// Breakaway grows with dwell.
    StaticAgeing, "static_ageing", Friction, true;
    /// µ depends on the direction.
    DirectionAsymmetry, "direction_asymmetry", Friction, true;
    /// Friction rises with speed before it falls.
    BellCurve, "bell_curve", Friction, true;
    /// The block creeps.
    RubberRelaxation, "rubber_relaxation", Friction, true;
    /// A film drags without regard to normal force.
    ViscousFilm, "viscous_film", Friction, true;
    /// The friction bridge sees normal force.
    BridgeCrosstalk, "bridge_crosstalk", Measurement, true;
    /// Zero or gain of a bridge drifts.
    BridgeDrift, "bridge_drift", Measurement, true;
    /// The friction channel comes late.
    FrictionDelay, "friction_delay", Measurement, true;
    /// The torque ring rings lower than stated.
    RingResonance, "ring_resonance", Measurement, true;
    /// The encoder's disc runs out of true.
    EncoderEccentricity, "encoder_eccentricity", Measurement, true;
    /// A channel clips.
    AdcSaturation, "adc_saturation", Measurement, true;
    /// Dry friction in the lever.
    LeverHysteresis, "lever_hysteresis", Pressure, true;
    /// The foil springs stiffen.
    FoilHardening, "foil_hardening", Pressure, true;
    /// M1 cogs.
    M1Ripple, "m1_ripple", Pressure, true;
    /// The shaft twists.
    ShaftTorsion, "shaft_torsion", Drive, true;
    /// The coupling has play.
    Backlash, "backlash", Drive, true;
    /// M2 cogs.
    M2Ripple, "m2_ripple", Drive, true;
    /// The bearing drags more in one direction.
    BearingAsymmetry, "bearing_asymmetry", Drive, true;
    /// The shaft gets a constant torque that nobody commanded.
    TorqueOffset, "torque_offset", Drive, true;
    /// The bearing's drag falls with speed near zero.
    BearingStribeck, "bearing_stribeck", Drive, true;
    /// The bearing gives before it slides.
    Presliding, "presliding", Drive, true;
    /// The motor obeys late.
    DriveDelay, "drive_delay", Drive, true;
    /// Outside: mains hum in the friction channel.
    MainsHum, "mains_hum", Measurement, false;
    /// Outside: µ jumps between two values at random times.
    MuTelegraph, "mu_telegraph", Friction, false;
    /// Outside: µ breathes at a rhythm of its own, whatever the motion does.
    MuBreathing, "mu_breathing", Friction, false;
    /// Outside: µ falls while the speed changes, in either sense.
    ShakenContact, "shaken_contact", Friction, false;
    /// Outside: µ depends on the distance since the last reversal.
    ReversalMemory, "reversal_memory", Friction, false;
    /// Outside: M1's torque monitor reads too much while M2 turns.
    MonitorSpeedGain, "monitor_speed_gain", Pressure, false;
    /// Outside: the disc's face runs out and moves the normal force.
    DiscWobble, "disc_wobble", Pressure, false;
    /// Outside: the normal bridge creeps after a change of load.
    BridgeCreep, "bridge_creep", Pressure, false;
    /// Outside: the bearing's drag grows with the normal force.
    ThrustBearing, "thrust_bearing", Drive, false;
    /// Outside: M2's torque constant falls with speed.
    TorqueSag, "torque_sag", Drive, false;
    /// Outside: µ wanders at random.
    MuWander, "mu_wander", Friction, false;
    /// Outside: the friction bridge loses part of its signal now and then.
    LoosePlug, "loose_plug", Measurement, false;
    /// Outside: friction follows the load only after some sliding.
    LoadMemory, "load_memory", Friction, false;
}

impl Effect {
    /// The effect called `id`.
    #[must_use]
    pub fn from_id(id: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|effect| effect.id() == id)
    }

    /// The effects a diagnosis is asked to name.
    #[must_use]
    pub fn known() -> Vec<Self> {
        Self::ALL.iter().copied().filter(|effect| effect.is_known()).collect()
    }

    /// The effects outside that list.
    #[must_use]
    pub fn outside() -> Vec<Self> {
        Self::ALL.iter().copied().filter(|effect| !effect.is_known()).collect()
    }

    /// Whether a drive without contact can show it.
    #[must_use]
    pub fn works_without_contact(self) -> bool {
        // A loss of torque constant hardly shows where only the bearing asks for torque at speed.
        self.subsystem() == Subsystem::Drive && !matches!(self, Self::ThrustBearing | Self::TorqueSag)
    }

    fn is_pair(self, other: Self, a: Self, b: Self) -> bool {
        (self == a && other == b) || (self == b && other == a)
    }

    /// Whether a log can hide both at once.
    #[must_use]
    pub fn goes_with(self, other: Self) -> bool {
        // The relaxing block needs a baseline with a block; the bell replaces the falling curve.
        self != other
            && !self.is_pair(other, Self::ElementCompliance, Self::RubberRelaxation)
            && !self.is_pair(other, Self::BellCurve, Self::DirectionAsymmetry)
    }

    /// Whether two effects that go together can be told apart in one log.
    #[must_use]
    pub fn tells_apart_from(self, other: Self) -> bool {
        // Play sits in the soft shaft; an uneven Coulomb part is an offset while the disc turns.
        self.goes_with(other)
            && !self.is_pair(other, Self::ShaftTorsion, Self::Backlash)
            && !self.is_pair(other, Self::BearingAsymmetry, Self::TorqueOffset)
    }

    /// Whether the paper's plan, three slides in one direction at two loads, can show it apart from the others.
    #[must_use]
    pub fn shows_in_the_papers_plan(self) -> bool {
        matches!(
            self,
            Self::ElementCompliance
                | Self::DiscAngle
                | Self::FrictionDelay
                | Self::RingResonance
                | Self::EncoderEccentricity
                | Self::M2Ripple
                | Self::MainsHum
        )
    }

    /// Every pair of nameable effects that can be told apart.
    #[must_use]
    pub fn pairs() -> Vec<[Self; 2]> {
        let known = Self::known();
        let with = |(i, one): (usize, &Self)| {
            let others = known[i + 1..].iter().filter(|other| one.tells_apart_from(**other));
            others.map(|other| [*one, *other]).collect::<Vec<_>>()
        };
        known.iter().enumerate().flat_map(with).collect()
    }

    /// One of these pairs, each as likely as the others, by the seed.
    #[must_use]
    pub fn random_pair(seed: u64) -> [Self; 2] {
        Stream::new(seed, "pair").pick(&Self::pairs())
    }
}

impl Serialize for Effect {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.id())
    }
}
