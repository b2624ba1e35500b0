//! The model file: which friction model, its parameters, and what `diagnose` added to it.
//!
//! `kind` names the model, `[parameters]` holds its numbers with their units in their names (stiffness
//! and damping are those of all three elements together), `[intervals]` may hold what `fit` found about
//! their uncertainty, and each `[[extension]]` has the `id` of an effect and its parameters.

use std::collections::BTreeMap;
use std::path::Path;

use model_core::error::ParameterError;
use model_core::extension::{Extension as CoreExtension, Extensions};
use model_core::friction::brush::BrushParameters;
use model_core::friction::lugre::LugreParameters;
use model_core::friction::series::SeriesParameters;
use model_core::friction::stribeck::StribeckParameters;
use model_core::friction::{FrictionModel, FrictionParameters};
pub use model_core::friction::{ModelKind, ParameterSpec};

use super::effect_id;
use super::number;
use super::overrides;
use super::toml_tree::{Document, FINITE, NOT_NEGATIVE, TableReader};
use crate::input_error::InputError;

/// All kinds with their names in the file.
#[must_use]
pub fn model_kinds() -> Vec<(&'static str, ModelKind)> {
    ModelKind::ALL.iter().map(|kind| (kind.name(), *kind)).collect()
}

/// Any step size, for what does not depend on it: to have numbers checked, to prepare a model that is given its step later.
pub(crate) const SOME_STEP_S: f64 = 1e-4;

/// What `fit` found about a parameter's uncertainty.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Interval {
    /// Standard deviation.
    pub std: f64,
    /// Lower end of the 95 % interval.
    pub low: f64,
    /// Upper end of the 95 % interval.
    pub high: f64,
}

/// An effect added to the model.
#[derive(Debug, Clone, PartialEq)]
pub struct Extension {
    /// Effect id, one of [`effect_id::EFFECTS`].
    pub id: String,
    /// Its parameters in the file's order, names with units.
    pub parameters: Vec<(String, f64)>,
}

impl Extension {
    /// A parameter of the extension.
    pub fn get(&self, name: &str) -> Option<f64> {
        self.parameters.iter().find(|(key, _)| key == name).map(|(_, value)| *value)
    }
}

/// A friction model with numbers.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelFile {
    /// The file as the user named it.
    pub source: String,
    /// Which model.
    pub kind: ModelKind,
    /// One value for each of [`ModelKind::parameters`], in that order.
    values: Vec<f64>,
    /// Uncertainties, where `fit` wrote them.
    pub intervals: BTreeMap<String, Interval>,
    /// Effects added by `diagnose`.
    pub extensions: Vec<Extension>,
}

impl ModelFile {
    /// A model with given parameters; those left out take their defaults.
    pub fn new(source: &str, kind: ModelKind, parameters: &[(&str, f64)]) -> Result<Self, InputError> {
        let refuse = |name: &str, problem: &str| InputError::new(problem).file(source).key(name);
        if let Some((name, _)) =
            parameters.iter().find(|(name, _)| !kind.parameters().iter().any(|s| s.name == *name))
        {
            let names: Vec<&str> = kind.parameters().iter().map(|spec| spec.name).collect();
            return Err(refuse(name, "unknown parameter").allowed(names.join(", ")));
        }
        let mut values = Vec::new();
        for spec in kind.parameters() {
            let given = parameters.iter().find(|(name, _)| *name == spec.name).map(|(_, value)| *value);
            values.push(given.or(spec.default).ok_or_else(|| refuse(spec.name, "is missing"))?);
        }
        let model =
            Self { source: source.into(), kind, values, intervals: BTreeMap::new(), extensions: Vec::new() };
        model.friction_model(SOME_STEP_S)?;
        Ok(model)
    }

    /// The assumed rubber: the series model with the numbers of the assumed rig.
    pub fn assumed(changes: &[(String, String)]) -> Result<Self, InputError> {
        let mut document = Document::parse("assumed model", include_str!("../../models/assumed.toml"))?;
        overrides::apply(&mut document, changes)?;
        Self::from_root(&document.root(), "assumed model")
    }

