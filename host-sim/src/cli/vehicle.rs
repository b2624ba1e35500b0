//! `rig vehicle`: a quarter of a car brakes on the patch models.

use std::path::PathBuf;

use serde::Serialize;

use super::common::say;
use crate::files::output_dir::OutputDir;
use crate::input_error::InputError;
use crate::report::{Block, Chart, Line, Page, Panel, Role, Table, Window};
use crate::studies::quarter_car::{Braking, PatchKind, Stop, all};

/// Brake a quarter of a car on three kinds of contact patch: a pounce on the brake, and a slow ramp
#[derive(clap::Args, Debug)]
#[command(after_long_help = "\
Example:
  rig vehicle --out target/vehicle

350 kg on one wheel at 25 m/s are braked to beyond what the road holds, by a brake that rises within 20 ms and within 2 s, on the averaged lumped LuGre model, on the LuGre patch under uniform and parabolic load, and on a patch of rubber blocks in
series with their bristles. The table has the largest friction coefficient, the slip there, when the wheel locks, and the
way to standstill. Mass, wheel and brake are assumed; the curve is a published one.

Writes vehicle.json and report.html.")]
pub(super) struct Vehicle {
    /// Folder for the results
    #[arg(long, value_name = "DIR", default_value = "target/vehicle")]
    out: PathBuf,
}

#[derive(Serialize)]
struct Row {
    patch: &'static str,
    braking: &'static str,
    peak_coefficient: f64,
    slip_at_peak: f64,
    over_steady_slip: f64,
    locks_at_s: Option<f64>,
    distance_m: f64,
}

impl Vehicle {
    /// Runs the command.
    pub(super) fn run(self) -> Result<(), InputError> {
        let mut output = OutputDir::new(&self.out)?;
        let stops = all()?;
        let table = table(&stops);
        let sentences = sentences(&stops);
        for row in std::iter::once(&table.head).chain(&table.rows) {
            say(&row.iter().map(|cell| format!("{cell:<28}")).collect::<String>());
        }
        sentences.iter().for_each(|sentence| say(sentence));
        let rows: Vec<Row> = stops.iter().map(row).collect();
        output.write_json("vehicle.json", &rows)?;
        let mut blocks = vec![Block::Table(table), Block::List(sentences)];
        blocks.extend(Braking::ALL.map(|braking| Block::Chart(chart(&stops, braking))));
        let page = Page {
            title: "A quarter of a car brakes".into(),
            lead: "Does it matter for braking whether the patch is LuGre's or one of rubber blocks? All numbers but the friction \
                   curve are assumed."
                .into(),
            blocks,
        };
        output.write("report.html", page.to_html())?;
        let report = output.folder().join("report.html");
        output.finish()?;
        say(&format!("report: {}", report.display()));
        Ok(())
    }
}

fn row(stop: &Stop) -> Row {
    Row {
        patch: stop.patch.words(),
        braking: stop.braking.words(),
        peak_coefficient: stop.peak,
        slip_at_peak: stop.slip_at_peak,
        over_steady_slip: stop.over_steady(),
        locks_at_s: stop.lock.map(|(at_s, _)| at_s),
        distance_m: stop.distance_m,
    }
}

fn table(stops: &[Stop]) -> Table {
    let head = [
        "patch",
        "brake",
        "largest F/F_N",
        "slip there",
        "over steady slip",
        "wheel locks",
        "way to standstill",
    ];
    let cells = |stop: &Stop| {
        vec![
            stop.patch.words().into(),
            stop.braking.words().into(),
            format!("{:.3}", stop.peak),
            format!("{:.1} %", 100.0 * stop.slip_at_peak),
            format!("{:+.1} %", 100.0 * stop.over_steady()),
            stop.lock.map_or("never".into(), |(at_s, v)| format!("{at_s:.3} s at {v:.1} m/s")),
            format!("{:.2} m", stop.distance_m),
        ]
    };
    Table { head: head.map(Into::into).to_vec(), rows: stops.iter().map(cells).collect() }
}

/// What each patch shows beyond steady slip, and what the patches differ by.
fn sentences(stops: &[Stop]) -> Vec<String> {
    let of =
        |patch: PatchKind, braking: Braking| stops.iter().find(|s| s.patch == patch && s.braking == braking);
    let mut out = Vec::new();
    for braking in Braking::ALL {
        let each = PatchKind::ALL.into_iter().filter_map(|patch| {
            Some(format!("{} {:+.1} %", patch.words(), 100.0 * of(patch, braking)?.over_steady()))
        });
        let each: Vec<String> = each.collect();
        out.push(format!(
            "{}: largest friction over the most that a LuGre patch has in steady slip at that speed: {}.",
            braking.words(),
            each.join(", ")
        ));
        if let (Some(lugre), Some(series)) = (of(PatchKind::Lugre, braking), of(PatchKind::Series, braking)) {
            out.push(format!(
                "{}: the series patch needs {:+.2} m to standstill beside the LuGre patch's {:.2} m.",
                braking.words(),
                series.distance_m - lugre.distance_m,
                lugre.distance_m
            ));
        }
    }
    out
}

fn chart(stops: &[Stop], braking: Braking) -> Chart {
    let roles = [Role::Lugre, Role::LugrePatch, Role::Reference, Role::Series];
    let chosen: Vec<(&Stop, Role)> = stops.iter().filter(|s| s.braking == braking).zip(roles).collect();
    let lines = |pick: fn(&Stop) -> &Vec<f64>| {
        let line = |(stop, role): &(&Stop, Role)| Line {
            name: stop.patch.words().into(),
            role: *role,
            x: stop.time_s.clone(),
            y: pick(stop).clone(),
            tolerance: 2e-3,
            fine_tolerance: 5e-4,
        };
        chosen.iter().map(line).collect::<Vec<_>>()
    };
    let end_s = chosen.iter().filter_map(|(s, _)| s.time_s.last().copied()).fold(0.1, f64::max);
    let lock_s = chosen.iter().filter_map(|(s, _)| s.lock.map(|l| l.0)).fold(0.0, f64::max);
    let window = |label: &str, range| Window { label: label.into(), range };
    Chart {
        title: format!("Brake: {}.", braking.words()),
        caption: "Friction over normal force, and the speed of the wheel's rim.".into(),
        x_title: "time from the begin of braking, s".into(),
        panels: vec![
            Panel { y_title: "F/F_N".into(), lines: lines(|s| &s.coefficient) },
            Panel { y_title: "rim, m/s".into(), lines: lines(|s| &s.rim_m_s) },
        ],
        windows: vec![
            window("until the wheels lock", (0.0, (1.3 * lock_s + 0.05).min(end_s))),
            window("whole stop", (0.0, end_s)),
        ],
        ..Chart::default()
    }
}

#[cfg(test)]
mod tests {
    #[test]
    fn the_command_writes_a_row_for_every_patch_and_braking() {
        let root = tempfile::tempdir().unwrap();
        let out = root.path().join("v");
        crate::cli::run(["rig", "vehicle", "--out", out.to_str().unwrap()]);
        let rows: serde_json::Value =
            serde_json::from_str(&std::fs::read_to_string(out.join("vehicle.json")).unwrap()).unwrap();
        assert_eq!(rows.as_array().unwrap().len(), 8);
        assert!(rows[0]["peak_coefficient"].as_f64().unwrap() > 0.8);
        assert!(std::fs::read_to_string(out.join("report.html")).unwrap().contains("series patch"));
    }
}
