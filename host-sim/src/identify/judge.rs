//! The diagnosis: contact, drive and normal-load actuator searched, one table over what they found, and what is left.
//!
//! A hypothesis is a set of effects. Each effect enters every balance that it touches; the evidence of a set is the sum
//! over the balances, each with the best of its sets that has no other effect. So a sensor's fault that the contact could
//! take for friction is decided by the drive, without a rule.

use super::contact::baseline::{KNOWN_WITHIN, baseline};
use super::contact::change::Change;
use super::contact::log::ContactLog;
use super::contact::noise::MODEL_FORM;
use super::contact::ringing::fast_line;
use super::contact_part::{self, ContactPart, DiscCause};
use super::drive::{DriveLog, DrivePrior};
use super::filters::rms;
use super::law_form::LAW_FORM;
use super::linear_part::{self, Linear};
use super::normal_load::NormalLoadLog;
use super::rest::{self, BEYOND_FORM, LeftByContact, Rest};
use super::table::{Candidate, Hypothesis, Part, TooSmall, real, table};
use crate::files::log::{Log, LogKind};
use crate::files::model_file::ModelFile;
use crate::files::rig_file::RigFile;
use crate::files::speed_lag::Lag;
use crate::input_error::InputError;

/// Hypotheses below this probability say nothing of what is unknown.
const LEAST_PROBABILITY: f64 = 0.02;

/// What is left, by balance.
type Rests = Vec<(Part, Rest)>;

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
    let linear_stage = kinds.first() == Some(&LogKind::LinearDrive);
    let found = if kinds.first() == Some(&LogKind::Contact) {
        of_contact_logs(train, rig, model, progress)?
    } else {
        progress("drive");
        Found { drive: Some(of_drive_logs(train, !linear_stage)?), ..Found::default() }
    };
    let Found { contact, drive, normal_load, notes: of_kind } = found;
    let stamps = train.iter().filter_map(|log| log.replaced_stamps().map(str::to_string));
    let mut notes: Vec<String> = stamps.chain(of_kind).collect();
    let drive = with_rows(drive, Part::Drive, "the drive", &mut notes);
    let normal_load = with_rows(normal_load, Part::Pressure, "the normal-load actuator", &mut notes);
    let mut parts: Vec<(Part, Vec<Candidate>)> = Vec::new();
    if let Some(contact) = &contact {
        parts.push((Part::Friction, contact.candidates()));
    }
    let linear = [(Part::Drive, &drive), (Part::Pressure, &normal_load)];
    let searched = linear.into_iter().filter_map(|(part, found)| Some((part, found.as_ref()?.candidates())));
    parts.extend(searched);
    notes.extend(contact.as_ref().and_then(|contact| contact.noise.unresolved()));
    if contact.as_ref().is_some_and(rest::nothing_is_known) {
        notes.push(
            "no sample of the friction torque is known to a tenth of its usual size: nothing can be said of the friction"
                .to_string(),
        );
    }
    progress("table of causes");
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
    judgement.share_with_alike();
    Ok(judgement)
}

/// A torque ring's mode is known to this share of it, as gain and preload of the rig file are: it is bolted on and taken off.
const RING_KNOWN: f64 = 0.1;

/// The balances, searched.
#[derive(Default)]
struct Found {
    contact: Option<ContactPart>,
    drive: Option<Linear>,
    normal_load: Option<Linear>,
    notes: Vec<String>,
}

/// A balance where it has rows; else a note says that it has none.
fn with_rows(linear: Option<Linear>, part: Part, what: &str, notes: &mut Vec<String>) -> Option<Linear> {
    let has_rows = |linear: &Linear| !linear.balance.used.is_empty();
    if linear.as_ref().is_some_and(|linear| !has_rows(linear)) {
        notes.push(format!(
            "no row of the balance of the {} can be used: {what} is not looked at",
            part.name()
        ));
    }
    linear.filter(has_rows)
}

/// What the motors' balances make of what the contact says of its channels.
struct Motors<'r> {
    rig: &'r RigFile,
    /// The logs with the encoders' motion: the contact's have the disc's where a coupling parts the two.
    logs: &'r [ContactLog],
    drive: Option<Linear>,
    normal_load: Option<Linear>,
    /// Whether the drive was searched on logs that the contact's answer changes.
    behind_channel: bool,
    /// The same of the normal-load actuator, which is searched last.
    without_end: Option<bool>,
}

