//! `model-extended.toml`: the fitted baseline with the named effects in it, as the chip takes them.
//!
//! An effect of the contact is written in the core's parameters, by the law of its own file. What the core has no law for is a
//! comment. For drive logs the drive's parameters under `kind = "drive"`.

use std::collections::BTreeMap;

use model_core::extension::Extension as CoreExtension;
use nalgebra::DMatrix;

use super::contact::baseline::has_block;
use super::contact::problem::{Fit, Numbers, Problem};
use super::contact::search;
use super::contact_part::ContactPart;
use super::fit_contact::{self, Begin};
use super::fit_interval::Linearised;
use super::judge::Judgement;
use super::linear::Slope;
use super::linear_part::Linear;
use super::table::Part;
use super::{effects, fit_parameters};
use crate::files::log::Log;
use crate::files::model_file::{Extension, ModelFile, ModelKind};
use crate::files::number;
use crate::files::rig_file::RigFile;
use crate::input_error::InputError;

/// Step of the finite differences that carry a covariance through a law.
const STEP: f64 = 1e-3;

/// A fitted number of an effect.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Value {
    /// Value.
    pub value: f64,
    /// Standard deviation; `None` where the logs do not determine it.
    pub std: Option<f64>,
}

/// Parameters of each named effect, by its id.
pub type Values = BTreeMap<&'static str, BTreeMap<String, Value>>;

/// The extended contact: model, parameters of its effects.
pub struct ExtendedContact {
    /// The model, which the core runs.
    pub model: ModelFile,
    /// Parameters of the effects in the contact.
    pub values: Values,
    /// The answer with its laws.
    pub laws: FittedLaws,
}

/// A fit of the contact's answer in laws.
pub struct FittedLaws {
    /// The fit.
    pub fit: Fit,
    /// Slopes of its residuals (negative), a column for each value.
    pub columns: Vec<Slope>,
    /// Covariance of its values.
    pub covariance: DMatrix<f64>,
}

/// The contact's answer in the core's laws.
///
/// # Errors
/// Where the model cannot take the fitted numbers.
pub fn contact(part: &ContactPart, place: usize, model: &ModelFile) -> Result<ExtendedContact, InputError> {
    let problem = part.problem();
    let fit = search::as_laws(&problem, part.fit(place));
    let base = part.baseline.free.len();
    let laws = FittedLaws::new(&problem, fit);
    let FittedLaws { fit, covariance, .. } = &laws;
    let mut numbers = part.baseline.numbers(&fit.p);
    // What changes a block changes one that is new; the bristles' numbers stand aside.
    let mut block = problem.change(&fit.terms, &fit.p).block;
    numbers.exchange(&mut block);
    let mut values = Values::new();
    let mut extensions = Vec::new();
    let mut at = base;
    for &term in &fit.terms {
        let term = &part.terms[term];
        let count = term.parameters.len();
        let own = &fit.p[at..at + count];
        let exported: BTreeMap<String, Value> = match &term.export {
            Some(export) => {
                let before = numbers;
                let named = export(own, &mut numbers);
                let sensitivity: Vec<Vec<f64>> = (0..count)
                    .map(|i| {
                        let mut moved = own.to_vec();
                        moved[i] += STEP;
                        let other = export(&moved, &mut before.clone());
                        named.iter().zip(other).map(|(a, b)| (b.1 - a.1) / STEP).collect()
                    })
                    .collect();
                let std = |k: usize| {
                    let mut sum = 0.0;
                    for i in 0..count {
                        for j in 0..count {
                            sum += sensitivity[i][k] * sensitivity[j][k] * covariance[(at + i, at + j)];
                        }
                    }
                    sum.max(0.0).sqrt()
                };
                let determined = |k: usize, value: f64| {
                    Some(std(k)).filter(|s| s.is_finite() && (*s < value.abs() || value == 0.0))
                };
                named
                    .iter()
                    .enumerate()
                    .map(|(k, (name, value))| {
                        (name.clone(), Value { value: *value, std: determined(k, *value) })
                    })
                    .collect()
            }
            None => term
                .parameters
                .iter()
                .zip(own)
                .enumerate()
                .map(|(i, (q, x))| {
                    (
                        q.name.clone(),
                        Value { value: *x, std: Some(covariance[(at + i, at + i)].max(0.0).sqrt()) },
                    )
                })
                .collect(),
        };
        let core = CoreExtension::with_id(term.effect).map(CoreExtension::names).unwrap_or_default();
        // A form of which the core has nothing is told, and not predicted.
        if term.export.is_some() && core.iter().any(|name| exported.contains_key(*name)) {
            let absent = |name: &str| effects::with_id(term.effect).map_or(0.0, |effect| effect.absent(name));
            let value = |name: &str| exported.get(name).map_or_else(|| absent(name), |v| v.value);
            let parameters = core.iter().map(|name| ((*name).to_string(), value(name))).collect();
            extensions.push(Extension { id: term.effect.into(), parameters });
        }
        values.entry(term.effect).or_default().extend(exported);
        at += count;
    }
    numbers.exchange(&mut block);
    let mut extended = with_numbers(model, &numbers, block)?;
    for extension in extensions {
        extended.extensions.push(extension);
        // What is out of the core's range stays out of the file.
        if ModelFile::parse("model-extended.toml", &extended.to_toml()).is_err() {
            extended.extensions.pop();
        }
    }
    Ok(ExtendedContact { model: extended, values, laws })
}

