//! Which column is which signal, and in which unit.

use std::path::Path;

use super::ASSUMED;
use super::units::{self, Conversion};
use crate::files::log::{Cells, Log};
use crate::files::signal::{SIGNALS, Signal};
use crate::files::toml_tree::Document;
use crate::input_error::InputError;

/// What was said about columns.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Columns {
    /// Signal, and the column that is it.
    map: Vec<(Signal, String)>,
    /// Column or signal, and its unit.
    units: Vec<(String, String)>,
}

/// `NAME=REST`, the rest not empty. The name of a column may hold a `=`, a signal's not.
fn split<'a>(
    option: &str,
    text: &'a str,
    form: &str,
    at_last: bool,
) -> Result<(&'a str, &'a str), InputError> {
    let parts = if at_last { text.rsplit_once('=') } else { text.split_once('=') };
    match parts {
        Some((left, right)) if !left.trim().is_empty() && !right.trim().is_empty() => {
            Ok((left.trim(), right.trim()))
        }
        _ => Err(InputError::new(format!("is no {form}")).file(option).value(text).allowed(form)),
    }
}

fn signal(option: &str, name: &str) -> Result<Signal, InputError> {
    Signal::named(name).ok_or_else(|| {
        let names: Vec<&str> = SIGNALS.iter().map(|signal| signal.column()).collect();
        InputError::new("is no signal of a log").file(option).value(name).allowed(names.join(", "))
    })
}

impl Columns {
    /// From `--map` and `--unit`.
    ///
    /// # Errors
    /// An option of another form, or an unknown signal.
    pub fn from_options(map: &[String], units: &[String]) -> Result<Self, InputError> {
        let mut columns = Self::default();
        for text in map {
            let (name, column) = split("--map", text, "SIGNAL=COLUMN", false)?;
            columns.map.push((signal("--map", name)?, column.to_owned()));
        }
        for text in units {
            let (column, unit) = split("--unit", text, "COLUMN=UNIT", true)?;
            columns.units.push((column.to_owned(), unit.to_owned()));
        }
        Ok(columns)
    }

    /// From the `[columns]` table of `NAME.toml` beside the log `NAME.csv`, or of `columns.toml` in its folder.
    ///
    /// # Errors
    /// The file cannot be read, or its table is none of columns.
    pub fn beside(log: &Path) -> Result<Self, InputError> {
        let own = log.with_extension("toml");
        let common = log.with_file_name("columns.toml");
        for path in [own, common] {
            let Ok(text) = std::fs::read_to_string(&path) else { continue };
            // Another kind of TOML file may have the log's name.
            if !text.lines().any(|line| line.trim() == "[columns]" || line.trim().starts_with("[columns.")) {
                continue;
            }
            return Self::parse(&path.display().to_string(), &text);
        }
        Ok(Self::default())
    }

    /// Parses a TOML text with a `[columns]` table: `time_s = "Zeit"`, or
    /// `m2_angle_rad = { from = "theta", unit = "deg" }`; either of the two may be left out.
    ///
    /// # Errors
    /// With the key that is wrong.
    pub fn parse(source: &str, text: &str) -> Result<Self, InputError> {
        // For the line of what is no TOML.
        Document::parse(source, text)?;
        let table: toml::Table = text.parse().map_err(|error: toml::de::Error| {
            InputError::new(format!("not valid TOML: {}", error.message())).file(source)
        })?;
        let refuse = |key: &str, problem: &str| {
            InputError::new(problem)
                .file(source)
                .key(format!("columns.{key}"))
                .allowed("\"COLUMN\" or { from = \"COLUMN\", unit = \"UNIT\" }")
        };
        let mut columns = Self::default();
        let Some(entries) = table.get("columns").and_then(toml::Value::as_table) else { return Ok(columns) };
        for (name, value) in entries {
            let signal = signal("columns", name).map_err(|error| error.file(source))?;
            match value {
                toml::Value::String(column) => columns.map.push((signal, column.clone())),
                toml::Value::Table(entry) => {
                    let text = |key: &str| match entry.get(key) {
                        None => Ok(None),
                        Some(toml::Value::String(text)) => Ok(Some(text.clone())),
                        Some(_) => Err(refuse(name, "is no text")),
                    };
                    if let Some(other) = entry.keys().find(|key| !["from", "unit"].contains(&key.as_str())) {
                        return Err(refuse(name, &format!("unknown key {other}")));
                    }
                    let from = text("from")?.unwrap_or_else(|| signal.column().to_owned());
                    columns.units.extend(text("unit")?.map(|unit| (from.clone(), unit)));
                    columns.map.push((signal, from));
                }
                _ => return Err(refuse(name, "is no column")),
            }
        }
        Ok(columns)
    }

