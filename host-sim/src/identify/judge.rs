//! Everything put together: contact, drive and press searched, then one table over what they found.

use crate::files::log::{Log, LogKind};
use crate::files::model_file::ModelFile;
use crate::files::rig_file::RigFile;
use crate::input_error::InputError;

use super::balance::{self, Alternative, Balance, Solved};
use super::contact::baseline;
use super::contact::change::ContactTerm;
use super::contact::log::ContactLog;
use super::contact::problem::{Baseline, Problem};
use super::contact::search::{self, Found};
use super::drive::{self, DriveLog, DrivePrior, DriveScales};
use super::effects::coordinates::{Coordinates, Scales};
use super::effects::{ContactView, DriveView, LIBRARY, PressView};
use super::press::{self, PressLog, PressScales};

/// Sets of effects in the drive's and in the press's balance have at most so many.
const MOST_AT_ONCE: usize = 2;

/// A searched linear balance.
pub struct Searched {
    /// The balance, with its noise as refitted.
    pub balance: Balance,
    /// Forms of the effects.
    pub alternatives: Vec<Alternative>,
    /// Sets, best first.
    pub solved: Vec<Solved>,
}

/// The contact, searched.
pub struct SearchedContact {
    /// Logs.
    pub logs: Vec<ContactLog>,
    /// Baseline.
    pub baseline: Baseline,
    /// Forms of the effects.
    pub terms: Vec<ContactTerm>,
    /// Sets, best first.
    pub found: Found,
}

fn view_terms(
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
pub fn search_drive(logs: &[DriveLog], prior: &DrivePrior, rotary: bool) -> Searched {
    let scales = DriveScales::new(logs);
    let mut balance = drive::balance(logs, prior, &scales);
    let base = balance.solve(&[], &[]);
    let inertia = base.p[drive::INERTIA];
    let view =
        DriveView { logs, scales: &scales, balance: &balance, residual: &base.residual, rotary, inertia };
    let alternatives: Vec<Alternative> = LIBRARY.iter().flat_map(|effect| effect.drive(&view)).collect();
    let solved = balance::search(&mut balance, &alternatives, MOST_AT_ONCE);
    Searched { balance, alternatives, solved }
}

/// The press's balance of these logs, searched.
pub fn search_press(logs: &[PressLog], rig: &RigFile) -> Searched {
    let scales = PressScales::new(logs);
    let mut balance = press::balance(logs, rig, &scales);
    let base = balance.solve(&[], &[]);
    let view = PressView { logs, scales: &scales, balance: &balance, residual: &base.residual };
    let alternatives: Vec<Alternative> = LIBRARY.iter().flat_map(|effect| effect.press(&view)).collect();
    let solved = balance::search(&mut balance, &alternatives, MOST_AT_ONCE);
    Searched { balance, alternatives, solved }
}

/// What the drive is known to be by the rig file.
pub fn drive_prior(rig: &RigFile) -> DrivePrior {
    DrivePrior {
        inertia: Some(rig.m2_inertia_kg_m2),
        coulomb: Some(rig.bearing_coulomb_nm),
        viscous: Some(rig.bearing_viscous_nm_s_per_rad),
    }
}
