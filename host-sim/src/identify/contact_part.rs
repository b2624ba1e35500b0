//! The contact, searched, and what the drive's causes and the channels' ends change in the other balances.

use std::borrow::Cow;

use nalgebra::DMatrix;
use rayon::prelude::*;

use super::balance::Alternative;
use super::contact::baseline;
use super::contact::change::{Change, ContactTerm};
use super::contact::channel::{before_ringing, error_nm, normal_error_n};
use super::contact::log::ContactLog;
use super::contact::problem::{Baseline, Fit, Noise, Numbers, PredictionErrors, Problem};
use super::contact::search::{self, Ranked};
use super::drive::DriveLog;
use super::effects::coordinates::{Coordinates, HEAT_TIMES_S, Scales, TIME};
use super::effects::{ContactView, LIBRARY};
use super::filters::rms;
use super::heard::{ChannelError, Heard, Teller};
use super::law_form::{COLUMNS, LAW_FORM, SHAPE_FORM};
use super::linear;
use super::linear_part::Linear;
use super::rest::{Contribution, Ground};
use super::table::{Candidate, LOG_PRIOR, Part};
use super::term::Starts;
use crate::files::model_file::ModelFile;
use crate::files::rig_file::RigFile;

/// A set with so much less ln evidence than the best one is not the answer, e^−60 of it, however small the best one's causes
/// are: their subsets stand in the table too.
const OUT_OF_QUESTION: f64 = 60.0;

/// Sets with a cause that a motor's balance denies that stay in the comparison.
const DENIED: usize = 3;

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
    pub ranked: Vec<Ranked>,
    /// Of each set, what each of its terms does.
    pub contributions: Vec<Vec<Contribution>>,
    /// Effects that change a channel, each where the best set has it.
    tellers: Vec<Teller>,
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
    /// Errors of what that predicts.
    pub errors_as_logged: PredictionErrors,
    /// What it does in the contact: to the baseline.
    pub contribution: Contribution,
    /// ln evidence that the contact loses with the motion as logged.
    lost: f64,
}

impl DiscCause {
    /// A cause that parts the disc's motion from the encoder's, which stands in `logged`, with what that does to a baseline that was
    /// fitted with the disc's.
    fn new(parted: Parted, logged: &[ContactLog], problem: &Problem<'_>, ranked: &[Ranked]) -> Self {
        let Parted { effect, way, as_logged: (residual_nm, errors_as_logged) } = parted;
        let as_logged = Problem::with_noise(logged, problem.baseline, &[], problem.noise.clone());
        let left = search::baseline(&as_logged);
        // The baseline is always among the sets.
        let none = ranked.iter().find(|r| r.fit.terms.is_empty()).unwrap_or(&ranked[0]);
        let contribution = Ground::new(problem, &ranked[0].fit).of_motion(problem, &none.fit, &left);
        let lost = (none.log_evidence - as_logged.log_evidence(&left)[1]).max(0.0);
        Self { way, effect, residual_nm, errors_as_logged, contribution, lost }
    }
}

/// What parts the disc's motion from the encoder's.
struct Parted {
    effect: &'static str,
    way: [usize; 2],
    as_logged: (Vec<f64>, PredictionErrors),
}

impl ContactPart {
    /// Searches the training logs, with what the drive says of the disc's motion.
    pub fn searched(
        logs: &[ContactLog],
        (model, rig): (&ModelFile, &RigFile),
        drive: Option<&Linear>,
        progress: &(dyn Fn(&str) + Sync),
    ) -> Self {
        let block = baseline::has_block(model);
        let baseline = baseline::baseline(model, baseline::KNOWN_WITHIN).with_bridge_zeros(rig);
        let logged = logs;
        let (logs, parted) = with_disc_motion(logs.to_vec(), &baseline, drive);
        let scales = Scales::new(&logs);
        let terms = contact_terms(&logs, &scales, true, logs.len(), block);
        let mut problem = Problem::new(&logs, &baseline, &terms);
        let ranked = search::search(&mut problem, &[], progress).ranked;
        let contributions = contributions(&problem, &ranked);
        let tellers = tellers(&problem, &ranked);
        let disc_cause = parted.map(|parted| DiscCause::new(parted, logged, &problem, &ranked));
        let noise = problem.noise.clone();
        Self { tellers, logs, scales, baseline, block, terms, noise, ranked, contributions, disc_cause }
    }

