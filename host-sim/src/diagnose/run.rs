//! A whole diagnosis: logs in, judged subsystems out.

use std::sync::Arc;

use super::analysis::{Analysis, Role};
use super::contact::ContactAnalysis;
use super::coordinates::Coordinates;
use super::drive::DriveAnalysis;
use super::pressure::PressureAnalysis;
use super::selection::select;
use super::shadows::settle;
use super::verdict::{Judged, Verdict, judge};
use crate::files::effect_id::{Subsystem, subsystem_of};
use crate::files::log::{Cells, Log, LogKind};
use crate::files::model_file::ModelFile;
use crate::files::rig_file::RigFile;
use crate::files::signal::Signal;
use crate::fit::drive::record::interpolate;
use crate::input_error::InputError;

/// Part of a log that is held out where no log is.
const HELD_OUT_SHARE: f64 = 0.3;

/// Logs with what is known about the rig, and the analyses that look at them.
pub struct Case {
    /// Training logs first.
    pub logs: Vec<(Log, Role)>,
    /// What was decided about them.
    pub notes: Vec<String>,
    /// The subsystems.
    pub analyses: Vec<Arc<dyn Analysis>>,
    /// The contact among them, which writes a model file.
    pub contact: Option<Arc<ContactAnalysis>>,
    drive: Option<Arc<DriveAnalysis>>,
    rig: RigFile,
    model: ModelFile,
}

/// What a case came to.
pub struct Outcome {
    /// The subsystems.
    pub judged: Vec<Judged>,
    /// What was decided on the way.
    pub notes: Vec<String>,
    /// The contact as it was judged at last.
    pub contact: Option<Arc<ContactAnalysis>>,
}

impl Case {
    /// Prepares the analyses. Where no log is held out, the end of each training log is.
    pub fn new(
        train: Vec<Log>,
        holdout: Vec<Log>,
        rig: &RigFile,
        model: &ModelFile,
    ) -> Result<Self, InputError> {
        let mut notes = Vec::new();
        let all = || train.iter().chain(&holdout);
        let Some(first) = all().next() else { return Err(InputError::new("no log").key("--train")) };
        let kind = first.kind()?;
        for log in all() {
            if log.kind()? != kind {
                return Err(InputError::new("another kind of log than the first")
                    .file(log.source.as_str())
                    .allowed(format!("logs with the columns of {}", first.source)));
            }
        }
        let mut logs: Vec<(Log, Role)> = Vec::new();
        if holdout.is_empty() {
            notes.push(format!(
                "no log is held out: the last {:.0} % of each training log was not fitted to, and stands for one",
                100.0 * HELD_OUT_SHARE
            ));
            let parts: Vec<(Log, Log)> = train.iter().map(split).collect();
            logs.extend(parts.iter().map(|(start, _)| (start.clone(), Role::Train)));
            logs.extend(parts.into_iter().map(|(_, end)| (end, Role::Holdout)));
        } else {
            logs.extend(train.into_iter().map(|log| (log, Role::Train)));
            logs.extend(holdout.into_iter().map(|log| (log, Role::Holdout)));
        }
        let mut case = Self {
            logs,
            notes,
            analyses: Vec::new(),
            contact: None,
            drive: None,
            rig: rig.clone(),
            model: model.clone(),
        };
        case.analyse(kind, rig, model)?;
        Ok(case)
    }

    /// Fits that a diagnosis is likely to take, for a progress bar.
    pub fn expected_fits(&self) -> u64 {
        self.analyses.iter().map(|a| 1 + 3 * a.candidates().len() as u64).sum()
    }

    /// Fits, compares and judges; subsystems that cannot be fitted become notes.
    pub fn judge(&self, told: &(dyn Fn(&str) + Sync)) -> Outcome {
        let coordinates: Vec<Coordinates> = self.logs.iter().map(|(log, _)| Coordinates::new(log)).collect();
        let mut outcome =
            Outcome { judged: Vec::new(), notes: self.notes.clone(), contact: self.contact.clone() };
        let mut drive = self.drive.clone();
        for analysis in &self.analyses {
            let mut analysis = analysis.clone();
            if analysis.subsystem() == Subsystem::Drive
                && let Some(corrected) = outcome.judged.first().and_then(|contact| self.drive_behind(contact))
            {
                outcome.notes.push(
                    "drive: the friction torque was corrected for what the friction channel adds".into(),
                );
                drive = Some(corrected.clone());
                analysis = corrected;
            }
            match select(analysis.as_ref(), told) {
                Ok(selection) => outcome.judged.push(judge(analysis, selection, &coordinates)),
                Err(why) => {
                    outcome.notes.push(format!("{}: not analysed: {why}", analysis.subsystem().name()));
                }
            }
        }
        let mut repaired = None;
        if let Some(drive) = drive
            && let Some(contact) = self.contact_on_the_disc(&outcome.judged, &drive)
            && let Ok(selection) = select(contact.as_ref(), told)
            && let Some(first) = outcome.judged.first_mut()
        {
            outcome.notes.push(
                "friction: the disc's angle was corrected for what the drive puts between disc and encoder"
                    .into(),
            );
            repaired = Some(first.structured_before());
            *first = judge(contact.clone(), selection, &coordinates);
            outcome.contact = Some(contact);
        }
        let notes = settle(&mut outcome.judged, outcome.contact.as_deref(), repaired);
        outcome.notes.extend(notes);
        outcome
    }