    /// Reads and checks a file, with changes.
    pub fn read(path: &Path, changes: &[(String, String)]) -> Result<Self, InputError> {
        let mut document = Document::read(path)?;
        overrides::apply(&mut document, changes)?;
        Self::from_root(&document.root(), &path.display().to_string())
    }

    /// Reads a file, or takes the assumed model where none is given.
    pub fn read_or_assumed(path: Option<&Path>, changes: &[(String, String)]) -> Result<Self, InputError> {
        let Some(path) = path else {
            crate::provenance::note("model", "assumed: no file was given");
            return Self::assumed(changes);
        };
        Self::read(path, changes)
    }

    /// Parses and checks a text.
    pub fn parse(source: &str, text: &str) -> Result<Self, InputError> {
        Self::from_root(&Document::parse(source, text)?.root(), source)
    }

    fn from_root(root: &TableReader<'_>, source: &str) -> Result<Self, InputError> {
        let kinds = model_kinds();
        let names: Vec<&str> = kinds.iter().map(|(name, _)| *name).collect();
        let kind = root.choice("kind", &kinds)?.ok_or_else(|| root.missing("kind", &names.join(", ")))?;
        let table =
            root.table("parameters")?.ok_or_else(|| root.missing("parameters", "a table [parameters]"))?;
        let given = kind.parameters().iter().map(|spec| table.number(spec.name, FINITE));
        let given = given.collect::<Result<Vec<_>, _>>()?;
        // A misspelt name is both unknown and missing: the line that has it is the one to show.
        table.finish()?;
        let mut values = Vec::new();
        for (spec, value) in kind.parameters().iter().zip(given) {
            let value = value.or(spec.default);
            values.push(value.ok_or_else(|| table.missing(spec.name, "a finite number"))?);
        }
        let intervals = root.table("intervals")?.map(|table| read_intervals(&table, kind)).transpose()?;
        let extensions = root.tables("extension")?.iter().map(read_extension).collect::<Result<_, _>>()?;
        root.finish()?;
        let intervals = intervals.unwrap_or_default();
        let model = Self { source: source.into(), kind, values, intervals, extensions };
        match model.build(SOME_STEP_S) {
            Ok(_) => Ok(model),
            Err(e) => Err(table.error(e.name, "out of range").allowed(e.allowed)),
        }
    }

    /// A parameter by its name; `None` for a name this kind does not have.
    pub fn get(&self, name: &str) -> Option<f64> {
        self.parameters().find(|(key, _)| *key == name).map(|(_, value)| value)
    }

    /// Changes a parameter; the model is unchanged where the name is unknown or the value out of range.
    pub fn set(&mut self, name: &str, value: f64) -> Result<(), InputError> {
        let at = self.kind.parameters().iter().position(|spec| spec.name == name).ok_or_else(|| {
            InputError::new("unknown parameter").file(self.source.as_str()).key(name).value(value)
        })?;
        let before = std::mem::replace(&mut self.values[at], value);
        self.friction_model(SOME_STEP_S).map(|_| ()).inspect_err(|_| self.values[at] = before)
    }

