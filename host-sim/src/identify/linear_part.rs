//! A balance that is linear in its parameters, searched: the drive's and the normal-load actuator's.

use std::borrow::Cow;

use rayon::prelude::*;

use super::balance::{self, Alternative, Balance, Company, Solved};
use super::bridge_zero;
use super::contact_part::ContactPart;
use super::drive::{self, DriveLog, DrivePrior, DriveScales};
use super::effects::{DriveView, LIBRARY, NormalLoadView};
use super::heard::{ChannelError, Heard};
use super::law_form::LAW_FORM;
use super::normal_load::{self, NormalLoadLog, NormalLoadScales};
use super::rest::{self, Contribution, Rest};
use super::table::{Candidate, LOG_PRIOR, MOST_CAUSES, Part};
use crate::files::log::Log;
use crate::files::rig_file::RigFile;
use crate::input_error::InputError;

/// Sets of each balance that enter the table.
const CANDIDATES: usize = 12;

/// A searched linear balance.
pub struct Linear {
    /// The balance, with its noise as refitted.
    pub balance: Balance,
    /// Forms of the effects.
    pub alternatives: Vec<Alternative>,
    /// Sets, best first.
    pub solved: Vec<Solved>,
    /// What its effects may follow, with units.
    pub coordinates: Vec<(String, Vec<f64>)>,
    /// Its unit.
    pub unit: &'static str,
    /// Scales of the drive's columns.
    pub drive_scales: Option<DriveScales>,
    /// Inertia of motor and disc together with which the drive's forms were made: their numbers are parts of it. 0 where there is
    /// no drive.
    pub inertia: f64,
    /// Scales of the normal-load actuator's columns.
    pub normal_load_scales: Option<NormalLoadScales>,
    /// Effects of which the contact tells: its channel is what that one says, and nothing else.
    heard: Vec<&'static str>,
}

impl Linear {
    /// The best sets and all single causes, for the table.
    pub fn candidates(&self) -> Vec<Candidate> {
        let wanted =
            |own: &(usize, &Solved)| self.admits(own.1) && (wanted(own) || !self.told(own.1).is_empty());
        let of_set = |(place, solved): (usize, &Solved)| {
            let names = solved.set.iter().map(|a| self.alternatives[*a].effect);
            let effects = names.zip(self.contributions(solved)).map(|(effect, own)| (effect, LAW_FORM, own));
            Candidate { told: self.told(solved), ..Candidate::new(place, solved.log_evidence, effects) }
        };
        self.solved.par_iter().enumerate().filter(wanted).map(of_set).collect()
    }

    /// Whether a set says of a channel nothing but what is heard of it.
    fn admits(&self, solved: &Solved) -> bool {
        let mut own = solved.set.iter().map(|a| &self.alternatives[*a]).filter(|a| !a.told);
        own.all(|a| !self.heard.contains(&a.effect))
    }

