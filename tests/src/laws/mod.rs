//! The hidden effects as laws of their own, one struct each.
//!
//! Every law is drawn once per case. A law with a memory (heat, wear, age) starts each log fresh; what
//! differs from log to log for other reasons (phases, event times) is drawn in `begin_log`.
//! Their form is on purpose not the shortest textbook one: a diagnosis must catch the physics.

pub mod drive;
pub mod friction;
pub mod measurement;
pub mod outside;
pub mod pressure;

use serde::Serialize;

use crate::contact_force::{Branch, Film};
use crate::curve::{Asymmetry, Bell};
use crate::effect::Effect;
use crate::random::Stream;
use crate::rig::Rig;

/// Laws of a case; `None` where the effect is absent.
#[derive(Debug, Clone, Default, Serialize)]
pub struct Laws {
    /// Cubic hardening of the hidden block, per m².
    #[serde(skip_serializing_if = "Option::is_none")]
    pub element_compliance: Option<f64>,
    /// See [`friction::ThermalFade`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub thermal_fade: Option<friction::ThermalFade>,
    /// See [`friction::WearDrift`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub wear_drift: Option<friction::WearDrift>,
    /// See [`friction::DiscAngle`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub disc_angle: Option<friction::DiscAngle>,
    /// See [`friction::LoadDependence`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub load_dependence: Option<friction::LoadDependence>,
    /// See [`friction::StaticAgeing`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub static_ageing: Option<friction::StaticAgeing>,
    /// See [`Asymmetry`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub direction_asymmetry: Option<Asymmetry>,
    /// See [`Bell`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bell_curve: Option<Bell>,
    /// Branches of the creeping block; stiffness is a share of the block's.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rubber_relaxation: Option<Vec<Branch>>,
    /// See [`Film`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub viscous_film: Option<Film>,
    /// See [`measurement::Crosstalk`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bridge_crosstalk: Option<measurement::Crosstalk>,
    /// See [`measurement::Drift`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bridge_drift: Option<measurement::Drift>,
    /// Delay of the friction channel, s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub friction_delay: Option<f64>,
    /// See [`measurement::Ring`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ring_resonance: Option<measurement::Ring>,
    /// See [`measurement::Eccentricity`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub encoder_eccentricity: Option<measurement::Eccentricity>,
    /// See [`measurement::Saturation`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub adc_saturation: Option<measurement::Saturation>,
    /// See [`pressure::LeverHysteresis`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub lever_hysteresis: Option<pressure::LeverHysteresis>,
    /// See [`pressure::FoilHardening`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub foil_hardening: Option<pressure::FoilHardening>,
    /// See [`pressure::M1Ripple`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub m1_ripple: Option<pressure::M1Ripple>,
    /// See [`drive::Coupling`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shaft_torsion: Option<drive::Coupling>,
    /// See [`drive::Coupling`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub backlash: Option<drive::Coupling>,
    /// See [`drive::Ripple`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub m2_ripple: Option<drive::Ripple>,
    /// See [`drive::Uneven`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bearing_asymmetry: Option<drive::Uneven>,
    /// Torque nobody commanded.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub torque_offset: Option<f64>,
    /// See [`drive::Falling`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bearing_stribeck: Option<drive::Falling>,
    /// See [`drive::Yielding`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub presliding: Option<drive::Yielding>,
    /// Delay between torque and shaft, s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub drive_delay: Option<f64>,
    /// See [`outside::Hum`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mains_hum: Option<outside::Hum>,
    /// See [`outside::Telegraph`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mu_telegraph: Option<outside::Telegraph>,
    /// See [`outside::Breathing`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mu_breathing: Option<outside::Breathing>,
    /// See [`outside::Shaken`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shaken_contact: Option<outside::Shaken>,
    /// See [`outside::Memory`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reversal_memory: Option<outside::Memory>,
    /// Gain error of M1's torque monitor per |speed of M2|.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub monitor_speed_gain: Option<f64>,
    /// See [`outside::Wobble`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub disc_wobble: Option<outside::Wobble>,
    /// See [`outside::Creep`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bridge_creep: Option<outside::Creep>,
    /// Bearing drag per normal force, N·m/N.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub thrust_bearing: Option<f64>,
    /// Loss of torque constant at the reference speed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub torque_sag: Option<f64>,
}

