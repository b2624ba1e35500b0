//! `report.html`: the verdict first, then what was measured and predicted, where the error lives, and the ranking.

use super::analysis::{Fit, LogFit, Role};
use super::results::{Diagnosis, Extended};
use super::structure::{Structure, View};
use super::verdict::{Judged, Verdict};
use crate::report::chart::{Chart, Line, Panel, Role as Stands, Window};
use crate::report::page::{Block, Page, Table};

/// Views drawn for each channel.
const VIEWS: usize = 4;
/// Error of a drawn line, of the span of what is drawn.
const COARSE: f64 = 1e-3;
/// Time shown by the second button of a chart, s.
const CLOSE_S: f64 = 2.0;

/// The page.
pub fn page(diagnosis: &Diagnosis, judged: &[Judged]) -> Page {
    let mut blocks = vec![Block::Table(figures(diagnosis))];
    if !diagnosis.causes.is_empty() {
        blocks.push(Block::Heading("Causes".into()));
        for cause in &diagnosis.causes {
            let mut items = vec![format!(
                "{} ({}), probability {:.1} %",
                cause.id,
                cause.subsystem,
                100.0 * cause.probability
            )];
            items.extend(cause.evidence.iter().cloned());
            blocks.push(Block::List(items));
        }
    }
    blocks.push(Block::Heading("Ranking".into()));
    blocks.push(Block::Table(ranking(diagnosis)));
    if !diagnosis.indistinguishable.is_empty() {
        let groups: Vec<String> = diagnosis.indistinguishable.iter().map(|g| g.join(" and ")).collect();
        blocks.push(Block::Text(format!("These logs do not tell apart: {}.", groups.join("; "))));
    }
    for part in judged {
        subsystem(part, &mut blocks);
    }
    blocks.push(Block::Heading("Next experiment".into()));
    blocks.push(Block::Text(diagnosis.next_experiment.clone()));
    if !diagnosis.notes.is_empty() {
        blocks.push(Block::Heading("Notes".into()));
        blocks.push(Block::List(diagnosis.notes.clone()));
    }
    Page { title: "Diagnosis".into(), lead: diagnosis.sentence.clone(), blocks }
}

fn percent(x: Option<f64>) -> String {
    x.map_or("–".into(), |x| format!("{:.3} %", 100.0 * x))
}

fn figures(diagnosis: &Diagnosis) -> Table {
    let head = ["subsystem", "verdict", "baseline, held out", "extended, held out", "gain", "noise alone"];
    let rows = diagnosis.subsystems.iter().map(|(name, part)| {
        let Extended { holdout_nrmse, gain, noise_floor_nrmse } = &part.extended;
        vec![
            (*name).to_string(),
            part.verdict.to_string(),
            percent(part.baseline.holdout_nrmse),
            percent(*holdout_nrmse),
            gain.map_or("–".into(), |g| format!("{:.1} %", 100.0 * g)),
            percent(*noise_floor_nrmse),
        ]
    });
    Table { head: head.map(String::from).to_vec(), rows: rows.collect() }
}

fn ranking(diagnosis: &Diagnosis) -> Table {
    let named = diagnosis.causes.iter().map(|c| {
        let numbers: Vec<String> = c
            .parameters
            .iter()
            .map(|(name, p)| match p.std {
                Some(std) if std > 0.0 => format!("{name} = {:.4e} ± {std:.1e}", p.value),
                _ => format!("{name} = {:.4e}", p.value),
            })
            .collect();
        vec![
            c.id.clone(),
            format!("{:.1} %", 100.0 * c.probability),
            format!("named: {}", numbers.join(", ")),
        ]
    });
    let rejected = diagnosis
        .rejected
        .iter()
        .map(|r| vec![r.id.clone(), format!("{:.1} %", 100.0 * r.probability), r.why.clone()]);
    Table {
        head: ["effect", "probability", "why"].map(String::from).to_vec(),
        rows: named.chain(rejected).collect(),
    }
}

fn subsystem(part: &Judged, blocks: &mut Vec<Block>) {
    let name = part.analysis.subsystem().name();
    let (Some(base), Some(result)) = (part.selection.baseline(), part.result()) else { return };
    blocks.push(Block::Heading(format!("{}{}", name[..1].to_uppercase(), &name[1..])));
    // The held-out logs are what nothing was fitted to; a training log stands in where there is none.
    let held_out = |log: &LogFit| log.role == Role::Holdout;
    let shown = base.logs.iter().position(held_out).unwrap_or(0);
    if let (Some(before), Some(after)) = (base.logs.get(shown), result.logs.get(shown)) {
        blocks.push(Block::Chart(over_time(name, before, after, part.verdict)));
    }
    for (before, after) in part.before.iter().zip(&part.after) {
        blocks.push(Block::Text(words(before, after)));
        for view in before.views.iter().filter(|v| v.deviations > 5.0).take(VIEWS) {
            let rest = after.views.iter().find(|v| v.name == view.name);
            blocks.push(Block::Chart(over_view(before, view, rest)));
        }
    }
    blocks.push(Block::Table(parameters(result)));
}

