//! The whole diagnosis, from logs to the files' contents.

use super::component::Drawn;
use super::extended_model::{self, Values};
use super::holdout;
use super::judge::{Judgement, judge};
use super::page;
use super::results::{Diagnosis, Found};
use super::table::Part;
use crate::files::log::Log;
use crate::files::model_file::ModelFile;
use crate::files::rig_file::RigFile;
use crate::input_error::InputError;
use crate::report::Page;

/// What is written.
pub struct Written {
    /// `diagnosis.json`.
    pub diagnosis: Diagnosis,
    /// `model-extended.toml`.
    pub model: String,
    /// `report.html`.
    pub page: Page,
    /// What it was made from.
    pub judgement: Judgement,
}

/// Share of each training log that is held out where no log is.
const HELD_OUT_SHARE: f64 = 0.3;

/// Diagnoses. Where no log is held out, the last part of each training log is.
///
/// # Errors
/// Where logs cannot be used together, or a held-out log is a training log.
pub fn diagnose(
    train: &[Log],
    holdout: &[Log],
    rig: &RigFile,
    model: &ModelFile,
    wall_s: &dyn Fn() -> f64,
    progress: &(dyn Fn(&str) + Sync),
) -> Result<Written, InputError> {
    for log in holdout {
        if let Some(same) = train.iter().find(|t| t.columns == log.columns) {
            return Err(InputError::new(format!("is the same log as {} of --train", same.source))
                .file(log.source.as_str())
                .key("--holdout")
                .allowed("a log that nothing is fitted to"));
        }
    }
    let (mut parts, mut notes) = ((train.to_vec(), holdout.to_vec()), Vec::new());
    if holdout.is_empty() {
        parts = train.iter().map(|log| log.split(1.0 - HELD_OUT_SHARE)).unzip();
        notes.push(format!("no log is held out: the last {:.0} % of each log are", 100.0 * HELD_OUT_SHARE));
    }
    let (train, holdout) = (&parts.0, &parts.1);
    let mut judgement = judge(train, rig, model, progress)?;
    judgement.notes.splice(0..0, notes);
    progress("held-out logs");
    let on_train = holdout::errors(&judgement, train, rig, true)?;
    let on_holdout = holdout::errors(&judgement, holdout, rig, false)?;
    let (mut values, mut drawn) = (Values::new(), Vec::new());
    for (part, linear) in [(Part::Drive, &judgement.drive), (Part::Pressure, &judgement.normal_load)] {
        if let (Some(linear), Some(place)) = (linear, judgement.place(part)) {
            values.extend(extended_model::linear_values(linear, place));
            drawn.push(Drawn::of_balance(part, linear, place));
        }
    }
    extended_model::add_amplitudes(&mut values);
    let text = match &judgement.contact {
        Some(contact) => {
            progress("extended model");
            let place = judgement.place(Part::Friction).unwrap_or(0);
            let mut extended = extended_model::contact(contact, place, model)?;
            if contact.disc_cause.is_none() {
                extended = extended.fitted(model, rig, train, &|| ());
            }
            let text = extended.model.to_toml()
                + &extended_model::remarks_of_contact(&extended.model, &extended.values)
                + &extended_model::remarks(&judgement);
            values.extend(extended.values);
            drawn.insert(0, Drawn::of_contact(contact, &extended.laws));
            text
        }
        None => extended_model::drive_text(&judgement),
    };
    let kind = if judgement.contact.is_some() { model.kind.name() } else { "drive" };
    let found =
        Found { judgement: &judgement, kind, values: &values, train: &on_train, holdout: &on_holdout };
    let diagnosis = Diagnosis::new(&found, wall_s());
    let page = page::page(&diagnosis, &drawn, &on_holdout);
    Ok(Written { diagnosis, model: text, page, judgement })
}
