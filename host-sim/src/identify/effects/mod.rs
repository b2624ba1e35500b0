//! The library: one file for each effect holds all that is known of it; this list is the only other place that names it.

pub mod coordinates;
mod dahl;
pub mod joint_waves;
mod stops;
mod stribeck_curve;
pub mod waves;

use crate::identify::balance::{Alternative, Balance, Company};
use crate::identify::contact::change::{Change, ContactTerm};
use crate::identify::contact::log::ContactLog;
use crate::identify::contact_part::ContactPart;
use crate::identify::drive::{Bearing, DriveLog, DriveScales};
use crate::identify::normal_load::{NormalLoadLog, NormalLoadScales};
use coordinates::Coordinates;

/// The logs of a contact, and what the effects' columns are scaled with: always that of the training logs.
pub struct ContactView<'a> {
    /// Logs.
    pub logs: &'a [ContactLog],
    /// Coordinates of each log.
    pub coordinates: &'a [Coordinates],
    /// Largest values of the coordinates in the training logs.
    pub scales: &'a coordinates::Scales,
    /// Whether these are the training logs: only they may say what belongs to one log.
    pub training: bool,
    /// How many training logs there are.
    pub train_count: usize,
    /// Whether the baseline has a block in series.
    pub block: bool,
}

/// The logs of a drive, and what columns are made from.
pub struct DriveView<'a> {
    /// Logs.
    pub logs: &'a [DriveLog],
    /// Usual sizes.
    pub scales: &'a DriveScales,
    /// The balance that the columns belong to.
    pub balance: &'a Balance,
    /// What stands in it already, and leaves: says where a search begins.
    pub company: Company<'a>,
    /// Whether the motion is a turn.
    pub rotary: bool,
    /// What the base makes of the inertia.
    pub inertia: f64,
    /// Shape found on other logs: only this one is wanted.
    pub fixed: Option<&'a [(String, f64)]>,
    /// What bears on the motor beside its inertia and a coupling by the values found on other logs: a shape that was found
    /// there needs it.
    pub bearing: Option<&'a Bearing>,
}

/// Shapes that are tried: those of a grid, or the one that was found on other logs.
pub(super) fn shapes(fixed: Option<&[(String, f64)]>, name: &str, grid: Vec<f64>) -> Vec<f64> {
    let given = fixed.and_then(|f| f.iter().find(|(key, _)| key == name)).map(|(_, value)| *value);
    given.map_or(grid, |value| vec![value])
}

/// The logs of a normal-load actuator, and what columns are made from.
pub struct NormalLoadView<'a> {
    /// Logs.
    pub logs: &'a [NormalLoadLog],
    /// Usual sizes.
    pub scales: &'a NormalLoadScales,
    /// The balance that the columns belong to.
    pub balance: &'a Balance,
    /// What stands in it already, and leaves: says where a search begins.
    pub company: Company<'a>,
    /// Shape found on other logs: only this one is wanted.
    pub fixed: Option<&'a [(String, f64)]>,
}

/// What a fitted effect makes of a drive whose motion is known.
#[derive(Default)]
pub struct DriveLaw {
    /// What it adds to the effort at a speed.
    pub effort: Option<Box<dyn Fn(f64) -> f64>>,
    /// By how much motion is late, s.
    pub late_s: f64,
}

impl DriveLaw {
    /// An effort over speed.
    fn effort(of: impl Fn(f64) -> f64 + 'static) -> Self {
        Self { effort: Some(Box::new(of)), late_s: 0.0 }
    }
}

/// What an effect's file tells of it.
#[derive(Debug, Clone, Copy)]
pub struct About {
    /// Its id.
    pub id: &'static str,
    /// What it means, as a clause.
    pub meaning: &'static str,
    /// The experiment that would confirm it.
    pub experiment: &'static str,
}

/// All that is known of an effect.
pub trait Effect: Sync {
    /// Its id and what to tell of it.
    fn about(&self) -> About;

    /// Its id.
    fn id(&self) -> &'static str {
        self.about().id
    }

    /// Whether all that it does in a balance of torques is what the bridge in it may do within its class too: then it is told
    /// beyond that only.
    fn is_like_a_bridges_error(&self) -> bool {
        false
    }

    /// What it changes in the contact's balance, in one or more forms.
    fn contact(&self, _view: &ContactView<'_>) -> Vec<ContactTerm> {
        Vec::new()
    }

    /// Value of a parameter of the core's law that the fitted form does not have.
    fn absent(&self, _parameter: &str) -> f64 {
        0.0
    }

    /// What its fitted law says beyond its parameters, as a clause with units.
    fn remark(&self, _contact: &ContactPart, _place: usize) -> Option<String> {
        None
    }

    /// Its columns in the drive's balance, one entry for each shape.
    fn drive(&self, _view: &DriveView<'_>) -> Vec<Alternative> {
        Vec::new()
    }

    /// Its law for a drive log that is predicted; `value` finds a parameter of the model file by the start of its name,
    /// which ends in the drive's unit. `None` where it needs a second mass, or an origin that every log has for itself.
    fn drive_law(&self, _value: &dyn Fn(&str) -> Option<f64>) -> Option<DriveLaw> {
        None
    }

    /// Its columns in the normal-load actuator's balance, one entry for each shape.
    fn normal_load(&self, _view: &NormalLoadView<'_>) -> Vec<Alternative> {
        Vec::new()
    }
}

macro_rules! library {
    ($($module:ident :: $effect:ident,)*) => {
        $(mod $module;)*
        /// Every effect.
        pub const LIBRARY: &[&dyn Effect] = &[$(&$module::$effect,)*];
    };
}

/// The effect that has this id.
pub fn with_id(id: &str) -> Option<&'static dyn Effect> {
    LIBRARY.iter().copied().find(|effect| effect.id() == id)
}

library! {
    element_compliance::ElementCompliance,
    thermal_fade::ThermalFade,
    wear_drift::WearDrift,
    disc_angle::DiscAngle,
    load_dependence::LoadDependence,
    static_ageing::StaticAgeing,
    direction_asymmetry::DirectionAsymmetry,
    bell_curve::BellCurve,
    rubber_relaxation::RubberRelaxation,
    viscous_film::ViscousFilm,
    bridge_crosstalk::BridgeCrosstalk,
    bridge_drift::BridgeDrift,
    friction_delay::FrictionDelay,
    ring_resonance::RingResonance,
    adc_saturation::AdcSaturation,
    encoder_eccentricity::EncoderEccentricity,
    lever_hysteresis::LeverHysteresis,
    foil_hardening::FoilHardening,
    m1_ripple::M1Ripple,
    shaft_torsion::ShaftTorsion,
    backlash::Backlash,
    m2_ripple::M2Ripple,
    bearing_asymmetry::BearingAsymmetry,
    torque_offset::TorqueOffset,
    bearing_stribeck::BearingStribeck,
    presliding::Presliding,
    drive_delay::DriveDelay,
}
