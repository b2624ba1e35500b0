//! What a commissioning leaves: a JSON file that carries its own digest, and a page to read and to file.
//!
//! The digest is the SHA-256 of the file's other entries, keys in alphabetical order, without white space. It shows that
//! nothing was changed by mistake; it is no secret, so it does not show who wrote the file. Who stands for it is the
//! name in `by`, and a signature by hand on the printed page.

use std::collections::BTreeMap;
use std::fmt::Write;

use rig_link::message::Hello;
use serde_json::{Value, json};
use sha2::{Digest, Sha256};

use super::{Calibration, Check, steps};
use crate::link::words;
use crate::report::{Block, Chart, Line, Page, Panel, Role, Table, value};

/// What was looked at, and of which rig.
#[derive(Debug, Clone, Default)]
pub struct Report {
    /// Everything that was looked at, in order.
    pub checks: Vec<Check>,
    /// Lines through calibration points.
    pub calibrations: Vec<Calibration>,
    /// Steps that were passed.
    pub steps_done: Vec<&'static str>,
    /// Firmware, in words.
    firmware: String,
    build_id: String,
    settings: BTreeMap<&'static str, f32>,
}

/// Who commissioned, when, and the ELF that was flashed.
#[derive(Debug, Clone, Default)]
pub struct Signature {
    /// Name of the person.
    pub by: Option<String>,
    /// Date and time.
    pub made: String,
    /// SHA-256 of the ELF file, and whether its build id is the firmware's.
    pub elf: Option<(String, bool)>,
    /// Why it ended early.
    pub ended: Option<String>,
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().fold(String::new(), |mut text, byte| {
        // Writing to a string does not fail.
        let _ = write!(text, "{byte:02x}");
        text
    })
}

impl Report {
    pub(super) fn identify(&mut self, hello: &Hello, settings: &BTreeMap<&'static str, f32>) {
        self.firmware = words::hello(hello);
        self.build_id = hex(&hello.build_id);
        self.settings.clone_from(settings);
    }

    /// Build id of the firmware that answered.
    #[must_use]
    pub fn build_id(&self) -> &str {
        &self.build_id
    }

    /// The settings that were found to be wrong were stored meanwhile: these are in force at the end.
    pub fn settings_at_the_end(&mut self, settings: BTreeMap<&'static str, f32>) {
        self.settings = settings;
    }

    /// Whether every step was passed.
    #[must_use]
    pub fn complete(&self) -> bool {
        self.steps_done == steps()
    }

    /// The check that ended it.
    #[must_use]
    pub fn failed(&self) -> Option<&Check> {
        self.checks.iter().find(|check| !check.passed)
    }

    /// SHA-256 over the settings in force, one `NAME=VALUE` a line in alphabetical order.
    #[must_use]
    pub fn settings_sha256(&self) -> String {
        let lines: String = self.settings.iter().map(|(name, value)| format!("{name}={value}\n")).collect();
        hex(&Sha256::digest(lines.as_bytes()))
    }

    /// The file.
    #[must_use]
    pub fn to_json(&self, signature: &Signature) -> Value {
        let mut value = json!({
            "complete": self.complete(),
            "steps_done": self.steps_done,
            "ended": signature.ended,
            "by": signature.by,
            "made": signature.made,
            "tool": env!("CARGO_PKG_VERSION"),
            "firmware": self.firmware,
            "build_id": self.build_id,
            "elf_sha256": signature.elf.as_ref().map(|(hash, _)| hash),
            "elf_is_the_firmware": signature.elf.as_ref().map(|(_, same)| same),
            "settings": self.settings,
            "settings_sha256": self.settings_sha256(),
            "checks": self.checks,
            "calibrations": self.calibrations,
        });
        let digest = digest(&value);
        if let Some(entries) = value.as_object_mut() {
            entries.insert("sha256".into(), digest.into());
        }
        value
    }