    /// Names and values in the order of the file.
    pub fn parameters(&self) -> impl Iterator<Item = (&'static str, f64)> + '_ {
        self.kind.parameters().iter().map(|spec| spec.name).zip(self.values.iter().copied())
    }

    /// The friction model with these numbers, without the extensions, prepared for a step size.
    pub fn friction_model(&self, step_s: f64) -> Result<FrictionModel<f64>, InputError> {
        self.build(step_s).map_err(|e| InputError::from(e).file(self.source.as_str()))
    }

    fn build(&self, step_s: f64) -> Result<FrictionModel<f64>, ParameterError> {
        self.kind.build(&self.values, step_s)
    }

    /// Kind and numbers, without uncertainties and effects.
    #[must_use]
    pub fn friction(&self) -> FrictionParameters<f64> {
        // The file was checked when it was read: it has a value for each parameter of its kind.
        let assumed = FrictionParameters::typical(self.kind);
        FrictionParameters::new(self.kind, &self.values).unwrap_or(assumed)
    }

    /// A parameter that the kind has; a name that it does not have is not a number, which every model refuses.
    fn value(&self, name: &str) -> f64 {
        self.get(name).unwrap_or(f64::NAN)
    }

    /// The numbers as those of a brush.
    pub fn brush(&self) -> BrushParameters<f64> {
        BrushParameters {
            c_n_per_m: self.value("c_n_per_m"),
            mu_s: self.value("mu_s"),
            mu_c: self.value("mu_c"),
        }
    }

    /// The numbers as those of bristles: LuGre, plain or modified.
    pub fn bristles(&self) -> LugreParameters<f64> {
        LugreParameters {
            sigma0_n_per_m: self.value("sigma0_n_per_m"),
            sigma1_n_s_per_m: self.value("sigma1_n_s_per_m"),
            a2_s_per_m: self.value("a2_s_per_m"),
            stribeck: StribeckParameters {
                a0: self.value("a0"),
                a1: self.value("a1"),
                v0_m_s: self.value("v0_m_s"),
                delta: self.value("delta"),
                theta: self.value("theta"),
            },
        }
    }

    /// The numbers as those of a block in series with bristles.
    pub fn block_and_bristles(&self) -> SeriesParameters<f64> {
        SeriesParameters {
            k_u_n_per_m: self.value("k_u_n_per_m"),
            c_u_n_s_per_m: self.value("c_u_n_s_per_m"),
            bristles: self.bristles(),
        }
    }

    /// The model as TOML.
    pub fn to_toml(&self) -> String {
        let mut text = format!("kind = \"{}\"\n\n[parameters]\n", self.kind.name());
        for (name, value) in self.parameters() {
            text += &format!("{name} = {}\n", toml_number(value));
        }
        if !self.intervals.is_empty() {
            text += "\n# Standard deviation and 95 % interval of each fitted parameter.\n[intervals]\n";
            for (name, Interval { std, low, high }) in &self.intervals {
                let (std, low, high) = (toml_number(*std), toml_number(*low), toml_number(*high));
                text += &format!("{name} = {{ std = {std}, low = {low}, high = {high} }}\n");
            }
        }
        for extension in &self.extensions {
            text += &format!("\n[[extension]]\nid = \"{}\"\n", extension.id);
            for (name, value) in &extension.parameters {
                text += &format!("{name} = {}\n", toml_number(*value));
            }
        }
        text
    }
}

/// A float that TOML reads as one.
fn toml_number(value: f64) -> String {
    let text = number::text(value);
    if text.contains(['.', 'e']) { text } else { text + ".0" }
}

fn read_intervals(
    table: &TableReader<'_>,
    kind: ModelKind,
) -> Result<BTreeMap<String, Interval>, InputError> {
    let mut intervals = BTreeMap::new();
    for spec in kind.parameters() {
        let Some(entry) = table.table(spec.name)? else { continue };
        let interval = Interval {
            std: entry.required_number("std", NOT_NEGATIVE)?,
            low: entry.required_number("low", FINITE)?,
            high: entry.required_number("high", FINITE)?,
        };
        entry.finish()?;
        intervals.insert(spec.name.to_string(), interval);
    }
    table.finish()?;
    Ok(intervals)
}

fn read_extension(table: &TableReader<'_>) -> Result<Extension, InputError> {
    let ids = || effect_id::EFFECTS.map(|(id, _)| id).join(", ");
    let id = table.text("id")?.ok_or_else(|| table.missing("id", &ids()))?;
    if effect_id::subsystem_of(id).is_none() {
        return Err(table.error("id", "unknown effect").allowed(ids()));
    }
    let mut parameters = Vec::new();
    match CoreExtension::with_id(id) {
        // An effect on the friction channel: the core says which parameters it has and checks them.
        Some(effect) => {
            let value = |(place, name): (usize, &&'static str)| match effect.absent(place) {
                None => table.required_number(name, FINITE),
                Some(absent) => Ok(table.number(name, FINITE)?.unwrap_or(absent)),
            };
            let values: Vec<f64> = effect.names().iter().enumerate().map(value).collect::<Result<_, _>>()?;
            table.finish()?;
            let checked = Extensions::none(SOME_STEP_S).set(effect, &values);
            checked.map_err(|e| table.error(e.name, "out of range").allowed(e.allowed))?;
            parameters.extend(effect.names().iter().map(|name| (*name).to_string()).zip(values));
        }
        None => {
            for key in table.keys().filter(|key| *key != "id") {
                if let Some(value) = table.number(key, FINITE)? {
                    parameters.push((key.to_string(), value));
                }
            }
        }
    }
    Ok(Extension { id: id.into(), parameters })
}

#[cfg(test)]
mod tests {
    use super::*;

