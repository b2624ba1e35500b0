//! `rig rivals`: what the modified LuGre model can mean, what bristle damping can do, and which models can be told apart.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Mutex;

use rayon::prelude::*;
use serde::Serialize;

use super::common::say;
use super::progress::Progress;
use crate::files::output_dir::OutputDir;
use crate::input_error::InputError;
use crate::plant::ElementParameters;
use crate::report::{Block, Page, Table};
use crate::studies::bristle_damping::{self, Damped};
use crate::studies::contenders::rubber_of;
use crate::studies::readings::{self, Row, SPEEDS_RPM};
use crate::studies::rivals::{
    Candidate, Plan, Separation, Tournament, all, answer, play, separate, separated,
};

/// Load of the comparisons, N: that of Figs. 18–21.
const LOAD_N: f64 = 88.0;
/// Noise of the measured friction torque over its RMS in Figs. 18–21: what misses by less is not told apart.
const NOISE: f64 = 2.7e-3;

/// Let friction models compete: each is fitted to the logs of every other and predicts held-out ones
#[derive(clap::Args, Debug)]
#[command(after_long_help = "\
Example:
  rig rivals --out target/rivals
  rig rivals --figures-only --out target/rivals
  rig rivals --rubber series --out target/rivals

Prints and writes three tables and an answer.
Readings: eqs. 17–19 of the paper in every way they can be read, each with its overshoot at 10, 20, 30, 120 rpm.
Damping: the overshoot of LuGre's force over its bristle damping, in closed loop and at constant speed.
Tournament: each model plays the rubber in figs. 18–21 and is fitted by every other (18, 20 and 21 fitted, 19 held out); then
the same with a step of speed, a step of load, and holds of two lengths. A cell is the held-out error over the RMS of
the force. Below 0.27 %, the noise of the friction channel, two models cannot be told apart by these experiments.
For pairs that look alike even then, the experiments of rig design are searched for the one that separates them. The last
lines say which models figs. 18–21 ask for. All data are synthetic; the numbers of the models are assumed.

Writes report.html and rivals.json.")]
pub(super) struct Rivals {
    /// The paper's experiments only
    #[arg(long)]
    figures_only: bool,
    /// Only these models play the rubber; all where left out
    #[arg(long, value_name = "MODEL", num_args = 1..)]
    rubber: Vec<String>,
    /// Folder for the results
    #[arg(long, value_name = "DIR", default_value = "target/rivals")]
    out: PathBuf,
}

#[derive(Serialize)]
struct Results<'a> {
    models: &'a [String],
    figures: Vec<Cell>,
    all: Vec<Cell>,
    separations: Vec<Separated<'a>>,
    answer: &'a [String],
}

#[derive(Serialize)]
struct Separated<'a> {
    truth: &'a str,
    rival: &'a str,
    separation: f64,
    experiment: &'a str,
    toml: &'a str,
}

#[derive(Serialize)]
struct Cell {
    truth: String,
    fitted: String,
    train_nrmse: f64,
    held_out_nrmse: Vec<f64>,
    parameters: BTreeMap<&'static str, f64>,
}

