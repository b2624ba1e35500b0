//! Friction torque one step ahead: the friction law at the slip that is observed from the measured force.
//!
//! A simulation driven with the motion alone may slip at other instants than the rig did, and then its error says more of
//! the instants than of the law. Here the element's deformation is taken from the measured force, sample by sample
//! ([`crate::identify::contact::observer`]); what is predicted is what law and block make of it. It is computed on the
//! engine's grid of about 1 ms and interpolated to the log's samples.
//! Left out: effects that extend the model.

use crate::files::log::Log;
use crate::files::model_file::ModelFile;
use crate::files::rig_file::RigFile;
use crate::fit::drive::record::interpolate;
use crate::identify::contact::baseline;
use crate::identify::contact::log::ContactLog;
use crate::identify::contact::problem::{Baseline, Problem};
use crate::input_error::InputError;

/// Column of the prediction.
pub const COLUMN: &str = "predicted_by_observed_slip";

/// The prediction at the log's samples, N m.
///
/// # Errors
/// Where the log is none of a contact.
pub fn predict_by_observed_slip(model: &ModelFile, rig: &RigFile, log: &Log) -> Result<Vec<f64>, InputError> {
    let baseline = Baseline { free: Vec::new(), ..baseline::baseline(model, baseline::KNOWN_WITHIN) };
    let logs = [ContactLog::new(log, rig)?.seen_through(&baseline.numbers)];
    let shown = Problem::new(&logs, &baseline, &[]).predict(&[], &[]).shown_nm;
    let grid = &logs[0].grid;
    let times_s: Vec<f64> = grid.time_s.iter().map(|t| t + grid.start_s).collect();
    let signals = log.contact()?;
    Ok(match times_s.len() {
        0 | 1 => signals.friction_torque_nm.to_vec(),
        _ => interpolate(&times_s, &shown, signals.time_s),
    })
}
