//! Do the 95 % intervals of `rig fit` hold the truth in 95 of 100 logs? Clean cases, a rig, a model file and a plan of its
//! own for each.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::Path;

use crate::generate::generate;
use crate::scenario::Scenario;
use crate::trial::run::Runner;
use crate::trial::statistics::{Share, median};

/// Interval of a parameter against its true value.
#[derive(Debug, Clone, PartialEq)]
pub struct Interval {
    /// Name in the model file.
    pub name: String,
    /// True value.
    pub truth: f64,
    /// Ends.
    pub ends: (f64, f64),
}

/// What a fit of one case gave.
#[derive(Debug, Clone)]
pub struct Fitted {
    /// Seed.
    pub seed: u64,
    /// Whether the rig sticks and slips.
    pub stick_slip: bool,
    /// Intervals, or why there are none.
    pub intervals: Result<Vec<Interval>, String>,
}

impl Fitted {
    /// In a line.
    #[must_use]
    pub fn words(&self) -> String {
        match &self.intervals {
            Err(why) => format!("seed {}: {why}", self.seed),
            Ok(list) => {
                let held = list.iter().filter(|i| i.holds()).count();
                let missed = list
                    .iter()
                    .filter(|i| !i.holds())
                    .map(|i| format!("; {} {:.4} for {:.4}", i.name, 0.5 * (i.ends.0 + i.ends.1), i.truth));
                let missed: String = missed.collect();
                format!("seed {}: {held} of {} intervals hold the truth{missed}", self.seed, list.len())
            }
        }
    }
}

impl Interval {
    /// Whether the truth is inside.
    #[must_use]
    pub fn holds(&self) -> bool {
        self.ends.0 <= self.truth && self.truth <= self.ends.1
    }
}

/// Fits a clean case with this seed.
#[must_use]
pub fn fit(runner: &Runner, scenario: &Scenario, seed: u64) -> Fitted {
    let scenario = Scenario { effects: Vec::new(), seed, ..scenario.clone() };
    let here = runner.folder.join(format!("fit-{seed}"));
    let mut stick_slip = false;
    let intervals = intervals(runner, &scenario, &here, &mut stick_slip);
    if !runner.keep {
        // Where it cannot be removed it only takes room.
        let _ = std::fs::remove_dir_all(&here);
    }
    Fitted { seed, stick_slip, intervals }
}

fn intervals(
    runner: &Runner,
    scenario: &Scenario,
    here: &Path,
    stick_slip: &mut bool,
) -> Result<Vec<Interval>, String> {
    let case = generate(scenario).map_err(|e| e.to_string())?;
    *stick_slip = case.truth.stick_slip;
    let failed = |e: std::io::Error| format!("{}: {e}", here.display());
    let paths = case.write(here).map_err(failed)?;
    if runner.keep {
        let text = case.truth.to_json().map_err(|e| e.to_string())?;
        std::fs::write(here.join("truth.json"), text).map_err(failed)?;
    }
    let out = here.join("out");
    let mut command = runner.tool("fit");
    command.arg("--train").args(&paths.train).arg("--out").arg(&out);
    if let (Some(rig), Some(model)) = (&paths.rig, &paths.model) {
        command.arg("--rig").arg(rig).arg("--model").arg(model);
    }
    let run = command.output().map_err(|e| format!("{}: {e}", runner.rig.display()))?;
    if !run.status.success() {
        return Err(String::from_utf8_lossy(&run.stderr).trim().to_string());
    }
    let text = std::fs::read_to_string(out.join("model.toml")).map_err(failed)?;
    let truth = serde_json::to_value(&case.truth.friction).map_err(|e| e.to_string())?;
    read(&text, |name| truth.get(name).and_then(serde_json::Value::as_f64))
}

/// The intervals of a model file whose parameters have a true value.
///
/// # Errors
/// Where the text is no model file with intervals.
pub fn read(text: &str, truth: impl Fn(&str) -> Option<f64>) -> Result<Vec<Interval>, String> {
    let model: toml::Table = text.parse().map_err(|e| format!("model.toml: {e}"))?;
    let table = model.get("intervals").and_then(toml::Value::as_table);
    let table = table.ok_or("model.toml: no table [intervals]")?;
    let end = |value: &toml::Value, keys: [&str; 2]| {
        keys.iter()
            .find_map(|key| value.get(key))
            .and_then(|v| v.as_float().or(v.as_integer().map(|i| i as f64)))
    };
    let interval = |(name, value): (&String, &toml::Value)| {
        let ends = (end(value, ["low", "low_95"])?, end(value, ["high", "high_95"])?);
        Some(Interval { name: name.clone(), truth: truth(name)?, ends })
    };
    Ok(table.iter().filter_map(interval).collect())
}

/// The table: for each parameter the share of the intervals that hold the truth.
#[must_use]
pub fn table(fits: &[Fitted]) -> String {
    let mut by_name: BTreeMap<&str, Vec<(&Interval, bool)>> = BTreeMap::new();
    for fit in fits {
        for interval in fit.intervals.iter().flatten() {
            by_name.entry(&interval.name).or_default().push((interval, fit.stick_slip));
        }
    }
    let failed = fits.iter().filter(|fit| fit.intervals.is_err()).count();
    let mut text =
        format!("95 % intervals of {} fits that hold the truth; {failed} fits failed\n", fits.len());
    let _ = writeln!(
        text,
        "{:20} {:26} {:>14} {:26} {:26}",
        "parameter", "all", "half width", "rigs that stick and slip", "other rigs"
    );
    for (name, list) in by_name {
        let share = |keep: &dyn Fn(bool) -> bool| {
            Share::of(list.iter().filter(|i| keep(i.1)).map(|i| i.0.holds())).words()
        };
        let widths =
            list.iter().map(|(i, _)| 0.5 * (i.ends.1 - i.ends.0) / i.truth.abs().max(1e-300)).collect();
        let _ = writeln!(
            text,
            "{name:20} {:26} {:12.2} % {:26} {:26}",
            share(&|_| true),
            100.0 * median(widths),
            share(&|stick_slip| stick_slip),
            share(&|stick_slip| !stick_slip)
        );
    }
    text +=
        "Half width: median, over the true value. Shares with exact 95 % intervals (Clopper and Pearson).\n";
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn intervals_are_read_from_a_model_file_and_counted() {
        let text = "kind = \"series\"\n[parameters]\na0 = 0.5\n[intervals]\n\
                    a0 = { std = 0.01, low = 0.48, high = 0.52 }\na1 = { std = 0.1, low = 0.8, high = 1 }\n\
                    other = { std = 1.0, low = 0.0, high = 2.0 }\n";
        let truth = |name: &str| match name {
            "a0" => Some(0.5),
            "a1" => Some(0.7),
            _ => None,
        };
        let intervals = read(text, truth).unwrap();
        assert_eq!(intervals.iter().map(Interval::holds).collect::<Vec<_>>(), [true, false]);
        let table = table(&[Fitted { seed: 1, stick_slip: true, intervals: Ok(intervals) }]);
        assert!(table.contains("a0                   1 of 1, 100 % [2, 100]"), "{table}");
        assert!(table.contains("a1                   0 of 1, 0 % [0, 98]"), "{table}");
        assert!(read("kind = \"series\"", truth).is_err());
    }
}