impl Rivals {
    /// Runs the command.
    pub(super) fn run(self) -> Result<(), InputError> {
        let rubber = rubber_of(&ElementParameters::default())
            .ok_or_else(|| InputError::new("the assumed rubber has no block"))?;
        let mut output = OutputDir::new(&self.out)?;
        let readings =
            readings_table(&readings::table(&rubber.bristles.stribeck, rubber.k_u_n_per_m, LOAD_N));
        let needed = bristle_damping::needed(&rubber, LOAD_N)?;
        let damping = damping_table(&bristle_damping::sweep(&rubber, LOAD_N)?);
        let candidates = all();
        let names: Vec<&str> = candidates.iter().map(|c| c.name.as_str()).collect();
        if let Some(unknown) = self.rubber.iter().find(|name| !names.contains(&name.as_str())) {
            let refusal = InputError::new("no such model").key("--rubber").value(unknown);
            return Err(refusal.allowed(names.join(", ")));
        }
        let plays = |name: &String| self.rubber.is_empty() || self.rubber.contains(name);
        let plan = |c: &Candidate| plays(&c.name).then(|| Plan::figures(&c.typical)).transpose();
        let figures = candidates.par_iter().map(plan).collect::<Result<Vec<_>, _>>()?;
        let compete = |what: &str, plans: &[Option<Plan>], before: Option<&Tournament>| {
            let bar = Mutex::new(Progress::new(what, 1));
            play(&candidates, plans, before, |done, total| advance(&bar, done, total))
        };
        let first = compete("figs. 18–21", &figures, None)?;
        let second = if self.figures_only {
            None
        } else {
            let plans: Vec<_> = figures.iter().map(|plan| plan.as_ref().map(Plan::and_more)).collect();
            Some(compete("steps and holds too", &plans, Some(&first))?)
        };
        let bar = Mutex::new(Progress::new("experiments that separate", 1));
        let last = second.as_ref().unwrap_or(&first);
        let separations = separate(&candidates, last, NOISE, |done, total| advance(&bar, done, total))?;
        drop(bar);
        let answer = answer(&candidates, &first, second.as_ref(), &separations, NOISE);
        let mut blocks = vec![
            Block::Heading("Eqs. 17–19, read in every way".into()),
            Block::Text("Overshoot of the deflection at constant speed and load, from rest.".into()),
            Block::Table(readings),
            Block::Heading("LuGre with bristle damping".into()),
            Block::Text(format!(
                "Overshoot of the force: in closed loop, and at constant speed and load in brackets. At constant speed it needs \
                 σ1 above {:.0}, {:.0}, {:.0} and {:.0} N s/m.",
                needed[0], needed[1], needed[2], needed[3]
            )),
            Block::Table(damping),
        ];
        for (heading, tournament) in [
            ("Held-out error on fig. 19, fitted to figs. 18, 20 and 21", Some(&first)),
            (
                "Held-out error, fitted to figs. 18, 20, 21, a speed step, a load step and holds",
                second.as_ref(),
            ),
        ] {
            let Some(tournament) = tournament else { continue };
            blocks.push(Block::Heading(heading.into()));
            blocks.push(Block::Text(
                "A row is the model that plays the rubber, a column the model fitted; %.".into(),
            ));
            blocks.push(Block::Table(matrix(tournament)));
            blocks.push(Block::List(alike(tournament)));
        }
        if !separations.is_empty() {
            blocks.push(Block::Heading("Experiments that tell look-alikes apart".into()));
            let pair = |s: &Separation| format!("{} and {}", first.names[s.truth], first.names[s.rival]);
            blocks.push(Block::List(
                separations.iter().map(|s| separated(&first.names, s, &pair(s))).collect(),
            ));
        }
        if !answer.is_empty() {
            blocks.push(Block::Heading("Which model figs. 18–21 ask for".into()));
            blocks.push(Block::List(answer.clone()));
        }
        for block in &blocks {
            match block {
                Block::Heading(text) => say(&format!("\n{text}")),
                Block::Text(text) => say(text),
                Block::Table(table) => print!("{}", plain(table)),
                Block::List(items) => items.iter().for_each(|item| say(item)),
                Block::Chart(_) => {}
            }
        }
        output.write_json(
            "rivals.json",
            &Results {
                models: &first.names,
                figures: cells(&first),
                all: second.as_ref().map_or(Vec::new(), cells),
                separations: separations
                    .iter()
                    .map(|s| Separated {
                        truth: &first.names[s.truth],
                        rival: &first.names[s.rival],
                        separation: s.separation,
                        experiment: &s.experiment,
                        toml: &s.toml,
                    })
                    .collect(),
                answer: &answer,
            },
        )?;
        let page = Page {
            title: "Rival friction models".into(),
            lead: "Could another model have made the same logs? All data are synthetic.".into(),
            blocks,
        };
        output.write("report.html", page.to_html())?;
        let report = output.folder().join("report.html");
        output.finish()?;
        say(&format!("\nreport: {}", report.display()));
        Ok(())
    }
}

fn advance(bar: &Mutex<Progress>, done: usize, total: usize) {
    if let Ok(mut bar) = bar.lock() {
        bar.of(total as u64);
        bar.set(done as u64);
    }
}

