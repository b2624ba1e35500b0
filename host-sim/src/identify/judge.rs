//! The diagnosis: contact, drive and normal-load actuator searched, one table over what they found, and what is left.
//!
//! A hypothesis is a set of effects. Each effect enters every balance that it touches; the evidence of a set is the sum
//! over the balances, each with the best of its sets that has no other effect. So a sensor's fault that the contact could
//! take for friction is decided by the drive, without a rule.

use rayon::prelude::*;

use super::balance::{self, Alternative, Balance, Company, Solved};
use super::contact::baseline as contact_baseline;
use super::contact::change::{Change, ContactTerm};
use super::contact::log::ContactLog;
use super::contact::noise::MODEL_FORM;
use super::contact::problem::{Baseline, Fit, Noise, Numbers, Problem};
use super::contact::search;
use super::drive::{self, DriveLog, DrivePrior, DriveScales};
use super::effects::coordinates::{Coordinates, Scales};
use super::effects::{ContactView, DriveView, LIBRARY, NormalLoadView};
use super::law_form::{COLUMNS, LAW_FORM, SHAPE_FORM};
use super::normal_load::{self, NormalLoadLog, NormalLoadScales};
use super::rest::{self, Contribution, Ground, Rest};
use crate::files::log::{Log, LogKind};
use crate::files::model_file::ModelFile;
use crate::files::rig_file::RigFile;
use crate::input_error::InputError;

/// A hypothesis has at most so many causes: more are no explanation but a fit, and what they would explain is left as it is.
const MOST_CAUSES: usize = 3;
/// ln of the prior probability that an effect of the library acts: one in fifty.
pub const LOG_PRIOR: f64 = -3.9;
/// A set with so much less ln evidence than the best one is not the answer, e^−60 of it, however small the best one's causes
/// are: their subsets stand in the table too.
const OUT_OF_QUESTION: f64 = 60.0;
/// Width of the step in ln(size over the model's form) between effects that could be the model's form and real ones.
const SIZE_WIDTH: f64 = 0.25 / 1.7;
/// Hypotheses below this probability say nothing of what is unknown.
const LEAST_PROBABILITY: f64 = 0.02;
/// Sets of each balance that enter the table.
const CANDIDATES: usize = 12;

/// Which balance.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Part {
    /// Friction torque.
    Friction,
    /// Torque of M2, or the force of a stage.
    Drive,
    /// Torque of M1.
    Pressure,
}

impl Part {
    /// Its name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Friction => "friction",
            Self::Drive => "drive",
            Self::Pressure => "pressure",
        }
    }
}

/// A set of effects in one balance.
#[derive(Debug, Clone)]
pub struct Candidate {
    /// Effects, in alphabetical order.
    pub effects: Vec<&'static str>,
    /// ln evidence, the likelihood with its share.
    pub log_evidence: f64,
    /// Place in the balance's own list.
    pub place: usize,
    /// What each effect does here, in the order of `effects`.
    pub contributions: Vec<Contribution>,
    /// Share of its size that each effect's form here may be wrong by, in the order of `effects`.
    pub forms: Vec<f64>,
}

/// A searched linear balance.
pub struct Linear {
    /// The balance, with its noise as refitted.
    pub balance: Balance,
    /// Forms of the effects.
    pub alternatives: Vec<Alternative>,
    /// Sets, best first.
    pub solved: Vec<Solved>,
    /// RMS of the response over its rows.
    pub signal: f64,
    /// Scales of the drive's columns.
    pub drive_scales: Option<DriveScales>,
    /// Scales of the normal-load actuator's columns.
    pub normal_load_scales: Option<NormalLoadScales>,
}

/// The contact, searched.
pub struct ContactPart {
    /// Training logs.
    pub logs: Vec<ContactLog>,
    /// Scales of the columns.
    pub scales: Scales,
    /// Baseline.
    pub baseline: Baseline,
    /// Whether the baseline has a block.
    pub block: bool,
    /// Forms of the effects.
    pub terms: Vec<ContactTerm>,
    /// Noise as refitted.
    pub noise: Noise,
    /// Sets, best first.
    pub ranked: Vec<search::Ranked>,
    /// Of each set, what each of its terms does.
    pub contributions: Vec<Vec<Contribution>>,
    /// The drive's cause that moves the contact otherwise than the encoder says.
    pub disc_cause: Option<DiscCause>,
}