/// What sizes an effect: the case's rig, the rate of its log, the loads it is run at.
#[derive(Debug, Clone, Copy)]
pub struct Setting<'a> {
    /// The true rig.
    pub rig: &'a Rig,
    /// Rate of the log.
    pub rate_hz: f64,
    /// Greatest normal force of the runs.
    pub greatest_normal_n: f64,
    /// Units of the drive.
    pub units: drive::Units,
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
        let units = setting.units;
        match effect {
            Effect::ElementCompliance => self.element_compliance = Some(s.uniform(3e3, 1e4)),
            Effect::ThermalFade => self.thermal_fade = Some(friction::ThermalFade::draw(s)),
            Effect::WearDrift => self.wear_drift = Some(friction::WearDrift::draw(s)),
            Effect::DiscAngle => self.disc_angle = Some(friction::DiscAngle::draw(s)),
            Effect::LoadDependence => self.load_dependence = Some(friction::LoadDependence::draw(s)),
            Effect::StaticAgeing => self.static_ageing = Some(friction::StaticAgeing::draw(s)),
            Effect::DirectionAsymmetry => self.direction_asymmetry = Some(Asymmetry::draw(s)),
            Effect::BellCurve => self.bell_curve = Some(Bell::draw(s)),
            Effect::RubberRelaxation => self.rubber_relaxation = Some(friction::relaxation_branches(s)),
            Effect::ViscousFilm => {
                self.viscous_film =
                    Some(Film { drag_n_s_per_m: s.uniform(9.0, 22.0), knee_m_s: s.uniform(1.5, 3.0) });
            }
            Effect::BridgeCrosstalk => self.bridge_crosstalk = Some(measurement::Crosstalk::draw(s)),
            Effect::BridgeDrift => self.bridge_drift = Some(measurement::Drift::draw(s)),
            Effect::FrictionDelay => self.friction_delay = Some(s.uniform(3e-3, 12e-3)),
            Effect::RingResonance => {
                self.ring_resonance = Some(measurement::Ring::draw(s, setting.rate_hz));
            }
            Effect::EncoderEccentricity => {
                self.encoder_eccentricity = Some(measurement::Eccentricity::draw(s));
            }
            Effect::AdcSaturation => self.adc_saturation = Some(measurement::Saturation::draw(s)),
            Effect::LeverHysteresis => self.lever_hysteresis = Some(pressure::LeverHysteresis::draw(s)),
            Effect::FoilHardening => {
                self.foil_hardening = Some(pressure::FoilHardening::draw(s, setting.greatest_normal_n));
            }
            Effect::M1Ripple => {
                let travel = setting.greatest_normal_n / setting.rig.mechanism_n_per_rad;
                self.m1_ripple = Some(pressure::M1Ripple::draw(s, travel, setting.rig));
            }
            Effect::ShaftTorsion => self.shaft_torsion = Some(drive::Coupling::torsion(s, setting)),
            Effect::Backlash => self.backlash = Some(drive::Coupling::backlash(s, setting)),
            Effect::M2Ripple => self.m2_ripple = Some(drive::Ripple::draw(s, units)),
            Effect::BearingAsymmetry => self.bearing_asymmetry = Some(drive::Uneven::draw(s, units)),
            Effect::TorqueOffset => self.torque_offset = Some(s.signed(0.1, 0.3) * units.torque),
            Effect::BearingStribeck => self.bearing_stribeck = Some(drive::Falling::draw(s, units)),
            Effect::Presliding => self.presliding = Some(drive::Yielding::draw(s, units)),
            Effect::DriveDelay => self.drive_delay = Some(s.uniform(3e-3, 9e-3)),
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
        }
    }

    /// Draws what differs from log to log.
    pub fn begin_log(&mut self, s: &mut Stream, duration_s: f64) {
        if let Some(hum) = &mut self.mains_hum {
            hum.begin_log(s);
        }
        if let Some(telegraph) = &mut self.mu_telegraph {
            telegraph.begin_log(s, duration_s);
        }
        if let Some(breathing) = &mut self.mu_breathing {
            breathing.begin_log(s);
        }
    }

    /// Factor of all the laws that act on µ as a whole; advances their memories by a step.
    pub fn mu_factor(&mut self, slide: &friction::Slide) -> f64 {
        let mut factor = 1.0;
        if let Some(law) = &mut self.thermal_fade {
            factor *= law.factor(slide);
        }
        if let Some(law) = &mut self.wear_drift {
            factor *= law.factor(slide);
        }
        if let Some(law) = &self.disc_angle {
            factor *= law.factor(slide);
        }
        if let Some(law) = &self.load_dependence {
            factor *= law.factor(slide);
        }
        if let Some(law) = &mut self.static_ageing {
            factor *= law.factor(slide);
        }
        if let Some(law) = &self.mu_telegraph {
            factor *= law.factor(slide);
        }
        if let Some(law) = &self.mu_breathing {
            factor *= law.factor(slide);
        }
        if let Some(law) = &mut self.shaken_contact {
            factor *= law.factor(slide);
        }
        if let Some(law) = &mut self.reversal_memory {
            factor *= law.factor(slide);
        }
        factor
    }
}