    /// Adds others, which win.
    pub fn extend(&mut self, other: Self) {
        self.map.retain(|(signal, _)| !other.map.iter().any(|(theirs, _)| theirs == signal));
        self.units.retain(|(column, _)| !other.units.iter().any(|(theirs, _)| theirs == column));
        self.map.extend(other.map);
        self.units.extend(other.units);
    }

    /// Whether nothing was said.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.map.is_empty() && self.units.is_empty()
    }

    /// The signal that a column of this name is.
    #[must_use]
    pub fn signal_of(&self, column: &str) -> Option<Signal> {
        let mapped = self.map.iter().find(|(_, name)| names(name, column)).map(|(signal, _)| *signal);
        // A signal that is taken from elsewhere is not also this column.
        let own = || Signal::named(column).filter(|own| !self.map.iter().any(|(signal, _)| signal == own));
        mapped.or_else(own)
    }

    /// Gives columns their signals' names and units. `in_file` are the units that stand in the file itself.
    ///
    /// # Errors
    /// A column that is not there, or a unit that is none of its signal.
    pub(super) fn apply(&self, log: &mut Log, in_file: &[(String, String)]) -> Result<(), InputError> {
        let source = log.source.clone();
        let there: Vec<String> = log.columns.iter().map(|column| column.name.clone()).collect();
        for (signal, wanted) in &self.map {
            if !there.iter().any(|name| names(wanted, name)) {
                return Err(InputError::new("there is no such column")
                    .file(source)
                    .key(format!("--map {}", signal.column()))
                    .value(wanted)
                    .allowed(there.join(", ")));
            }
        }
        if let Some((column, unit)) = self.units.iter().find(|(column, _)| {
            !there
                .iter()
                .any(|name| names(column, name) || self.signal_of(name).is_some_and(|s| s.column() == column))
        }) {
            return Err(InputError::new("there is no such column")
                .file(source)
                .key(format!("--unit {column}"))
                .value(unit)
                .allowed(there.join(", ")));
        }
        let mut assumed = Vec::new();
        // A column in the place of a mapped one goes aside.
        for name in there {
            let Some(signal) = self.signal_of(&name) else {
                if Signal::named(&name).is_some()
                    && let Some(column) = log.columns.iter_mut().find(|column| column.name == name)
                {
                    column.name = format!("{name} (as found)");
                }
                continue;
            };
            let conversion = self.unit(signal, &name, in_file, &source, &mut assumed)?;
            let Some(column) = log.columns.iter_mut().find(|column| column.name == name) else { continue };
            let Cells::Numbers(values) = &mut column.cells else {
                return Err(InputError::new("is no column of numbers").file(source).key(name));
            };
            values.iter_mut().for_each(|value| *value = conversion.apply(*value));
            if signal == Signal::Time
                && let Some(first) = values.first().copied().filter(|first| first.abs() > 1e6)
            {
                values.iter_mut().for_each(|value| *value -= first);
                assumed.push(format!("{} begins at 0: {first} s was taken off", signal.column()));
            }
            signal.column().clone_into(&mut column.name);
        }
        log.metadata.extend(assumed.into_iter().map(|note| (ASSUMED.to_owned(), note)));
        Ok(())
    }

    fn unit(
        &self,
        signal: Signal,
        name: &str,
        in_file: &[(String, String)],
        source: &str,
        assumed: &mut Vec<String>,
    ) -> Result<Conversion, InputError> {
        let own = signal.column();
        let said = self.units.iter().find(|(column, _)| names(column, name) || column == own);
        let found = in_file.iter().find(|(column, _)| column == name);
        let (what, unit, key) = match (said, found) {
            (Some((_, unit)), _) => ("as asked for", unit, "--unit"),
            (None, Some((_, unit))) => ("by the file", unit, "unit of"),
            (None, None) if name == own => return Ok(Conversion::NONE),
            (None, None) => {
                assumed.push(format!("{own} is the column {name}, in {}", signal.unit()));
                return Ok(Conversion::NONE);
            }
        };
        let conversion = units::conversion(signal, unit).ok_or_else(|| {
            InputError::new(format!("is no unit of {own}"))
                .file(source)
                .key(format!("{key} {name}"))
                .value(unit)
                .allowed(units::allowed(signal))
        })?;
        assumed.push(format!("{own} is the column {name}, in {unit} {what}"));
        Ok(conversion)
    }
}