/// A cause in the drive that moves the contact.
pub struct DiscCause {
    /// In which of its form's ways the disc's motion is reckoned, the one with which the baseline leaves least, and the next
    /// best one: as far as the two differ it is not known.
    pub way: [usize; 2],
    /// Its id.
    pub effect: &'static str,
    /// Residuals of the baseline with the motion as logged, N m.
    pub residual_nm: Vec<f64>,
}

impl ContactPart {
    /// The likelihood of the training logs.
    pub fn problem(&self) -> Problem<'_> {
        Problem::with_noise(&self.logs, &self.baseline, &self.terms, self.noise.clone())
    }

    /// What an effect changes in a candidate, and the contact's numbers there.
    pub fn change_by(&self, place: usize, effect: &str) -> Option<(Change, Numbers)> {
        let fit = self.fit(place);
        let mut at = self.baseline.free.len();
        for term in fit.terms.iter().map(|t| &self.terms[*t]) {
            let values = &fit.p[at..at + term.parameters.len()];
            if term.effect == effect {
                let mut change = Change::default();
                (term.act)(values, &mut change);
                return Some((change, self.baseline.numbers(&fit.p)));
            }
            at += term.parameters.len();
        }
        None
    }

    /// The fit of a candidate.
    pub fn fit(&self, place: usize) -> &Fit {
        &self.ranked[place].fit
    }
}

/// Terms of all effects for these logs.
pub fn contact_terms(
    logs: &[ContactLog],
    scales: &Scales,
    training: bool,
    train_count: usize,
    block: bool,
) -> Vec<ContactTerm> {
    let coordinates: Vec<Coordinates> = logs.iter().map(|log| Coordinates::new(log, scales)).collect();
    let view = ContactView { logs, coordinates: &coordinates, scales, training, train_count, block };
    LIBRARY.iter().flat_map(|effect| effect.contact(&view)).collect()
}

/// The drive's balance of these logs, searched.
pub fn search_drive(logs: &[DriveLog], prior: &DrivePrior, rotary: bool) -> Linear {
    let scales = DriveScales::new(logs);
    let mut balance = drive::balance(logs, prior, &scales);
    let inertia = balance.solve(&[], &[]).p[drive::INERTIA];
    let propose = |balance: &Balance, company: Company<'_>, wanted: &dyn Fn(&str) -> bool| {
        let view = DriveView { logs, scales: &scales, balance, company, rotary, inertia, fixed: None };
        LIBRARY.iter().filter(|e| wanted(e.id())).flat_map(|effect| effect.drive(&view)).collect()
    };
    let (alternatives, solved) = balance::search(&mut balance, &propose, MOST_CAUSES);
    let signal = balance.rms(&balance.response);
    Linear { balance, alternatives, solved, signal, drive_scales: Some(scales), normal_load_scales: None }
}

/// Inertia or mass by a first balance through the widest filter: it says how narrow the filter may be.
///
/// # Errors
/// Where a column is missing.
fn drive_inertia(logs: &[Log]) -> Result<f64, InputError> {
    let logs = logs.iter().map(|log| DriveLog::new(log, f64::INFINITY)).collect::<Result<Vec<_>, _>>()?;
    let nothing = DrivePrior { inertia: None, coulomb: None, viscous: None };
    let balance = drive::balance(&logs, &nothing, &DriveScales::new(&logs));
    Ok(balance.solve(&[], &[]).p[drive::INERTIA].max(0.0))
}

/// The normal-load actuator's balance of these logs, searched.
pub fn search_normal_load(logs: &[NormalLoadLog], rig: &RigFile) -> Linear {
    let scales = NormalLoadScales::new(logs);
    let mut balance = normal_load::balance(logs, rig, &scales);
    let propose = |balance: &Balance, company: Company<'_>, wanted: &dyn Fn(&str) -> bool| {
        let view = NormalLoadView { logs, scales: &scales, balance, company, fixed: None };
        LIBRARY.iter().filter(|e| wanted(e.id())).flat_map(|effect| effect.normal_load(&view)).collect()
    };
    let (alternatives, solved) = balance::search(&mut balance, &propose, MOST_CAUSES);
    let signal = balance.rms(&balance.response);
    Linear { balance, alternatives, solved, signal, drive_scales: None, normal_load_scales: Some(scales) }
}

