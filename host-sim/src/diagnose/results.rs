//! `diagnosis.json`.

use std::collections::BTreeMap;

use serde::Serialize;

use super::analysis::{Fit, Role};
use super::lines::SpectralLine;
use super::structure::{Structure, View};
use super::verdict::{Judged, Verdict};

/// Views named for an unexplained rest.
const MOST_VIEWS: usize = 4;

/// A fitted number.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Parameter {
    /// Value.
    pub value: f64,
    /// Standard deviation; null where the logs do not determine it.
    pub std: Option<f64>,
}

/// A named cause.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[allow(missing_docs, reason = "the contract's names")]
pub struct Cause {
    pub id: String,
    pub subsystem: &'static str,
    pub probability: f64,
    pub parameters: BTreeMap<String, Parameter>,
    pub evidence: Vec<String>,
}

/// A rejected rival.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[allow(missing_docs, reason = "the contract's names")]
pub struct Rejected {
    pub id: String,
    pub probability: f64,
    pub why: String,
}

/// Errors of the baseline.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[allow(missing_docs, reason = "the contract's names")]
pub struct Baseline {
    pub kind: String,
    pub train_nrmse: Option<f64>,
    pub holdout_nrmse: Option<f64>,
}

/// Errors of the extended model.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[allow(missing_docs, reason = "the contract's names")]
pub struct Extended {
    pub holdout_nrmse: Option<f64>,
    pub gain: Option<f64>,
    pub noise_floor_nrmse: Option<f64>,
}

/// What an unexplained residual goes along with.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[allow(missing_docs, reason = "the contract's names")]
pub struct Correlation {
    pub channel: String,
    pub quantity: String,
    /// Share of the residual's variance that the quantity explains.
    pub share: f64,
}

/// A channel's residual on the training logs, in variances of the noise.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[allow(missing_docs, reason = "the names say it")]
pub struct ChannelResult {
    pub name: String,
    pub baseline: f64,
    pub baseline_structured: f64,
    pub explained: f64,
    pub explained_structured: f64,
    /// Structured part of the baseline's residual, relative to the signal.
    pub baseline_structured_nrmse: f64,
}

/// One subsystem.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[allow(missing_docs, reason = "the contract's names")]
pub struct SubsystemResult {
    pub verdict: &'static str,
    pub causes: Vec<String>,
    pub baseline: Baseline,
    pub extended: Extended,
    /// The best explanation, named or not.
    pub nearest: Vec<String>,
    /// Fits that were compared.
    pub fits: usize,
    /// Residuals of the training logs.
    pub channels: Vec<ChannelResult>,
    /// What the rest goes along with, where it is more than noise.
    pub correlates_with: Vec<Correlation>,
}

/// The file.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[allow(missing_docs, reason = "the contract's names")]
pub struct Diagnosis {
    pub verdict: &'static str,
    /// The verdict in words.
    pub sentence: String,
    pub baseline: Baseline,
    pub causes: Vec<Cause>,
    pub rejected: Vec<Rejected>,
    pub indistinguishable: Vec<Vec<String>>,
    pub extended: Extended,
    pub next_experiment: String,
    pub subsystems: BTreeMap<&'static str, SubsystemResult>,
    /// Lines in the channels' spectra that nothing in the rig makes.
    pub lines: Vec<String>,
    /// What was assumed about the input.
    pub notes: Vec<String>,
    /// Time that the diagnosis took.
    pub wall_s: f64,
}

/// Parameters of an effect in a fit.
pub fn parameters(fit: &Fit, effect: Option<&str>) -> BTreeMap<String, Parameter> {
    let name = |p: &super::analysis::Estimate| match p.log {
        Some(log) => format!("{}_log{}", p.name, log + 1),
        None => p.name.clone(),
    };
    fit.parameters
        .iter()
        .filter(|p| p.effect == effect)
        .map(|p| (name(p), Parameter { value: p.value, std: p.std.is_finite().then_some(p.std) }))
        .collect()
}