impl ExtendedContact {
    /// What turned out to be a model of another kind, without an effect around it, is fitted as `rig fit` does: the
    /// observer's bias is taken off its numbers. Where that fit refuses, they stand as they were found.
    pub fn fitted(self, told: &ModelFile, rig: &RigFile, logs: &[Log], progress: &(dyn Fn() + Sync)) -> Self {
        if self.model.kind == told.kind || !self.model.extensions.is_empty() {
            return self;
        }
        let free = fit_parameters::default_free(&self.model);
        let fit = fit_contact::identify(&self.model, rig, logs, &free, Begin::There, progress);
        let Ok(fit) = fit else { return self };
        let Self { mut values, laws, .. } = self;
        for (at, name) in fit.names.iter().enumerate() {
            let std = fit.ends[at].map(|_| fit.std[at]);
            for own in values.values_mut().filter_map(|entry| entry.get_mut(name)) {
                *own = Value { value: fit.values[at], std };
            }
        }
        Self { model: fit.model, values, laws }
    }
}

impl FittedLaws {
    /// With the covariance from blocks of the residuals: what strikes a few load steps is known by those few.
    fn new(problem: &Problem<'_>, fit: Fit) -> Self {
        let columns = problem.jacobian(&fit.terms, &fit.p, &fit.r);
        let prior_sd: Vec<f64> = problem.parameters(&fit.terms).map(|q| q.sd).collect();
        let covariance = Linearised::new(problem, &fit, &columns).known(&prior_sd, prior_sd.len()).covariance;
        Self { fit, columns, covariance }
    }
}

/// A model file with fitted numbers; `block` makes a model without one the series element, with brush friction in it as a curve
/// that falls at once.
fn with_numbers(
    model: &ModelFile,
    numbers: &Numbers,
    block: Option<(f64, f64)>,
) -> Result<ModelFile, InputError> {
    let theta = model.get("theta").unwrap_or(1.0);
    let n = numbers;
    let stiffness = if has_block(model) { "k_u_n_per_m" } else { "sigma0_n_per_m" };
    let damping = if has_block(model) { "c_u_n_s_per_m" } else { "sigma1_n_s_per_m" };
    let mut fitted = vec![
        ("a0", n.a0 / theta),
        ("a1", n.static_drop() / theta),
        ("v0_m_s", n.v0_m_s),
        ("delta", n.delta.clamp(0.1, 4.0)),
        ("theta", theta),
        ("a2_s_per_m", n.a2_s_per_m),
        (stiffness, n.stiffness_n_per_m),
        (damping, n.damping_n_s_per_m),
        ("mu_c", n.a0),
        ("mu_s", n.a0 + n.static_drop()),
        ("c_n_per_m", n.stiffness_n_per_m),
    ];
    fitted.extend(block.into_iter().flat_map(|(k, c)| [("k_u_n_per_m", k), ("c_u_n_s_per_m", c)]));
    let kind = if block.is_some() { ModelKind::Series } else { model.kind };
    let value =
        |name| fitted.iter().find(|(own, _)| *own == name).map(|(_, fitted)| *fitted).or(model.get(name));
    let names = kind.parameters().iter().map(|spec| spec.name);
    let values: Vec<(&str, f64)> = names.filter_map(|name| Some((name, value(name)?))).collect();
    ModelFile::new("model-extended.toml", kind, &values)
}

