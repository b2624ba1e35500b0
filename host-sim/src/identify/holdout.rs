//! Errors of baseline and extended model, on the logs fitted and on those held out.
//!
//! Nothing is fitted to a held-out log: its columns are made with the training logs' scales and shapes, and multiplied with
//! the training logs' values. What belongs to one log alone, as the phase of a pattern under an incremental encoder, is
//! not known for another one and left out.

use super::balance::{Alternative, Balance, Company, Solved, noise_variance_of};
use super::contact::log::ContactLog;
use super::contact::problem::{Fit, Prediction, Problem, Role, WELL_KNOWN};
use super::contact_part::{self, ContactPart};
use super::drive::{self, Bearing, DriveLog, DriveScales};
use super::effects::{self, DriveView, NormalLoadView};
use super::heard::Heard;
use super::judge::Judgement;
use super::linear_part::{self, Linear};
use super::normal_load::{self, NormalLoadLog, NormalLoadScales};
use super::rest;
use super::table::Part;
use crate::files::log::Log;
use crate::files::rig_file::RigFile;
use crate::input_error::InputError;

/// Blocks of the standard error of a gain, s: longer than anything that correlates residuals.
const BLOCK_S: f64 = 0.5;

/// Errors in one log.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct LogErrors {
    /// The log's name.
    pub log: String,
    /// RMS error over RMS signal, baseline.
    pub baseline_nrmse: f64,
    /// The same, extended.
    pub extended_nrmse: f64,
    /// The same of what noise alone leaves.
    pub noise_floor_nrmse: f64,
    /// 1 − extended/baseline.
    pub gain: f64,
    /// Its standard error, from blocks of half a second.
    pub gain_std: f64,
}

/// Errors of a part over logs.
#[derive(Debug, Clone, Default)]
pub struct Errors {
    /// Each log.
    pub logs: Vec<LogErrors>,
    sums: [f64; 4],
}

impl Errors {
    /// nrmse of the baseline, of the extended model, of noise alone, over all logs together.
    pub fn nrmse(&self) -> Option<[f64; 3]> {
        let [signal, base, extended, noise] = self.sums;
        (signal > 0.0).then(|| [base, extended, noise].map(|s| (s / signal).sqrt()))
    }

    fn add(&mut self, name: &str, points: &[Point], step_s: f64) {
        let sum = |of: fn(&Point) -> f64| points.iter().map(of).sum::<f64>();
        let sums = [
            sum(|p| p.signal * p.signal),
            sum(|p| p.base * p.base),
            sum(|p| p.extended * p.extended),
            sum(|p| p.noise * p.noise),
        ];
        self.sums.iter_mut().zip(sums).for_each(|(all, own)| *all += own);
        let [signal, base, extended, noise] = sums;
        if signal <= 0.0 || base <= 0.0 {
            return;
        }
        let gain = |base: f64, extended: f64| 1.0 - (extended / base.max(1e-300)).sqrt();
        // Jackknife over blocks.
        let block = (BLOCK_S / step_s).round().max(1.0) as usize;
        let without: Vec<f64> = points
            .chunks(block)
            .map(|chunk| {
                let b: f64 = chunk.iter().map(|p| p.base * p.base).sum();
                let e: f64 = chunk.iter().map(|p| p.extended * p.extended).sum();
                gain(base - b, extended - e)
            })
            .collect();
        let n = without.len() as f64;
        let mean = without.iter().sum::<f64>() / n;
        let variance = (n - 1.0) / n * without.iter().map(|g| (g - mean).powi(2)).sum::<f64>();
        self.logs.push(LogErrors {
            log: name.into(),
            baseline_nrmse: (base / signal).sqrt(),
            extended_nrmse: (extended / signal).sqrt(),
            noise_floor_nrmse: (noise / signal).sqrt(),
            gain: gain(base, extended),
            gain_std: variance.sqrt(),
        });
    }
}

struct Point {
    signal: f64,
    base: f64,
    extended: f64,
    noise: f64,
}

