//! `diagnosis.json`.

use std::collections::BTreeMap;

use serde::Serialize;

use super::effects::{self, LIBRARY};
use super::extended_model::Values;
use super::holdout::{Errors, LogErrors};
use super::judge::Judgement;
use super::linear_part::Linear;
use super::rest::{self, NAMED_WITHIN, Rest};
use super::table::{Hypothesis, Part, TooSmall};
use crate::files::effect_id::subsystem_of;

/// Hypotheses written out; the others are summed up.
const WRITTEN: usize = 40;
/// Rivals that hold this share of the answer's probability are not told apart from it.
const OPEN_SHARE: f64 = 0.2;

/// A fitted number.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Parameter {
    /// Value.
    pub value: f64,
    /// Standard deviation; null where these logs do not determine it.
    pub std: Option<f64>,
}

/// A named cause.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[allow(missing_docs, reason = "the format's names")]
pub struct Cause {
    pub id: String,
    pub subsystem: &'static str,
    pub probability: f64,
    pub parameters: BTreeMap<String, Parameter>,
    pub evidence: Vec<String>,
}

/// A rejected rival.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[allow(missing_docs, reason = "the format's names")]
pub struct Rejected {
    pub id: String,
    pub probability: f64,
    pub why: String,
}

/// Errors of the baseline.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[allow(missing_docs, reason = "the format's names")]
pub struct BaselineErrors {
    pub kind: String,
    pub train_nrmse: Option<f64>,
    pub holdout_nrmse: Option<f64>,
}

/// Errors of the extended model.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[allow(missing_docs, reason = "the format's names")]
pub struct ExtendedErrors {
    pub holdout_nrmse: Option<f64>,
    pub gain: Option<f64>,
    pub noise_floor_nrmse: Option<f64>,
}

/// What is left after the best hypothesis.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[allow(missing_docs, reason = "the format's names")]
pub struct Remaining {
    pub share_of_baseline: f64,
    pub times_noise: f64,
    pub follows: Vec<String>,
    pub balance: &'static str,
    pub sentence: String,
}

/// One subsystem.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[allow(missing_docs, reason = "the format's names")]
pub struct Subsystem {
    pub causes: Vec<String>,
    pub baseline: BaselineErrors,
    pub extended: ExtendedErrors,
    pub remaining: Remaining,
    /// Each held-out log.
    pub holdout: Vec<LogErrors>,
}

/// The file.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[allow(missing_docs, reason = "the format's names")]
pub struct Diagnosis {
    pub verdict: &'static str,
    /// The verdict in words.
    pub sentence: String,
    pub baseline: BaselineErrors,
    pub causes: Vec<Cause>,
    pub rejected: Vec<Rejected>,
    pub indistinguishable: Vec<Vec<String>>,
    pub extended: ExtendedErrors,
    pub posterior: BTreeMap<String, f64>,
    pub remaining: Remaining,
    pub next_experiment: String,
    pub subsystems: BTreeMap<&'static str, Subsystem>,
    /// What was assumed about the input.
    pub notes: Vec<String>,
    /// Time that the diagnosis took.
    pub wall_s: f64,
}

/// What the diagnosis is put together from.
pub struct Found<'a> {
    /// The search.
    pub judgement: &'a Judgement,
    /// Kind of the baseline.
    pub kind: &'a str,
    /// Parameters of the effects.
    pub values: &'a Values,
    /// Errors on the training logs and on those held out.
    pub train: &'a [(Part, Errors)],
    /// As [`Self::train`].
    pub holdout: &'a [(Part, Errors)],
}

fn set_name(effects: &[&str]) -> String {
    if effects.is_empty() { "none".into() } else { effects.join("+") }
}

fn percent(x: f64) -> String {
    format!("{:.2} %", 100.0 * x)
}