    /// Effects of a set that are told by another balance.
    fn told(&self, solved: &Solved) -> Vec<&'static str> {
        let told = solved.set.iter().map(|a| &self.alternatives[*a]).filter(|a| a.told);
        let mut told: Vec<&'static str> = told.map(|a| a.effect).collect();
        told.sort_unstable();
        told
    }

    /// Effects of the contact's best set whose errors of a channel cost more here than another cause would: the motor's torque
    /// does not know of them.
    pub fn denied(&self, part: Part, contact: &ContactPart) -> Vec<(Part, &'static str)> {
        let best = |told: &[&str]| {
            let own = self.solved.iter().filter(|solved| self.admits(solved) && self.told(solved) == told);
            own.map(|solved| solved.log_evidence).fold(f64::NEG_INFINITY, f64::max)
        };
        let nothing = best(&[]);
        let costs = |effect: &&'static str| best(&[*effect]) < nothing + LOG_PRIOR;
        contact.told(part, 0).into_iter().filter(costs).map(|effect| (part, effect)).collect()
    }

    /// With its sets weighed by another response: they were looked for where a channel does not ring, which whoever says that it
    /// does not has to answer for. They stay in their order.
    #[must_use]
    pub fn weighed_by(self, response: Vec<f64>) -> Self {
        let balance = self.balance.with_response(response);
        let solve = |solved: &Solved| balance.solve(&self.alternatives, &solved.set);
        let solved = self.solved.par_iter().map(solve).collect();
        Self { balance, solved, ..self }
    }

    /// Takes back what the contact has told.
    pub fn forget(&mut self) {
        let told: Vec<bool> = self.solved.iter().map(|solved| !self.told(solved).is_empty()).collect();
        let mut told = told.into_iter();
        self.solved.retain(|_| !told.next().unwrap_or(false));
        self.alternatives.retain(|a| !a.told);
        self.heard.clear();
    }

    /// Adds the sets in which a channel is as the contact's sets say that it is. What the channel shows too much is no torque:
    /// where a set of the contact has such an error, the motor's balance has it too, and by the same numbers. These are the
    /// forms of what is heard, which of it stands together in a set, and all effects of which it is the contact that tells.
    pub fn tell(
        &mut self,
        forms: Vec<Alternative>,
        mut together: Vec<Vec<&'static str>>,
        heard: Vec<&'static str>,
    ) {
        let from = self.alternatives.len();
        let effects: Vec<&'static str> = forms.iter().map(|form| form.effect).collect();
        self.alternatives.extend(forms);
        self.heard = heard;
        let place = |effect: &&'static str| from + effects.iter().position(|e| e == effect).unwrap_or(0);
        together.sort();
        together.dedup();
        let mut sets: Vec<Vec<usize>> = Vec::new();
        for together in together.iter().filter(|together| !together.is_empty()) {
            for own in self.solved.iter().enumerate().filter(wanted).map(|(_, solved)| &solved.set) {
                let apart = own.iter().all(|a| !together.contains(&self.alternatives[*a].effect));
                if apart && own.len() + together.len() <= MOST_CAUSES {
                    sets.push(own.iter().copied().chain(together.iter().map(place)).collect());
                }
            }
        }
        let solve = |set: &Vec<usize>| self.balance.solve(&self.alternatives, set);
        let solved: Vec<Solved> = sets.par_iter().map(solve).collect();
        self.solved.extend(solved);
    }

    /// What each alternative of a set does, the others fitted again without it, once the sensors have shown the errors that they
    /// may have. A large cause with the shape of such an error would be taken for one where its rows outweigh what is known of
    /// the sensor, and a small one is none that a sensor may make.
    fn contributions(&self, solved: &Solved) -> Vec<Contribution> {
        let own = |a: &usize| {
            let set: Vec<usize> = solved.set.iter().copied().filter(|b| b != a).collect();
            let known = self.solved.iter().find(|other| other.set == set);
            let without =
                known.map_or_else(|| Cow::Owned(self.balance.solve(&self.alternatives, &set)), Cow::Borrowed);
            let of_sensors = self.balance.possible_errors(&without.p);
            let [with, without] = [solved, &without]
                .map(|solved| self.balance.left_beside_errors(&of_sensors, &self.alternatives, solved));
            rest::contribution(&self.balance, self.alternatives[*a].effect, &with, &without)
        };
        solved.set.iter().map(own).collect()
    }

    /// RMS of the difference of what two sets predict without the errors of the sensors, relative to the efforts: an error that
    /// does what a cause would is a difference.
    pub fn apart(&self, a: usize, b: usize) -> f64 {
        let [a, b] = [a, b].map(|place| self.balance.left_by_causes(&self.solved[place]));
        self.balance.difference(&a, &b) / self.balance.scale.max(1e-12)
    }

    /// Effects of a set of which each log has values of its own.
    pub fn of_each_log(&self, place: usize) -> Vec<&'static str> {
        let forms = self.solved[place].forms(&self.alternatives).map(|(form, _)| form);
        forms.filter(|form| form.is_of_each_log()).map(|form| form.effect).collect()
    }

    /// What a set leaves, where slow noise of the friction bridge makes this variance of a block's mean.
    pub fn rest(&self, place: usize, of_bridge: f64) -> Rest {
        let none = self.solved.iter().find(|s| s.set.is_empty());
        let solved = &self.solved[place];
        rest::of_balance(
            &self.balance,
            &solved.residual,
            none.map(|s| s.residual.as_slice()),
            solved.set.len(),
            of_bridge,
            &self.coordinates,
        )
    }
}

/// Whether a set enters the table.
fn wanted((place, solved): &(usize, &Solved)) -> bool {
    *place < CANDIDATES || solved.set.len() < 2
}

/// What the drive makes of what the contact says of the friction channel.
pub fn heard_by_drive(heard: &[Heard], logs: &[DriveLog]) -> Vec<Alternative> {
    let filtered = |error_nm: &ChannelError| -> Vec<f64> {
        logs.iter().zip(error_nm).flat_map(|(log, error_nm)| log.filtered(error_nm)).collect()
    };
    heard.iter().map(|heard| heard.form(filtered)).collect()
}