impl Motors<'_> {
    fn search_drive(rig: &RigFile, logs: &[DriveLog]) -> Linear {
        linear_part::search_drive(logs, &linear_part::drive_prior(rig), true)
    }

    /// Hears of the channels what the contact says, and forgets what it said before. A balance is searched again where its logs
    /// change.
    fn hear(&mut self, contact: &ContactPart, progress: &(dyn Fn(&str) + Sync)) {
        let rig = self.rig;
        let (logs, behind) =
            contact_part::drive_logs(self.logs, &contact.best_change(), rig.m2_inertia_kg_m2);
        if std::mem::replace(&mut self.behind_channel, behind) || behind {
            self.drive = logs.as_ref().map(|logs| Self::search_drive(rig, logs));
        }
        if let (Some(drive), Some(logs)) = (&mut self.drive, logs) {
            drive.forget();
            let heard = contact.heard(Part::Drive, &contact.logs, true);
            drive.tell(
                linear_part::heard_by_drive(&heard, &logs),
                contact.told_together(Part::Drive),
                contact.channel_effects(Part::Drive),
            );
        }
        // Of these logs the answer of contact and drive says where the normal channel shows its end.
        let drive = self.drive.iter().map(|drive| (Part::Drive, drive.candidates()));
        let parts: Vec<_> = std::iter::once((Part::Friction, contact.candidates())).chain(drive).collect();
        let place = table(&parts).0[0].place(Part::Friction).unwrap_or(0);
        let seen = contact_part::without_normal_end(self.logs, &contact.change(place));
        let before = self.without_end.replace(seen.is_some());
        let logs = seen.as_deref().unwrap_or(self.logs).iter().map(|log| NormalLoadLog::new(log, rig));
        let Some(logs) = logs.collect::<Option<Vec<NormalLoadLog>>>() else { return };
        if before.is_none() || before == Some(true) || seen.is_some() {
            progress("normal-load actuator");
            self.normal_load = Some(linear_part::search_normal_load(&logs, rig));
        }
        if let Some(normal_load) = &mut self.normal_load {
            normal_load.forget();
            let heard = contact.heard(Part::Pressure, &contact.logs, true);
            let forms = linear_part::heard_by_normal_load(&heard, &logs, rig);
            normal_load.tell(
                forms,
                contact.told_together(Part::Pressure),
                contact.channel_effects(Part::Pressure),
            );
        }
    }

    /// Whether the drive's best set parts the disc's motion from the encoder's.
    fn parts_disc(&self) -> bool {
        let parts = |drive: &Linear| {
            let best = drive.solved.first();
            best.is_some_and(|best| best.forms(&drive.alternatives).any(|(form, _)| form.disc.is_some()))
        };
        self.drive.as_ref().is_some_and(parts)
    }

    /// What the balances deny of the contact's best set.
    fn denied(&self, contact: &ContactPart) -> Vec<(Part, &'static str)> {
        let linear = [(Part::Drive, &self.drive), (Part::Pressure, &self.normal_load)];
        let denied = |(part, linear): (Part, &Option<Linear>)| Some(linear.as_ref()?.denied(part, contact));
        linear.into_iter().filter_map(denied).flatten().collect()
    }
}

/// Contact, drive and normal-load actuator. What the contact says of the channels changes what the motors see.
fn of_contact_logs(
    train: &[Log],
    rig: &RigFile,
    model: &ModelFile,
    progress: &(dyn Fn(&str) + Sync),
) -> Result<Found, InputError> {
    let logs = ContactLog::all(train, rig, &baseline(model, KNOWN_WITHIN).numbers)?;
    let mut notes: Vec<String> =
        train.iter().zip(&logs).filter_map(|(log, seen)| speed_note(log, seen.jitter_s)).collect();
    notes.extend(logs.iter().filter_map(|log| ring_note(log, rig)));
    progress("drive");
    let (as_shown, _) = contact_part::drive_logs(&logs, &Change::default(), rig.m2_inertia_kg_m2);
    let drive = as_shown.map(|logs| Motors::search_drive(rig, &logs));
    let searched = |drive: Option<&Linear>| ContactPart::searched(&logs, (model, rig), drive, progress);
    let mut contact = searched(drive.as_ref());
    let mut motors =
        Motors { rig, logs: &logs, drive, normal_load: None, behind_channel: false, without_end: None };
    motors.hear(&contact, progress);
    if motors.behind_channel && (contact.disc_cause.is_some() || motors.parts_disc()) {
        // The coupling was looked for with a friction torque that is not the disc's, and the contact with its disc.
        contact = searched(motors.drive.as_ref());
        motors.hear(&contact, progress);
    }
    let denied = motors.denied(&contact);
    if !denied.is_empty() {
        contact = contact.without(&denied, progress);
        motors.hear(&contact, progress);
    }
    let Motors { drive, normal_load, .. } = motors;
    for (found, of) in [(&drive, "M2: the drive"), (&normal_load, "M1: the normal-load actuator")] {
        if found.is_none() {
            notes.push(format!("no torque of {of} is not looked at"));
        }
    }
    Ok(Found { contact: Some(contact), drive, normal_load, notes })
}

