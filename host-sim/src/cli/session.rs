//! What every command shares: `--force`, `--json`, what is said, and what was written.
//!
//! With `--json` standard output holds one object and nothing else: what the command would have printed, its
//! warnings, the files it wrote, and the contents of those that are JSON.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::Mutex;

use serde_json::{Map, Value, json};

use crate::files::import::columns::Columns;
use crate::files::import::read_logs_with;
use crate::files::output_dir;
use crate::input_error::{InputError, Kind};
use crate::notices;

/// Heading of the options for commands that read logs.
pub(super) const LOGS_OF_OTHER_TOOLS: &str = "Logs of other tools";

/// Options that every command takes.
#[derive(clap::Args, Debug, Clone, Default)]
pub(super) struct Shared {
    /// Replace results that are in the folder already
    #[arg(long, global = true, help_heading = "Options of every command")]
    force: bool,
    /// One JSON object on standard output in place of text
    #[arg(long, global = true, help_heading = "Options of every command")]
    json: bool,
    /// This column of the logs is that signal, e.g. m2_angle_rad=theta; may be given several times
    #[arg(long, global = true, value_name = "SIGNAL=COLUMN", num_args = 1.., help_heading = LOGS_OF_OTHER_TOOLS)]
    map: Vec<String>,
    /// This column has that unit, e.g. theta=deg, Fz=-kN, pos=counts/4096; may be given several times
    #[arg(long, global = true, value_name = "COLUMN=UNIT", num_args = 1.., help_heading = LOGS_OF_OTHER_TOOLS)]
    unit: Vec<String>,
}

/// What is collected for `--json`.
#[derive(Debug, Default)]
struct Collected {
    lines: Vec<String>,
}

static COLLECTED: Mutex<Option<Collected>> = Mutex::new(None);

fn with_collected<T>(what: impl FnOnce(&mut Collected) -> T) -> Option<T> {
    COLLECTED.lock().ok().and_then(|mut collected| collected.as_mut().map(what))
}

/// Prints a line on stdout, or keeps it for the JSON object.
pub(super) fn say(line: &str) {
    let kept = with_collected(|collected| collected.lines.extend(line.lines().map(str::to_owned)));
    if kept.is_none() {
        // A reader that has gone away (`rig … | head`) is no error.
        let _ = writeln!(std::io::stdout(), "{line}");
    }
}

impl Shared {
    /// Puts the options in force, for a command that reads logs or one that does not.
    pub(super) fn begin(&self, reads_logs: bool) -> Result<(), InputError> {
        let options = [("--map", &self.map), ("--unit", &self.unit)];
        if !reads_logs && let Some((name, _)) = options.iter().find(|(_, values)| !values.is_empty()) {
            let what =
                format!("{name} says how a log of another tool is read, and this command reads no log");
            return Err(InputError::new(what));
        }
        if !(self.map.is_empty() && self.unit.is_empty()) {
            read_logs_with(Columns::from_options(&self.map, &self.unit)?);
        }
        if self.force {
            output_dir::allow_overwriting();
        }
        if let Ok(mut collected) = COLLECTED.lock() {
            *collected = self.json.then(Collected::default);
        }
        Ok(())
    }

    /// Says what was written and what went wrong.
    pub(super) fn end(&self, command: &str, result: &Result<(), InputError>) {
        let written = output_dir::take_written();
        if !written.is_empty() {
            let names: Vec<String> = written.iter().map(|path| path.display().to_string()).collect();
            eprintln!("rig: wrote {}", names.join(", "));
        }
        if let Err(error) = result {
            eprintln!("rig: {error}");
        }
        let collected = COLLECTED.lock().ok().and_then(|mut collected| collected.take());
        if let Some(collected) = collected {
            say(&object(command, result, &collected.lines, &notices::take(), &written).to_string());
        }
    }
}

fn object(
    command: &str,
    result: &Result<(), InputError>,
    lines: &[String],
    warnings: &[String],
    written: &[PathBuf],
) -> Value {
    let kind = result.as_ref().err().map(InputError::kind);
    let read = |path: &Path| -> Option<(String, Value)> {
        let name = path.file_name()?.to_string_lossy().into_owned();
        if !name.ends_with(".json") {
            return None;
        }
        Some((name, serde_json::from_slice(&std::fs::read(path).ok()?).ok()?))
    };
    let results: Map<String, Value> = written.iter().filter_map(|path| read(path)).collect();
    json!({
        "command": command,
        "exit_status": kind.map_or(0, Kind::exit_status),
        "status": kind.map_or("done", Kind::words),
        "error": result.as_ref().err().map(ToString::to_string),
        "warnings": warnings,
        "lines": lines,
        "wrote": written.iter().map(|path| path.display().to_string()).collect::<Vec<_>>(),
        "results": results,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_object_has_what_was_said_written_and_wrong() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("summary.json");
        std::fs::write(&path, "{\"a\": 1}").unwrap();
        let error = Err(InputError::new("lost").of_kind(Kind::Rig));
        let object = object("run", &error, &["one".into()], &["careful".into()], &[path]);
        assert_eq!(object["results"]["summary.json"]["a"], 1);
        assert_eq!((&object["exit_status"], &object["error"]), (&json!(4), &json!("lost")));
        assert_eq!(object["warnings"][0], "careful");
    }
}