    const LUGRE: &str =
        "kind = \"lugre\"\n[parameters]\nsigma0_n_per_m = 1e6\na0 = 0.5\na1 = 0.7\nv0_m_s = 0.5\n";

    #[test]
    fn parameters_left_out_take_their_defaults() {
        let model = ModelFile::parse("m.toml", LUGRE).unwrap();
        assert_eq!((model.get("theta"), model.get("delta")), (Some(1.0), Some(0.5)));
        assert_eq!((model.get("sigma1_n_s_per_m"), model.get("a2_s_per_m")), (Some(0.0), Some(0.0)));
        assert_eq!(model.get("k_u_n_per_m"), None);
    }

    #[test]
    fn a_model_written_reads_back_the_same() {
        let mut model = ModelFile::parse("m.toml", LUGRE).unwrap();
        model.intervals.insert("a0".into(), Interval { std: 0.01, low: 0.48, high: 0.52 });
        let names = ["change_per_m", "scale_m"];
        let parameters = names.iter().zip([1e-3, 20.0]).map(|(name, x)| (name.to_string(), x)).collect();
        model.extensions.push(Extension { id: "wear_drift".into(), parameters });
        assert_eq!(ModelFile::parse("m.toml", &model.to_toml()).unwrap(), model);
    }

    #[test]
    fn bad_models_are_named() {
        let refused = |text: &str| ModelFile::parse("m.toml", text).unwrap_err().to_string();
        assert_eq!(
            refused(&LUGRE.replace("1e6", "-1e6")),
            "m.toml:3: parameters.sigma0_n_per_m = -1e6: out of range; allowed: 1 to 1e10 N/m"
        );
        assert_eq!(
            refused(&LUGRE.replace("a0 = 0.5\n", "")),
            "m.toml:2: parameters.a0: is missing; allowed: a finite number"
        );
        assert!(
            refused(&LUGRE.replace("a0 =", "a00 ="))
                .contains("parameters.a00 = 0.5: unknown key; allowed: sigma0_n_per_m, ")
        );
        assert_eq!(
            refused(&LUGRE.replace("lugre", "glue")),
            format!(
                "m.toml:1: kind = \"glue\": not known; allowed: {}",
                ModelKind::ALL.iter().map(|k| k.name()).collect::<Vec<_>>().join(", ")
            )
        );
        assert!(
            refused(&format!("{LUGRE}k_u_n_per_m = 3e4\n")).starts_with(
                "m.toml:7: parameters.k_u_n_per_m = 3e4: unknown key; allowed: sigma0_n_per_m, "
            )
        );
        assert!(refused(&format!("{LUGRE}[[extension]]\nid = \"rust\"\n")).starts_with(
            "m.toml:8: extension.0.id = \"rust\": unknown effect; allowed: element_compliance, thermal_fade"
        ));
        let film = format!("{LUGRE}[[extension]]\nid = \"viscous_film\"\n");
        assert_eq!(
            refused(&film),
            "m.toml:7: extension.0.coefficient_n_s_per_m: is missing; allowed: a number, finite"
        );
        assert_eq!(
            refused(&format!("{film}coefficient_n_s_per_m = -1\n")),
            "m.toml:9: extension.0.coefficient_n_s_per_m = -1: out of range; allowed: 0 to 1e6 N s/m"
        );
        let brush = "kind = \"brush\"\n[parameters]\nc_n_per_m = 3e4\nmu_s = 0.8\nmu_c = 0.9\n";
        assert_eq!(
            refused(brush),
            "m.toml:4: parameters.mu_s = 0.8: out of range; allowed: mu_c <= mu_s <= 10"
        );
    }

    #[test]
    fn the_assumed_model_is_the_series_element() {
        assert_eq!(ModelFile::assumed(&[]).unwrap().kind, ModelKind::Series);
    }
}