/// Errors of each part on these logs.
///
/// # Errors
/// Where a log lacks a column.
pub fn errors(
    found: &Judgement,
    logs: &[Log],
    rig: &RigFile,
    training: bool,
) -> Result<Vec<(Part, Errors)>, InputError> {
    let mut out = Vec::new();
    if let Some(contact) = &found.contact {
        let place = found.place(Part::Friction).unwrap_or(0);
        let prepared = ContactLog::all(logs, rig, &contact.baseline.numbers)?;
        let change = contact.change(place);
        let told = contact.heard(Part::Drive, &prepared, training);
        let (drives, _) = contact_part::drive_logs(&prepared, &change, rig.m2_inertia_kg_m2);
        let following = match (&contact.disc_cause, &found.drive, &drives) {
            (Some(cause), Some(drive), Some(drives)) if found.best().effects.contains(&cause.effect) => {
                if training {
                    Some(contact.logs.clone())
                } else {
                    let solved = &drive.solved[found.place(Part::Drive).unwrap_or(0)];
                    let (_, fixed) = drive_alternatives(drive, solved, (drives, true), Some(rig), &told);
                    let forms = known_forms(drive, solved, &fixed).filter_map(|(form, p)| Some((form, p?)));
                    contact_part::following(&prepared, forms)
                        .map(|(_, ways)| contact_part::known_by(&ways, cause.way))
                }
            }
            _ => None,
        };
        let following = following.as_ref().unwrap_or(&prepared);
        out.push((Part::Friction, contact_errors(contact, place, &prepared, following, training)));
        if let (Some(drive), Some(drives)) = (&found.drive, drives) {
            out.push((Part::Drive, drive_errors(found, drive, &drives, Some(rig), &told, training)));
        }
        let sensed = contact_part::without_normal_end(&prepared, &change);
        let load_logs: Option<Vec<NormalLoadLog>> =
            sensed.as_ref().unwrap_or(&prepared).iter().map(|log| NormalLoadLog::new(log, rig)).collect();
        if let (Some(normal_load), Some(load_logs)) = (&found.normal_load, load_logs) {
            let names: Vec<String> = logs.iter().map(|log| log.source.clone()).collect();
            let heard = contact.heard(Part::Pressure, &prepared, training);
            let told = linear_part::heard_by_normal_load(&heard, &load_logs, rig);
            let errors = normal_load_errors(found, normal_load, (&load_logs, &names), (rig, told), training);
            out.push((Part::Pressure, errors));
        }
    } else if let Some(drive) = &found.drive {
        // Through the filter of the training logs.
        let drives =
            logs.iter().map(|log| DriveLog::new(log, drive.inertia)).collect::<Result<Vec<_>, _>>()?;
        out.push((Part::Drive, drive_errors(found, drive, &drives, None, &[], training)));
    }
    Ok(out)
}

/// The baseline with the motion as logged, the extended model with the disc's own where a cause parts the two.
fn contact_errors(
    contact: &ContactPart,
    place: usize,
    as_logged: &[ContactLog],
    logs: &[ContactLog],
    training: bool,
) -> Errors {
    let terms =
        contact_part::contact_terms(logs, &contact.scales, training, contact.logs.len(), contact.block);
    // The forms stand in the same order, but that a held-out log may offer some that the training logs did not.
    let find = |term: usize| {
        let own = &contact.terms[term];
        terms.iter().position(|t| t.effect == own.effect && t.form == own.form)
    };
    let fit = contact.fit(place);
    let Some(own_terms) = fit.terms.iter().map(|t| find(*t)).collect::<Option<Vec<usize>>>() else {
        return Errors::default();
    };
    let none = contact.ranked.iter().find(|r| r.fit.terms.is_empty()).map_or(fit, |r| &r.fit);
    let mut problem = Problem::new(logs, &contact.baseline, &terms);
    problem.noise = problem.noise_at(&own_terms, &fit.p);
    let logged = Problem::with_noise(as_logged, &contact.baseline, &terms, problem.noise.clone());
    let predicted = problem.predict(&own_terms, &fit.p);
    let base = logged.left(&logged.predict(&none.terms, &none.p));
    let extended = problem.left(&predicted);
    let noise = contact_noise(contact, fit, &problem, &predicted);
    let mut errors = Errors::default();
    let measured: Vec<f64> = problem.measured().collect();
    let mut known = problem.compared().into_iter().peekable();
    let mut ends = 0;
    for log in logs {
        ends += log.len();
        let own = std::iter::from_fn(|| known.next_if(|i| *i < ends));
        let points: Vec<Point> = own
            .map(|i| Point { signal: measured[i], base: base[i], extended: extended[i], noise: noise[i] })
            .collect();
        errors.add(&log.source, &points, log.grid.step_s);
    }
    errors
}