/// What the normal-load actuator makes of what the contact says of the normal channel.
pub fn heard_by_normal_load(heard: &[Heard], logs: &[NormalLoadLog], rig: &RigFile) -> Vec<Alternative> {
    let torque = |error_n: &ChannelError| -> Vec<f64> {
        let of_log = |(log, error_n): (&NormalLoadLog, &Vec<f64>)| log.filtered(error_n);
        logs.iter().zip(error_n).flat_map(of_log).map(|n| n / rig.lever_gain_n_per_nm).collect()
    };
    heard.iter().map(|heard| heard.form(torque)).collect()
}

/// The drive's balance of these logs, searched.
pub fn search_drive(logs: &[DriveLog], prior: &DrivePrior, rotary: bool) -> Linear {
    let scales = DriveScales::new(logs);
    let mut balance = drive::balance(logs, prior, &scales);
    let inertia = balance.solve(&[], &[]).p[drive::INERTIA];
    let propose = |balance: &Balance, company: Company<'_>, wanted: &(dyn Fn(&str) -> bool + Sync)| {
        let view = DriveView {
            logs,
            scales: &scales,
            balance,
            company,
            rotary,
            inertia,
            fixed: None,
            bearing: None,
        };
        LIBRARY.par_iter().filter(|e| wanted(e.id())).flat_map(|effect| effect.drive(&view)).collect()
    };
    let (alternatives, solved) = balance::search(&mut balance, &propose, MOST_CAUSES);
    let shown = drive::shown_response(&balance, logs);
    let found = Linear {
        balance,
        alternatives,
        solved,
        coordinates: drive::coordinates(logs, rotary),
        unit: if rotary { "N m" } else { "N" },
        drive_scales: Some(scales),
        inertia,
        normal_load_scales: None,
        heard: Vec::new(),
    };
    match shown {
        Some(response) => found.weighed_by(response),
        None => found,
    }
}

/// Inertia or mass by a first balance through the widest filter: it says how narrow the filter may be.
///
/// # Errors
/// Where a column is missing.
pub fn drive_inertia(logs: &[Log]) -> Result<f64, InputError> {
    let logs = logs.iter().map(|log| DriveLog::new(log, f64::INFINITY)).collect::<Result<Vec<_>, _>>()?;
    let balance = drive::balance(&logs, &DrivePrior::default(), &DriveScales::new(&logs));
    Ok(balance.solve(&[], &[]).p[drive::INERTIA].max(0.0))
}

/// What the drive is known to be by the rig file.
pub fn drive_prior(rig: &RigFile) -> DrivePrior {
    DrivePrior {
        inertia: Some(rig.m2_inertia_kg_m2),
        coulomb: Some(rig.bearing_coulomb_nm),
        viscous: Some(rig.bearing_viscous_nm_s_per_rad),
        bridge_zero: Some(bridge_zero::standard_deviations(rig)[0]),
    }
}