impl Linear {
    fn candidates(&self) -> Vec<Candidate> {
        let mut out = Vec::new();
        for (place, solved) in self.solved.iter().enumerate() {
            let wanted = place < CANDIDATES || solved.set.len() < 2;
            if !wanted {
                continue;
            }
            let names = solved.set.iter().map(|a| self.alternatives[*a].effect);
            let mut effects: Vec<(&'static str, Contribution)> =
                names.zip(self.contributions(solved)).collect();
            effects.sort_by_key(|e| e.0);
            out.push(Candidate {
                effects: effects.iter().map(|e| e.0).collect(),
                log_evidence: solved.log_evidence,
                place,
                contributions: effects.iter().map(|e| e.1).collect(),
                forms: vec![LAW_FORM; effects.len()],
            });
        }
        out
    }

    /// What each alternative of a set does, the others fitted again without it.
    fn contributions(&self, solved: &Solved) -> Vec<Contribution> {
        let own = |a: &usize| {
            let set: Vec<usize> = solved.set.iter().copied().filter(|b| b != a).collect();
            let without = self.balance.solve(&self.alternatives, &set);
            rest::contribution(&self.balance, self.signal, &solved.residual, &without.residual)
        };
        solved.set.iter().map(own).collect()
    }

    /// What a set leaves.
    pub fn rest(&self, place: usize) -> Rest {
        let none = self.solved.iter().find(|s| s.set.is_empty());
        let solved = &self.solved[place];
        rest::of_balance(
            &self.balance,
            &solved.residual,
            none.map(|s| s.residual.as_slice()),
            solved.set.len(),
        )
    }
}

fn sorted(mut names: Vec<&'static str>) -> Vec<&'static str> {
    names.sort_unstable();
    names.dedup();
    names
}

/// A hypothesis in the table.
#[derive(Debug, Clone)]
pub struct Hypothesis {
    /// Effects, in alphabetical order.
    pub effects: Vec<&'static str>,
    /// ln evidence over all balances, with the prior.
    pub log_weight: f64,
    /// Place of the candidate in each part.
    pub places: Vec<(Part, usize)>,
    /// Largest change of a prediction by each effect, relative to the signal.
    pub sizes: Vec<f64>,
    /// The same over what a change has to exceed.
    pub over_floor: Vec<f64>,
    /// Posterior probability.
    pub probability: f64,
}

/// An effect that changes less than it would have to.
#[derive(Debug, Clone, Copy)]
pub struct TooSmall {
    /// Its id.
    pub effect: &'static str,
    /// What it changes, relative to the signal.
    pub size: f64,
    /// What it would have to exceed: the form of the model and of a larger cause beside it.
    pub floor: f64,
}

/// What is left, by balance.
type Rests = Vec<(Part, Rest)>;

impl Hypothesis {
    /// ln evidence over all balances, without the prior of its causes.
    pub fn log_evidence(&self) -> f64 {
        self.log_weight - LOG_PRIOR * self.effects.len() as f64
    }
}

/// What was found.
pub struct Judgement {
    /// The contact, where the logs have one.
    pub contact: Option<ContactPart>,
    /// The drive, where its torque is logged.
    pub drive: Option<Linear>,
    /// The normal-load actuator, where its torque is logged.
    pub normal_load: Option<Linear>,
    /// All hypotheses compared, the answer first.
    pub hypotheses: Vec<Hypothesis>,
    /// Effects that a balance asked for but that change too little.
    pub too_small: Vec<TooSmall>,
    /// Probability that the rest is something that the library does not have.
    pub unknown: f64,
    /// What is left, by balance.
    pub rests: Rests,
    /// What was assumed about the input.
    pub notes: Vec<String>,
    /// Whether the logs are of a linear stage.
    pub linear_stage: bool,
}

/// Probability that an effect is real that is so many times as large as the form of the model and what is left.
pub fn real(over_floor: f64) -> f64 {
    1.0 / (1.0 + (-over_floor.max(1e-9).ln() / SIZE_WIDTH).exp())
}

/// Diagnoses training logs.
///
/// # Errors
/// Where logs are of different kinds, or have nothing that can be analysed.
pub fn judge(
    train: &[Log],
    rig: &RigFile,
    model: &ModelFile,
    progress: &(dyn Fn(&str) + Sync),
) -> Result<Judgement, InputError> {
    let kinds = train.iter().map(Log::kind).collect::<Result<Vec<_>, _>>()?;
    if kinds.windows(2).any(|k| k[0] != k[1]) {
        return Err(InputError::new("logs of different kinds together")
            .key("--train")
            .allowed("contact logs, or drive logs"));
    }
    let mut notes = Vec::new();
    let (mut contact, mut normal_load) = (None, None);
    let mut drive;
    let linear_stage = kinds.first() == Some(&LogKind::LinearDrive);
    if kinds.first() == Some(&LogKind::Contact) {
        let mut logs = train.iter().map(|log| ContactLog::new(log, rig)).collect::<Result<Vec<_>, _>>()?;
        let of_drive = |logs: &[ContactLog]| -> Option<Linear> {
            let drives: Option<Vec<DriveLog>> =
                logs.iter().map(|log| DriveLog::of_contact(log, rig.m2_inertia_kg_m2)).collect();
            drives.map(|drives| search_drive(&drives, &drive_prior(rig), true))
        };
        progress("drive");
        drive = of_drive(&logs);
        let block = contact_baseline::has_block(model);
        let baseline = contact_baseline::baseline(model, contact_baseline::KNOWN_WITHIN);
        // The motion with which the baseline leaves less is the better known one.
        let mut disc_cause = None;
        let parted = drive.as_ref().and_then(|drive| {
            let best = drive.solved.first()?;
            let forms = best.forms(&drive.alternatives).map(|(form, places)| (form, &best.p[places]));
            following(&logs, forms)
        });
        if let Some((effect, ways)) = parted {
            let (residual_nm, as_logged) = left_by_baseline(&logs, &baseline);
            let mut left: Vec<(usize, f64)> =
                ways.par_iter().map(|logs| left_by_baseline(logs, &baseline).1).enumerate().collect();
            left.sort_by(|a, b| a.1.total_cmp(&b.1));
            if left[0].1 < as_logged {
                let way = [left[0].0, left.get(1).unwrap_or(&left[0]).0];
                disc_cause = Some(DiscCause { effect, way, residual_nm });
                logs = known_by(&ways, way);
            }
        }
        if drive.is_none() {
            notes.push("no torque of M2: the drive is not looked at".to_string());
        }
        let load_logs: Option<Vec<NormalLoadLog>> = logs.iter().map(NormalLoadLog::new).collect();
        if let Some(load_logs) = load_logs {
            progress("normal-load actuator");
            normal_load = Some(search_normal_load(&load_logs, rig));
        } else {
            notes.push("no torque of M1: the normal-load actuator is not looked at".to_string());
        }
        let scales = Scales::new(&logs);
        let terms = contact_terms(&logs, &scales, true, logs.len(), block);
        let (noise, ranked, contributions, best) = {
            let mut problem = Problem::new(&logs, &baseline, &terms);
            let found = search::search(&mut problem, progress);
            let best = found.ranked.first().map_or(0.0, |r| r.log_evidence);
            let in_question = |ranked: &&search::Ranked| best - ranked.log_evidence <= OUT_OF_QUESTION;
            let mut fitted: Vec<&Fit> = found.ranked.iter().map(|r| &r.fit).collect();
            let subsets =
                search::subsets(&problem, found.ranked.iter().filter(in_question).map(|r| &r.fit), &fitted);
            fitted.extend(&subsets);
            let ground = Ground::new(&problem, &found.ranked[0].fit);
            let contributions = |ranked: &search::Ranked| {
                let fit = &ranked.fit;
                let without = if in_question(&ranked) {
                    search::without_each(&problem, fit, &fitted)
                } else {
                    search::without_each_as_they_are(&problem, fit)
                };
                ground.contributions(&problem, fit, &without)
            };
            let contributions: Vec<Vec<Contribution>> = found.ranked.par_iter().map(contributions).collect();
            let best = of_largest_posterior(&found.ranked, &contributions);
            let best = problem.change(&best.terms, &best.p);
            (problem.noise.clone(), found.ranked, contributions, best)
        };
        if let (Some(seen), true) = (without_normal_end(&logs, &best), normal_load.is_some()) {
            let seen: Option<Vec<NormalLoadLog>> = seen.iter().map(NormalLoadLog::new).collect();
            normal_load = seen.map(|logs| search_normal_load(&logs, rig));
        }
        if let (Some(seen), true) = (without_ends(&logs, &best), drive.is_some()) {
            drive = of_drive(&seen);
        }
        contact = Some(ContactPart {
            logs,
            scales,
            baseline,
            block,
            terms,
            noise,
            ranked,
            contributions,
            disc_cause,
        });
    } else {
        let inertia = drive_inertia(train)?;
        let logs = train.iter().map(|log| DriveLog::new(log, inertia)).collect::<Result<Vec<_>, _>>()?;
        progress("drive");
        drive = Some(search_drive(
            &logs,
            &DrivePrior { inertia: None, coulomb: None, viscous: None },
            !linear_stage,
        ));
    }
    for (part, what, linear) in [
        (Part::Drive, "the drive", &mut drive),
        (Part::Pressure, "the normal-load actuator", &mut normal_load),
    ] {
        if linear.as_ref().is_some_and(|linear| linear.balance.used.is_empty()) {
            *linear = None;
            notes.push(format!(
                "no row of the balance of the {} can be used: {what} is not looked at",
                part.name()
            ));
        }
    }
    notes.extend(contact.as_ref().and_then(|contact| contact.noise.unresolved()));
    if contact.as_ref().is_some_and(rest::nothing_is_known) {
        notes.push(
            "no sample of the friction torque is known to a tenth of its usual size: nothing can be said of the friction"
                .to_string(),
        );
    }
    progress("table of causes");
    let mut parts: Vec<(Part, Vec<Candidate>)> = Vec::new();
    if let Some(contact) = &contact {
        parts.push((Part::Friction, contact_candidates(contact)));
    }
    if let Some(drive) = &drive {
        parts.push((Part::Drive, drive.candidates()));
    }
    if let Some(normal_load) = &normal_load {
        parts.push((Part::Pressure, normal_load.candidates()));
    }
    let (hypotheses, too_small) = table(&parts);
    let mut judgement = Judgement {
        contact,
        drive,
        normal_load,
        hypotheses,
        too_small,
        unknown: 0.0,
        rests: Vec::new(),
        notes,
        linear_stage,
    };
    judgement.weigh_rests();
    Ok(judgement)
}

/// The fit of the set that is the likeliest with its prior and in which no cause is too small to be told: a channel has an end
/// where more says so than that nothing is lost by one.
fn of_largest_posterior<'r>(ranked: &'r [search::Ranked], contributions: &[Vec<Contribution>]) -> &'r Fit {
    let posterior = |r: &search::Ranked| r.log_evidence + LOG_PRIOR * r.fit.terms.len() as f64;
    let large = |own: &Contribution| own.size > MODEL_FORM;
    let told = ranked.iter().zip(contributions).filter(|(_, all)| all.iter().all(large));
    let best = told.map(|(r, _)| r).max_by(|a, b| posterior(a).total_cmp(&posterior(b)));
    &best.unwrap_or(&ranked[0]).fit
}