/// Deviation of each sample that noise alone leaves: that of the sensors, as many times as a fit to the training logs leaves there
/// within what is known of it.
fn contact_noise(
    contact: &ContactPart,
    fit: &Fit,
    problem: &Problem<'_>,
    predicted: &Prediction,
) -> Vec<f64> {
    let zero_nm = contact.baseline.deviation_of(Role::FrictionZero);
    let of_sensors = |problem: &Problem<'_>, predicted: &Prediction| {
        problem.noise.of_sensors(&contact.noise, &predicted.slides(), zero_nm)
    };
    let mut there = contact.problem();
    there.noise = there.noise_at(&fit.terms, &fit.p);
    let fitted = there.predict(&fit.terms, &fit.p);
    let left = there.left(&fitted);
    let times = rest::over_named(&of_sensors(&there, &fitted), &left, &there.compared());
    of_sensors(problem, predicted).into_iter().map(|deviation| times * deviation).collect()
}

/// Values of a training set's columns in another balance; those of one log alone are left out.
fn extended_residual(
    part: &Linear,
    place: usize,
    balance: &Balance,
    fixed: &[Alternative],
) -> (Vec<f64>, Vec<f64>) {
    let base_values = |solved: &Solved| solved.p[..balance.base.len()].to_vec();
    let take = |values: &[f64], response: Vec<f64>, columns: Vec<&Vec<f64>>| {
        let mut r = response;
        for (c, p) in columns.into_iter().zip(values) {
            r.iter_mut().zip(c).for_each(|(r, x)| *r -= p * x);
        }
        r
    };
    let none = part.solved.iter().find(|s| s.set.is_empty()).unwrap_or(&part.solved[place]);
    let base =
        take(&base_values(none), balance.response.clone(), balance.base.iter().map(|b| &b.1).collect());
    let solved = &part.solved[place];
    let mut response = balance.response.clone();
    let mut columns: Vec<&Vec<f64>> = balance.base.iter().map(|b| &b.1).collect();
    let mut values = base_values(solved);
    for (form, p) in known_forms(part, solved, fixed) {
        if let Some(added) = &form.response {
            response.iter_mut().zip(added).for_each(|(y, a)| *y += a);
        }
        if let Some(p) = p {
            columns.extend(form.columns.iter());
            values.extend_from_slice(p);
        }
    }
    (base, take(&values, response, columns))
}

/// The forms of a training set in another balance, with the values of their parameters; those that each log has for itself
/// have none there.
fn known_forms<'f>(
    part: &'f Linear,
    solved: &'f Solved,
    fixed: &'f [Alternative],
) -> impl Iterator<Item = (&'f Alternative, Option<&'f [f64]>)> {
    solved.forms(&part.alternatives).filter_map(|(own, places)| {
        let same = |a: &&Alternative| {
            a.effect == own.effect
                && a.parameters.len() == own.parameters.len()
                && a.parameters.iter().zip(&own.parameters).all(|(a, b)| a.name == b.name)
        };
        let form = fixed.iter().find(same)?;
        Some((form, (!form.is_of_each_log()).then(|| &solved.p[places])))
    })
}