/// The normal-load actuator's balance of these logs, searched.
pub fn search_normal_load(logs: &[NormalLoadLog], rig: &RigFile) -> Linear {
    let scales = NormalLoadScales::new(logs);
    let mut balance = normal_load::balance(logs, rig, &scales);
    let propose = |balance: &Balance, company: Company<'_>, wanted: &(dyn Fn(&str) -> bool + Sync)| {
        let view = NormalLoadView { logs, scales: &scales, balance, company, fixed: None };
        LIBRARY.par_iter().filter(|e| wanted(e.id())).flat_map(|effect| effect.normal_load(&view)).collect()
    };
    let (alternatives, solved) = balance::search(&mut balance, &propose, MOST_CAUSES);
    Linear {
        balance,
        alternatives,
        solved,
        coordinates: normal_load::coordinates(logs),
        unit: "N m",
        drive_scales: None,
        inertia: 0.0,
        normal_load_scales: Some(scales),
        heard: Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::identify::balance::tests::white_log;
    use crate::identify::noise::tests::white;
    use crate::identify::term::Parameter;

    const ROWS: usize = 4000;

    /// A drive whose response is the error of a channel, and noise.
    fn drive(error_nm: &[f64]) -> (Balance, [DriveLog; 1]) {
        let still = vec![0.0; ROWS];
        let grid = crate::identify::grid::Grid::new(&(0..ROWS).map(|i| 1e-3 * i as f64).collect::<Vec<_>>());
        let log = DriveLog::made(
            String::new(),
            grid,
            still.clone(),
            still.clone(),
            Some(still.clone()),
            None,
            vec![true; ROWS],
            0.02,
        );
        let noise = white(ROWS, 3);
        let response = log.filtered(error_nm).iter().zip(&noise).map(|(e, n)| 0.01 * n - e).collect();
        let swing = (0..ROWS).map(|i| (0.01 * i as f64).sin()).collect();
        let balance = Balance::new(
            response,
            vec![(Parameter::amplitude("swing", 1.0), swing)],
            &[white_log(ROWS, 0.01)],
            1.0,
        );
        (balance, [log])
    }

    /// What a drive gains by an error that it hears of, and the values of the form.
    fn heard(shown_nm: &[f64], error_nm: &[f64], open_nm: &[&[f64]]) -> (f64, Vec<f64>) {
        let (balance, logs) = drive(shown_nm);
        let open = open_nm.iter().map(|open_nm| vec![open_nm.to_vec()]).collect();
        let heard = [Heard { effect: "channel", error: vec![error_nm.to_vec()], open }];
        let form = &heard_by_drive(&heard, &logs)[0];
        let [none, with] = [&[][..], &[form]].map(|forms| balance.solve_forms(forms));
        (with.log_evidence - none.log_evidence, with.p[1..].to_vec())
    }

    #[test]
    fn an_error_that_is_told_is_as_large_as_it_is_told_or_costs_evidence() {
        let error_nm: Vec<f64> = (0..ROWS).map(|i| 0.3 * (0.004 * i as f64).cos()).collect();
        let times = |factor: f64| error_nm.iter().map(|e| factor * e).collect::<Vec<f64>>();
        // The channel shows what the motor does not bear, and so by a tenth less; the motor bears it all.
        for factor in [1.0, 0.9] {
            let (gained, p) = heard(&times(factor), &error_nm, &[]);
            assert!(gained > -LOG_PRIOR && (p[0] - (factor - 1.0)).abs() < 0.01, "{factor}: {gained} {p:?}");
        }
        let (gained, _) = heard(&times(0.0), &error_nm, &[]);
        assert!(gained < LOG_PRIOR, "{gained}");
    }

    #[test]
    fn a_course_that_the_contact_leaves_open_is_found_where_the_motor_bears_it() {
        let error_nm: Vec<f64> = (0..ROWS).map(|i| 0.3 * (0.004 * i as f64).cos()).collect();
        let open_nm: Vec<f64> = (0..ROWS).map(|i| 0.05 * (0.007 * i as f64).sin()).collect();
        let shown_nm: Vec<f64> = error_nm.iter().zip(&open_nm).map(|(e, open)| e - 1.5 * open).collect();
        let (closed, _) = heard(&shown_nm, &error_nm, &[]);
        let (gained, p) = heard(&shown_nm, &error_nm, &[&open_nm]);
        assert!(gained > closed - LOG_PRIOR && (p[1] + 1.5).abs() < 0.05, "{gained} {closed} {p:?}");
    }

    #[test]
    fn a_channel_that_does_not_ring_has_to_answer_for_what_it_shows_of_ringing() {
        let ringing_nm: Vec<f64> = (0..ROWS).map(|i| 0.3 * (0.2 * i as f64).cos()).collect();
        // The response has nothing of it: the channel's torque is that behind the ring.
        let (balance, [log]) = drive(&vec![0.0; ROWS]);
        assert!(drive::shown_response(&balance, std::slice::from_ref(&log)).is_none());
        let logs = [DriveLog { ringing: Some(ringing_nm.clone()), ..log }];
        let response = drive::shown_response(&balance, &logs).expect("it was taken off");
        let told = Heard { effect: "channel", error: vec![ringing_nm], open: Vec::new() };
        let [none, ring] = [Vec::new(), heard_by_drive(&[told], &logs)];
        let evidence = |balance: &Balance, forms: &[Alternative]| {
            balance.solve_forms(&forms.iter().collect::<Vec<_>>()).log_evidence
        };
        let behind = evidence(&balance, &none);
        let shown = balance.with_response(response);
        let [with, without] = [&ring, &none].map(|forms| behind - evidence(&shown, forms));
        // The form costs what is known of its size.
        assert!(with < -LOG_PRIOR && without > 100.0 * with, "{with} {without}");
    }
}
