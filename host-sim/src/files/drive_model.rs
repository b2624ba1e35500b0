//! Model file of a drive (TOML, `kind = "drive"`): what `fit` and `diagnose` write for a drive on its own.
//!
//! `[parameters]` has the names of [`Friction::names`], symmetric or per direction, rotary or linear; what is left out
//! is zero but for the inertia. `[per_direction]` may hold the second set beside the first; `[intervals]` what is known of
//! the uncertainty; `[[extension]]` tables effects with their parameters.

use std::collections::BTreeMap;
use std::path::Path;

use super::effect_id;
use super::model_file::{Extension, Interval};
use super::overrides;
use super::toml_tree::{Document, FINITE, NOT_NEGATIVE, POSITIVE, TableReader};
use crate::fit::drive::inverse::{Friction, Motion};
use crate::input_error::InputError;

/// `kind` of such a file.
pub const KIND: &str = "drive";

/// Numbers of a drive, in the order of [`Friction::names`].
#[derive(Debug, Clone, PartialEq)]
pub struct DriveNumbers {
    /// Whether friction is the same in both directions.
    pub friction: Friction,
    /// Values.
    pub values: Vec<f64>,
}

/// A drive with numbers.
#[derive(Debug, Clone, PartialEq)]
pub struct DriveModel {
    /// The file as the user named it.
    pub source: String,
    /// Unit of its motion.
    pub motion: Motion,
    /// The model of the file.
    pub main: DriveNumbers,
    /// The same with friction per direction, where the file has it too.
    pub per_direction: Option<DriveNumbers>,
    /// Uncertainties of the first, where `fit` wrote them.
    pub intervals: BTreeMap<String, Interval>,
    /// Effects.
    pub extensions: Vec<Extension>,
}

impl DriveModel {
    /// Reads a file, with changes; `None` where it is a model of something else.
    ///
    /// # Errors
    /// A file that cannot be read or parsed, and a drive's file that is wrong.
    pub fn read_if_drive(path: &Path, changes: &[(String, String)]) -> Result<Option<Self>, InputError> {
        let mut document = Document::read(path)?;
        overrides::apply(&mut document, changes)?;
        let root = document.root();
        if root.has("kind") && root.text("kind").ok().flatten() == Some(KIND) {
            return Self::from_root(&root, &path.display().to_string()).map(Some);
        }
        Ok(None)
    }

    /// Parses and checks a text.
    ///
    /// # Errors
    /// What is wrong with it.
    pub fn parse(source: &str, text: &str) -> Result<Self, InputError> {
        Self::from_root(&Document::parse(source, text)?.root(), source)
    }

    fn from_root(root: &TableReader<'_>, source: &str) -> Result<Self, InputError> {
        root.choice("kind", &[(KIND, ())])?.ok_or_else(|| root.missing("kind", KIND))?;
        let table =
            root.table("parameters")?.ok_or_else(|| root.missing("parameters", "a table [parameters]"))?;
        let motion = if table.has("mass_kg") { Motion::Linear } else { Motion::Rotary };
        let directed = Friction::PerDirection.names(motion).iter().skip(1).any(|name| table.has(name));
        let main =
            numbers(&table, if directed { Friction::PerDirection } else { Friction::Symmetric }, motion)?;
        let per_direction = root
            .table("per_direction")?
            .map(|table| numbers(&table, Friction::PerDirection, motion))
            .transpose()?;
        let intervals = root
            .table("intervals")?
            .map(|table| intervals(&table, main.friction.names(motion)))
            .transpose()?
            .unwrap_or_default();
        let extensions = root.tables("extension")?.iter().map(extension).collect::<Result<_, _>>()?;
        root.finish()?;
        Ok(Self { source: source.into(), motion, main, per_direction, intervals, extensions })
    }
}