    /// What the likeliest set changes whose causes are all large enough to be told.
    pub fn best_change(&self) -> Change {
        let best = of_largest_posterior(&self.ranked, &self.contributions);
        self.problem().change(&best.terms, &best.p)
    }

    /// Searched again without causes that the balances which hear of them deny; the best sets that have one stay in the
    /// comparison.
    #[must_use]
    pub fn without(self, denied: &[(Part, &str)], progress: &(dyn Fn(&str) + Sync)) -> Self {
        let is_denied = |term: &usize| {
            let term = &self.terms[*term];
            denied.contains(&(term.heard_by(), term.effect))
        };
        let denied: Vec<usize> = (0..self.terms.len()).filter(is_denied).collect();
        let mut problem = Problem::new(&self.logs, &self.baseline, &self.terms);
        let found = search::search(&mut problem, &denied, progress).ranked;
        let with_denied = |fit: &Fit| fit.terms.iter().any(|term| denied.contains(term));
        let before = self.ranked.iter().map(|r| &r.fit).filter(|fit| with_denied(fit)).take(DENIED).cloned();
        let ranked = search::beside(&problem, found, before.collect());
        let contributions = contributions(&problem, &ranked);
        let tellers = tellers(&problem, &ranked);
        let noise = problem.noise.clone();
        Self { noise, ranked, contributions, tellers, ..self }
    }