impl Diagnosis {
    /// Puts it together.
    pub fn new(found: &Found<'_>, wall_s: f64) -> Self {
        let judged = found.judgement;
        let verdict = judged.verdict();
        let best = judged.best();
        let marginal = |id: &str| -> f64 {
            let with = judged.hypotheses.iter().filter(|h| h.effects.contains(&id));
            // The sum of no numbers is −0.
            (1.0 - judged.unknown) * with.fold(0.0, |sum, h| sum + h.probability)
        };
        let subsystems: BTreeMap<&'static str, Subsystem> =
            judged.rests.iter().map(|(part, _)| (part.name(), subsystem(found, *part))).collect();
        let causes: Vec<Cause> = if verdict == "named" {
            let mut causes: Vec<Cause> = best
                .effects
                .iter()
                .zip(&best.sizes)
                .map(|(id, size)| cause(found, id, *size, marginal(id)))
                .collect();
            let size = |id: &str| best.effects.iter().position(|e| *e == id).map_or(0.0, |at| best.sizes[at]);
            causes.sort_by(|a, b| size(&b.id).total_cmp(&size(&a.id)));
            causes
        } else {
            Vec::new()
        };
        let main = main_part(judged, &causes);
        let shown = subsystems.get(main.name());
        let empty = || BaselineErrors { kind: found.kind.into(), train_nrmse: None, holdout_nrmse: None };
        let baseline = shown.map_or_else(empty, |s| s.baseline.clone());
        let nothing = ExtendedErrors { holdout_nrmse: None, gain: None, noise_floor_nrmse: None };
        let extended = shown.map_or(nothing, |s| s.extended.clone());
        let remaining = remaining(judged, main);
        let groups = groups(judged, verdict);
        let apart = apart(found);
        let sentence = sentence(verdict, &causes, &baseline, &extended, &remaining, &apart);
        let notes = judged.notes.iter().cloned().chain(apart.iter().map(Apart::sentence)).collect();
        Self {
            verdict,
            sentence,
            baseline,
            rejected: rejected(judged, verdict, &marginal),
            next_experiment: next(judged, verdict, &groups, &apart),
            indistinguishable: groups,
            causes,
            extended,
            posterior: posterior(judged),
            remaining,
            subsystems,
            notes,
            wall_s,
        }
    }
}

fn posterior(judged: &Judgement) -> BTreeMap<String, f64> {
    let known = 1.0 - judged.unknown;
    let mut out: BTreeMap<String, f64> = BTreeMap::new();
    out.insert("unknown".into(), judged.unknown);
    out.insert("none".into(), 0.0);
    let mut others = 0.0;
    for (i, h) in judged.hypotheses.iter().enumerate() {
        if i < WRITTEN || h.effects.is_empty() {
            *out.entry(set_name(&h.effects)).or_insert(0.0) += known * h.probability;
        } else {
            others += known * h.probability;
        }
    }
    if others > 0.0 {
        out.insert("others".into(), others);
    }
    out
}

fn subsystem(found: &Found<'_>, part: Part) -> Subsystem {
    let of = |errors: &[(Part, Errors)]| errors.iter().find(|(p, _)| *p == part).and_then(|(_, e)| e.nrmse());
    let (train, holdout) = (of(found.train), of(found.holdout));
    let logs = found.holdout.iter().find(|(p, _)| *p == part).map_or(Vec::new(), |(_, e)| e.logs.clone());
    let judged = found.judgement;
    let kind = if part == Part::Friction { found.kind } else { part.name() };
    Subsystem {
        causes: acting(judged, part).into_iter().map(String::from).collect(),
        baseline: BaselineErrors {
            kind: kind.into(),
            train_nrmse: train.map(|e| e[0]),
            holdout_nrmse: holdout.map(|e| e[0]),
        },
        extended: ExtendedErrors {
            holdout_nrmse: holdout.map(|e| e[1]),
            gain: holdout.filter(|e| e[0] > 0.0).map(|e| 1.0 - e[1] / e[0]),
            noise_floor_nrmse: holdout.map(|e| e[2]),
        },
        remaining: remaining(judged, part),
        holdout: logs,
    }
}

/// Effects of the answer that act in a part's balance.
fn acting(judged: &Judgement, part: Part) -> Vec<&'static str> {
    let Some(place) = judged.place(part) else { return Vec::new() };
    match part {
        Part::Friction => judged.contact.as_ref().map_or(Vec::new(), |contact| {
            contact.fit(place).terms.iter().map(|t| contact.terms[*t].effect).collect()
        }),
        Part::Drive | Part::Pressure => {
            let linear = if part == Part::Drive { &judged.drive } else { &judged.normal_load };
            let effects =
                |l: &Linear| l.solved[place].set.iter().map(|a| l.alternatives[*a].effect).collect();
            linear.as_ref().map_or(Vec::new(), effects)
        }
    }
}

