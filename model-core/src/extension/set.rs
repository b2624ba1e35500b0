//! Any combination of effects, each at most once, addressed by the names of the model file.

use super::adc_saturation::AdcSaturation;
use super::bell_curve::BellCurve;
use super::bridge_crosstalk::BridgeCrosstalk;
use super::bridge_drift::BridgeDrift;
use super::direction_asymmetry::DirectionAsymmetry;
use super::disc_angle::DiscAngle;
use super::encoder_eccentricity::EncoderEccentricity;
use super::friction_delay::FrictionDelay;
use super::load_dependence::LoadDependence;
use super::ring_resonance::RingResonance;
use super::rubber_relaxation::RubberRelaxation;
use super::static_ageing::StaticAgeing;
use super::thermal_fade::ThermalFade;
use super::viscous_film::ViscousFilm;
use super::wear_drift::WearDrift;
use crate::error::ParameterError;
use crate::real::Real;

/// Most values that an effect has.
pub const MOST_VALUES: usize = 21;

macro_rules! effects {
    ($($variant:ident, $field:ident, $type:ident, $id:literal, [$($step:ident)?] $(, $optional:expr)?;)*) => {
        /// An effect of the library that extends the friction model.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
        pub enum Extension {
            $(#[doc = concat!("`", $id, "`")] $variant,)*
        }

        impl Extension {
            /// All of them, in the order of the model file's ids.
            pub const ALL: &'static [Self] = &[$(Self::$variant,)*];

            /// Id in the model file.
            pub const fn id(self) -> &'static str {
                match self { $(Self::$variant => $id,)* }
            }

            /// Names of its parameters, in the order in which values are given.
            pub const fn names(self) -> &'static [&'static str] {
                match self { $(Self::$variant => $type::<f32>::NAMES,)* }
            }

            /// Values of its last parameters where they are not given.
            const fn optional(self) -> &'static [f64] {
                const NONE: &[f64] = &[];
                match self { $(Self::$variant => [$($optional,)? NONE][0],)* }
            }

            /// Value of the parameter at this place where it is not given; `None` where it has to be.
            pub fn absent(self, place: usize) -> Option<f64> {
                let from = self.names().len().checked_sub(self.optional().len())?;
                self.optional().get(place.checked_sub(from)?).copied()
            }
        }

        /// The effects of an extended model.
        #[derive(Debug, Clone, Copy, PartialEq)]
        pub struct Extensions<T> {
            $(pub(super) $field: Option<$type<T>>,)*
            step_s: T,
        }

        impl<T: Real> Extensions<T> {
            /// No effect, for a step of `step_s` seconds.
            pub fn none(step_s: T) -> Self {
                Self { $($field: None,)* step_s }
            }

            /// Adds an effect, or replaces it; optional values may be left out. A wrong number of values is refused like a value
            /// out of range.
            pub fn set(&mut self, extension: Extension, values: &[T]) -> Result<(), ParameterError> {
                let wrong_count = ParameterError {
                    name: extension.id(),
                    value: values.len() as f64,
                    allowed: "as many values as the effect has names",
                };
                #[allow(unused_variables)]
                let step_s = self.step_s;
                match extension {
                    $(Extension::$variant => {
                        let values = with_absent(values, extension).ok_or(wrong_count)?;
                        self.$field = Some($type::new(&values $(, { let $step = step_s; $step })?)?);
                    })*
                }
                Ok(())
            }

            /// Whether an effect is there.
            pub fn has(&self, extension: Extension) -> bool {
                match extension { $(Extension::$variant => self.$field.is_some(),)* }
            }
        }
    };
}

effects! {
    ThermalFade, thermal_fade, ThermalFade, "thermal_fade", [];
    WearDrift, wear_drift, WearDrift, "wear_drift", [];
    DiscAngle, disc_angle, DiscAngle, "disc_angle", [];
    LoadDependence, load_dependence, LoadDependence, "load_dependence", [];
    StaticAgeing, static_ageing, StaticAgeing, "static_ageing", [];
    DirectionAsymmetry, direction_asymmetry, DirectionAsymmetry, "direction_asymmetry", [];
    BellCurve, bell_curve, BellCurve, "bell_curve", [];
    RubberRelaxation, rubber_relaxation, RubberRelaxation, "rubber_relaxation", [];
    ViscousFilm, viscous_film, ViscousFilm, "viscous_film", [];
    BridgeCrosstalk, bridge_crosstalk, BridgeCrosstalk, "bridge_crosstalk", [];
    BridgeDrift, bridge_drift, BridgeDrift, "bridge_drift", [];
    FrictionDelay, friction_delay, FrictionDelay, "friction_delay", [step_s];
    RingResonance, ring_resonance, RingResonance, "ring_resonance", [step_s];
    EncoderEccentricity, encoder_eccentricity, EncoderEccentricity, "encoder_eccentricity", [];
    AdcSaturation, adc_saturation, AdcSaturation, "adc_saturation", [], AdcSaturation::<f32>::OPTIONAL;
}

/// All values of an effect, of which the last ones may not be given; `None` where others are missing, or there are too many.
fn with_absent<T: Real, const COUNT: usize>(values: &[T], extension: Extension) -> Option<[T; COUNT]> {
    let mut all = [T::from_f64(0.0); COUNT];
    for (place, value) in all.iter_mut().enumerate() {
        let given = values.get(place).copied();
        *value = given.or_else(|| extension.absent(place).map(T::from_f64))?;
    }
    (values.len() <= COUNT).then_some(all)
}

impl<T: Real> Extensions<T> {
    /// Changes the step size, s. The caller keeps it positive.
    pub(super) fn set_step_s(&mut self, step_s: T) {
        self.step_s = step_s;
        if let Some(ring) = &mut self.ring_resonance {
            ring.set_step_s(step_s);
        }
        if let Some(delay) = &mut self.friction_delay {
            delay.set_step_s(step_s);
        }
    }

    /// Step size, s.
    pub(crate) fn step_s(&self) -> T {
        self.step_s
    }
}

impl Extension {
    /// The effect with an id.
    pub fn with_id(id: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|extension| extension.id() == id)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_effect_is_found_by_its_id_and_refuses_a_wrong_number_of_values() {
        let mut set = Extensions::none(1e-4f64);
        for &extension in Extension::ALL {
            assert_eq!(Extension::with_id(extension.id()), Some(extension));
            assert!(extension.names().len() <= MOST_VALUES);
            assert_eq!(set.set(extension, &[]).unwrap_err().name, extension.id());
            assert!(!set.has(extension));
        }
        set.set(Extension::ViscousFilm, &[3.0]).unwrap();
        assert!(set.has(Extension::ViscousFilm) && !set.has(Extension::WearDrift));
        // An older record of the channel's ends has no knee.
        for (values, whole) in [(&[-2.0, 2.0][..], true), (&[-2.0, 2.0, 0.1], true), (&[-2.0], false)] {
            assert_eq!(set.set(Extension::AdcSaturation, values).is_ok(), whole, "{values:?}");
        }
        assert!(set.set(Extension::AdcSaturation, &[-2.0, 2.0, 0.1, 0.0]).is_err());
        set.set(Extension::AdcSaturation, &[-2.0, 2.0]).unwrap();
        assert_eq!(set.adc_saturation.unwrap().shown_nm(9.0), 2.0);
        let error = set.set(Extension::ViscousFilm, &[-3.0]).unwrap_err();
        assert_eq!((error.name, error.value), ("coefficient_n_s_per_m", -3.0));
    }
}
