//! What follows from the list of friction models in [`super`]: kinds, the models' and states' enums, and their dispatch.
//!
//! A line names the variant, the type with its [`Element`] implementation, its state, and the `kind` of a model
//! file. A kind is known by its name in files, on the wire and in flash, never by its place in this list.

use super::ModelKind;

macro_rules! models {
    ($($(#[doc = $doc:literal])* $variant:ident, $model:path, $state:path, $name:literal;)*) => {
        /// Which friction model.
        #[non_exhaustive]
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
        pub enum ModelKind {
            $($(#[doc = $doc])* $variant,)*
        }

        /// A friction model, prepared for a step size.
        #[non_exhaustive]
        #[derive(Debug, Clone, Copy, PartialEq)]
        #[allow(clippy::large_enum_variant, reason = "made once, and there is no heap to put it on")]
        pub enum FrictionModel<T> {
            $($(#[doc = $doc])* $variant($model),)*
        }

        /// State of a [`FrictionModel`], of the same kind as the model.
        #[non_exhaustive]
        #[derive(Debug, Clone, Copy, PartialEq)]
        pub enum FrictionState<T> {
            $($(#[doc = $doc])* $variant($state),)*
        }

        impl ModelKind {
            /// All of them.
            pub const ALL: &'static [Self] = &[$(Self::$variant,)*];

            /// Name in a model file, on the wire and in flash.
            #[must_use]
            pub const fn name(self) -> &'static str {
                match self { $(Self::$variant => $name,)* }
            }

            /// Its parameters in the order of the file.
            #[must_use]
            pub fn parameters(self) -> &'static [ParameterSpec] {
                type T = f32;
                match self { $(Self::$variant => <$model as Element<T>>::PARAMETERS,)* }
            }

            /// The model from one value for each parameter, prepared for a step size, or the parameter out of range.
            pub fn build<T: $crate::real::Real>(self, values: &[T], step_s: T) -> Result<FrictionModel<T>, ParameterError> {
                Ok(match self {
                    $(Self::$variant => FrictionModel::$variant(Element::build(values, step_s)?),)*
                })
            }
        }

        const _: () = {
            type T = f32;
            $(assert!(<$model as Element<T>>::PARAMETERS.len() <= MOST_PARAMETERS);)*
        };

        impl<T: Real> FrictionModel<T> {
            /// Which model it is.
            pub fn kind(&self) -> ModelKind {
                match self { $(Self::$variant(_) => ModelKind::$variant,)* }
            }

            /// The undeformed state.
            pub fn rest(&self) -> FrictionState<T> {
                match self { $(Self::$variant(m) => FrictionState::$variant(Element::rest(m)),)* }
            }

            /// The state that carries `force_n` at rest, limited to what the load can carry: where a record
            /// begins with the element already deformed.
            pub fn holding(&self, force_n: T, contact: &Contact<T>) -> FrictionState<T> {
                match self {
                    $(Self::$variant(m) => FrictionState::$variant(Element::holding(m, force_n, contact)),)*
                }
            }

            /// Changes the step size, s, for unevenly sampled inputs. The caller keeps it positive.
            #[inline]
            pub fn set_step_s(&mut self, step_s: T) {
                match self { $(Self::$variant(m) => Element::set_step_s(m, step_s),)* }
            }

            /// Advances the element by one step and returns the friction force. A state of another kind is
            /// first replaced by the undeformed state of this kind.
            #[inline]
            pub fn step(&self, state: &mut FrictionState<T>, contact: &Contact<T>) -> FrictionForce<T> {
                match (self, &mut *state) {
                    $((Self::$variant(m), FrictionState::$variant(s)) => Element::step(m, s, contact),)*
                    _ => {
                        *state = self.rest();
                        FrictionForce::default()
                    }
                }
            }

            /// Largest friction coefficient that the model can show.
            pub fn largest_coefficient(&self) -> T {
                match self { $(Self::$variant(m) => Element::largest_coefficient(m),)* }
            }

            /// Stiffness against a small motion while the element sticks under `load_n`, N/m.
            pub fn sticking_stiffness_n_per_m(&self, load_n: T) -> T {
                match self { $(Self::$variant(m) => Element::sticking_stiffness_n_per_m(m, load_n),)* }
            }

            /// What a user should know who runs the model with these parameters.
            pub fn warning(&self) -> Option<&'static str> {
                match self { $(Self::$variant(m) => Element::warning(m),)* }
            }

            /// The curve of steady sliding, where it is a Stribeck curve.
            pub fn stribeck(&self) -> Option<&Stribeck<T>> {
                match self { $(Self::$variant(m) => Element::stribeck(m),)* }
            }

            /// Shortest time constant of the rubber that a step should resolve, s.
            pub fn block_time_s(&self) -> Option<T> {
                match self { $(Self::$variant(m) => Element::block_time_s(m),)* }
            }

            /// Distance over which asperities wind up that are stepped in first order, m.
            pub fn winding_reach_m(&self, load_n: T) -> Option<T> {
                match self { $(Self::$variant(m) => Element::winding_reach_m(m, load_n),)* }
            }
        }

        impl<T: Real> FrictionState<T> {
            /// Deformation of the rubber, or of the asperities where the model has no rubber, m.
            pub fn deformation_m(&self) -> T {
                match self { $(Self::$variant(s) => <$model as Element<T>>::deformation_m(s),)* }
            }
        }
    };
}

impl ModelKind {
    /// The kind with a name.
    #[must_use]
    pub fn with_name(name: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|kind| kind.name() == name)
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Contact, FrictionParameters, MOST_PARAMETERS};
    use super::*;

    #[test]
    fn every_kind_is_found_by_its_name_and_its_assumed_numbers_make_a_model() {
        for &kind in ModelKind::ALL {
            assert_eq!(ModelKind::with_name(kind.name()), Some(kind));
            let model = FrictionParameters::<f64>::typical(kind).model(1e-4).unwrap();
            assert_eq!(model.kind(), kind);
            assert!(kind.build(&[1.0f64; MOST_PARAMETERS + 1], 1e-4).is_err(), "{}", kind.name());
            for spec in kind.parameters() {
                if let Some((low, high)) = spec.search {
                    assert!(low <= spec.typical && spec.typical <= high, "{}: {}", kind.name(), spec.name);
                }
            }
        }
    }

    #[test]
    fn every_model_names_each_parameter_that_is_no_number() {
        for &kind in ModelKind::ALL {
            let typical = FrictionParameters::<f64>::typical(kind);
            for (at, spec) in kind.parameters().iter().enumerate() {
                let mut values = [0.0; MOST_PARAMETERS];
                let values = &mut values[..kind.parameters().len()];
                values.copy_from_slice(typical.values());
                values[at] = f64::NAN;
                assert_eq!(kind.build(values, 1e-4).unwrap_err().name, spec.name, "{}", kind.name());
            }
        }
    }

    #[test]
    fn every_model_is_bounded_by_its_largest_coefficient_and_lets_go_without_load() {
        for &kind in ModelKind::ALL {
            let model = FrictionParameters::<f64>::typical(kind).model(1e-4).unwrap();
            let mut state = model.rest();
            let most = 88.0 * model.largest_coefficient();
            for k in 0..20_000 {
                let v = 0.3 * libm::sin(1e-3 * f64::from(k)) * libm::sin(0.13 * f64::from(k));
                let force_n = model.step(&mut state, &Contact::new(v, 88.0)).force_n;
                assert!(force_n.abs() <= most * (1.0 + 1e-9), "{} {k}: {force_n}", kind.name());
            }
            assert_eq!(model.step(&mut state, &Contact::new(0.1, 0.0)).force_n, 0.0, "{}", kind.name());
        }
    }

    #[test]
    fn every_model_holds_what_it_is_told_to_and_no_more_than_the_load_carries() {
        for &kind in ModelKind::ALL {
            let mut model = FrictionParameters::<f64>::typical(kind).model(1e-7).unwrap();
            model.set_step_s(1e-7);
            let contact = Contact::new(0.0, 88.0);
            let mut state = model.holding(20.0, &contact);
            let force_n = model.step(&mut state, &contact).force_n;
            assert!((force_n - 20.0).abs() < 0.2, "{}: {force_n}", kind.name());
            let mut state = model.holding(1e4, &contact);
            assert!(
                model.step(&mut state, &contact).force_n <= 88.0 * model.largest_coefficient() * (1.0 + 1e-9)
            );
        }
    }
}
