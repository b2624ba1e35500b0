//! The paper's experiments end to end: run, judge, report.
//!
//! Figs. 18–23 in closed loop, Figs. 26 and 27 without motors, and beside them each of the five models in the same
//! closed loop and driven by the true motion. What the page says is computed from the runs; nothing in it is
//! written down beforehand but the explanations.

mod axes;
pub mod case_study;
mod charts;
mod comparison;
pub mod figure;
mod findings;
mod runs;

pub use case_study::CaseStudy;
pub use comparison::Comparison;
pub use runs::{ClosedLoop, Runs};

use crate::files::rig_file::RigFile;
use crate::input_error::InputError;
use crate::report::{Block, Page, Table};

/// Everything the demo made.
#[derive(Debug, Clone)]
pub struct Demo {
    /// The runs.
    pub runs: Runs,
    /// The hidden effect.
    pub case_study: CaseStudy,
    /// The page.
    pub page: Page,
    /// The short table for the terminal.
    pub table: String,
}

/// Runs everything. `progress` gets the steps done of all and what is done next.
///
/// # Errors
/// What a run refuses.
pub fn demo(mut progress: impl FnMut(usize, usize, &str)) -> Result<Demo, InputError> {
    let runs = Runs::new(&mut progress)?;
    let (case_study, axes) = rayon::join(|| CaseStudy::new(&runs), || axes::table(&runs));
    let case_study = case_study?;
    progress(runs::STEPS, runs::STEPS, "report");
    let page = page(&runs, &case_study, axes?);
    let mut table = terminal_table(&runs);
    for (name, what, found) in [
        ("hidden", "what LuGre lacks in figs. 18–21", case_study.found()),
        ("", "its parameters, found for true", case_study.parameters()?),
    ] {
        table.push_str(&format!("{name:<8} {what:<53} {found}\n"));
    }
    Ok(Demo { runs, case_study, page, table })
}

fn page(runs: &Runs, case_study: &CaseStudy, axes: Table) -> Page {
    let mut blocks = vec![
        Block::Heading("The experiments".into()),
        Block::Text(findings::experiments_sentence(runs)),
        Block::Table(experiments_table(runs)),
    ];
    blocks.extend(
        runs.closed_loop.iter().flat_map(|run| charts::experiment(run).into_iter().map(Block::Chart)),
    );
    let radius_m = RigFile::assumed_rig(&[]).map(|rig| rig.friction_radius_m);
    if let (Some(run), Ok(radius_m)) = (runs.named("fig20"), radius_m) {
        blocks.push(Block::Chart(charts::stress(run, &runs.rubber, radius_m)));
    }
    blocks.push(Block::Heading("Five models side by side".into()));
    blocks.extend(findings::models(runs));
    for comparison in &runs.comparisons {
        blocks.push(Block::Chart(charts::comparison(comparison)));
    }
    blocks.push(Block::Heading("Across the contact patch, and over speed".into()));
    blocks.push(Block::Chart(runs.crossing.chart()));
    blocks.push(Block::Chart(runs.sweep.chart()));
    blocks.extend(case_study.blocks.iter().cloned());
    blocks.push(Block::Heading("What the paper says, and what was found".into()));
    blocks.push(Block::Table(findings::statements(runs)));
    blocks.push(Block::Heading("On the paper's own axes, and with other assumed numbers".into()));
    blocks.push(Block::Table(axes));
    blocks.push(Block::Heading("What is assumed".into()));
    blocks.extend(findings::assumptions());
    Page {
        title: "Rubber sliding on asphalt: the paper's experiments in closed loop".into(),
        lead: findings::lead(runs),
        blocks,
    }
}

fn experiments_table(runs: &Runs) -> Table {
    let head = [
        "figure",
        "what",
        "friction peak",
        "settles at",
        "overshoot",
        "peak at",
        "normal force within 5 % at",
        "settled coefficient over that at the peak",
        "loop energy",
        "damping ratio",
    ];
    let rows = runs.closed_loop.iter().map(|run| {
        let s = &run.summary;
        let show = |value: Option<f64>, decimals: usize, unit: &str| {
            value.map_or("–".into(), |v| format!("{v:.decimals$}{unit}"))
        };
        let sine = s.friction_overshoot.is_none();
        let step = !sine && s.damping_ratio.is_none();
        let only = |value: Option<f64>, there: bool| value.filter(|_| there);
        vec![
            run.label(),
            run.title.clone(),
            show(s.friction_peak_nm, 2, "\u{a0}N\u{a0}m"),
            show(s.friction_settled_nm, 2, "\u{a0}N\u{a0}m"),
            show(only(s.friction_overshoot, step).map(|v| 100.0 * v), 1, "\u{a0}%"),
            show(only(s.friction_peak_time_s, step), 4, "\u{a0}s"),
            show(only(s.normal_settled_time_s, step), 4, "\u{a0}s"),
            show(only(s.friction_coefficient_ratio, step), 3, ""),
            show(s.loop_energy_j.map(|v| 1e3 * v), 2, "\u{a0}mJ"),
            show(s.damping_ratio, 3, ""),
        ]
    });
    Table { head: head.map(Into::into).to_vec(), rows: rows.collect() }
}

fn terminal_table(runs: &Runs) -> String {
    let mut text = String::from("figure   what must be seen                                     found\n");
    for run in &runs.closed_loop {
        let (wanted, found) = findings::verdict(run);
        text.push_str(&format!("{:<8} {wanted:<53} {found}\n", run.label()));
    }
    text.push_str(&format!(
        "{:<8} {:<53} {}\n",
        "fig. 26",
        "u(s): who passes a maximum on the way through",
        findings::crossing_sentence(runs)
    ));
    text.push_str(&format!(
        "{:<8} {:<53} {}\n",
        "fig. 27",
        "steady friction over speed: bell against LuGre",
        findings::sweep_sentence(runs)
    ));
    text.push_str(&format!(
        "{:<8} {:<53} {}\n",
        "models",
        "overshoot at constant speed and load, 30 rpm, 88 N",
        findings::constant_sentence(runs)
    ));
    text
}