/// Where the friction channel shows an end of its range, the drive's balance has no friction torque; `None` where it does not.
pub fn without_ends(logs: &[ContactLog], change: &Change) -> Option<Vec<ContactLog>> {
    let ends = change.ends_nm?;
    let mut seen = logs.to_vec();
    seen.iter_mut().for_each(|log| log.leave_out_ends(ends));
    Some(seen)
}

/// Where the normal channel shows its end, the actuator's balance has no normal force; `None` where it does not.
pub fn without_normal_end(logs: &[ContactLog], change: &Change) -> Option<Vec<ContactLog>> {
    let (end_n, knee_n) = change.normal_end_n?;
    let mut seen = logs.to_vec();
    seen.iter_mut().for_each(|log| log.leave_out_normal_end(end_n, knee_n));
    Some(seen)
}

/// The logs with the disc's own motion, reckoned in each way, where one of these forms, with these values, parts it from the
/// motor's encoder; the cause's id before them.
pub fn following<'f>(
    logs: &[ContactLog],
    mut forms: impl Iterator<Item = (&'f Alternative, &'f [f64])>,
) -> Option<(&'static str, Vec<Vec<ContactLog>>)> {
    let (effect, disc, values) =
        forms.find_map(|(form, values)| Some((form.effect, form.disc.as_ref()?, values)))?;
    let of_way = |way: usize| {
        let angles = disc.angle(way, values);
        logs.iter().zip(&angles).map(|(log, angle_rad)| log.following(angle_rad)).collect()
    };
    Some((effect, (0..disc.angle_rad.len()).map(of_way).collect()))
}