    /// Effects that change the channel which another balance hears of: it has them by what is told here alone.
    pub fn channel_effects(&self, by: Part) -> Vec<&'static str> {
        let changes = |term: &&ContactTerm| {
            let (Starts::At(points) | Starts::BestOf(points, _)) = &term.starts;
            term.heard_by() == by && points.iter().any(|point| term.changes_channel(point))
        };
        self.terms.iter().filter(changes).map(|term| term.effect).collect()
    }

    /// What a candidate changes.
    pub fn change(&self, place: usize) -> Change {
        let fit = self.fit(place);
        self.problem().change(&fit.terms, &fit.p)
    }

    /// The likelihood of the training logs.
    pub fn problem(&self) -> Problem<'_> {
        Problem::with_noise(&self.logs, &self.baseline, &self.terms, self.noise.clone())
    }

    /// What an effect changes in a candidate, and the contact's numbers there.
    pub fn change_by(&self, place: usize, effect: &str) -> Option<(Change, Numbers)> {
        let fit = self.fit(place);
        let (term, values) =
            placed(&self.terms, &self.baseline, fit).find(|(term, _)| term.effect == effect)?;
        Some((term.change(values), self.baseline.numbers(&fit.p)))
    }

    /// Effects of a candidate.
    pub fn effects(&self, place: usize) -> impl Iterator<Item = &'static str> + '_ {
        self.fit(place).terms.iter().map(|term| self.terms[*term].effect)
    }

    /// What another balance hears of the effects that change a channel, for these logs.
    pub fn heard(&self, by: Part, logs: &[ContactLog], training: bool) -> Vec<Heard> {
        let own = (!training).then(|| contact_terms(logs, &self.scales, false, self.logs.len(), self.block));
        let terms = own.as_ref().unwrap_or(&self.terms);
        let of_teller = |teller: &Teller| {
            let form = placed(&self.terms, &self.baseline, self.fit(teller.place))
                .find(|(term, _)| term.effect == teller.effect)
                .map(|(term, _)| term.form)?;
            let same = |term: &&ContactTerm| term.effect == teller.effect && term.form == form;
            let term = terms.iter().find(same)?;
            teller.tell(|values| channel_error(logs, term, values))
        };
        self.tellers.iter().filter(|teller| teller.heard_by == by).filter_map(of_teller).collect()
    }

    /// What each candidate tells another balance.
    pub fn told_together(&self, by: Part) -> Vec<Vec<&'static str>> {
        (0..self.ranked.len()).map(|place| self.told(by, place)).collect()
    }

    /// What a candidate tells another balance.
    pub fn told(&self, by: Part, place: usize) -> Vec<&'static str> {
        let teller =
            |effect: &&'static str| self.tellers.iter().any(|t| t.heard_by == by && t.effect == *effect);
        let terms = self.fit(place).terms.iter().map(|term| &self.terms[*term]);
        let told = terms.filter(|term| term.heard_by() == by).map(|term| term.effect).filter(teller);
        let mut told: Vec<&'static str> = told.collect();
        told.sort_unstable();
        told
    }

    /// The fit of a candidate.
    pub fn fit(&self, place: usize) -> &Fit {
        &self.ranked[place].fit
    }

    /// RMS of the difference of what two sets predict, relative to the signal; bridges whose zeros do what a cause would are a
    /// difference.
    pub fn apart(&self, a: usize, b: usize) -> f64 {
        let problem = self.problem();
        let [a, b] = [a, b].map(|place| self.fit(place));
        let [of_a, of_b] = [a, b].map(|fit| self.baseline.numbers(&fit.p));
        let of_friction = (of_a.friction_zero_nm - of_b.friction_zero_nm) / self.scales.torque_nm;
        let of_load = (of_a.normal_zero_n - of_b.normal_zero_n) / self.scales.load_n;
        search::difference(&problem, &a.r, &b.r).hypot(of_friction).hypot(of_load)
    }

    /// The sets found, for the table: where a cause in the drive moves the disc otherwise than the encoder says each with it, and
    /// without it as the motion is logged.
    pub fn candidates(&self) -> Vec<Candidate> {
        // A sum of columns finds its shape, a law has one.
        let of_term = |term: &usize| {
            let term = &self.terms[*term];
            let shaped = term.parameters.len() >= COLUMNS && term.parameters.iter().all(|p| p.amplitude);
            (term.effect, if shaped { SHAPE_FORM } else { LAW_FORM })
        };
        let of_set = |(place, (ranked, contributions)): (usize, (&Ranked, &Vec<Contribution>))| {
            let terms = ranked.fit.terms.iter().map(of_term).zip(contributions);
            let effects: Vec<_> = terms.map(|((effect, form), own)| (effect, form, *own)).collect();
            let tells = [Part::Drive, Part::Pressure].map(|by| (by, self.told(by, place)));
            let candidate = |log_evidence: f64, effects: Vec<_>| Candidate {
                tells: tells.to_vec(),
                ..Candidate::new(place, log_evidence, effects.into_iter())
            };
            match &self.disc_cause {
                None => vec![candidate(ranked.log_evidence, effects)],
                Some(cause) => {
                    let own = (cause.effect, LAW_FORM, cause.contribution);
                    let with = effects.iter().copied().chain([own]).collect();
                    let without = ranked.log_evidence - cause.lost;
                    vec![candidate(ranked.log_evidence, with), candidate(without, effects)]
                }
            }
        };
        self.ranked.iter().zip(&self.contributions).enumerate().flat_map(of_set).collect()
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

/// The terms of a fit, each with its values.
fn placed<'t>(
    terms: &'t [ContactTerm],
    baseline: &Baseline,
    fit: &'t Fit,
) -> impl Iterator<Item = (&'t ContactTerm, &'t [f64])> {
    fit.terms.iter().scan(baseline.free.len(), |at, term| {
        let term = &terms[*term];
        let from = std::mem::replace(at, *at + term.parameters.len());
        Some((term, &fit.p[from..*at]))
    })
}

/// What a term with these values has its channel show too much; `None` where it changes none.
fn channel_error(logs: &[ContactLog], term: &ContactTerm, values: &[f64]) -> Option<ChannelError> {
    let change = term.change(values);
    if term.heard_by() == Part::Pressure { normal_error_n(logs, &change) } else { error_nm(logs, &change) }
}

