//! The library of effects on the contact and the channels that measure it: one file an effect.
//!
//! Each says what the effect does to the model, which numbers of it are free, between which bounds, and
//! where a search for them starts. A start gives the effect's shape (a time constant, a speed) with its
//! amplitudes at zero; the amplitudes follow from the data by one linear step. Effects whose amplitude
//! is not separable (a delay, a softer ring) give whole starts.

mod adc_saturation;
mod bell_curve;
mod bridge_crosstalk;
mod bridge_drift;
mod direction_asymmetry;
mod disc_angle;
mod element_compliance;
mod friction_delay;
mod load_dependence;
mod ring_resonance;
mod rubber_relaxation;
mod static_ageing;
mod thermal_fade;
mod viscous_film;
mod wear_drift;

use super::contact::model::ContactModel;
use crate::fit::bounds::Parameter;

/// What the library knows about the records before anything is fitted.
#[derive(Debug, Clone, PartialEq)]
pub struct Scales {
    /// Longest record, s.
    pub duration_s: f64,
    /// Longest distance slid in a record, m.
    pub distance_m: f64,
    /// Mean power rubbed off while sliding, W.
    pub power_w: f64,
    /// Median normal force in contact, N.
    pub load_n: f64,
    /// Median friction coefficient while sliding.
    pub friction: f64,
    /// Largest but for 2 %.
    pub most_friction: f64,
    /// Friction torque, RMS, N·m.
    pub torque_nm: f64,
    /// Low and high end of the sliding speeds (5 % and 95 % of the sliding samples), m/s.
    pub speed_m_s: (f64, f64),
    /// Share of the sliding time that goes in the rarer direction.
    pub rarer_direction: f64,
    /// Sampling step, s.
    pub step_s: f64,
    /// Lowest and highest value of the friction channel where it clips, N·m.
    pub friction_ends_nm: (Option<f64>, Option<f64>),
    /// Whether the normal bridge clips and the load beyond its end is known from M1.
    pub normal_clips: bool,
    /// Frequencies at which the friction channel may ring, the most striking first, Hz.
    pub ring_peaks_hz: Vec<f64>,
    /// Mode of the torque ring by the rig file, Hz.
    pub ring_hz: Option<f64>,
    /// Damping ratio of that mode.
    pub ring_damping: Option<f64>,
    /// Stiffness of the rubber: that of the model, or a usual one, N/m.
    pub stiffness_n_per_m: f64,
}

/// Where a search starts.
#[derive(Debug, Clone, PartialEq)]
pub struct Start {
    /// One value a shared parameter.
    pub values: Vec<f64>,
    /// Parameters, by position, that are amplitudes: zero in `values`, found by a linear step.
    pub amplitudes: Vec<usize>,
}

impl Start {
    /// A start whose values are taken as they are.
    pub fn whole(values: &[f64]) -> Self {
        Self { values: values.to_vec(), amplitudes: Vec::new() }
    }

    /// A start with amplitudes at zero.
    pub fn shape(values: &[f64], amplitudes: &[usize]) -> Self {
        Self { values: values.to_vec(), amplitudes: amplitudes.to_vec() }
    }
}

/// An effect on the contact or on the friction channel.
pub trait ContactEffect: Sync {
    /// Id of the contract.
    fn id(&self) -> &'static str;

    /// Forms of the effect that are fitted apart, the better one standing for it.
    fn variants(&self) -> usize {
        1
    }

    /// Free parameters that all logs share.
    fn parameters(&self, variant: usize, scales: &Scales) -> Vec<Parameter>;

    /// A free parameter that each log but the first has of its own: the origin of a disc's angle.
    fn origin(&self) -> Option<Parameter> {
        None
    }

    /// Where the search starts.
    fn starts(&self, variant: usize, scales: &Scales) -> Vec<Start>;

    /// Puts the effect into a model. `origin` is that of the log.
    fn apply(&self, variant: usize, values: &[f64], origin: f64, scales: &Scales, model: &mut ContactModel);

    /// Whether the effect is conceivable with this baseline and these records.
    fn applies(&self, _model: &ContactModel, _scales: &Scales) -> bool {
        true
    }
}

/// The effects in the order of the contract.
pub static LIBRARY: [&dyn ContactEffect; 15] = [
    &element_compliance::ElementCompliance,
    &thermal_fade::ThermalFade,
    &wear_drift::WearDrift,
    &disc_angle::DiscAngle,
    &load_dependence::LoadDependence,
    &static_ageing::StaticAgeing,
    &direction_asymmetry::DirectionAsymmetry,
    &bell_curve::BellCurve,
    &rubber_relaxation::RubberRelaxation,
    &viscous_film::ViscousFilm,
    &bridge_crosstalk::BridgeCrosstalk,
    &bridge_drift::BridgeDrift,
    &friction_delay::FrictionDelay,
    &ring_resonance::RingResonance,
    &adc_saturation::AdcSaturation,
];

/// The effect with an id.
pub fn effect(id: &str) -> Option<&'static dyn ContactEffect> {
    LIBRARY.into_iter().find(|effect| effect.id() == id)
}