/// Errors of a part on the logs that it was fitted to.
fn fitted_errors(names: &[String], part: &Linear, place: usize) -> Errors {
    let solved = &part.solved[place];
    let none = part.solved.iter().find(|s| s.set.is_empty()).unwrap_or(solved);
    let forms: Vec<&Alternative> = solved.forms(&part.alternatives).map(|(form, _)| form).collect();
    linear_errors(names, (&part.balance, &forms), [&none.residual, &solved.residual], (part, solved))
}

/// Errors of a part in the balance of other logs, in which its causes have these forms.
fn foretold_errors(
    names: &[String],
    part: &Linear,
    place: usize,
    balance: &Balance,
    fixed: &[Alternative],
) -> Errors {
    let solved = &part.solved[place];
    let (base, extended) = extended_residual(part, place, balance, fixed);
    let forms: Vec<&Alternative> = known_forms(part, solved, fixed).map(|(form, _)| form).collect();
    linear_errors(names, (balance, &forms), [&base, &extended], (part, solved))
}

fn linear_errors(
    names: &[String],
    (balance, forms): (&Balance, &[&Alternative]),
    [base, extended]: [&[f64]; 2],
    (part, solved): (&Linear, &Solved),
) -> Errors {
    let fitted_forms: Vec<&Alternative> = solved.forms(&part.alternatives).map(|(form, _)| form).collect();
    let noise = balance.noise_alone(forms, (&part.balance, &fitted_forms), &solved.residual);
    let mut errors = Errors::default();
    // As in the contact: what a form says of instants that nothing tells, as that of a blow, is no law of it. A channel may be as noisy
    // as it likes.
    let limit = (WELL_KNOWN * balance.rms(&balance.response)).powi(2);
    for (rows, name) in balance.rows_of_logs().iter().zip(names) {
        let points: Vec<Point> = rows
            .iter()
            .filter(|&&i| noise_variance_of(forms, i) < limit)
            .map(|&i| Point {
                signal: balance.response[i],
                base: base[i],
                extended: extended[i],
                noise: noise[i],
            })
            .collect();
        errors.add(name, &points, balance.row_step_s);
    }
    errors
}

fn drive_errors(
    found: &Judgement,
    part: &Linear,
    logs: &[DriveLog],
    rig: Option<&RigFile>,
    told: &[Heard],
    training: bool,
) -> Errors {
    let place = found.place(Part::Drive).unwrap_or(0);
    let names: Vec<String> = logs.iter().map(|log| log.source.clone()).collect();
    if training {
        return fitted_errors(&names, part, place);
    }
    let logs = (logs, !found.linear_stage);
    let (balance, fixed) = drive_alternatives(part, &part.solved[place], logs, rig, told);
    foretold_errors(&names, part, place, &balance, &fixed)
}