/// The effects that change a channel, each in the best set that has it.
fn tellers(problem: &Problem<'_>, ranked: &[Ranked]) -> Vec<Teller> {
    let mut out: Vec<Teller> = Vec::new();
    let best = ranked.first().map_or(0.0, |r| r.log_evidence);
    for (place, Ranked { fit, log_evidence }) in ranked.iter().enumerate() {
        let mut at = problem.baseline.free.len();
        let mut open = None;
        for term in fit.terms.iter().map(|term| &problem.terms[*term]) {
            let own = at..at + term.parameters.len();
            at = own.end;
            let (effect, heard_by, values) = (term.effect, term.heard_by(), &fit.p[own.clone()]);
            let known = out.iter().any(|teller| (teller.effect, teller.heard_by) == (effect, heard_by));
            if known || !term.changes_channel(values) {
                continue;
            }
            // The friction bridge's noise stands in the drive too: what the contact leaves open of it the drive would take for the
            // same noise once more, and confirm it.
            let open = if heard_by == Part::Pressure && best - log_evidence <= OUT_OF_QUESTION {
                let open = open.get_or_insert_with(|| problem.open(fit));
                let own = open.view((own.start, own.start), (own.len(), own.len()));
                linear::factor(&own.into_owned()).unpack()
            } else {
                DMatrix::zeros(own.len(), 0)
            };
            out.push(Teller { effect, heard_by, place, values: values.to_vec(), open });
        }
    }
    out
}

/// What each term of each set does. Without it the others are fitted again where the set is in question.
fn contributions(problem: &Problem<'_>, ranked: &[Ranked]) -> Vec<Vec<Contribution>> {
    let best = ranked.first().map_or(0.0, |r| r.log_evidence);
    let in_question = |ranked: &&Ranked| best - ranked.log_evidence <= OUT_OF_QUESTION;
    let mut fitted: Vec<&Fit> = ranked.iter().map(|r| &r.fit).collect();
    let subsets = search::subsets(problem, ranked.iter().filter(in_question).map(|r| &r.fit), &fitted);
    fitted.extend(&subsets);
    let ground = Ground::new(problem, &ranked[0].fit);
    let of_set = |ranked: &Ranked| {
        let fit = &ranked.fit;
        let without = if in_question(&ranked) {
            search::without_each(problem, fit, &fitted)
        } else {
            search::without_each_as_they_are(problem, fit)
        };
        ground.contributions(problem, fit, &without)
    };
    ranked.par_iter().map(of_set).collect()
}

/// The logs with the disc's own motion where a cause in the drive parts it from the encoder's, and the baseline leaves less with
/// it: that motion is the better known one.
fn with_disc_motion(
    logs: Vec<ContactLog>,
    baseline: &Baseline,
    drive: Option<&Linear>,
) -> (Vec<ContactLog>, Option<Parted>) {
    let parted = drive.and_then(|drive| {
        let best = drive.solved.first()?;
        let forms = best.forms(&drive.alternatives).map(|(form, places)| (form, &best.p[places]));
        following(&logs, forms)
    });
    let Some((effect, ways)) = parted else { return (logs, None) };
    let as_logged = left_by_baseline(&logs, baseline);
    let mut left: Vec<(usize, f64)> =
        ways.par_iter().map(|logs| rms(&left_by_baseline(logs, baseline).0)).enumerate().collect();
    left.sort_by(|a, b| a.1.total_cmp(&b.1));
    if left[0].1 >= rms(&as_logged.0) {
        return (logs, None);
    }
    let way = [left[0].0, left.get(1).unwrap_or(&left[0]).0];
    (known_by(&ways, way), Some(Parted { effect, way, as_logged }))
}

/// The fit of the set that is the likeliest with its prior and in which no cause is too small to be told: a channel has an end
/// where more says so than that nothing is lost by one.
fn of_largest_posterior<'r>(ranked: &'r [Ranked], contributions: &[Vec<Contribution>]) -> &'r Fit {
    let posterior = |r: &Ranked| r.log_evidence + LOG_PRIOR * r.fit.terms.len() as f64;
    let told = ranked.iter().zip(contributions).filter(|(_, all)| all.iter().all(Contribution::is_told));
    let best = told.map(|(r, _)| r).max_by(|a, b| posterior(a).total_cmp(&posterior(b)));
    &best.unwrap_or(&ranked[0]).fit
}