impl ChannelResult {
    fn new((before, after): (&Structure, &Structure)) -> Self {
        Self {
            name: before.channel.to_string(),
            baseline: before.mean_square,
            baseline_structured: before.structured,
            explained: after.mean_square,
            explained_structured: after.structured,
            baseline_structured_nrmse: before.nrmse,
        }
    }
}

impl SubsystemResult {
    /// From what was judged.
    pub fn new(judged: &Judged) -> Self {
        let base = judged.selection.baseline();
        let result = judged.result();
        let nrmse = |fit: Option<&Fit>, role| fit.and_then(|fit| fit.nrmse(role));
        let (before, after) = (nrmse(base, Role::Holdout), nrmse(result, Role::Holdout));
        Self {
            verdict: judged.verdict.name(),
            causes: judged.causes.iter().map(|c| c.id.to_string()).collect(),
            baseline: Baseline {
                kind: judged.analysis.baseline_kind().to_string(),
                train_nrmse: nrmse(base, Role::Train),
                holdout_nrmse: before,
            },
            extended: Extended {
                holdout_nrmse: after,
                gain: before.zip(after).filter(|(b, _)| *b > 0.0).map(|(b, a)| 1.0 - a / b),
                noise_floor_nrmse: result.and_then(|fit| fit.noise_floor(Role::Holdout)),
            },
            nearest: judged.selection.chosen.iter().map(ToString::to_string).collect(),
            fits: judged.selection.fits.len(),
            channels: judged.before.iter().zip(&judged.after).map(ChannelResult::new).collect(),
            correlates_with: correlations(judged),
        }
    }
}

/// The views that say most about what is left.
pub fn telling_views(judged: &Judged) -> impl Iterator<Item = (&'static str, &View)> {
    judged.after.iter().take(1).filter(|s| s.is_material()).flat_map(|s| {
        let telling = s.views.iter().filter(|v| v.deviations > 2.0 && v.share > 0.05);
        telling.take(MOST_VIEWS).map(|v| (s.channel, v))
    })
}

fn correlations(judged: &Judged) -> Vec<Correlation> {
    telling_views(judged)
        .map(|(channel, v)| Correlation {
            channel: channel.to_string(),
            quantity: v.name.to_string(),
            share: v.share,
        })
        .collect()
}

impl Diagnosis {
    /// Puts the subsystems together.
    pub fn new(
        judged: &[Judged],
        lines: &[SpectralLine],
        notes: Vec<String>,
        next_experiment: String,
        wall_s: f64,
    ) -> Self {
        let verdict = if lines.is_empty() { overall(judged) } else { Verdict::Unknown };
        let mut ranked: Vec<(f64, Cause)> = Vec::new();
        for part in judged.iter().filter(|_| verdict == Verdict::Named) {
            for cause in &part.causes {
                ranked.push((cause.weight, cause_of(part, cause)));
            }
        }
        ranked.sort_by(|a, b| b.0.total_cmp(&a.0));
        let causes: Vec<Cause> = ranked.into_iter().map(|(_, cause)| cause).collect();
        let main = main_part(judged, verdict, &causes);
        let main = main.map(SubsystemResult::new);
        let nothing = Baseline { kind: String::new(), train_nrmse: None, holdout_nrmse: None };
        let no_gain = Extended { holdout_nrmse: None, gain: None, noise_floor_nrmse: None };
        let rejected = judged.iter().flat_map(|part| &part.rejected).map(|r| Rejected {
            id: r.id.to_string(),
            probability: r.probability,
            why: r.why.clone(),
        });
        let groups = judged.iter().flat_map(|part| &part.indistinguishable);
        Self {
            verdict: verdict.name(),
            sentence: sentence(judged, lines, verdict, &causes),
            baseline: main.as_ref().map_or(nothing, |m| m.baseline.clone()),
            causes,
            rejected: rejected.collect(),
            indistinguishable: groups.map(|g| g.iter().map(ToString::to_string).collect()).collect(),
            extended: main.map_or(no_gain, |m| m.extended),
            next_experiment,
            subsystems: judged
                .iter()
                .map(|part| (part.analysis.subsystem().name(), SubsystemResult::new(part)))
                .collect(),
            lines: lines.iter().map(SpectralLine::sentence).collect(),
            notes,
            wall_s,
        }
    }
}