    /// The contact under the disc's own motion, where the drive is known to take disc and encoder apart.
    fn contact_on_the_disc(&self, judged: &[Judged], drive: &DriveAnalysis) -> Option<Arc<ContactAnalysis>> {
        self.contact.as_ref()?;
        let part = judged.iter().find(|part| part.analysis.subsystem() == Subsystem::Drive)?;
        let offsets = match part.verdict {
            Verdict::Named => drive.disc_offsets(&part.selection.chosen)?,
            _ => return None,
        };
        let mut logs = self.logs.clone();
        for ((log, _), offset) in logs.iter_mut().zip(&offsets) {
            let start_s = log.time_s().first().copied().unwrap_or(0.0);
            let times: Vec<f64> = log.time_s().iter().map(|t| t - start_s).collect();
            for (signal, values) in
                [(Signal::M2Angle, &offset.angle_rad), (Signal::M2Speed, &offset.speed_rad_s)]
            {
                let Some(shown) = log.signal(signal) else { continue };
                let more = interpolate(&offset.time_s, values, &times);
                let own = shown.iter().zip(&more).map(|(shown, more)| shown + more).collect();
                log.set_signal(signal, own);
            }
        }
        let logs: Vec<(&Log, Role)> = logs.iter().map(|(log, role)| (log, *role)).collect();
        ContactAnalysis::new(&self.rig, &self.model, &logs).ok().map(Arc::new)
    }

    /// The drive under the friction torque itself, where the channel that measures it is known to be wrong.
    fn drive_behind(&self, contact: &Judged) -> Option<Arc<DriveAnalysis>> {
        let analysis = self.contact.as_ref()?;
        let measured = |cause: &&'static str| subsystem_of(cause) == Some(Subsystem::Measurement);
        if contact.verdict != Verdict::Named || !contact.selection.chosen.iter().any(measured) {
            return None;
        }
        let excess = analysis.shown_in_excess(contact.result()?).ok()?;
        let mut logs = self.logs.clone();
        for ((log, _), (time_s, excess)) in logs.iter_mut().zip(&excess) {
            let start_s = log.time_s().first().copied().unwrap_or(0.0);
            let times: Vec<f64> = log.time_s().iter().map(|t| t - start_s).collect();
            let excess = interpolate(time_s, excess, &times);
            let shown = log.signal(Signal::FrictionTorque)?;
            let torque = shown.iter().zip(&excess).map(|(shown, excess)| shown - excess).collect();
            log.set_signal(Signal::FrictionTorque, torque);
        }
        let logs: Vec<(&Log, Role)> = logs.iter().map(|(log, role)| (log, *role)).collect();
        DriveAnalysis::new(&logs).ok().map(Arc::new)
    }

    fn analyse(&mut self, kind: LogKind, rig: &RigFile, model: &ModelFile) -> Result<(), InputError> {
        let logs: Vec<(&Log, Role)> = self.logs.iter().map(|(log, role)| (log, *role)).collect();
        let mut notes = Vec::new();
        if kind == LogKind::Contact {
            let contact = Arc::new(ContactAnalysis::new(rig, model, &logs)?);
            self.analyses.push(contact.clone());
            self.contact = Some(contact);
            match PressureAnalysis::new(rig, &logs) {
                Ok(Some(press)) => self.analyses.push(Arc::new(press)),
                Ok(None) => notes.push("pressure: not analysed: a log has no torque of M1".into()),
                Err(why) => notes.push(format!("pressure: not analysed: {why}")),
            }
        }
        if kind != LogKind::Contact || logs.iter().all(|(log, _)| log.drive().is_ok()) {
            match DriveAnalysis::new(&logs) {
                Ok(drive) => {
                    let drive = Arc::new(drive);
                    self.analyses.push(drive.clone());
                    self.drive = Some(drive);
                }
                Err(why) => notes.push(format!("drive: not analysed: {why}")),
            }
        }
        if self.analyses.is_empty() {
            return Err(InputError::new(notes.join("; ")).file(self.logs[0].0.source.as_str()));
        }
        self.notes.extend(notes);
        Ok(())
    }
}

/// Start and end of a log as two logs.
fn split(log: &Log) -> (Log, Log) {
    let cut = ((1.0 - HELD_OUT_SHARE) * log.len() as f64).round() as usize;
    let part = |from: usize, to: usize| {
        let mut part = log.clone();
        for column in &mut part.columns {
            match &mut column.cells {
                Cells::Numbers(values) => *values = values[from..to].to_vec(),
                Cells::Text(values) => *values = values[from..to].to_vec(),
            }
        }
        part
    };
    (part(0, cut), part(cut, log.len()))
}
