//! The hidden effects as laws of their own: for each effect several from the literature, drawn by the seed.
//!
//! A law is drawn once per case, from those of its [`LawFamily`]. A law with a memory (heat, wear, age) starts
//! each log fresh; what differs from log to log for other reasons (phases, event times) is drawn in
//! [`Laws::begin_log`]. Amplitudes aim at a relative size between 2 and 15 % of the channel, uniform in the
//! logarithm ([`family::size`]).

pub mod ageing;
pub mod bearing;
pub mod block;
pub mod clipping;
pub mod coupling;
pub mod disc;
pub mod encoder;
pub mod family;
pub mod film;
pub mod hysteresis;
pub mod lateness;
pub mod lever;
pub mod load;
pub mod measurement;
pub mod outside;
pub mod ripple;
pub mod slide;
pub mod springs;
pub mod thermal;
pub mod wear;

use std::collections::BTreeMap;

use serde::Serialize;

pub use family::LawFamily;
pub use slide::Slide;

use crate::curve::{Asymmetry, Bell};
use crate::effect::Effect;
use crate::random::Stream;
use crate::rig::Rig;

/// Size of the drive's quantities relative to the rotary one: a linear stage moves 10 mm where the
/// rotary drive turns 1 rad, and pushes 80 N where it turns with 1 N·m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Units {
    /// Torque or force per N·m.
    pub torque: f64,
    /// Angle or length per rad.
    pub travel: f64,
}

impl Units {
    /// The rotary drive.
    pub const ROTARY: Self = Self { torque: 1.0, travel: 1.0 };
    /// The linear stage.
    pub const LINEAR: Self = Self { torque: 80.0, travel: 0.01 };
}

/// What the draws may depend on.
#[derive(Debug, Clone, Copy)]
pub struct Setting<'a> {
    /// True rig.
    pub rig: &'a Rig,
    /// Rate of the log.
    pub rate_hz: f64,
    /// Length of a log.
    pub duration_s: f64,
    /// Greatest static normal force of the courses; 0 where there is no contact.
    pub greatest_normal_n: f64,
    /// Units of the drive.
    pub units: Units,
    /// Laws to draw from.
    pub family: LawFamily,
}

/// Distance that a course slides per time.
const SLID_M_PER_S: f64 = 0.3;
/// Factor on the Coulomb drag of a bearing that yields before it slides: with the drag of a plain bearing
/// it would hardly show beside the contact.
const STRONGER: (f64, f64) = (1.5, 2.6);

/// A bearing that gives before it slides; see [`hysteresis`] for its laws.
#[derive(Debug, Clone, Serialize)]
pub struct Yielding {
    /// Share of the drag over travel.
    #[serde(flatten)]
    pub hysteresis: hysteresis::Hysteresis,
    /// Factor on the Coulomb drag of the rig.
    pub stronger: f64,
}

impl Yielding {
    /// Draws one that yields over 0.04 to 0.12 rad.
    pub fn draw(s: &mut Stream, family: LawFamily, units: Units) -> Self {
        let reach = s.log_uniform(0.04, 0.12) * units.travel;
        let stronger = s.uniform(STRONGER.0, STRONGER.1);
        Self { hysteresis: hysteresis::Hysteresis::draw(s, family, reach), stronger }
    }
}