fn main_part(judged: &Judgement, causes: &[Cause]) -> Part {
    let first = causes.first();
    let with_cause = first.and_then(|cause| {
        let parts = judged.rests.iter().map(|(part, _)| *part);
        parts.into_iter().find(|part| acting(judged, *part).contains(&cause.id.as_str()))
    });
    let largest = || {
        let unknown = judged.rests.iter().max_by(|a, b| a.1.unknown().total_cmp(&b.1.unknown()));
        let tells = |rest: &Rest| judged.verdict() == "unknown" || rest.unknown() > 0.5;
        unknown.filter(|(_, rest)| tells(rest)).map(|(part, _)| *part)
    };
    let first_part = judged.rests.first().map_or(Part::Friction, |(part, _)| *part);
    with_cause.or_else(largest).unwrap_or(first_part)
}

fn remaining(judged: &Judgement, part: Part) -> Remaining {
    let rest =
        judged.rests.iter().find(|(p, _)| *p == part).map(|(_, rest)| rest.clone()).unwrap_or_default();
    let follows: Vec<String> = rest.follows.iter().map(|(name, _)| name.clone()).collect();
    let along = if rest.follows.is_empty() {
        "nothing that was looked at".to_string()
    } else {
        rest.follows
            .iter()
            .map(|(name, share)| format!("{name} ({:.0} % of it)", 100.0 * share))
            .collect::<Vec<_>>()
            .join(", ")
    };
    let sentence = format!(
        "In the balance of the {} {} of the signal is left beyond noise ({:.1} times it, {:.0} % of what the baseline leaves); it follows {along}.",
        part.name(),
        percent(rest.size),
        rest.times_noise,
        100.0 * rest.share
    );
    Remaining {
        share_of_baseline: rest.share,
        times_noise: rest.times_noise,
        follows,
        balance: part.name(),
        sentence,
    }
}

/// A balance in which the answer leaves more of the held-out logs than of those that it was fitted to.
struct Apart {
    part: Part,
    /// RMS of what is left over that of the noise, held out and fitted.
    times_noise: [f64; 2],
}

impl Apart {
    fn sentence(&self) -> String {
        let [holdout, train] = self.times_noise;
        format!(
            "in the balance of the {} the answer leaves {holdout:.1} times the noise on the held-out logs, {train:.1} times it on the \
             training logs: the held-out runs show something that the training runs do not",
            self.part.name()
        )
    }
}

/// Held-out logs decide nothing, but that an answer does not hold for them is said.
fn apart(found: &Found<'_>) -> Vec<Apart> {
    let ratio = |errors: &Errors| errors.nrmse().filter(|e| e[2] > 0.0).map(|e| e[1] / e[2]);
    found
        .holdout
        .iter()
        .filter_map(|(part, holdout)| {
            let train = found.train.iter().find(|(p, _)| p == part).and_then(|(_, errors)| ratio(errors))?;
            Some(Apart { part: *part, times_noise: [ratio(holdout)?, train] })
        })
        // What is not predicted says nothing of the runs.
        .filter(|apart| found.judgement.of_each_log(apart.part).is_empty())
        // Noise is known within the factor; a training log that is better than it is so by chance or by fitting.
        .filter(|apart| apart.times_noise[0] > NAMED_WITHIN * apart.times_noise[1].max(1.0))
        .collect()
}

