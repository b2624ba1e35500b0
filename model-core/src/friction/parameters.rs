//! A friction model's kind with one value for each of its parameters: what a model file, the wire and the observer's
//! settings hold.

use core::fmt::{self, Debug};

use super::brush::BrushParameters;
use super::element::MOST_PARAMETERS;
use super::lugre::{self, LugreParameters};
use super::series::SeriesParameters;
use super::{FrictionModel, ModelKind};
use crate::error::ParameterError;
use crate::real::Real;

/// Kind and numbers of a friction model, all elements together.
#[derive(Clone, Copy, PartialEq)]
pub struct FrictionParameters<T> {
    kind: ModelKind,
    values: [T; MOST_PARAMETERS],
}

impl<T: Debug> Debug for FrictionParameters<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut shown = f.debug_struct(self.kind.name());
        for (spec, value) in self.kind.parameters().iter().zip(&self.values) {
            shown.field(spec.name, value);
        }
        shown.finish()
    }
}

impl<T: Real> FrictionParameters<T> {
    /// One value for each parameter of the kind, in its order. Whether they are in range is found when the model is
    /// built.
    ///
    /// # Errors
    /// A wrong number of values.
    pub fn new(kind: ModelKind, values: &[T]) -> Result<Self, ParameterError> {
        if values.len() != kind.parameters().len() {
            let allowed = "one value for each parameter of the model";
            return Err(ParameterError { name: kind.name(), value: values.len() as f64, allowed });
        }
        Ok(Self::of(kind, values))
    }

    fn of(kind: ModelKind, given: &[T]) -> Self {
        let mut values = [T::ZERO; MOST_PARAMETERS];
        values.iter_mut().zip(given).for_each(|(value, given)| *value = *given);
        Self { kind, values }
    }

    /// The numbers of the assumed rubber.
    #[must_use]
    pub fn typical(kind: ModelKind) -> Self {
        let mut values = [T::ZERO; MOST_PARAMETERS];
        let typical = kind.parameters().iter().map(|spec| T::from_f64(spec.typical));
        values.iter_mut().zip(typical).for_each(|(value, typical)| *value = typical);
        Self { kind, values }
    }

    /// A brush.
    pub fn brush(p: &BrushParameters<T>) -> Self {
        Self::of(ModelKind::Brush, &p.values())
    }

    /// LuGre.
    pub fn lugre(p: &LugreParameters<T>) -> Self {
        Self::of(ModelKind::Lugre, &p.values())
    }

    /// Modified LuGre.
    pub fn modified_lugre(p: &LugreParameters<T>) -> Self {
        Self::of(ModelKind::ModifiedLugre, &p.values())
    }

    /// A block in series with bristles.
    pub fn series(p: &SeriesParameters<T>) -> Self {
        Self::of(ModelKind::Series, &p.values())
    }

    /// Which model.
    pub fn kind(&self) -> ModelKind {
        self.kind
    }

    /// The values in the order of [`ModelKind::parameters`].
    pub fn values(&self) -> &[T] {
        &self.values[..self.kind.parameters().len()]
    }

    fn position(&self, name: &str) -> Option<usize> {
        self.kind.parameters().iter().position(|spec| spec.name == name)
    }

    /// A parameter by its name in the model file.
    pub fn get(&self, name: &str) -> Option<T> {
        self.position(name).map(|at| self.values[at])
    }

    /// The same with another value; unchanged where the kind has no such parameter.
    #[must_use]
    pub fn with(mut self, name: &str, value: T) -> Self {
        if let Some(at) = self.position(name) {
            self.values[at] = value;
        }
        self
    }

    /// The parameters of an element that is this share of the whole contact.
    #[must_use]
    pub fn share(&self, share: T) -> Self {
        let mut part = *self;
        for (value, spec) in part.values.iter_mut().zip(self.kind.parameters()) {
            if spec.extensive {
                *value = *value * share;
            }
        }
        part
    }

    /// The same numbers in another precision.
    #[must_use]
    pub fn cast<U: Real>(&self) -> FrictionParameters<U> {
        FrictionParameters { kind: self.kind, values: self.values.map(|value| U::from_f64(value.to_f64())) }
    }

    /// The model, prepared for a step of `step_s` seconds.
    ///
    /// # Errors
    /// The parameter out of range.
    pub fn model(&self, step_s: T) -> Result<FrictionModel<T>, ParameterError> {
        self.kind.build(self.values(), step_s)
    }

    /// The numbers of a block in series with bristles, where it is one.
    pub fn as_series(&self) -> Option<SeriesParameters<T>> {
        (self.kind == ModelKind::Series).then(|| SeriesParameters::from_values(self.values()).ok()).flatten()
    }

    /// The numbers of a brush, where it is one.
    pub fn as_brush(&self) -> Option<BrushParameters<T>> {
        (self.kind == ModelKind::Brush).then(|| BrushParameters::from_values(self.values()).ok()).flatten()
    }

    /// The bristles, of every model that has LuGre's.
    pub fn bristles(&self) -> Option<LugreParameters<T>> {
        let has_them = self.kind.parameters().starts_with(lugre::PARAMETERS);
        has_them.then(|| LugreParameters::from_values(&self.values[..lugre::PARAMETERS.len()]).ok()).flatten()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::friction::Contact;

    #[test]
    fn a_third_of_the_contact_has_a_third_of_what_grows_with_it() {
        let whole = FrictionParameters::<f64>::typical(ModelKind::Series);
        let third = whole.share(1.0 / 3.0);
        for spec in ModelKind::Series.parameters() {
            let ratio = third.get(spec.name).unwrap() / whole.get(spec.name).unwrap();
            let grows = spec.name.ends_with("n_per_m") || spec.name.ends_with("n_s_per_m");
            let expected = if grows { 1.0 / 3.0 } else { 1.0 };
            // σ1 and a2 are zero.
            assert!(ratio.is_nan() || (ratio - expected).abs() < 1e-15, "{}: {ratio}", spec.name);
        }
    }

    #[test]
    fn every_model_split_into_three_gives_the_friction_of_the_whole() {
        for &kind in ModelKind::ALL {
            let whole = FrictionParameters::<f64>::typical(kind);
            let (all, part) = (whole.model(1e-4).unwrap(), whole.share(1.0 / 3.0).model(1e-4).unwrap());
            let (mut a, mut b) = (all.rest(), part.rest());
            for k in 0..300 {
                let v = 0.18 * libm::sin(0.02 * f64::from(k));
                let force_n = all.step(&mut a, &Contact::new(v, 88.0)).force_n;
                let thrice_n = 3.0 * part.step(&mut b, &Contact::new(v, 88.0 / 3.0)).force_n;
                assert!(
                    (force_n - thrice_n).abs() < 1e-6 * 88.0,
                    "{} {k}: {force_n} {thrice_n}",
                    kind.name()
                );
            }
        }
    }

    #[test]
    fn typed_parameters_come_back_as_they_went() {
        let series = FrictionParameters::<f64>::typical(ModelKind::Series);
        let typed = series.as_series().unwrap();
        assert_eq!(FrictionParameters::series(&typed), series);
        assert_eq!(series.bristles(), Some(typed.bristles));
        assert_eq!(FrictionParameters::<f64>::typical(ModelKind::Brush).bristles(), None);
        assert_eq!(series.as_brush(), None);
    }
}