/// What is said of a log whose speed is not used, or the instants of whose angle jitter by so much.
fn speed_note(log: &Log, jitter_s: Option<f64>) -> Option<String> {
    if let Some(jitter_s) = jitter_s {
        return Some(format!(
            "{}: the instants at which m2_angle_rad was taken are {:.0} µs off time_s; what is fast is taken from m2_speed_rad_s",
            log.source,
            1e6 * jitter_s,
        ));
    }
    let Lag { lag_s, std_s } = log.speed_lag()?;
    Some(format!(
        "{}: m2_speed_rad_s is {:.2} ± {:.2} ms {} m2_angle_rad; the slope of the angle is used in its place",
        log.source,
        1e3 * lag_s.abs(),
        1e3 * std_s,
        if lag_s > 0.0 { "behind" } else { "ahead of" }
    ))
}

/// What is said of a torque ring that rings too fast to be followed from sample to sample, and not where its mode would be seen: it
/// is taken for noise, and no cause.
fn ring_note(log: &ContactLog, rig: &RigFile) -> Option<String> {
    let mode_hz = rig.friction_bridge.mode?.mode_hz;
    let rate_hz = log.grid.step_s.recip();
    log.ringing.as_ref()?;
    let (cycles, rms_nm) = fast_line(&log.friction_nm)?;
    let seen_hz = cycles * rate_hz;
    let expected_hz = (mode_hz - rate_hz * (mode_hz / rate_hz).round()).abs();
    let large = rms_nm > BEYOND_FORM * MODEL_FORM * rms(&log.friction_nm);
    let elsewhere = (seen_hz - expected_hz).abs() > RING_KNOWN * mode_hz;
    (large && elsewhere).then(|| {
        format!(
            "{}: the friction torque rings at {seen_hz:.0} Hz or what sampling mirrors there, {:.0} Hz; the mode of the rig file, \
             {mode_hz:.0} Hz, would be seen at {expected_hz:.0} Hz: log faster, and set friction_bridge.mode_hz",
            log.source,
            rate_hz - seen_hz,
        )
    })
}

/// A drive alone, of which nothing is known beforehand.
fn of_drive_logs(train: &[Log], rotary: bool) -> Result<Linear, InputError> {
    let inertia = linear_part::drive_inertia(train)?;
    let logs = train.iter().map(|log| DriveLog::new(log, inertia)).collect::<Result<Vec<_>, _>>()?;
    Ok(linear_part::search_drive(&logs, &DrivePrior::default(), rotary))
}

/// A hypothesis with what it leaves.
struct Weighed {
    hypothesis: Hypothesis,
    rests: Rests,
    /// Probability that what it leaves is something unknown.
    unknown: f64,
    /// Place of the hypothesis that explains what it leaves with one cause more, where there is one.
    heir: Option<usize>,
}

/// Place of the best hypothesis with one cause more, if the evidence is for it: not counting that causes are improbable.
fn with_one_more(all: &[Hypothesis], h: &Hypothesis) -> Option<usize> {
    let larger = |other: &Hypothesis| {
        other.effects.len() == h.effects.len() + 1
            && h.effects.iter().all(|effect| other.effects.contains(effect))
            && other.log_evidence() > h.log_evidence()
    };
    let larger = (0..all.len()).filter(|at| larger(&all[*at]));
    larger.max_by(|a, b| all[*a].log_weight.total_cmp(&all[*b].log_weight))
}