/// Parameters of the effects in a linear balance.
pub fn linear_values(part: &Linear, place: usize) -> Values {
    let solved = &part.solved[place];
    let mut out = Values::new();
    // What the contact tells has its numbers there.
    for (alternative, places) in solved.forms(&part.alternatives).filter(|(form, _)| !form.told) {
        let entry = out.entry(alternative.effect).or_default();
        for (q, i) in alternative.parameters.iter().zip(places) {
            entry.insert(q.name.clone(), Value { value: solved.p[i], std: Some(solved.std(i)) });
        }
        for (name, value) in &alternative.constants {
            entry.insert(name.clone(), Value { value: *value, std: None });
        }
    }
    out
}

/// Adds the amplitude of each wave, from the sizes of its cosine and its sine.
pub fn add_amplitudes(values: &mut Values) {
    for entry in values.values_mut() {
        let waves: Vec<(String, Value)> = entry
            .iter()
            .filter_map(|(name, cosine)| {
                let which = name.strip_prefix("cos_")?;
                let sine = entry.get(&format!("sin_{which}"))?;
                let size = cosine.value.hypot(sine.value).max(f64::MIN_POSITIVE);
                let spread = |v: &Value| v.std.map(|s| s * v.value / size);
                let std = spread(cosine).zip(spread(sine)).map(|(c, s)| c.hypot(s));
                Some((format!("amplitude_{which}"), Value { value: size, std }))
            })
            .collect();
        entry.extend(waves);
    }
}

fn line(name: &str, value: f64) -> String {
    let value = number::text(value);
    let point = if value.contains(['.', 'e']) { "" } else { ".0" };
    format!("{name} = {value}{point}\n")
}

/// The file of a drive.
pub fn drive_text(found: &Judgement) -> String {
    let Some(part) = &found.drive else { return String::new() };
    let place = found.place(Part::Drive).unwrap_or(0);
    let names = if found.linear_stage {
        ["mass_kg", "coulomb_n", "viscous_n_s_per_m"]
    } else {
        ["inertia_kg_m2", "coulomb_nm", "viscous_nm_s_per_rad"]
    };
    let mut text = "kind = \"drive\"\n\n[parameters]\n".to_string();
    for (name, value) in names.iter().zip(&part.solved[place].p) {
        text += &line(name, *value);
    }
    for (id, values) in linear_values(part, place) {
        text += &format!("\n[[extension]]\nid = \"{id}\"\n");
        values.iter().for_each(|(name, v)| text += &line(name, v.value));
    }
    text
}

/// Numbers of the contact's effects that its file does not have, as comments of it.
pub fn remarks_of_contact(model: &ModelFile, values: &Values) -> String {
    let mut text = String::new();
    for (id, values) in values {
        let own = model.extensions.iter().find(|extension| extension.id == *id);
        let has = |name: &str| own.is_some_and(|own| own.parameters.iter().any(|(other, _)| other == name));
        let missing = |(name, _): &(&String, &Value)| !has(name) && model.get(name).is_none();
        let missing: Vec<(&String, &Value)> = values.iter().filter(missing).collect();
        if !missing.is_empty() {
            text += &format!("\n# {id}: the observer on the chip has no law for this of it:\n");
            missing.iter().for_each(|(name, v)| text += &format!("# {}", line(name, v.value)));
        }
    }
    text
}