/// The balance of held-out logs of a rotary or a linear drive, and the forms of a solved set's causes there with the training logs'
/// shapes; `told` is what the contact says of the friction channel there.
fn drive_alternatives(
    part: &Linear,
    solved: &Solved,
    (logs, rotary): (&[DriveLog], bool),
    rig: Option<&RigFile>,
    told: &[Heard],
) -> (Balance, Vec<Alternative>) {
    let prior = rig.map(linear_part::drive_prior).unwrap_or_default();
    let scales = part.drive_scales.unwrap_or_else(|| DriveScales::new(logs));
    let balance = drive::balance(logs, &prior, &scales);
    let balance = match drive::shown_response(&balance, logs) {
        Some(response) => balance.with_response(response),
        None => balance,
    };
    let none = part.solved.iter().find(|s| s.set.is_empty()).unwrap_or(solved);
    let residual: Vec<f64> = {
        let mut r = balance.response.clone();
        for ((_, c), p) in balance.base.iter().zip(&none.p) {
            r.iter_mut().zip(c).for_each(|(r, x)| *r -= p * x);
        }
        r
    };
    let known = |own: &Alternative, bearing: Option<&Bearing>| -> Vec<Alternative> {
        let view = DriveView {
            logs,
            scales: &scales,
            balance: &balance,
            company: Company { forms: &[], residual: &residual },
            rotary,
            inertia: part.inertia,
            fixed: Some(&own.constants),
            bearing,
        };
        effects::with_id(own.effect).into_iter().flat_map(|e| e.drive(&view)).collect()
    };
    let (heard, chosen): (Vec<&Alternative>, Vec<&Alternative>) =
        solved.set.iter().map(|chosen| &part.alternatives[*chosen]).partition(|own| own.told);
    let (couplings, others): (Vec<&Alternative>, Vec<&Alternative>) =
        chosen.into_iter().partition(|own| own.is_coupling());
    let mut fixed: Vec<Alternative> = others.into_iter().flat_map(|own| known(own, None)).collect();
    if !heard.is_empty() {
        fixed.extend(linear_part::heard_by_drive(told, logs));
    }
    if !couplings.is_empty() {
        // What is in the shaft is the motor's torque less its inertia and what else bears on it.
        let mut torque_nm = vec![0.0; balance.response.len()];
        let base = balance.base.iter().map(|b| &b.1).zip(&solved.p).skip(drive::INERTIA + 1);
        let forms = known_forms(part, solved, &fixed);
        let of_forms = forms.filter_map(|(form, p)| Some(form.columns.iter().zip(p?)));
        for (column, p) in base.chain(of_forms.flatten()) {
            torque_nm.iter_mut().zip(column).for_each(|(sum, x)| *sum += p * x);
        }
        let bearing = Bearing::new(torque_nm, &solved.p, &scales);
        fixed.extend(couplings.into_iter().flat_map(|own| known(own, Some(&bearing))));
    }
    (balance, fixed)
}

