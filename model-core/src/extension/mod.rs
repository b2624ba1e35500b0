//! Effects that extend a friction model: what `rig diagnose` adds, and what the observer then computes.
//!
//! An effect acts in one of three places, and never inside the friction model itself:
//!
//! | place | effects |
//! |---|---|
//! | measured inputs | [`encoder_eccentricity`], [`bridge_drift`] of the normal force |
//! | contact, through [`Contact::road_factor`], the speed at the root, or a force beside it | [`thermal_fade`], [`wear_drift`], [`disc_angle`], [`load_dependence`], [`static_ageing`], [`direction_asymmetry`], [`bell_curve`], [`rubber_relaxation`], [`viscous_film`] |
//! | the friction channel | [`ring_resonance`], [`bridge_drift`], [`bridge_crosstalk`], [`friction_delay`], [`adc_saturation`] |
//!
//! [`Contact::road_factor`]: crate::friction::Contact::road_factor
//!
//! Each effect can be there once, so any combination is one value without allocation ([`Extensions`]),
//! and [`ExtendedFriction`] runs them in the order of the rig; that of the friction channel is [`SensorChain`]'s.
//!
//! [`SensorChain`]: crate::sensor::SensorChain

pub mod adc_saturation;
pub mod bell_curve;
pub mod bridge_crosstalk;
pub mod bridge_drift;
mod channel;
pub mod direction_asymmetry;
pub mod disc_angle;
pub mod encoder_eccentricity;
mod extended;
pub mod friction_delay;
pub mod load_dependence;
pub mod ring_resonance;
pub mod rubber_relaxation;
mod set;
pub mod static_ageing;
pub mod thermal_fade;
pub mod viscous_film;
pub mod wear_drift;

pub use extended::{ExtendedFriction, ExtendedInput, ExtendedOutput, ExtendedState};
pub use set::{Extension, Extensions, MOST_VALUES};