fn cause(found: &Found<'_>, id: &'static str, size: f64, probability: f64) -> Cause {
    let judged = found.judgement;
    let about = effects::with_id(id).map(|effect| effect.about());
    let mut evidence = Vec::new();
    if let Some(about) = about {
        evidence.push(format!(
            "{}: it changes the prediction by {} of the signal",
            about.meaning,
            percent(size)
        ));
    }
    if let (Some(contact), Some(place)) = (&judged.contact, judged.place(Part::Friction)) {
        let remark = effects::with_id(id).and_then(|effect| effect.remark(contact, place));
        evidence.extend(remark);
    }
    let without = judged.hypotheses.iter().find(|h| !h.effects.contains(&id));
    if let Some(without) = without {
        evidence.push(format!(
            "the best explanation without it ({}) {}",
            set_name(&without.effects),
            against(judged.best(), without)
        ));
    }
    for (part, errors) in found.holdout {
        if let (true, Some([base, extended, noise])) = (acting(judged, *part).contains(&id), errors.nrmse()) {
            evidence.push(format!(
                "on the held-out logs the error of the {} {}; noise alone leaves {}",
                part.name(),
                moves(base, extended),
                percent(noise)
            ));
            if judged.of_each_log(*part).contains(&id) {
                evidence.push(
                    "each log has values of its own for it, as the phase of a pattern is under an incremental encoder: of it nothing \
                     is predicted on held-out logs"
                        .into(),
                );
            }
        }
    }
    let parameters = found.values.get(id).map_or(BTreeMap::new(), |values| {
        values.iter().map(|(name, v)| (name.clone(), Parameter { value: v.value, std: v.std })).collect()
    });
    let subsystem = subsystem_of(id).map_or("friction", |s| s.name());
    Cause { id: id.into(), subsystem, probability, parameters, evidence }
}

/// How a rival stands against the answer.
fn against(best: &Hypothesis, rival: &Hypothesis) -> String {
    let lower = best.log_evidence() - rival.log_evidence();
    if lower >= 0.5 {
        format!("has a log evidence that is {lower:.0} lower")
    } else if lower > -0.5 {
        "has the same log evidence, and less prior or size".into()
    } else {
        format!("has a log evidence that is {:.0} higher, too little for its prior and size", -lower)
    }
}

/// Why a cause that changes so little is not named.
fn too_small(small: &TooSmall) -> String {
    if small.size < f64::EPSILON {
        return "it would not change the prediction".into();
    }
    format!(
        "it would change the prediction by {} of the signal, less than the {} that the form of the model and the law of \
         a larger cause leave open",
        percent(small.size),
        percent(small.floor)
    )
}

fn rejected(judged: &Judgement, verdict: &str, marginal: &dyn Fn(&str) -> f64) -> Vec<Rejected> {
    let best = judged.best();
    let named = |id: &str| verdict == "named" && best.effects.contains(&id);
    let mut out: Vec<Rejected> = Vec::new();
    for effect in LIBRARY.iter().map(|e| e.id()).filter(|id| !named(id)) {
        let with = judged.hypotheses.iter().find(|h| h.effects.contains(&effect));
        let small = judged.too_small.iter().find(|small| small.effect == effect);
        let why = match (with, small) {
            (_, Some(small)) => too_small(small),
            (Some(h), None) if h.effects == best.effects => {
                "what is left is larger than what it explains".into()
            }
            (Some(h), None) => {
                format!("the best explanation with it ({}) {}", set_name(&h.effects), against(best, h))
            }
            (None, None) => continue,
        };
        out.push(Rejected { id: effect.into(), probability: marginal(effect), why });
    }
    out.sort_by(|a, b| b.probability.total_cmp(&a.probability));
    out
}

/// Effects that stand in for each other: sets that differ from the answer in one effect and are nearly as probable.
fn groups(judged: &Judgement, verdict: &str) -> Vec<Vec<String>> {
    if verdict != "named" {
        return Vec::new();
    }
    let best = judged.best();
    let near = |h: &&Hypothesis| {
        h.probability > OPEN_SHARE * best.probability && h.effects.len() == best.effects.len()
    };
    let mut out = Vec::new();
    for other in judged.hypotheses.iter().skip(1).filter(near) {
        let only = |a: &[&'static str], b: &[&'static str]| -> Vec<&'static str> {
            a.iter().copied().filter(|e| !b.contains(e)).collect()
        };
        let (mine, theirs) = (only(&best.effects, &other.effects), only(&other.effects, &best.effects));
        if let ([a], [b]) = (mine.as_slice(), theirs.as_slice()) {
            out.push(vec![(*a).to_string(), (*b).to_string()]);
        }
    }
    out
}