    /// The page.
    #[must_use]
    pub fn to_page(&self, signature: &Signature, sha256: &str) -> Page {
        let row = |what: &str, value: &str| vec![what.to_owned(), value.to_owned()];
        let elf = signature.elf.as_ref().map_or("not given (--elf)".to_owned(), |(hash, same)| {
            format!("SHA-256 {hash}; its build id is {}the firmware's", if *same { "" } else { "NOT " })
        });
        let lead = match (self.complete(), self.failed()) {
            (true, _) => "Every step was passed. The rig may run experiments with these settings.".to_owned(),
            (false, Some(check)) => {
                let advice = check.advice.as_deref().unwrap_or_default();
                format!("Not passed. Step {}: {}: {}. {advice}", check.step, check.what, check.found)
            }
            (false, None) => {
                format!("Not finished: {}", signature.ended.as_deref().unwrap_or("ended early"))
            }
        };
        let checks = self.checks.iter().map(|check| {
            let mark = if check.passed { "passed" } else { "FAILED" };
            [&check.what, check.step, &check.found, &check.allowed, mark].map(str::to_owned).to_vec()
        });
        let mut blocks = vec![
            Block::Heading("Rig and firmware".into()),
            Block::Table(Table {
                head: vec!["what".into(), "value".into()],
                rows: vec![
                    row("firmware", &self.firmware),
                    row("build id", &self.build_id),
                    row("ELF", &elf),
                    row("settings in force", &format!("SHA-256 {}", self.settings_sha256())),
                    row("commissioning.json", &format!("SHA-256 {sha256}")),
                    row("made", &signature.made),
                    row("by", signature.by.as_deref().unwrap_or("____________________")),
                    row("signature", "____________________"),
                ],
            }),
            Block::Heading("Checks".into()),
            Block::Table(Table {
                head: ["check", "step", "found", "allowed", "result"].map(str::to_owned).to_vec(),
                rows: checks.collect(),
            }),
        ];
        if !self.calibrations.is_empty() {
            blocks.push(Block::Heading("Calibrations".into()));
            blocks.extend(self.calibrations.iter().map(|calibration| Block::Chart(chart(calibration))));
        }
        blocks.push(Block::Heading("Settings in force".into()));
        blocks.push(Block::Table(Table {
            head: vec!["setting".into(), "value".into(), "unit".into()],
            rows: self
                .settings
                .iter()
                .map(|(name, value)| {
                    let unit = rig_link::settings::by_name(name).map_or("", |info| info.unit);
                    vec![(*name).to_owned(), value.to_string(), unit.to_owned()]
                })
                .collect(),
        }));
        Page { title: "Commissioning".into(), lead, blocks }
    }
}

/// Hash of a file's entries.
fn digest(value: &Value) -> String {
    // Without the feature `preserve_order`, objects keep their keys in alphabetical order.
    hex(&Sha256::digest(value.to_string().as_bytes()))
}

/// Whether a file's digest is that of its other entries.
#[must_use]
pub fn is_unchanged(file: &Value) -> bool {
    let mut rest = file.clone();
    let Some(given) = rest.as_object_mut().and_then(|entries| entries.remove("sha256")) else { return false };
    given == digest(&rest)
}

/// The points, and what the line leaves of them.
fn chart(calibration: &Calibration) -> Chart {
    let fit = &calibration.fit;
    let residual: Vec<f64> = fit.x.iter().zip(&fit.y).map(|(x, y)| y - fit.offset - fit.slope * x).collect();
    let line: Vec<f64> = fit.x.iter().map(|x| fit.offset + fit.slope * x).collect();
    let size =
        |values: &[f64]| values.iter().fold(0.0, |most: f64, y| most.max(y.abs())) * 1e-6 + f64::MIN_POSITIVE;
    let draw = |name: &str, role, y: &[f64]| {
        let tolerance = size(y);
        Line {
            name: name.into(),
            role,
            x: fit.x.clone(),
            y: y.to_vec(),
            tolerance,
            fine_tolerance: tolerance,
        }
    };
    let slope =
        fit.slope_std.map_or_else(|| value::plain(fit.slope), |std| value::with_uncertainty(fit.slope, std));
    Chart {
        title: calibration.name.clone(),
        caption: format!(
            "Slope {slope}, offset {}, largest deviation {}.",
            value::plain(fit.offset),
            value::plain(fit.largest_residual)
        ),
        x_title: calibration.x.into(),
        panels: vec![
            Panel {
                y_title: calibration.y.into(),
                lines: vec![draw("measured", Role::Measured, &fit.y), draw("line", Role::Reference, &line)],
            },
            Panel {
                y_title: format!("deviation, {}", calibration.y.split(", ").nth(1).unwrap_or_default()),
                lines: vec![draw("deviation", Role::Measured, &residual)],
            },
        ],
        plane: true,
        ..Chart::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_that_was_changed_is_told_from_one_that_was_not() {
        let mut report = Report::default();
        report.settings_at_the_end([("m1.reversed", 0.0)].into());
        let mut file = report.to_json(&Signature { by: Some("A. Fitter".into()), ..Signature::default() });
        let read: Value = serde_json::from_str(&serde_json::to_string_pretty(&file).unwrap()).unwrap();
        assert!(is_unchanged(&read));
        file["settings"]["m1.reversed"] = json!(1.0);
        assert!(!is_unchanged(&file) && !is_unchanged(&json!({})));
    }

    #[test]
    fn the_hash_of_the_settings_is_that_of_their_lines() {
        let mut report = Report::default();
        report.settings_at_the_end([("b", 0.5), ("a", 1.0)].into());
        // printf 'a=1\nb=0.5\n' | sha256sum
        let expected = hex(&Sha256::digest(b"a=1\nb=0.5\n"));
        assert_eq!(report.settings_sha256(), expected);
        assert!(!report.complete() && report.failed().is_none());
    }
}
