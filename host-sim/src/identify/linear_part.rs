//! A balance that is linear in its parameters, searched: the drive's and the normal-load actuator's.

use super::balance::{self, Alternative, Balance, Company, Solved};
use super::drive::{self, DriveLog, DrivePrior, DriveScales};
use super::effects::{DriveView, LIBRARY, NormalLoadView};
use super::law_form::LAW_FORM;
use super::normal_load::{self, NormalLoadLog, NormalLoadScales};
use super::rest::{self, Contribution, Rest};
use super::table::{Candidate, MOST_CAUSES};
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
    /// RMS of the response over its rows.
    pub signal: f64,
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
        let wanted = |(place, solved): &(usize, &Solved)| *place < CANDIDATES || solved.set.len() < 2;
        let of_set = |(place, solved): (usize, &Solved)| {
            let names = solved.set.iter().map(|a| self.alternatives[*a].effect);
            let effects = names.zip(self.contributions(solved)).map(|(effect, own)| (effect, LAW_FORM, own));
            Candidate::new(place, solved.log_evidence, effects)
        };
        self.solved.iter().enumerate().filter(wanted).map(of_set).collect()
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
            &self.coordinates,
        )
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
    let signal = balance.rms(&balance.response);
    Linear {
        balance,
        alternatives,
        solved,
        signal,
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
    let signal = balance.rms(&balance.response);
    Linear {
        balance,
        alternatives,
        solved,
        signal,
        coordinates: normal_load::coordinates(logs),
        unit: "N m",
        drive_scales: None,
        normal_load_scales: Some(scales),
    }
}