/// The logs of the first of two ways, with the difference of the two as the error of the sliding speed.
pub fn known_by(ways: &[Vec<ContactLog>], [best, next]: [usize; 2]) -> Vec<ContactLog> {
    ways[best].iter().zip(&ways[next]).map(|(log, other)| log.known_as_well_as(other)).collect()
}

/// What the baseline leaves of these logs with a noise model of its own, N m, and its mean square, (N m)².
fn left_by_baseline(logs: &[ContactLog], baseline: &Baseline) -> (Vec<f64>, f64) {
    let problem = Problem::new(logs, baseline, &[]);
    let residual_nm: Vec<f64> = {
        let r = search::baseline(&problem).r;
        r.iter().zip(&problem.noise.deviation).map(|(r, s)| r * s).collect()
    };
    let square = residual_nm.iter().map(|r| r * r).sum::<f64>() / residual_nm.len().max(1) as f64;
    (residual_nm, square)
}

fn contact_candidates(contact: &ContactPart) -> Vec<Candidate> {
    let mut out = Vec::new();
    for (place, (ranked, contributions)) in contact.ranked.iter().zip(&contact.contributions).enumerate() {
        let fit = &ranked.fit;
        // A sum of columns finds its shape, a law has one.
        let of_term = |term: &usize| {
            let term = &contact.terms[*term];
            let shaped = term.parameters.len() >= COLUMNS && term.parameters.iter().all(|p| p.amplitude);
            (term.effect, if shaped { SHAPE_FORM } else { LAW_FORM })
        };
        let terms = fit.terms.iter().map(of_term).zip(contributions);
        let mut effects: Vec<(&'static str, f64, Contribution)> =
            terms.map(|((effect, form), own)| (effect, form, *own)).collect();
        effects.sort_by_key(|e| e.0);
        out.push(Candidate {
            effects: effects.iter().map(|e| e.0).collect(),
            log_evidence: ranked.log_evidence,
            place,
            contributions: effects.iter().map(|e| e.2).collect(),
            forms: effects.iter().map(|e| e.1).collect(),
        });
    }
    out
}

/// The best candidate that has no effect but these; of each effect its size there.
fn within<'c>(candidates: &'c [Candidate], effects: &[&str]) -> Option<&'c Candidate> {
    candidates
        .iter()
        .filter(|c| c.effects.iter().all(|e| effects.contains(e)))
        .max_by(|a, b| a.log_evidence.total_cmp(&b.log_evidence))
}