fn cause_of(part: &Judged, cause: &super::verdict::Cause) -> Cause {
    let subsystem = crate::files::effect_id::subsystem_of(cause.id).unwrap_or(part.analysis.subsystem());
    let mut parameters = part.result().map_or(BTreeMap::new(), |fit| parameters(fit, Some(cause.id)));
    let read_off = part.analysis.constants(cause.id).into_iter();
    parameters.extend(read_off.map(|(name, value)| (name.to_string(), Parameter { value, std: None })));
    Cause {
        id: cause.id.to_string(),
        subsystem: subsystem.name(),
        probability: cause.probability,
        parameters,
        evidence: cause.evidence.clone(),
    }
}

/// The verdict on the whole: an unexplained rest anywhere makes it `unknown`, since what is named elsewhere may be its shadow.
pub fn overall(judged: &[Judged]) -> Verdict {
    let has = |verdict| judged.iter().any(|part| part.verdict == verdict);
    if has(Verdict::Unknown) {
        Verdict::Unknown
    } else if has(Verdict::Named) {
        Verdict::Named
    } else {
        Verdict::None
    }
}

/// The subsystem that the figures are about: that of the first cause, of the largest rest, or the first one.
pub fn main_part<'a>(judged: &'a [Judged], verdict: Verdict, causes: &[Cause]) -> Option<&'a Judged> {
    let found = match verdict {
        Verdict::Named => {
            let first = causes.first()?;
            judged.iter().find(|part| part.causes.iter().any(|c| c.id == first.id))
        }
        Verdict::Unknown => judged
            .iter()
            .filter(|part| part.verdict == Verdict::Unknown)
            .max_by(|a, b| a.structured_before().total_cmp(&b.structured_before())),
        Verdict::None => None,
    };
    found.or(judged.first())
}

fn sentence(judged: &[Judged], lines: &[SpectralLine], verdict: Verdict, causes: &[Cause]) -> String {
    let percent = |x: Option<f64>| x.map_or("?".to_string(), |x| format!("{:.2} %", 100.0 * x));
    let main = main_part(judged, verdict, causes).map(SubsystemResult::new);
    let Some(main) = main else { return "Nothing could be analysed.".into() };
    match verdict {
        Verdict::None => format!(
            "Nothing is wrong beyond noise: the baseline's error on the held-out logs is {}, the noise alone would be {}.",
            percent(main.baseline.holdout_nrmse),
            percent(main.extended.noise_floor_nrmse)
        ),
        Verdict::Named => {
            let names: Vec<String> =
                causes.iter().map(|c| format!("{} ({:.1} %)", c.id, 100.0 * c.probability)).collect();
            format!(
                "The cause is {}: with it the error on the held-out logs falls from {} to {}; the noise alone would be {}.",
                names.join(" and "),
                percent(main.baseline.holdout_nrmse),
                percent(main.extended.holdout_nrmse),
                percent(main.extended.noise_floor_nrmse)
            )
        }
        Verdict::Unknown => {
            let mut along: Vec<String> = lines.iter().map(SpectralLine::sentence).collect();
            for part in judged.iter().filter(|part| part.verdict == Verdict::Unknown) {
                let views: Vec<String> = telling_views(part)
                    .map(|(channel, v)| format!("{} ({:.0} % of {channel})", v.name, 100.0 * v.share))
                    .collect();
                let part = part.analysis.subsystem().name();
                along.push(if views.is_empty() {
                    format!("in the {part}, at short lags only")
                } else {
                    format!("in the {part}, along {}", views.join(", "))
                });
            }
            format!("Something is wrong that nothing in the library explains: {}.", along.join("; "))
        }
    }
}