/// What was found outside the contact, as comments of its file.
pub fn remarks(found: &Judgement) -> String {
    let mut text = String::new();
    for (part, linear) in [(Part::Drive, &found.drive), (Part::Pressure, &found.normal_load)] {
        let (Some(linear), Some(place)) = (linear, found.place(part)) else { continue };
        for (id, values) in linear_values(linear, place) {
            text += &format!(
                "\n# {id} was found in the balance of the {}; the observer on the chip has no law for it:\n",
                part.name()
            );
            values.iter().for_each(|(name, v)| text += &format!("# {}", line(name, v.value)));
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::identify::contact::baseline::{KNOWN_WITHIN, baseline};

    #[test]
    fn any_model_with_the_block_that_was_found_is_a_model_of_the_same_friction() {
        let brush = "kind = \"brush\"\n[parameters]\nc_n_per_m = 3e4\nmu_s = 1.0\nmu_c = 0.5\n";
        let lugre = "kind = \"lugre\"\n[parameters]\nsigma0_n_per_m = 3e4\nsigma1_n_s_per_m = 0.0\na0 = 0.5\na1 = 0.5\n\
                     a2_s_per_m = 0.0\nv0_m_s = 1e-4\ndelta = 1.0\ntheta = 1.0\n";
        let [brush, lugre] = [brush, lugre].map(|text| {
            let model = ModelFile::parse("model.toml", text).unwrap();
            with_numbers(&model, &baseline(&model, KNOWN_WITHIN).numbers, Some((2e4, 50.0))).unwrap()
        });
        assert_eq!((brush.kind, brush.get("k_u_n_per_m")), (ModelKind::Series, Some(2e4)));
        assert_eq!(brush.to_toml(), lugre.to_toml());
    }

    #[test]
    fn what_the_file_lacks_of_an_effect_is_a_comment_of_it() {
        let text = "kind = \"brush\"\n[parameters]\nc_n_per_m = 3e4\nmu_s = 1.0\nmu_c = 0.5\n\n[[extension]]\n\
                    id = \"adc_saturation\"\nfriction_low_nm = -3.0\nfriction_high_nm = 3.0\nfriction_knee_nm = 0.1\n";
        let model = ModelFile::parse("model.toml", text).unwrap();
        let value = |name: &str, value| (name.to_string(), Value { value, std: None });
        let clips = [value("friction_low_nm", -3.0), value("friction_high_nm", 3.0)];
        // In the numbers of the model.
        let stiffer = [value("c_n_per_m", 3e4)];
        let remarks = |clips: &[(String, Value)]| {
            let values =
                [("adc_saturation", clips.iter().cloned().collect()), ("stiffer", stiffer.clone().into())];
            remarks_of_contact(&model, &values.into())
        };
        assert_eq!(remarks(&clips), "");
        let said = remarks(&[&clips[..], &[value("normal_high_n", 90.0)]].concat());
        assert!(
            said.contains("# adc_saturation: ") && said.ends_with(":\n# normal_high_n = 90.0\n"),
            "{said}"
        );
        assert_eq!(ModelFile::parse("model.toml", &(text.to_string() + &said)).unwrap(), model);
    }

    #[test]
    fn a_brush_that_was_fitted_without_a_fall_is_a_file_that_can_be_read() {
        let brush = "kind = \"brush\"\n[parameters]\nc_n_per_m = 3e4\nmu_s = 0.5\nmu_c = 0.5\n";
        let model = ModelFile::parse("model.toml", brush).unwrap();
        let numbers = Numbers { a1: -0.02, ..baseline(&model, KNOWN_WITHIN).numbers };
        let [alone, in_series] =
            [None, Some((2e4, 50.0))].map(|block| with_numbers(&model, &numbers, block).unwrap());
        assert_eq!((alone.get("mu_s"), in_series.get("a1")), (Some(0.5), Some(0.0)));
    }
}