fn table(parts: &[(Part, Vec<Candidate>)]) -> (Vec<Hypothesis>, Vec<TooSmall>) {
    // Sets: one candidate of each part, put together.
    let mut sets: Vec<Vec<&'static str>> = vec![Vec::new()];
    for (_, candidates) in parts {
        let mut next = Vec::new();
        for set in &sets {
            for candidate in candidates {
                let joined = sorted(set.iter().chain(&candidate.effects).copied().collect());
                if joined.len() <= MOST_CAUSES && !next.contains(&joined) {
                    next.push(joined);
                }
            }
        }
        sets = next;
    }
    let mut all: Vec<Hypothesis> = sets
        .into_iter()
        .filter_map(|effects| {
            let mut log_weight = LOG_PRIOR * effects.len() as f64;
            let mut sizes = vec![0.0f64; effects.len()];
            let mut over_floor = vec![0.0f64; effects.len()];
            let mut places = Vec::new();
            for (part, candidates) in parts {
                let best = within(candidates, &effects)?;
                log_weight += best.log_evidence;
                places.push((*part, best.place));
                for (own, (effect, what)) in best.effects.iter().zip(&best.contributions).enumerate() {
                    let at = effects.iter().position(|e| e == effect)?;
                    let others = best
                        .contributions
                        .iter()
                        .zip(&best.forms)
                        .enumerate()
                        .filter(|(other, _)| *other != own);
                    let wrong_by = others.map(|(_, (other, form))| other.size * form).fold(0.0, f64::max);
                    sizes[at] = sizes[at].max(what.size);
                    // What a second cause adds may be the first one's form.
                    let over = what.over_form(MODEL_FORM.max(wrong_by));
                    over_floor[at] = over_floor[at].max(over);
                }
            }
            Some(Hypothesis { effects, log_weight, places, sizes, over_floor, probability: 0.0 })
        })
        .collect();
    all.sort_by(|a, b| b.log_weight.total_cmp(&a.log_weight));
    // An effect below what is known is taken out of the table, the smallest first.
    let mut too_small = Vec::new();
    while let Some((at, over)) = all.first().and_then(|best| {
        let below = best.over_floor.iter().copied().enumerate().filter(|(_, over)| *over < 1.0);
        below.min_by(|a, b| a.1.total_cmp(&b.1))
    }) {
        let (effect, size) = (all[0].effects[at], all[0].sizes[at]);
        too_small.push(TooSmall { effect, size, floor: size / over.max(1e-12) });
        all.retain(|h| !h.effects.contains(&effect));
    }
    let top = all.first().map_or(0.0, |h| h.log_weight);
    all.iter_mut().for_each(|h| h.probability = (h.log_weight - top).exp());
    let mass: f64 = all.iter().map(|h| h.probability).sum();
    all.iter_mut().for_each(|h| h.probability /= mass);
    hand_down(&mut all);
    (all, too_small)
}