fn cells(tournament: &Tournament) -> Vec<Cell> {
    let name = |at: usize| tournament.names[at].clone();
    let cell = |m: &crate::studies::rivals::Match| Cell {
        truth: name(m.truth),
        fitted: name(m.fitted),
        train_nrmse: m.train_nrmse,
        held_out_nrmse: m.held_out_nrmse.clone(),
        parameters: m
            .parameters
            .kind()
            .parameters()
            .iter()
            .map(|spec| spec.name)
            .zip(m.parameters.values().iter().copied())
            .collect(),
    };
    tournament.matches.iter().map(cell).collect()
}

fn speeds() -> impl Iterator<Item = String> {
    SPEEDS_RPM.iter().map(|rpm| format!("{rpm} rpm"))
}

fn readings_table(rows: &[Row]) -> Table {
    let head = ["reading".to_string(), "solutions for s".into()].into_iter().chain(speeds());
    let head = head.chain(["steep curve".to_string(), "the authors would have seen".into()]).collect();
    let row = |row: &Row| {
        let seen = row.figures.iter().chain([&row.steep]).map(|seen| seen.words());
        let first = [row.reading.words(), row.roots.to_string()].into_iter();
        first.chain(seen).chain([row.verdict().to_string()]).collect()
    };
    Table { head, rows: rows.iter().map(row).collect() }
}

fn damping_table(rows: &[Damped]) -> Table {
    let head = ["model".to_string()].into_iter().chain(speeds()).collect();
    let percent = |x: f64| format!("{:.1} %", 100.0 * x);
    let row = |row: &Damped| {
        let name = match row.sigma1_n_s_per_m {
            Some(sigma1) => format!("LuGre, σ1 = {sigma1} N s/m"),
            None => "series element, σ1 = 0".into(),
        };
        let both = row.closed_loop.iter().zip(row.constant).map(|(closed, constant)| {
            format!("{} ({})", closed.map_or("stopped".into(), percent), percent(constant.max(0.0)))
        });
        [name].into_iter().chain(both).collect()
    };
    Table { head, rows: rows.iter().map(row).collect() }
}

fn matrix(tournament: &Tournament) -> Table {
    let names = &tournament.names;
    let head = ["rubber \\ fitted".to_string()].into_iter().chain(names.iter().cloned()).collect();
    let row = |truth: usize| {
        let cell = |fitted: usize| {
            tournament.of(truth, fitted).map_or("–".into(), |m| format!("{:.2}", 100.0 * m.held_out()))
        };
        [names[truth].clone()].into_iter().chain((0..names.len()).map(cell)).collect()
    };
    let played = (0..names.len()).filter(|truth| tournament.matches.iter().any(|m| m.truth == *truth));
    Table { head, rows: played.map(row).collect() }
}

fn alike(tournament: &Tournament) -> Vec<String> {
    let line = |truth: usize| {
        let rivals = tournament.alike(truth, NOISE);
        let text: Vec<String> =
            rivals.iter().map(|(name, e)| format!("{name} ({:.2} %)", 100.0 * e)).collect();
        let text = if text.is_empty() { "nothing else".to_string() } else { text.join(", ") };
        format!("{}: within the noise {text}", tournament.names[truth])
    };
    let played = |truth: &usize| tournament.matches.iter().any(|m| m.truth == *truth);
    (0..tournament.names.len()).filter(played).map(line).collect()
}

/// A table for the terminal.
fn plain(table: &Table) -> String {
    let rows = || std::iter::once(&table.head).chain(&table.rows);
    let width = |column: usize| rows().filter_map(|row| row.get(column)).map(|c| c.chars().count()).max();
    let widths: Vec<usize> = (0..table.head.len()).map(|column| width(column).unwrap_or(0)).collect();
    let mut text = String::new();
    for row in rows() {
        let cells = row.iter().zip(&widths).map(|(cell, width)| format!("{cell:<width$}"));
        text += cells.collect::<Vec<_>>().join("  ").trim_end();
        text.push('\n');
    }
    text
}