fn numbers(table: &TableReader<'_>, friction: Friction, motion: Motion) -> Result<DriveNumbers, InputError> {
    let names = friction.names(motion);
    let given =
        names.iter().enumerate().map(|(i, name)| table.number(name, if i == 0 { POSITIVE } else { FINITE }));
    let given = given.collect::<Result<Vec<_>, _>>()?;
    // A misspelt name is both unknown and missing: the line that has it is the one to show.
    table.finish()?;
    if given[0].is_none() {
        return Err(table.missing(names[0], "a number > 0 (inertia_kg_m2, or mass_kg of a linear stage)"));
    }
    Ok(DriveNumbers { friction, values: given.into_iter().map(|value| value.unwrap_or(0.0)).collect() })
}

fn intervals(table: &TableReader<'_>, names: &[&str]) -> Result<BTreeMap<String, Interval>, InputError> {
    let mut intervals = BTreeMap::new();
    for name in names {
        let Some(entry) = table.table(name)? else { continue };
        let interval = Interval {
            std: entry.required_number("std", NOT_NEGATIVE)?,
            low: entry.required_number("low", FINITE)?,
            high: entry.required_number("high", FINITE)?,
        };
        entry.finish()?;
        intervals.insert((*name).to_string(), interval);
    }
    table.finish()?;
    Ok(intervals)
}

fn extension(table: &TableReader<'_>) -> Result<Extension, InputError> {
    let ids = || effect_id::EFFECTS.map(|(id, _)| id).join(", ");
    let id = table.text("id")?.ok_or_else(|| table.missing("id", &ids()))?;
    if effect_id::subsystem_of(id).is_none() {
        return Err(table.error("id", "unknown effect").allowed(ids()));
    }
    let mut parameters = Vec::new();
    for key in table.keys().filter(|key| *key != "id") {
        if let Some(value) = table.number(key, FINITE)? {
            parameters.push((key.to_string(), value));
        }
    }
    Ok(Extension { id: id.into(), parameters })
}

#[cfg(test)]
mod tests {
    use super::*;

    const STAGE: &str = "kind = \"drive\"\n[parameters]\nmass_kg = 95.1\nviscous_n_s_per_m = 203\ncoulomb_n = 20.4\n\
                         [intervals]\nmass_kg = { std = 0.1, low = 94.9, high = 95.3 }\n\
                         [per_direction]\nmass_kg = 95\ncoulomb_forward_n = 20\n\
                         [[extension]]\nid = \"drive_delay\"\ndelay_s = 6e-4\n";

    #[test]
    fn a_stage_is_read_with_all_that_fit_and_diagnose_write() {
        let stage = DriveModel::parse("d.toml", STAGE).unwrap();
        assert_eq!((stage.motion, stage.main.friction), (Motion::Linear, Friction::Symmetric));
        assert_eq!(stage.main.values, [95.1, 203.0, 20.4, 0.0]);
        assert_eq!(stage.per_direction.unwrap().values, [95.0, 0.0, 0.0, 20.0, 0.0]);
        assert_eq!(stage.intervals["mass_kg"].high, 95.3);
        assert_eq!(stage.extensions[0].get("delay_s"), Some(6e-4));
    }

    #[test]
    fn what_is_wrong_with_a_drive_is_named_with_its_line() {
        let refused = |text: &str| DriveModel::parse("d.toml", text).unwrap_err().to_string();
        assert!(refused(&STAGE.replace("coulomb_n =", "coulomb =")).starts_with(
            "d.toml:5: parameters.coulomb = 20.4: unknown key; allowed: mass_kg, viscous_n_s_per_m, coulomb_n"
        ));
        assert!(refused(&STAGE.replace("95.1", "-1")).starts_with("d.toml:3: parameters.mass_kg = -1: "));
        assert!(refused("kind = \"drive\"\n[parameters]\n").contains("parameters.inertia_kg_m2: is missing"),);
        assert!(refused(&STAGE.replace("drive_delay", "rust")).contains("unknown effect; allowed: "));
    }
}