/// As far as an effect of a set may be the model's form, the set without it has its probability: the largest sets first.
fn hand_down(all: &mut [Hypothesis]) {
    for size in (1..=MOST_CAUSES).rev() {
        for at in (0..all.len()).filter(|at| all[*at].effects.len() == size).collect::<Vec<_>>() {
            let doubted = all[at].over_floor.iter().map(|over| 1.0 - real(*over)).enumerate();
            let Some((effect, doubt)) = doubted.max_by(|a, b| a.1.total_cmp(&b.1)) else { continue };
            let mut left = all[at].effects.clone();
            left.remove(effect);
            if let Some(without) = all.iter().position(|h| h.effects == left) {
                let handed = doubt * all[at].probability;
                all[at].probability -= handed;
                all[without].probability += handed;
            }
        }
    }
}

/// Coordinates of the contact with their units, all logs on end: what residuals are drawn over.
pub fn coordinates_of(logs: &[ContactLog], scales: &Scales) -> Vec<(String, Vec<f64>)> {
    let all: Vec<Coordinates> = logs.iter().map(|log| Coordinates::new(log, scales)).collect();
    let signal = |of: &dyn Fn(&ContactLog) -> Vec<f64>| logs.iter().flat_map(of).collect::<Vec<f64>>();
    let own = |of: &dyn Fn(&Coordinates) -> Vec<f64>| all.iter().flat_map(of).collect::<Vec<f64>>();
    vec![
        ("heat held, J".into(), own(&|c| c.heat_j[1].clone())),
        ("distance slid, m".into(), own(&|c| c.distance_m.clone())),
        ("normal force, N".into(), signal(&|log| log.load_n.clone())),
        ("sliding speed, m/s".into(), signal(&|log| log.root_speed_m_s.clone())),
        (
            "disc angle, rad".into(),
            signal(&|log| log.angle_rad.iter().map(|a| a.rem_euclid(std::f64::consts::TAU)).collect()),
        ),
        ("time, s".into(), signal(&|log| log.grid.time_s.clone())),
    ]
}

/// What the drive is known to be by the rig file.
pub fn drive_prior(rig: &RigFile) -> DrivePrior {
    DrivePrior {
        inertia: Some(rig.m2_inertia_kg_m2),
        coulomb: Some(rig.bearing_coulomb_nm),
        viscous: Some(rig.bearing_viscous_nm_s_per_rad),
    }
}

impl Judgement {
    /// The answer.
    pub fn best(&self) -> &Hypothesis {
        &self.hypotheses[0]
    }

    /// A part's place in the answer.
    pub fn place(&self, part: Part) -> Option<usize> {
        self.best().places.iter().find(|(p, _)| *p == part).map(|(_, place)| *place)
    }