fn words(before: &Structure, after: &Structure) -> String {
    let views: Vec<String> = before
        .views
        .iter()
        .filter(|v| v.deviations > 5.0)
        .take(VIEWS)
        .map(|v| format!("{} {:.0} %", v.name, 100.0 * v.share))
        .collect();
    let seen = if views.is_empty() {
        "no view stands out".into()
    } else {
        format!("explained by: {}", views.join(", "))
    };
    format!(
        "Channel {}: the baseline's residual has {:.2} times the variance of noise, of which {:.2} are structured ({seen}). \
         With what was named {:.2} times, {:.2} structured.",
        before.channel, before.mean_square, before.structured, after.mean_square, after.structured
    )
}

fn span(values: &[f64]) -> f64 {
    let finite = values.iter().copied().filter(|x| x.is_finite());
    let (low, high) = finite.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
    if high > low { high - low } else { 1.0 }
}

fn line(name: &str, role: Stands, x: &[f64], y: Vec<f64>, span: f64) -> Line {
    Line {
        name: name.into(),
        role,
        x: x.to_vec(),
        y,
        tolerance: COARSE * span,
        fine_tolerance: 0.2 * COARSE * span,
    }
}

fn over_time(name: &str, before: &LogFit, after: &LogFit, verdict: Verdict) -> Chart {
    let time = &before.time_s;
    let size = span(&before.measured);
    let kept = |log: &LogFit, values: Vec<f64>| -> Vec<f64> {
        values.iter().zip(&log.used).map(|(x, used)| if *used { *x } else { f64::NAN }).collect()
    };
    let error =
        |log: &LogFit| kept(log, log.measured.iter().zip(&log.predicted).map(|(m, p)| m - p).collect());
    let named = verdict == Verdict::Named;
    let mut signals = vec![
        line("measured", Stands::Measured, time, before.measured.clone(), size),
        line("baseline", Stands::Lugre, time, before.predicted.clone(), size),
    ];
    let left = error(before);
    let error_size = span(&left);
    let mut errors = vec![line("baseline", Stands::Lugre, time, left, error_size)];
    if named {
        signals.push(line("extended", Stands::Series, time, after.predicted.clone(), size));
        errors.push(line("extended", Stands::Series, time, error(after), error_size));
    }
    let noise: Vec<f64> = after.noise_std.clone();
    errors.push(line("noise, +1 standard deviation", Stands::Reference, time, noise.clone(), error_size));
    errors.push(line("−1", Stands::Reference, time, noise.iter().map(|x| -x).collect(), error_size));
    let (from, to) = (time.first().copied().unwrap_or(0.0), time.last().copied().unwrap_or(1.0));
    // The two seconds in which the baseline errs most.
    let worst = before
        .time_s
        .iter()
        .zip(before.measured.iter().zip(&before.predicted))
        .zip(&before.used)
        .filter(|(_, used)| **used)
        .max_by(|((_, (m, p)), _), ((_, (n, q)), _)| (*m - *p).abs().total_cmp(&(*n - *q).abs()))
        .map_or(from, |((t, _), _)| *t);
    let close = ((worst - 0.5 * CLOSE_S).max(from), (worst + 0.5 * CLOSE_S).min(to));
    Chart {
        title: format!("{name}: measured and predicted."),
        caption: match before.role {
            Role::Holdout => {
                "A held-out log: nothing was fitted to it but origins and initial states.".into()
            }
            Role::Train => "A training log.".into(),
        },
        x_title: "time, s".into(),
        panels: vec![
            Panel { y_title: "signal, in the log's unit".into(), lines: signals },
            Panel { y_title: "measured − predicted".into(), lines: errors },
        ],
        windows: vec![
            Window { label: "the whole log".into(), range: (from, to) },
            Window { label: "where the baseline errs most".into(), range: close },
        ],
        ..Chart::default()
    }
}

fn over_view(before: &Structure, view: &View, rest: Option<&View>) -> Chart {
    let drawn =
        |name: &str, role, view: &View| line(name, role, &view.at, view.mean.clone(), span(&view.mean));
    let mut lines = vec![drawn("baseline", Stands::Lugre, view)];
    lines.extend(rest.map(|rest| drawn("best explanation", Stands::Series, rest)));
    Chart {
        title: format!("Residual of {} over {}.", before.channel, view.name),
        caption: format!(
            "Means of bins, training logs; {:.0} % of the baseline's residual variance.",
            100.0 * view.share
        ),
        x_title: if view.unit.is_empty() {
            view.name.into()
        } else {
            format!("{}, {}", view.name, view.unit)
        },
        panels: vec![Panel { y_title: "over the noise's standard deviation".into(), lines }],
        plane: true,
        ..Chart::default()
    }
}

fn parameters(fit: &Fit) -> Table {
    let rows = fit.parameters.iter().filter(|p| p.log.is_none()).map(|p| {
        vec![
            p.name.clone(),
            p.effect.unwrap_or("baseline").to_string(),
            format!("{:.6e}", p.value),
            if p.std.is_finite() { format!("{:.1e}", p.std) } else { "not determined".into() },
        ]
    });
    Table {
        head: ["parameter", "of", "value", "standard deviation"].map(String::from).to_vec(),
        rows: rows.collect(),
    }
}