/// The drive's logs as it sees them behind the friction channel, and whether it sees something else than that shows: no torque
/// where it is at an end of its range, and where its sensor rings the torque itself. `None` where a log has no torque of the motor.
pub fn drive_logs(logs: &[ContactLog], change: &Change, inertia: f64) -> (Option<Vec<DriveLog>>, bool) {
    let behind = |log: &ContactLog| before_ringing(&log.friction_nm, change.mode?, log.grid.step_s);
    let mut changed = change.ends_nm.is_some();
    let mut of_log = |log: &ContactLog| {
        let mut seen = Cow::Borrowed(log);
        // The end is one of what the channel shows.
        if let Some(ends) = &change.ends_nm {
            seen.to_mut().leave_out_ends(ends);
        }
        let Some(torque_nm) = behind(log) else { return DriveLog::of_contact(&seen, inertia) };
        changed = true;
        seen.to_mut().friction_nm = torque_nm;
        Some(DriveLog::of_contact(&seen, inertia)?.beside_ringing(log))
    };
    let drives = logs.iter().map(&mut of_log).collect();
    (drives, changed)
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

/// What the baseline leaves of these logs with a noise model of its own, N m, and the errors of what it predicts.
fn left_by_baseline(logs: &[ContactLog], baseline: &Baseline) -> (Vec<f64>, PredictionErrors) {
    let problem = Problem::new(logs, baseline, &[]);
    let fit = search::baseline(&problem);
    let residual_nm = fit.r.iter().zip(&problem.noise.deviation).map(|(r, s)| r * s).collect();
    (residual_nm, PredictionErrors::new(&problem, &fit))
}

/// Coordinates of the contact with their units, all logs on end: what residuals are drawn over.
pub fn coordinates_of(logs: &[ContactLog], scales: &Scales) -> Vec<(String, Vec<f64>)> {
    let all: Vec<Coordinates> = logs.iter().map(|log| Coordinates::new(log, scales)).collect();
    let signal = |of: &dyn Fn(&ContactLog) -> Vec<f64>| logs.iter().flat_map(of).collect::<Vec<f64>>();
    let own = |of: &dyn Fn(&Coordinates) -> Vec<f64>| all.iter().flat_map(of).collect::<Vec<f64>>();
    let heat = HEAT_TIMES_S.iter().enumerate();
    let mut out: Vec<(String, Vec<f64>)> = heat
        .map(|(at, time_s)| (format!("heat held for {time_s} s, J"), own(&|c| c.heat_j[at].clone())))
        .collect();
    out.extend([
        ("distance slid, m".into(), own(&|c| c.distance_m.clone())),
        ("normal force, N".into(), signal(&|log| log.load_n.clone())),
        ("sliding speed, m/s".into(), signal(&|log| log.root_speed_m_s.clone())),
        (
            "disc angle, rad".into(),
            signal(&|log| log.angle_rad.iter().map(|a| a.rem_euclid(std::f64::consts::TAU)).collect()),
        ),
        (TIME.into(), signal(&|log| log.grid.time_s.clone())),
    ]);
    out
}

#[cfg(test)]
mod tests {
    use model_core::sensor::{SecondOrder, SecondOrderState};

    use super::*;
    use crate::files::log::Log;
    use crate::files::rig_file::RigFile;
    use crate::files::signal::Signal;
    use crate::identify::contact::ends::Ends;
    use crate::identify::filters::{rms, shifted};
    use crate::identify::noise::White;
    use crate::identify::noise::tests::white;
    use crate::predict::{ContactInputs, simulate_friction};

    const COUNT: usize = 4000;
    const LONG: usize = 15_000;
    const STEP_S: f64 = 1e-3;
    const MODE: (f64, f64) = (60.0, 0.02);

    /// Every 400 samples it steps.
    fn torque(i: usize) -> f64 {
        if (i / 400).is_multiple_of(2) { 1.0 } else { 2.0 }
    }

    /// What a ring shows of it.
    fn shown() -> Vec<f64> {
        let ring = SecondOrder::new(MODE.0, MODE.1, STEP_S);
        let mut state = SecondOrderState::holding(torque(0));
        (0..COUNT).map(|i| ring.step(&mut state, torque(i))).collect()
    }

    /// A log of 15 s of the assumed rubber that slides, whose friction channel has this noise beside white one.
    fn sliding(noise_nm: &[f64], seed: u64) -> ContactLog {
        let rig = RigFile::assumed_rig(&[]).unwrap();
        let series = |of: &dyn Fn(f64) -> f64| (0..LONG).map(|i| of(STEP_S * i as f64)).collect();
        let mut log = Log::default();
        log.set_signal(Signal::Time, series(&|t| t));
        log.set_signal(Signal::M2Speed, series(&|t| 6.0 + 3.0 * (1.3 * t).sin()));
        log.set_signal(Signal::NormalForce, series(&|t| 70.0 + 25.0 * (0.7 * t).sin()));
        log.set_signal(Signal::FrictionTorque, vec![0.0; LONG]);
        let inputs = ContactInputs::new(&log.contact().unwrap(), &rig);
        let torque_nm = simulate_friction(&ModelFile::assumed(&[]).unwrap(), &rig, &inputs).unwrap();
        let noise = noise_nm.iter().zip(white(LONG, seed)).map(|(slow, white)| slow + 0.02 * white);
        log.set_signal(Signal::FrictionTorque, torque_nm.iter().zip(noise).map(|(t, e)| t + e).collect());
        ContactLog::new(&log, &rig).unwrap()
    }

    /// What an effect at its best gains in ln evidence on logs of 15 s whose friction channel has this noise beside white one.
    fn gained_by(effect: &str, noise_nm: &(dyn Fn(u64) -> Vec<f64> + Sync)) -> f64 {
        let rig = RigFile::assumed_rig(&[]).unwrap();
        let model = ModelFile::assumed(&[]).unwrap();
        let log = |seed: u64| sliding(&noise_nm(seed), seed);
        let logs = [1, 2].map(log);
        let baseline = baseline::baseline(&model, baseline::KNOWN_WITHIN).with_bridge_zeros(&rig);
        let terms: Vec<ContactTerm> = contact_terms(&logs, &Scales::new(&logs), true, 2, true)
            .into_iter()
            .filter(|term| term.effect == effect)
            .collect();
        let mut problem = Problem::new(&logs, &baseline, &terms);
        let ranked = search::search(&mut problem, &[], &|_| ()).ranked;
        let best = |with: bool| {
            let of_kind = |r: &&Ranked| r.fit.terms.is_empty() != with;
            ranked.iter().find(of_kind).map_or(f64::NEG_INFINITY, |r| r.log_evidence)
        };
        best(true) - best(false)
    }

    #[test]
    fn what_wanders_as_noise_does_is_no_drift() {
        // First-order processes a decade apart: 1/f noise.
        let flicker = |seed: u64| {
            let mut noise = White::new(1000 + seed);
            let mut states =
                [0.05, 0.5, 5.0, 50.0].map(|long_s: f64| (f64::exp(-STEP_S / long_s), noise.next()));
            let next = |_| {
                let step = |(kept, state): &mut (f64, f64)| {
                    *state = *kept * *state + (1.0 - *kept * *kept).sqrt() * noise.next();
                    0.01 * *state
                };
                states.iter_mut().map(step).sum()
            };
            (0..LONG).map(next).collect::<Vec<f64>>()
        };
        let gained: Vec<f64> = [0, 10, 20, 30, 40, 50]
            .into_par_iter()
            .map(|first| gained_by("bridge_drift", &|seed| flicker(first + seed)))
            .collect();
        assert!(gained.iter().all(|gained| *gained < 0.0), "{gained:.1?}");
        let drifts = |_| (0..LONG).map(|i| 0.1 * i as f64 / LONG as f64).collect::<Vec<f64>>();
        let gained = gained_by("bridge_drift", &drifts);
        assert!(gained > -10.0 * LOG_PRIOR, "{gained}");
    }

    #[test]
    fn a_bridge_that_hums_has_no_other_mode() {
        // An amplitude of twice the white noise's deviation.
        let hum = |seed: u64| {
            let turn = |i: usize| std::f64::consts::TAU * 50.0 * STEP_S * i as f64 + seed as f64;
            (0..LONG).map(|i| 0.04 * turn(i).sin()).collect::<Vec<f64>>()
        };
        let gained = gained_by("ring_resonance", &hum);
        assert!(gained < -LOG_PRIOR, "{gained}");
    }

    #[test]
    fn a_motion_that_is_not_the_discs_costs_evidence_in_the_contact() {
        let logs = [sliding(&vec![0.0; LONG], 1)];
        let baseline = baseline::baseline(&ModelFile::assumed(&[]).unwrap(), baseline::KNOWN_WITHIN);
        let problem = Problem::new(&logs, &baseline, &[]);
        let fit = search::baseline(&problem);
        let ranked = [Ranked { log_evidence: problem.log_evidence(&fit)[1], fit }];
        // The encoder beside the disc swings about it at 5 Hz, as behind a soft shaft.
        let cause = |swing_rad: f64| {
            let swing = |i: usize| swing_rad * (std::f64::consts::TAU * 5.0 * STEP_S * i as f64).sin();
            let angle_rad: Vec<f64> =
                logs[0].angle_rad.iter().enumerate().map(|(i, angle)| angle + swing(i)).collect();
            let logged = [logs[0].following(&angle_rad)];
            let parted = Parted { effect: "shaft_torsion", way: [0, 1], as_logged: Default::default() };
            DiscCause::new(parted, &logged, &problem, &ranked)
        };
        let [still, swings] = [cause(0.0), cause(0.05)];
        assert!(still.lost < 0.5 && !still.contribution.is_told(), "{} {:?}", still.lost, still.contribution);
        assert!(
            swings.lost > 20.0 && swings.contribution.is_told(),
            "{} {:?}",
            swings.lost,
            swings.contribution
        );
    }

    #[test]
    fn the_drive_sees_the_torque_behind_a_ring_and_none_beyond_an_end() {
        let shown = shown();
        let mut log = Log::default();
        log.set_signal(Signal::Time, (0..COUNT).map(|i| STEP_S * i as f64).collect());
        log.set_signal(Signal::M2Speed, vec![5.0; COUNT]);
        log.set_signal(Signal::NormalForce, vec![80.0; COUNT]);
        log.set_signal(Signal::FrictionTorque, shown.clone());
        log.set_signal(Signal::M2Torque, vec![3.0; COUNT]);
        let logs = [ContactLog::new(&log, &RigFile::assumed_rig(&[]).unwrap()).unwrap()];
        assert!(
            !drive_logs(&logs, &Change::default(), RigFile::assumed_rig(&[]).unwrap().m2_inertia_kg_m2).1
        );
        let change = Change { mode: Some(MODE), ends_nm: Some(Ends::hard((0.0, 2.5))), ..Change::default() };
        let (Some(seen), true) =
            drive_logs(&logs, &change, RigFile::assumed_rig(&[]).unwrap().m2_inertia_kg_m2)
        else {
            panic!("it rings and has an end")
        };
        let DriveLog { friction: Some(friction_nm), ringing: Some(ringing), usable, .. } = &seen[0] else {
            panic!("it has a torque and rings")
        };
        // Between the steps, whose edges a filter rounds.
        let off = |values: &[f64]| {
            let between = (20..COUNT).filter(|i| (20..380).contains(&(i % 400)));
            rms(&between.map(|i| values[i] - torque(i)).collect::<Vec<f64>>())
        };
        let [behind, before] = [off(friction_nm), off(&shown)];
        assert!(behind < 0.1 * before, "{behind} {before}");
        let both: Vec<f64> =
            friction_nm.iter().zip(ringing).map(|(torque, ringing)| torque + ringing).collect();
        let shown_nm = shifted(&logs[0].friction_nm, logs[0].friction_late);
        assert!(both.iter().zip(&shown_nm).all(|(both, shown)| (both - shown).abs() < 1e-9));
        // A ring that overshoots an end of the range is known no better than one that does not.
        let beyond = (0..COUNT).find(|i| shown[*i] > 2.6).expect("an overshoot");
        assert!(!usable[beyond] && usable[200]);
    }
}