    /// The probability that what a hypothesis leaves is something unknown is that of all hypotheses, each with its own.
    fn weigh_rests(&mut self) {
        let mut weighed: Vec<(f64, Hypothesis, Rests)> = Vec::new();
        for h in std::mem::take(&mut self.hypotheses) {
            let rests = if h.probability > LEAST_PROBABILITY { self.rests_of(&h) } else { Vec::new() };
            let unknown = rests.iter().map(|(_, rest)| rest.unknown()).fold(0.0, f64::max);
            weighed.push((unknown, h, rests));
        }
        self.unknown = weighed.iter().map(|(unknown, h, _)| unknown * h.probability).sum::<f64>().min(1.0);
        if self.unknown < 0.5 {
            for (unknown, h, _) in &mut weighed {
                h.probability *= (1.0 - *unknown) / (1.0 - self.unknown);
            }
        }
        weighed.sort_by(|a, b| b.1.probability.total_cmp(&a.1.probability));
        if let Some((_, _, rests)) = weighed.first_mut() {
            self.rests = std::mem::take(rests);
        }
        self.hypotheses = weighed.into_iter().map(|(_, h, _)| h).collect();
    }

    fn rests_of(&self, hypothesis: &Hypothesis) -> Rests {
        let place = |part: Part| hypothesis.places.iter().find(|(p, _)| *p == part).map(|(_, place)| *place);
        let mut out = Vec::new();
        if let (Some(contact), Some(place)) = (&self.contact, place(Part::Friction)) {
            let disc_cause = contact.disc_cause.as_ref().filter(|c| hypothesis.effects.contains(&c.effect));
            out.push((Part::Friction, rest::of_contact(contact, place, disc_cause)));
        }
        for (part, linear) in [(Part::Drive, &self.drive), (Part::Pressure, &self.normal_load)] {
            if let (Some(linear), Some(place)) = (linear, place(part)) {
                out.push((part, linear.rest(place)));
            }
        }
        out
    }

    /// `none`, `named` or `unknown`.
    pub fn verdict(&self) -> &'static str {
        if self.unknown > 0.5 {
            "unknown"
        } else if self.best().effects.is_empty() {
            "none"
        } else {
            "named"
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_small_cause_that_leaves_more_than_it_explains_is_a_form() {
        // Two sets in one balance; the evidence of the second cause is sure.
        let told = |size: f64, over_rest: f64| {
            let candidate = |effects: &[&'static str], log_evidence: f64, place: usize| Candidate {
                effects: effects.to_vec(),
                log_evidence,
                place,
                contributions: [Contribution { size: 0.1, over_rest: 9.0 }, Contribution { size, over_rest }]
                    [..effects.len()]
                    .to_vec(),
                forms: vec![LAW_FORM; effects.len()],
            };
            let candidates = vec![candidate(&["a", "b"], 50.0, 0), candidate(&["a"], 0.0, 1)];
            table(&[(Part::Friction, candidates)]).0[0].clone()
        };
        assert_eq!(told(0.02, 3.0).effects, ["a", "b"]);
        assert!(told(0.02, 3.0).probability > 0.98);
        // One that leaves nearly twice what it explains: hardly better than even odds.
        assert!((0.5..0.7).contains(&told(0.02, 0.55).probability));
        assert_eq!(told(0.02, 0.4).effects, ["a"]);
        // A large one is none, whatever another cause leaves beside it.
        assert_eq!(told(0.05, 0.1).effects, ["a", "b"]);
    }

    #[test]
    fn what_may_be_a_form_is_the_set_without_it() {
        let set = |effects: &[&'static str], over_floor: &[f64], probability: f64| Hypothesis {
            effects: effects.to_vec(),
            log_weight: 0.0,
            places: Vec::new(),
            sizes: vec![0.1; effects.len()],
            over_floor: over_floor.to_vec(),
            probability,
        };
        // The second cause is as large as the first one's form may be wrong by: even odds, however sure its evidence is.
        let mut all = [set(&["a", "b"], &[50.0, 1.0], 1.0), set(&["a"], &[50.0], 0.0), set(&[], &[], 0.0)];
        hand_down(&mut all);
        let found = all.each_ref().map(|h| h.probability);
        assert!(
            (found[0] - 0.5).abs() < 1e-9 && (found[1] - 0.5).abs() < 1e-9 && found[2] < 1e-9,
            "{found:?}"
        );
    }
}