/// As far as what a hypothesis leaves is no noise, something makes it: a cause of the library that explains it is no less likely
/// beforehand than one that is not in it, and as far as it leaves nothing unknown itself, it takes its place.
fn pass_on(weighed: &mut [Weighed]) {
    let mut order: Vec<usize> = (0..weighed.len()).collect();
    order.sort_by_key(|at| weighed[*at].hypothesis.effects.len());
    for at in order {
        let Some(heir) = weighed[at].heir else { continue };
        let own = &weighed[at];
        let more = weighed[heir].hypothesis.effects.iter().zip(&weighed[heir].hypothesis.over_floor);
        let is_real = more
            .filter(|(effect, _)| !own.hypothesis.effects.contains(effect))
            .map(|(_, over)| real(*over))
            .fold(1.0, f64::min);
        let explained = (1.0 - weighed[heir].unknown / own.unknown.max(f64::MIN_POSITIVE)).max(0.0);
        let share = own.unknown * is_real * explained;
        let passed = share * own.hypothesis.probability;
        // Where all of it goes, nothing is left that could be unknown.
        weighed[at].unknown = (own.unknown - share) / (1.0 - share).max(f64::MIN_POSITIVE);
        weighed[at].hypothesis.probability -= passed;
        weighed[heir].hypothesis.probability += passed;
    }
}

impl Judgement {
    /// The answer.
    pub fn best(&self) -> &Hypothesis {
        &self.hypotheses[0]
    }

    /// A part's place in the answer.
    pub fn place(&self, part: Part) -> Option<usize> {
        self.best().place(part)
    }

    /// The probability that what a hypothesis leaves is something unknown is that of all hypotheses, each with its own.
    fn weigh_rests(&mut self) {
        let hypotheses = std::mem::take(&mut self.hypotheses);
        let looked_at = |h: &Hypothesis| h.probability > LEAST_PROBABILITY;
        let heir = |h: &Hypothesis| looked_at(h).then(|| with_one_more(&hypotheses, h)).flatten();
        let heirs: Vec<Option<usize>> = hypotheses.iter().map(heir).collect();
        let mut weighed: Vec<Weighed> = Vec::new();
        for (at, h) in hypotheses.into_iter().enumerate() {
            let known = looked_at(&h) || heirs.contains(&Some(at));
            let rests = if known { self.rests_of(&h) } else { Vec::new() };
            let unknown = rests.iter().map(|(_, rest)| rest.unknown()).fold(0.0, f64::max);
            weighed.push(Weighed { hypothesis: h, rests, unknown, heir: heirs[at] });
        }
        pass_on(&mut weighed);
        let unknown = |w: &Weighed| w.unknown * w.hypothesis.probability;
        self.unknown = weighed.iter().map(unknown).sum::<f64>().min(1.0);
        if self.unknown < 0.5 {
            for Weighed { hypothesis, unknown, .. } in &mut weighed {
                hypothesis.probability *= (1.0 - *unknown) / (1.0 - self.unknown);
            }
        }
        weighed.sort_by(|a, b| b.hypothesis.probability.total_cmp(&a.hypothesis.probability));
        if let Some(best) = weighed.first_mut() {
            self.rests = std::mem::take(&mut best.rests);
        }
        self.hypotheses = weighed.into_iter().map(|w| w.hypothesis).collect();
    }

    /// What a cause in place of one of the answer's predicts alike, to what a law's form is known to, cannot be told from it,
    /// however sure the evidence is of the difference: each is as likely as the other.
    fn share_with_alike(&mut self) {
        let best = self.best();
        let alike: Vec<usize> = (1..self.hypotheses.len())
            .filter(|at| best.in_place_of(&self.hypotheses[*at]).is_some_and(|own| self.alike(own, *at)))
            .collect();
        let together = || std::iter::once(0).chain(alike.iter().copied());
        let each =
            together().map(|at| self.hypotheses[at].probability).sum::<f64>() / (1 + alike.len()) as f64;
        for at in together().collect::<Vec<_>>() {
            self.hypotheses[at].probability = each;
        }
    }