fn next(judged: &Judgement, verdict: &str, groups: &[Vec<String>], apart: &[Apart]) -> String {
    let about = |id: &str| effects::with_id(id).map(|effect| effect.about());
    if let Some(pair) = groups.first() {
        let texts: Vec<&str> = pair.iter().filter_map(|id| about(id).map(|a| a.experiment)).collect();
        return format!("To tell {} apart: {}.", pair.join(" and "), texts.join("; or "));
    }
    match verdict {
        "named" => {
            let id = judged.best().effects.first().copied().unwrap_or_default();
            about(id).map_or(String::new(), |a| format!("To confirm {id}: {}.", a.experiment))
        }
        "unknown" => {
            let follows =
                judged.rests.iter().flat_map(|(_, rest)| rest.follows.first()).map(|f| f.0.as_str()).next();
            match follows {
                Some(rest::MAINS) => {
                    "To see what the rest is: record with both motors off, and look after shield and ground of the bridges.".into()
                }
                Some(what) => format!("To see what the rest is: vary the {what} alone, everything else held."),
                None => "To see what the rest is: repeat the same run twice; what does not repeat is no property of the rig.".into(),
            }
        }
        _ if !apart.is_empty() => {
            "To see what the held-out runs show and the training runs do not: give runs like them to --train as well.".into()
        }
        _ => "Nothing is open: hold out a run with larger speeds and loads than these.".into(),
    }
}

/// How an error changes: what is fitted to other logs may make it larger too.
fn moves(from: f64, to: f64) -> String {
    let (before, after) = (percent(from), percent(to));
    if before == after {
        format!("stays at {after}")
    } else {
        format!("{} from {before} to {after}", if to > from { "rises" } else { "falls" })
    }
}

fn sentence(
    verdict: &str,
    causes: &[Cause],
    base: &BaselineErrors,
    extended: &ExtendedErrors,
    rest: &Remaining,
    apart: &[Apart],
) -> String {
    let text = |x: Option<f64>| x.map_or("unknown".to_string(), percent);
    let error = base.holdout_nrmse.zip(extended.holdout_nrmse);
    match verdict {
        "named" => {
            let names: Vec<String> =
                causes.iter().map(|c| format!("{} ({:.1} %)", c.id, 100.0 * c.probability)).collect();
            format!(
                "The cause is {}: with it the error on the held-out logs {}; noise alone leaves {}.",
                names.join(" and "),
                error.map_or("is unknown".to_string(), |(base, extended)| moves(base, extended)),
                text(extended.noise_floor_nrmse)
            )
        }
        "unknown" => format!("Something is wrong that nothing in the library explains. {}", rest.sentence),
        _ => format!(
            "Nothing is wrong beyond noise{}: the baseline's error on the held-out logs is {}, noise alone leaves {}.",
            if apart.is_empty() { "" } else { " in the training logs, but the held-out logs differ" },
            text(base.holdout_nrmse),
            text(extended.noise_floor_nrmse)
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_unknown_is_described_where_it_is_largest() {
        // A little more likely than not over all hypotheses; what this one leaves is a little less likely than that.
        let of_drive =
            Rest { size: 0.0132, share: 0.519, explained: 0.0235, times_noise: 196.0, ..Rest::default() };
        assert!((0.4..0.5).contains(&of_drive.unknown()), "{}", of_drive.unknown());
        let judged = Judgement {
            contact: None,
            drive: None,
            normal_load: None,
            hypotheses: Vec::new(),
            too_small: Vec::new(),
            unknown: 0.63,
            rests: vec![(Part::Friction, Rest::default()), (Part::Drive, of_drive)],
            notes: Vec::new(),
            linear_stage: false,
        };
        assert_eq!(main_part(&judged, &[]), Part::Drive);
    }

    #[test]
    fn an_error_that_grows_is_not_said_to_fall() {
        assert_eq!(moves(0.052, 0.0031), "falls from 5.20 % to 0.31 %");
        assert_eq!(moves(0.0102, 0.0139), "rises from 1.02 % to 1.39 %");
        assert_eq!(moves(0.01021, 0.01019), "stays at 1.02 %");
    }

    #[test]
    fn a_cause_that_changes_nothing_is_not_said_to_change_less_than_nothing() {
        let why = |size, floor| too_small(&TooSmall { effect: "wear_drift", size, floor });
        assert_eq!(why(0.0, 0.0), "it would not change the prediction");
        assert!(why(0.001, 0.004).contains("0.10 % of the signal, less than the 0.40 %"));
    }
}