macro_rules! laws {
    ($($(#[$doc:meta])* $field:ident: $law:ty,)*) => {
        /// Laws of a case; `None` where the effect is absent.
        #[derive(Debug, Clone, Default, Serialize)]
        pub struct Laws {
            $($(#[$doc])* #[serde(skip_serializing_if = "Option::is_none")] pub $field: Option<$law>,)*
        }
    };
}

laws! {
    /// Spring of the hidden block.
    element_compliance: block::Spring,
    /// See [`thermal`].
    thermal_fade: thermal::ThermalFade,
    /// See [`wear`].
    wear_drift: wear::WearDrift,
    /// See [`disc`].
    disc_angle: disc::DiscAngle,
    /// See [`load`].
    load_dependence: load::LoadDependence,
    /// See [`ageing`].
    static_ageing: ageing::StaticAgeing,
    /// See [`crate::curve`].
    direction_asymmetry: Asymmetry,
    /// See [`crate::curve`].
    bell_curve: Bell,
    /// See [`block`].
    rubber_relaxation: block::Relaxation,
    /// See [`film`].
    viscous_film: film::Film,
    /// See [`measurement`].
    bridge_crosstalk: measurement::Crosstalk,
    /// See [`measurement`].
    bridge_drift: measurement::Drift,
    /// See [`lateness`].
    friction_delay: lateness::Lateness,
    /// See [`measurement`].
    ring_resonance: measurement::Ring,
    /// See [`encoder`].
    encoder_eccentricity: encoder::Eccentricity,
    /// See [`clipping`].
    adc_saturation: clipping::Saturation,
    /// See [`lever`].
    lever_hysteresis: lever::LeverHysteresis,
    /// See [`springs`].
    foil_hardening: springs::FoilHardening,
    /// See [`lever`].
    m1_ripple: ripple::Ripple,
    /// See [`coupling`].
    shaft_torsion: coupling::Coupling,
    /// See [`coupling`].
    backlash: coupling::Coupling,
    /// See [`ripple`].
    m2_ripple: ripple::Ripple,
    /// See [`bearing`].
    bearing_asymmetry: bearing::Uneven,
    /// See [`bearing`].
    torque_offset: bearing::Offset,
    /// See [`bearing`].
    bearing_stribeck: bearing::Falling,
    /// See [`Yielding`].
    presliding: Yielding,
    /// See [`lateness`].
    drive_delay: lateness::Lateness,
    /// See [`outside::Hum`].
    mains_hum: outside::Hum,
    /// See [`outside::Telegraph`].
    mu_telegraph: outside::Telegraph,
    /// See [`outside::Breathing`].
    mu_breathing: outside::Breathing,
    /// See [`outside::Shaken`].
    shaken_contact: outside::Shaken,
    /// See [`outside::Memory`].
    reversal_memory: outside::Memory,
    /// Relative error of M1's torque monitor per speed of M2.
    monitor_speed_gain: f64,
    /// See [`outside::Wobble`].
    disc_wobble: outside::Wobble,
    /// See [`outside::Creep`].
    bridge_creep: outside::Creep,
    /// Extra Coulomb drag of the bearing per normal force.
    thrust_bearing: f64,
    /// Loss of torque constant at the reference speed.
    torque_sag: f64,
    /// See [`outside::Wander`].
    mu_wander: outside::Wander,
    /// See [`outside::LoosePlug`].
    loose_plug: outside::LoosePlug,
    /// See [`outside::LoadMemory`].
    load_memory: outside::LoadMemory,
}

impl Laws {
    /// Draws the laws of these effects.
    #[must_use]
    pub fn draw(effects: &[Effect], seed: u64, setting: &Setting<'_>) -> Self {
        let mut laws = Self::default();
        for effect in effects {
            laws.add(*effect, &mut Stream::new(seed, effect.id()), setting);
        }
        laws
    }

    fn add(&mut self, effect: Effect, s: &mut Stream, setting: &Setting<'_>) {
        let (family, units) = (setting.family, setting.units);
        match effect {
            Effect::ElementCompliance => self.element_compliance = Some(block::Spring::draw(s, family)),
            Effect::ThermalFade => self.thermal_fade = Some(thermal::ThermalFade::draw(s, family)),
            Effect::WearDrift => {
                let distance_m = SLID_M_PER_S * setting.duration_s;
                self.wear_drift = Some(wear::WearDrift::draw(s, family, distance_m));
            }
            Effect::DiscAngle => self.disc_angle = Some(disc::DiscAngle::draw(s, family)),
            Effect::LoadDependence => self.load_dependence = Some(load::LoadDependence::draw(s, family)),
            Effect::StaticAgeing => self.static_ageing = Some(ageing::StaticAgeing::draw(s, family)),
            Effect::DirectionAsymmetry => self.direction_asymmetry = Some(Asymmetry::draw(s, family)),
            Effect::BellCurve => self.bell_curve = Some(Bell::draw(s, family)),
            Effect::RubberRelaxation => self.rubber_relaxation = Some(block::Relaxation::draw(s, family)),
            Effect::ViscousFilm => self.viscous_film = Some(film::Film::draw(s, family)),
            Effect::BridgeCrosstalk => self.bridge_crosstalk = Some(measurement::Crosstalk::draw(s, family)),
            Effect::BridgeDrift => self.bridge_drift = Some(measurement::Drift::draw(s, family, setting)),
            Effect::FrictionDelay => {
                self.friction_delay = Some(lateness::Lateness::draw(s, family, 2e-3, 12e-3));
            }
            Effect::RingResonance => self.ring_resonance = Some(measurement::Ring::draw(s, setting)),
            Effect::EncoderEccentricity => {
                self.encoder_eccentricity = Some(encoder::Eccentricity::draw(s, family));
            }
            Effect::AdcSaturation => self.adc_saturation = Some(clipping::Saturation::draw(s, family)),
            Effect::LeverHysteresis => self.lever_hysteresis = Some(lever::LeverHysteresis::draw(s, setting)),
            Effect::FoilHardening => {
                let greatest_n = setting.greatest_normal_n;
                self.foil_hardening = Some(springs::FoilHardening::draw(s, family, greatest_n));
            }
            Effect::M1Ripple => self.m1_ripple = Some(lever::m1_ripple(s, setting)),
            Effect::ShaftTorsion => self.shaft_torsion = Some(coupling::Coupling::torsion(s, setting)),
            Effect::Backlash => self.backlash = Some(coupling::Coupling::backlash(s, setting)),
            Effect::M2Ripple => {
                let orders = [4.0, 6.0, 8.0, 9.0, 10.0, 12.0, 14.0, 18.0, 24.0];
                let rms = s.log_uniform(0.06, 0.25) * units.torque;
                let per_travel = orders.map(|order| order / units.travel);
                self.m2_ripple = Some(ripple::Ripple::draw(s, family, &per_travel, rms));
            }
            Effect::BearingAsymmetry => {
                self.bearing_asymmetry = Some(bearing::Uneven::draw(s, family, units));
            }
            Effect::TorqueOffset => self.torque_offset = Some(bearing::Offset::draw(s, family, units)),
            Effect::BearingStribeck => {
                self.bearing_stribeck = Some(bearing::Falling::draw(s, family, units));
            }
            Effect::Presliding => self.presliding = Some(Yielding::draw(s, family, units)),
            Effect::DriveDelay => {
                self.drive_delay = Some(lateness::Lateness::draw(s, family, 2.5e-3, 9e-3));
            }
            Effect::MainsHum => self.mains_hum = Some(outside::Hum::draw(s)),
            Effect::MuTelegraph => self.mu_telegraph = Some(outside::Telegraph::draw(s)),
            Effect::MuBreathing => self.mu_breathing = Some(outside::Breathing::draw(s)),
            Effect::ShakenContact => self.shaken_contact = Some(outside::Shaken::draw(s)),
            Effect::ReversalMemory => self.reversal_memory = Some(outside::Memory::draw(s)),
            Effect::MonitorSpeedGain => self.monitor_speed_gain = Some(s.signed(0.008, 0.015)),
            Effect::DiscWobble => self.disc_wobble = Some(outside::Wobble::draw(s)),
            Effect::BridgeCreep => self.bridge_creep = Some(outside::Creep::draw(s)),
            Effect::ThrustBearing => self.thrust_bearing = Some(s.uniform(0.003, 0.007)),
            Effect::TorqueSag => self.torque_sag = Some(s.uniform(0.15, 0.3)),
            Effect::MuWander => self.mu_wander = Some(outside::Wander::draw(s)),
            Effect::LoosePlug => self.loose_plug = Some(outside::LoosePlug::draw(s)),
            Effect::LoadMemory => self.load_memory = Some(outside::LoadMemory::draw(s)),
        }
    }

    /// Draws what differs from log to log.
    pub fn begin_log(&mut self, s: &mut Stream, duration_s: f64) {
        if let Some(law) = &mut self.mains_hum {
            law.begin_log(s);
        }
        if let Some(law) = &mut self.mu_telegraph {
            law.begin_log(s, duration_s);
        }
        if let Some(law) = &mut self.mu_breathing {
            law.begin_log(s);
        }
        if let Some(law) = &mut self.mu_wander {
            law.begin_log(s, duration_s);
        }
        if let Some(law) = &mut self.loose_plug {
            law.begin_log(s, duration_s);
        }
        if let Some(law) = &mut self.torque_offset {
            law.begin_log(s);
        }
    }

    /// Factor of all the laws that act on µ as a whole; advances their memories by a step.
    pub fn mu_factor(&mut self, slide: &Slide) -> f64 {
        let mut factor = 1.0;
        let mut with = |of: Option<f64>| factor *= of.unwrap_or(1.0);
        with(self.thermal_fade.as_mut().map(|law| law.factor(slide)));
        with(self.wear_drift.as_mut().map(|law| law.factor(slide)));
        with(self.disc_angle.as_ref().map(|law| law.factor(slide)));
        with(self.load_dependence.as_ref().map(|law| law.factor(slide)));
        with(self.static_ageing.as_mut().map(|law| law.factor(slide)));
        with(self.mu_telegraph.as_ref().map(|law| law.factor(slide)));
        with(self.mu_breathing.as_ref().map(|law| law.factor(slide)));
        with(self.shaken_contact.as_mut().map(|law| law.factor(slide)));
        with(self.reversal_memory.as_mut().map(|law| law.factor(slide)));
        with(self.mu_wander.as_ref().map(|law| law.factor(slide)));
        with(self.load_memory.as_mut().map(|law| law.factor(slide)));
        factor
    }

    /// Name of the law drawn for each effect that has several.
    #[must_use]
    pub fn names(&self) -> BTreeMap<String, String> {
        let Ok(serde_json::Value::Object(all)) = serde_json::to_value(self) else { return BTreeMap::new() };
        let name = |law: &serde_json::Value| {
            let of = |key: &str| law.get(key).and_then(|name| name.as_str()).filter(|name| *name != "none");
            of("play_law").or(of("law")).map(str::to_owned)
        };
        all.into_iter().filter_map(|(effect, law)| Some((effect, name(&law)?))).collect()
    }
}
