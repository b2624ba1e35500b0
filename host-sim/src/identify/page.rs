//! `report.html`: the verdict, the probabilities, what each effect's law looks like against the residual, what is left.

use super::contact::problem::Fit;
use super::contact_part::{ContactPart, coordinates_of};
use super::holdout::Errors;
use super::judge::Judgement;
use super::results::Diagnosis;
use super::table::Part;
use crate::report::chart::{Chart, Line, Panel, Role, Window};
use crate::report::page::{Block, Page, Table};
use crate::report::value;

/// Hypotheses in the table.
const ROWS: usize = 12;
/// Bins of a coordinate.
const BINS: usize = 40;
/// Bins with fewer points are not drawn.
const FEWEST: usize = 20;

/// The page.
pub fn page(diagnosis: &Diagnosis, judged: &Judgement, holdout: &[(Part, Errors)]) -> Page {
    let mut blocks = vec![Block::Table(figures(diagnosis))];
    for cause in &diagnosis.causes {
        blocks.push(Block::Heading(cause.id.clone()));
        blocks.push(Block::List(cause.evidence.clone()));
        blocks.push(Block::Table(parameters(cause)));
    }
    if let Some(contact) = &judged.contact {
        let place = judged.place(Part::Friction).unwrap_or(0);
        blocks.push(Block::Heading("Residual over its coordinates".into()));
        blocks.push(Block::Text(
            "Mean residual of the friction torque in bins of a coordinate, training logs: what the baseline leaves, and what the answer leaves.".into(),
        ));
        blocks.extend(over_coordinates(contact, place).into_iter().map(Block::Chart));
    }
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

/// Binned residuals over the coordinates on which the answer and the baseline differ most.
fn over_coordinates(contact: &ContactPart, place: usize) -> Vec<Chart> {
    let none = contact.ranked.iter().find(|r| r.fit.terms.is_empty()).map(|r| &r.fit);
    let (Some(none), best) = (none, contact.fit(place)) else { return Vec::new() };
    let deviation = &contact.noise.deviation;
    let limit = 10.0 * contact.logs.iter().map(|log| log.friction_noise_nm).fold(0.0, f64::max);
    let used: Vec<usize> =
        (0..deviation.len()).filter(|i| deviation[*i] < limit && none.r[*i] != 0.0).collect();
    let residual = |fit: &Fit, i: usize| fit.r[i] * deviation[i];
    let coordinates = coordinates_of(&contact.logs, &contact.scales);
    let mut charts: Vec<(f64, Chart)> = coordinates
        .into_iter()
        .filter_map(|(name, values)| {
            let mut rows = used.clone();
            rows.sort_by(|a, b| values[*a].total_cmp(&values[*b]));
            let size = rows.len().div_ceil(BINS).max(FEWEST);
            let (mut x, mut before, mut after, mut counts) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
            let mut spread = 0.0;
            for bin in rows.chunks(size).filter(|bin| bin.len() >= FEWEST) {
                let n = bin.len() as f64;
                counts.push(bin.len());
                x.push(bin.iter().map(|i| values[*i]).sum::<f64>() / n);
                before.push(bin.iter().map(|i| residual(none, *i)).sum::<f64>() / n);
                after.push(bin.iter().map(|i| residual(best, *i)).sum::<f64>() / n);
                spread += before.last().map_or(0.0, |b: &f64| b * b);
            }
            if x.len() < 3 || x.first() == x.last() {
                return None;
            }
            let window = Window { label: "all".into(), range: (x[0], x[x.len() - 1]) };
            let line = |name: &str, values: &[f64], role| Line {
                name: name.into(),
                role,
                x: x.clone(),
                y: values.to_vec(),
                tolerance: 0.0,
                fine_tolerance: 0.0,
            };
            let panel = Panel {
                y_title: "mean residual, N m".into(),
                lines: vec![line("baseline", &before, Role::Measured), line("answer", &after, Role::Series)],
            };
            Some((spread, Chart { counts, ..chart(&name, panel, window) }))
        })
        .collect();
    charts.sort_by(|a, b| b.0.total_cmp(&a.0));
    charts.into_iter().take(3).map(|(_, chart)| chart).collect()
}

fn chart(name: &str, panel: Panel, window: Window) -> Chart {
    Chart {
        title: format!("Friction residual over {name}"),
        x_title: name.into(),
        panels: vec![panel],
        windows: vec![window],
        ..Chart::default()
    }
}
