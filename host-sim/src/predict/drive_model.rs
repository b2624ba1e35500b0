//! Torque or force of a drive on its own, from its motion, by a model file of `kind = "drive"`.
//!
//! u = M q̈ + Fv q̇ + Fc sign(q̇) + offset, on the grid and through the filters of [`crate::fit::drive::inverse`]: an
//! integrating plant is judged by the force that its motion asks for. Effects that are a force over position and speed, or
//! a delay, are applied; what needs a second mass, or an origin that every log has for itself, is named and left out.

use crate::files::drive_model::{DriveModel, DriveNumbers};
use crate::files::log::{Log, LogKind};
use crate::files::model_file::Extension;
use crate::fit::drive::inverse::{Comparison, Motion, predict};
use crate::fit::drive::record::{DriveRecord, FEWEST_SAMPLES};
use crate::identify::effects::{self, DriveLaw};
use crate::identify::filters::shifted;
use crate::input_error::InputError;

/// A drive's log predicted.
#[derive(Debug, Clone)]
pub struct DrivePrediction {
    /// By the file's model.
    pub main: Comparison,
    /// By its model with friction per direction, where it has one.
    pub per_direction: Option<Comparison>,
    /// Effects of the file that are not in this prediction.
    pub not_applied: Vec<String>,
}

/// What an effect of a file makes of the drive; `None` where it cannot be applied here.
fn applied(extension: &Extension) -> Option<DriveLaw> {
    // Names end in the unit of the drive.
    let value = |start: &str| {
        extension.parameters.iter().find(|(name, _)| name.starts_with(start)).map(|(_, value)| *value)
    };
    effects::with_id(&extension.id)?.drive_law(&value)
}

/// A drive log as an even record.
///
/// # Errors
/// Where a column is missing or there are too few samples.
pub fn record(log: &Log) -> Result<DriveRecord, InputError> {
    let signals = log.drive()?;
    DriveRecord::new(signals.time_s, signals.effort, signals.position).ok_or_else(|| {
        InputError::new(format!("{} samples", log.len()))
            .file(log.source.as_str())
            .allowed(format!("at least {FEWEST_SAMPLES} samples"))
    })
}

/// Predicts a drive log.
///
/// # Errors
/// A log of another kind, or too short for the filters.
pub fn predict_drive_log(model: &DriveModel, log: &Log) -> Result<DrivePrediction, InputError> {
    let wanted = match model.motion {
        Motion::Rotary => LogKind::RotaryDrive,
        Motion::Linear => LogKind::LinearDrive,
    };
    if log.kind()? != wanted {
        let columns = match model.motion {
            Motion::Rotary => "time_s, m2_torque_nm, m2_angle_rad",
            Motion::Linear => "time_s, force_n, position_m",
        };
        return Err(InputError::new(format!("no log of the drive in {}", model.source))
            .file(log.source.as_str())
            .allowed(format!("a log of {columns}, without contact columns")));
    }
    let mut record = record(log)?;
    let (mut efforts, mut late_s, mut not_applied) = (Vec::new(), 0.0, Vec::new());
    for extension in &model.extensions {
        match applied(extension) {
            Some(law) => {
                efforts.extend(law.effort);
                late_s += law.late_s;
            }
            None => not_applied.push(extension.id.clone()),
        }
    }
    // Motion follows its effort late: what an effort does now is seen in the motion to come.
    record.position = shifted(&record.position, late_s / record.step_s);
    let added = |v: f64| efforts.iter().map(|effort| effort(v)).sum();
    let by = |numbers: &DriveNumbers| {
        predict(&record, numbers.friction, &numbers.values, &added)
            .map_err(|why| InputError::new(why.to_string()).file(log.source.as_str()))
    };
    Ok(DrivePrediction {
        main: by(&model.main)?,
        per_direction: model.per_direction.as_ref().map(by).transpose()?,
        not_applied,
    })
}