fn normal_load_errors(
    found: &Judgement,
    part: &Linear,
    (logs, names): (&[NormalLoadLog], &[String]),
    (rig, told): (&RigFile, Vec<Alternative>),
    training: bool,
) -> Errors {
    let place = found.place(Part::Pressure).unwrap_or(0);
    if training {
        return fitted_errors(names, part, place);
    }
    let own_scales = NormalLoadScales::new(logs);
    let scales = part.normal_load_scales.as_ref().unwrap_or(&own_scales);
    let balance = normal_load::balance(logs, rig, scales);
    let solved = &part.solved[place];
    let mut fixed = told;
    for own in solved.set.iter().map(|chosen| &part.alternatives[*chosen]).filter(|own| !own.told) {
        let view = NormalLoadView {
            logs,
            scales,
            balance: &balance,
            company: Company { forms: &[], residual: &balance.response },
            fixed: Some(&own.constants),
        };
        fixed.extend(effects::with_id(own.effect).into_iter().flat_map(|e| e.normal_load(&view)));
    }
    foretold_errors(names, part, place, &balance, &fixed)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::identify::drive::DrivePrior;
    use crate::identify::grid::Grid;
    use crate::identify::noise::tests::white;
    use crate::identify::two_mass::tests::swinging_disc;

    /// Where torsion makes most of the torque, a baseline whose noise was refitted may have another inertia than the one with which
    /// the coupling was looked for.
    #[test]
    fn a_coupling_explains_its_own_log_as_well_when_it_is_made_again_from_its_numbers() {
        let logs = [swinging_disc(|twist, rate| 40.0 * twist + 0.05 * rate)];
        let mut part = linear_part::search_drive(&logs, &DrivePrior::default(), true);
        let solved = part.solved[0].clone();
        let effects: Vec<&str> = solved.forms(&part.alternatives).map(|(form, _)| form.effect).collect();
        assert_eq!(effects, ["shaft_torsion"]);
        part.solved.iter_mut().filter(|s| s.set.is_empty()).for_each(|none| none.p[drive::INERTIA] *= 0.5);
        let (balance, fixed) = drive_alternatives(&part, &solved, (&logs, true), None, &[]);
        let (_, again) = extended_residual(&part, 0, &balance, &fixed);
        let [again, fitted] = [&again, &solved.residual].map(|left| balance.rms(left));
        assert!((again / fitted - 1.0).abs() < 0.01, "{again} for {fitted}");
    }

    /// A motor alone that swings by this speed at half a radian a second, with a bearing whose friction is all there from a tenth of a
    /// rad/s on, and this noise of its torque.
    fn turning(fastest_rad_s: f64, noise_nm: f64, seed: u64) -> DriveLog {
        const COUNT: usize = 16_000;
        const INERTIA_KG_M2: f64 = 0.02;
        let time: Vec<f64> = (0..COUNT).map(|i| 1e-3 * i as f64).collect();
        let (omega, noise) = (0.5, white(COUNT, seed));
        let torque = |(t, n): (&f64, f64)| {
            let speed = fastest_rad_s * (omega * t).sin();
            let inertial = INERTIA_KG_M2 * fastest_rad_s * omega * (omega * t).cos();
            inertial + 0.4 * (speed / 0.03).tanh() + noise_nm * n
        };
        let effort = time.iter().zip(noise).map(torque).collect();
        let position = time.iter().map(|t| -fastest_rad_s / omega * (omega * t).cos()).collect();
        let grid = Grid::new(&time);
        let usable = grid.covered.clone();
        DriveLog::made("log".into(), grid, effort, position, None, None, usable, INERTIA_KG_M2)
    }

    #[test]
    fn instants_that_a_form_cannot_know_are_left_out_and_a_noisy_channel_is_not() {
        let part = linear_part::search_drive(&[turning(20.0, 1.0, 1)], &DrivePrior::default(), true);
        let place = part.solved.iter().position(|solved| solved.set.is_empty()).unwrap();
        let names = ["log".to_string()];
        let [_, extended, noise] = fitted_errors(&names, &part, place).nrmse().expect("rows");
        assert!(noise > 2.0 * WELL_KNOWN && (extended / noise - 1.0).abs() < 0.1, "{extended} {noise}");
        // Where the form is uncertain by as much as is left, all of it is left out.
        let points = part.balance.response.len();
        let fifth = 0.2 * part.balance.rms(&part.balance.response);
        let error = |noise_variance: Vec<f64>| {
            let columns = Alternative::columns("coupling", Vec::new(), Vec::new());
            let form = Alternative { noise_variance, ..columns };
            let left = early(points, fifth);
            let residuals: [&[f64]; 2] = [&vec![1.0; points], &left];
            linear_errors(&names, (&part.balance, &[&form]), residuals, (&part, &part.solved[place])).nrmse()
        };
        assert_eq!(error(early(points, fifth.powi(2))).map(|e| e[1]), Some(0.0));
        assert!(error(Vec::new()).is_some_and(|e| e[1] > 0.1));
    }

    /// This value at the first half of the points, and nothing after it.
    fn early(points: usize, value: f64) -> Vec<f64> {
        (0..points).map(|i| if i < points / 2 { value } else { 0.0 }).collect()
    }

    #[test]
    fn a_slow_log_is_foretold_with_the_standstill_of_the_training_logs() {
        const NOISE_NM: f64 = 0.004;
        let log = |fastest_rad_s: f64, seed: u64| turning(fastest_rad_s, NOISE_NM, seed);
        let part = linear_part::search_drive(&[log(20.0, 1)], &DrivePrior::default(), true);
        let place = part.solved.iter().position(|solved| solved.set.is_empty()).unwrap();
        let (balance, fixed) =
            drive_alternatives(&part, &part.solved[place], (&[log(0.3, 2)], true), None, &[]);
        let (left, _) = extended_residual(&part, place, &balance, &fixed);
        assert!(balance.rms(&left) < NOISE_NM, "{}", balance.rms(&left));
    }
}
