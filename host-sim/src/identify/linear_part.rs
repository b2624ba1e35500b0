//! A balance that is linear in its parameters, searched: the drive's and the normal-load actuator's.

use rayon::prelude::*;

use super::balance::{self, Alternative, Balance, Company, Solved};
use super::contact_part::ContactPart;
use super::drive::{self, DriveLog, DrivePrior, DriveScales};
use super::effects::{DriveView, LIBRARY, NormalLoadView};
use super::law_form::LAW_FORM;
use super::normal_load::{self, NormalLoadLog, NormalLoadScales};
use super::rest::{self, Contribution, Rest};
use super::table::{Candidate, MOST_CAUSES};
use super::term::Parameter;
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
    /// Scales of the normal-load actuator's columns.
    pub normal_load_scales: Option<NormalLoadScales>,
}

impl Linear {
    /// The best sets and all single causes, for the table.
    pub fn candidates(&self) -> Vec<Candidate> {
        let wanted = |own: &(usize, &Solved)| wanted(own) || !self.told(own.1).is_empty();
        let of_set = |(place, solved): (usize, &Solved)| {
            let names = solved.set.iter().map(|a| self.alternatives[*a].effect);
            let effects = names.zip(self.contributions(solved)).map(|(effect, own)| (effect, LAW_FORM, own));
            Candidate { told: self.told(solved), ..Candidate::new(place, solved.log_evidence, effects) }
        };
        self.solved.iter().enumerate().filter(wanted).map(of_set).collect()
    }

    /// Effects of a set that are told by another balance.
    fn told(&self, solved: &Solved) -> Vec<&'static str> {
        let told = solved.set.iter().map(|a| &self.alternatives[*a]).filter(|a| a.told);
        let mut told: Vec<&'static str> = told.map(|a| a.effect).collect();
        told.sort_unstable();
        told
    }

    /// Adds the sets in which the friction channel is as the contact's sets say that it is. What the channel shows too much is
    /// no torque: where a set of the contact has such an error, the drive has it too, and by the same numbers.
    pub fn tell(&mut self, logs: &[DriveLog], contact: &ContactPart) {
        let errors = contact.channel_errors(&contact.logs, true);
        let from = self.alternatives.len();
        self.alternatives.extend(errors.iter().map(|(effect, error_nm)| told(effect, logs, error_nm)));
        let effects: Vec<&'static str> = errors.iter().map(|(effect, _)| *effect).collect();
        let place = |effect: &&'static str| from + effects.iter().position(|e| e == effect).unwrap_or(0);
        let mut sets: Vec<Vec<usize>> = Vec::new();
        for together in contact.together(&effects).iter().filter(|together| !together.is_empty()) {
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

    /// What each alternative of a set does, the others fitted again without it.
    fn contributions(&self, solved: &Solved) -> Vec<Contribution> {
        let own = |a: &usize| {
            let set: Vec<usize> = solved.set.iter().copied().filter(|b| b != a).collect();
            let without = self.balance.solve(&self.alternatives, &set);
            rest::contribution(&self.balance, &solved.residual, &without.residual)
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
            &self.coordinates,
        )
    }
}

/// Whether a set enters the table.
fn wanted((place, solved): &(usize, &Solved)) -> bool {
    *place < CANDIDATES || solved.set.len() < 2
}

/// An error of the friction channel as the contact's balance tells it, which is known there as well as a law is.
pub fn told(effect: &'static str, logs: &[DriveLog], error_nm: &[Vec<f64>]) -> Alternative {
    let error: Vec<f64> = logs.iter().zip(error_nm).flat_map(|(log, error)| log.filtered(error)).collect();
    let more = Parameter { amplitude: false, ..Parameter::amplitude("told_too_small", LAW_FORM) };
    let column = error.iter().map(|e| -e).collect();
    Alternative {
        form: "as the contact tells it".into(),
        response: Some(error),
        told: true,
        ..Alternative::columns(effect, vec![more], vec![column])
    }
}

/// The drive's balance of these logs, searched.
pub fn search_drive(logs: &[DriveLog], prior: &DrivePrior, rotary: bool) -> Linear {
    let scales = DriveScales::new(logs);
    let mut balance = drive::balance(logs, prior, &scales);
    let inertia = balance.solve(&[], &[]).p[drive::INERTIA];
    let propose = |balance: &Balance, company: Company<'_>, wanted: &dyn Fn(&str) -> bool| {
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
        LIBRARY.iter().filter(|e| wanted(e.id())).flat_map(|effect| effect.drive(&view)).collect()
    };
    let (alternatives, solved) = balance::search(&mut balance, &propose, MOST_CAUSES);
    Linear {
        balance,
        alternatives,
        solved,
        coordinates: drive::coordinates(logs, rotary),
        unit: if rotary { "N m" } else { "N" },
        drive_scales: Some(scales),
        normal_load_scales: None,
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
    }
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
    Linear {
        balance,
        alternatives,
        solved,
        coordinates: normal_load::coordinates(logs),
        unit: "N m",
        drive_scales: None,
        normal_load_scales: Some(scales),
    }
}