    /// Causes of the answer in a balance of which each log has values of its own: nothing of them is predicted of another log.
    pub fn of_each_log(&self, part: Part) -> Vec<&'static str> {
        let linear = match part {
            Part::Friction => None,
            Part::Drive => self.drive.as_ref(),
            Part::Pressure => self.normal_load.as_ref(),
        };
        linear.zip(self.place(part)).map_or(Vec::new(), |(linear, place)| linear.of_each_log(place))
    }

    /// Whether the hypothesis at a place predicts what the answer does, to the form of that one's cause at `own`.
    fn alike(&self, own: usize, at: usize) -> bool {
        let (best, other) = (self.best(), &self.hypotheses[at]);
        let apart = |part: Part| -> Option<f64> {
            let (a, b) = (best.place(part)?, other.place(part)?);
            Some(match part {
                Part::Friction => self.contact.as_ref()?.apart(a, b),
                Part::Drive => self.drive.as_ref()?.apart(a, b),
                Part::Pressure => self.normal_load.as_ref()?.apart(a, b),
            })
        };
        // One of them moves the disc otherwise than the encoder says.
        let disc = self.contact.as_ref().and_then(|contact| contact.disc_cause.as_ref());
        let parts_them = |cause: &&DiscCause| {
            best.effects.contains(&cause.effect) != other.effects.contains(&cause.effect)
        };
        let moved = disc.filter(parts_them).map_or(0.0, |cause| cause.contribution.size);
        let most =
            [Part::Friction, Part::Drive, Part::Pressure].into_iter().filter_map(apart).fold(moved, f64::max);
        most < LAW_FORM * best.sizes[own]
    }

    fn rests_of(&self, hypothesis: &Hypothesis) -> Rests {
        let place = |part| hypothesis.place(part);
        let mut contact = self
            .contact
            .as_ref()
            .zip(place(Part::Friction))
            .map(|(contact, place)| LeftByContact::new(contact, place));
        let drive = self.drive.as_ref().zip(place(Part::Drive));
        let of_bridge = contact.as_mut().zip(drive).map_or(0.0, |(contact, (drive, place))| {
            contact.shared_with(&drive.balance, &drive.solved[place].residual)
        });
        let contact = contact.map(|left| (Part::Friction, left.rest(&hypothesis.effects)));
        let drive = drive.map(|(drive, place)| (Part::Drive, drive.rest(place, of_bridge)));
        let normal_load = self.normal_load.as_ref().zip(place(Part::Pressure));
        let pressure = normal_load.map(|(linear, place)| (Part::Pressure, linear.rest(place, 0.0)));
        let mut out: Rests = [contact, drive, pressure].into_iter().flatten().collect();
        // What is left where nothing acts is weighed against what is explained elsewhere.
        let most = out.iter().map(|(_, rest)| rest.explained).fold(0.0, f64::max);
        out.iter_mut().filter(|(_, rest)| rest.explained == 0.0).for_each(|(_, rest)| rest.elsewhere = most);
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
    use crate::files::signal::Signal;
    use crate::identify::balance::Alternative;
    use crate::identify::noise::tests::white;
    use crate::identify::table::LOG_PRIOR;
    use crate::identify::term::Parameter;

    #[test]
    fn a_ring_is_told_where_it_rings_elsewhere_than_the_rig_file_says() {
        let rig = RigFile::assumed_rig(&[]).unwrap();
        assert_eq!(rig.friction_bridge.mode.unwrap().mode_hz, 600.0);
        let note = |hz: f64| {
            let noise = white(8000, 3);
            let time_s: Vec<f64> = (0..8000).map(|i| 1e-3 * f64::from(i)).collect();
            let ring = |t: &f64| 0.3 * (std::f64::consts::TAU * hz * t).sin();
            let mut log = Log::default();
            log.set_signal(Signal::M2Speed, vec![5.0; time_s.len()]);
            log.set_signal(Signal::NormalForce, vec![60.0; time_s.len()]);
            let torque = time_s.iter().zip(&noise).map(|(t, n)| 3.0 + ring(t) + 0.02 * n).collect();
            log.set_signal(Signal::FrictionTorque, torque);
            log.set_signal(Signal::Time, time_s);
            ring_note(&ContactLog::new(&log, &rig).unwrap(), &rig)
        };
        // 600 Hz is seen at 400 Hz in a log of 1 kHz, and a mode of 5 % less at 430.
        assert_eq!([note(600.0), note(570.0)], [None, None]);
        let told = note(517.0).unwrap();
        assert!(told.contains("483 Hz") && told.contains("would be seen at 400 Hz"), "{told}");
    }

    #[test]
    fn what_each_log_has_for_itself_is_known_by_its_parameters() {
        let form = |name: &str| {
            Alternative::columns("pattern", vec![Parameter::amplitude(name, 1.0)], vec![Vec::new()])
        };
        assert_eq!(["cos_1", "cos_1_log2"].map(|name| form(name).is_of_each_log()), [false, true]);
    }

    #[test]
    fn a_rest_that_a_cause_of_the_library_explains_is_not_unknown() {
        // Of the probability, of what is left being unknown, and of the larger set's cause over its floor.
        let weighed_from = |smaller: f64, larger: &[&'static str], log_weight: f64, left: f64, over: f64| {
            let one = |effects: &[&'static str], probability, log_weight, unknown| Weighed {
                hypothesis: Hypothesis {
                    effects: effects.to_vec(),
                    log_weight,
                    places: Vec::new(),
                    sizes: vec![0.1; effects.len()],
                    over_floor: effects.iter().map(|e| if *e == "a" { 50.0 } else { over }).collect(),
                    probability,
                },
                rests: Vec::new(),
                unknown,
                heir: None,
            };
            let mut all = vec![one(&["a"], 0.8, 0.0, smaller), one(larger, 0.2, log_weight, left)];
            let hypotheses: Vec<Hypothesis> = all.iter().map(|w| w.hypothesis.clone()).collect();
            all.iter_mut().for_each(|w| w.heir = with_one_more(&hypotheses, &w.hypothesis));
            pass_on(&mut all);
            let unknown: f64 = all.iter().map(|w| w.unknown * w.hypothesis.probability).sum();
            (all[1].hypothesis.probability, unknown)
        };
        let weighed = |larger: &[&'static str], log_weight: f64, left: f64, over: f64| {
            weighed_from(0.9, larger, log_weight, left, over)
        };
        let near = |found: (f64, f64), expected: (f64, f64)| {
            assert!((found.0 - expected.0).abs() < 1e-3 && (found.1 - expected.1).abs() < 1e-3, "{found:?}");
        };
        // Two nats for it, less than it is improbable beforehand: it takes the place of what would be unknown.
        near(weighed(&["a", "b"], 2.0 + LOG_PRIOR, 0.0, 50.0), (0.92, 0.0));
        // Evidence against it, another set, a cause that may be the model's form, and one that leaves as much: none of it.
        near(weighed(&["a", "b"], LOG_PRIOR - 0.1, 0.0, 50.0), (0.2, 0.72));
        near(weighed(&["b", "c"], 2.0 + LOG_PRIOR, 0.0, 50.0), (0.2, 0.72));
        near(weighed(&["a", "b"], 2.0 + LOG_PRIOR, 0.0, 0.1), (0.2, 0.72));
        near(weighed(&["a", "b"], 2.0 + LOG_PRIOR, 0.9, 50.0), (0.2, 0.9));
        // All of it.
        near(weighed_from(1.0, &["a", "b"], 2.0 + LOG_PRIOR, 0.0, 1e9), (1.0, 0.0));
    }

    #[test]
    fn causes_that_predict_the_same_are_as_likely_as_each_other() {
        let hypothesis = |effects: &[&'static str], probability| Hypothesis {
            effects: effects.to_vec(),
            log_weight: 0.0,
            places: Vec::new(),
            sizes: vec![0.1; effects.len()],
            over_floor: vec![9.0; effects.len()],
            probability,
        };
        let mut judgement = Judgement {
            contact: None,
            drive: None,
            normal_load: None,
            hypotheses: vec![
                hypothesis(&["a", "x"], 0.88),
                hypothesis(&["b", "x"], 0.04),
                hypothesis(&["b", "y"], 0.03),
                hypothesis(&["x"], 0.05),
            ],
            too_small: Vec::new(),
            unknown: 0.0,
            rests: Vec::new(),
            notes: Vec::new(),
            linear_stage: false,
        };
        // No balance tells them apart. That there is one cause less, or that both are others, is another statement.
        judgement.share_with_alike();
        let found: Vec<f64> = judgement.hypotheses.iter().map(|h| h.probability).collect();
        assert_eq!(found, [0.46, 0.46, 0.03, 0.05]);
    }
}
