//! `report.html`: the verdict, the probabilities, what each effect's law looks like against the residual, what is left.

use super::component::Drawn;
use super::holdout::Errors;
use super::results::Diagnosis;
use super::table::Part;
use crate::report::page::{Block, Page, Table};
use crate::report::value;

/// Hypotheses in the table.
const ROWS: usize = 12;

/// The page; `drawn` are the balances with the answer.
pub fn page(diagnosis: &Diagnosis, drawn: &[Drawn], holdout: &[(Part, Errors)]) -> Page {
    let mut blocks = vec![Block::Table(figures(diagnosis))];
    for cause in &diagnosis.causes {
        blocks.push(Block::Heading(cause.id.clone()));
        blocks.push(Block::List(cause.evidence.clone()));
        blocks.push(Block::Table(parameters(cause)));
        blocks.extend(drawn.iter().filter_map(|balance| balance.law(&cause.id)).map(Block::Chart));
    }
    blocks.push(Block::Heading("Residuals over their coordinates".into()));
    blocks.push(Block::Text(
        "Mean residual in bins of a coordinate, training logs: what the baseline leaves, and what the answer leaves.".into(),
    ));
    blocks.extend(drawn.iter().flat_map(Drawn::residuals).map(Block::Chart));
    blocks.push(Block::Heading("Probabilities".into()));
    blocks.push(Block::Table(probabilities(diagnosis)));
    if !diagnosis.indistinguishable.is_empty() {
        let groups: Vec<String> = diagnosis.indistinguishable.iter().map(|g| g.join(" and ")).collect();
        blocks.push(Block::Text(format!("These logs do not tell apart: {}.", groups.join("; "))));
    }
    let logs: Vec<Vec<String>> = holdout
        .iter()
        .flat_map(|(part, errors)| {
            errors.logs.iter().map(|log| {
                vec![
                    log.log.clone(),
                    part.name().to_string(),
                    percent(Some(log.baseline_nrmse)),
                    percent(Some(log.extended_nrmse)),
                    percent(Some(log.noise_floor_nrmse)),
                    format!("{:.1} ± {:.1} %", 100.0 * log.gain, 100.0 * log.gain_std),
                ]
            })
        })
        .collect();
    if !logs.is_empty() {
        blocks.push(Block::Heading("Held-out logs".into()));
        let head = ["log", "balance", "baseline", "extended", "noise alone", "gain ± standard error"];
        blocks.push(Block::Table(Table { head: head.map(String::from).to_vec(), rows: logs }));
    }
    blocks.push(Block::Heading("What is left".into()));
    blocks.push(Block::List(diagnosis.subsystems.values().map(|s| s.remaining.sentence.clone()).collect()));
    blocks.push(Block::Heading("Next experiment".into()));
    blocks.push(Block::Text(diagnosis.next_experiment.clone()));
    let why = diagnosis
        .rejected
        .iter()
        .map(|r| vec![r.id.clone(), format!("{:.1} %", 100.0 * r.probability), r.why.clone()]);
    blocks.push(Block::Heading("Rejected".into()));
    blocks.push(Block::Table(Table {
        head: ["effect", "probability", "why"].map(String::from).to_vec(),
        rows: why.collect(),
    }));
    if !diagnosis.notes.is_empty() {
        blocks.push(Block::Heading("Notes".into()));
        blocks.push(Block::List(diagnosis.notes.clone()));
    }
    Page { title: "Diagnosis".into(), lead: diagnosis.sentence.clone(), blocks }
}

fn percent(x: Option<f64>) -> String {
    x.map_or("–".into(), |x| format!("{:.2} %", 100.0 * x))
}

fn figures(diagnosis: &Diagnosis) -> Table {
    let rows = diagnosis.subsystems.iter().map(|(name, part)| {
        vec![
            (*name).to_string(),
            if part.causes.is_empty() { "–".into() } else { part.causes.join(", ") },
            percent(part.baseline.holdout_nrmse),
            percent(part.extended.holdout_nrmse),
            part.extended.gain.map_or("–".into(), |g| format!("{:.1} %", 100.0 * g)),
            percent(part.extended.noise_floor_nrmse),
        ]
    });
    let head =
        ["balance", "effects in it", "baseline, held out", "extended, held out", "gain", "noise alone"];
    Table { head: head.map(String::from).to_vec(), rows: rows.collect() }
}

fn parameters(cause: &super::results::Cause) -> Table {
    let rows = cause.parameters.iter().map(|(name, p)| {
        let shown = match p.std {
            Some(std) if std > 0.0 => value::with_uncertainty(p.value, std),
            _ => format!("{} (not determined by these logs, or chosen from a grid)", value::plain(p.value)),
        };
        vec![name.clone(), shown]
    });
    Table {
        head: ["parameter", "value ± standard deviation"].map(String::from).to_vec(),
        rows: rows.collect(),
    }
}

fn probabilities(diagnosis: &Diagnosis) -> Table {
    let mut all: Vec<(&String, f64)> = diagnosis.posterior.iter().map(|(name, p)| (name, *p)).collect();
    all.sort_by(|a, b| b.1.total_cmp(&a.1));
    let rows = all.into_iter().take(ROWS).map(|(name, p)| vec![name.clone(), format!("{:.1} %", 100.0 * p)]);
    Table { head: ["hypothesis", "probability"].map(String::from).to_vec(), rows: rows.collect() }
}