/// Whether a wanted name is this column: as it stands, or without its unit in brackets.
fn names(wanted: &str, column: &str) -> bool {
    wanted == column || wanted == without_unit(column).0
}

/// `Time [ms]` is `Time` and `ms`.
#[must_use]
pub fn without_unit(name: &str) -> (&str, Option<&str>) {
    for (open, close) in [('[', ']'), ('(', ')')] {
        if let Some(inner) = name.strip_suffix(close)
            && let Some((stem, unit)) = inner.rsplit_once(open)
            && !stem.trim().is_empty()
        {
            return (stem.trim(), Some(unit.trim()));
        }
    }
    (name, None)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_beside_the_log_says_the_same_as_the_options() {
        let toml = "[columns]\ntime_s = \"t\"\nm2_angle_rad = { from = \"theta\", unit = \"deg\" }\nnormal_force_n = { unit = \"kN\" }\n";
        let options = Columns::from_options(
            &["time_s=t".into(), "m2_angle_rad=theta".into(), "normal_force_n=normal_force_n".into()],
            &["theta=deg".into(), "normal_force_n=kN".into()],
        )
        .unwrap();
        let mut table = Columns::parse("c.toml", toml).unwrap();
        table.map.sort();
        let mut expected = options.clone();
        expected.map.sort();
        assert_eq!(table, expected);
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("run.toml"), toml).unwrap();
        assert_eq!(Columns::beside(&folder.path().join("run.csv")).unwrap().map.len(), 3);
        assert!(Columns::beside(&folder.path().join("other.csv")).unwrap().is_empty());
    }

    #[test]
    fn options_win_over_the_table() {
        let mut table =
            Columns::parse("c.toml", "[columns]\ntime_s = { from = \"t\", unit = \"ms\" }\n").unwrap();
        table.extend(Columns::from_options(&["time_s=stamp".into()], &["t=us".into()]).unwrap());
        assert_eq!(table.map, [(Signal::Time, "stamp".to_owned())]);
        assert_eq!(table.units, [("t".to_owned(), "us".to_owned())]);
    }

    #[test]
    fn a_wrong_table_names_its_key() {
        let refused = |text: &str| Columns::parse("c.toml", text).unwrap_err().to_string();
        assert!(refused("[columns]\ntime_s = 3\n").starts_with("c.toml: columns.time_s: is no column"));
        assert!(refused("[columns]\nspeed = \"v\"\n").contains("speed: is no signal of a log"));
        assert!(refused("[columns]\ntime_s = { form = \"v\" }\n").contains("unknown key form"));
    }

    #[test]
    fn a_unit_in_brackets_is_told_from_the_name() {
        assert_eq!(without_unit("Time [ms]"), ("Time", Some("ms")));
        assert_eq!(without_unit("F (N)"), ("F", Some("N")));
        assert_eq!(without_unit("[x]"), ("[x]", None));
        assert_eq!(without_unit("plain"), ("plain", None));
    }
}
