//! One experiment on the virtual bench, from power-on to the disarmed rig, over the serial link.

use crate::bench::{self, Outcome};
use crate::defmt_log::{self, DefmtLog};
use crate::elf::Firmware;
use crate::endpoint::Endpoint;
use crate::endpoint_link::perform;
use crate::error::BenchError;
use crate::full_rate;
use crate::meter::Ticks;
use crate::outside::{Action, PlantSide};
use crate::plant_side::HostPlant;
use crate::record::Record;
use host_sim::files::experiment_file::ExperimentFile;
use host_sim::files::log::Log;
use host_sim::files::model_file::ModelFile;
use host_sim::files::rig_file::RigFile;
use host_sim::link::ask::Ask;
use host_sim::link::capture::{Captured, ReadCapture};
use host_sim::link::client::Client;
use host_sim::link::run_experiment::{RunExperiment, RunOptions, RunRecord};
use host_sim::link::{model_upload, rows, words};
use host_sim::lockstep::control_settings;
use host_sim::plant::PlantParameters;
use host_sim::summary::phase_start_s;
use model_core::control::ControlSettings;
use rig_link::capture::CaptureTrigger;
use rig_link::message::Command;
use rig_link::model::{FrictionRecord, ModelRecord};
use rig_link::settings;
use rig_link::telemetry::TelemetryRow;
use serde::Serialize;

/// From power-on until the firmware surely listens: clocks, settings in flash, self-check of 0.1 s.
pub const BOOT_NS: u64 = 300_000_000;
/// How long the switch stays off before it is turned on.
const SWITCH_NS: u64 = 20_000_000;
/// The capture is triggered so long after the step: it then holds 0.1 s before it and 1.9 s after.
const CAPTURE_AFTER_S: f64 = 0.9;
/// Control ticks a second.
const TICK_HZ: u32 = 10_000;

/// What is run on what.
#[derive(Debug, Clone)]
pub struct Request {
    /// The experiment.
    pub experiment: ExperimentFile,
    /// The rig the plant is built from; the firmware gets what of it differs from its defaults as settings.
    pub rig: RigFile,
    /// The elements on the disc.
    pub model: ModelFile,
    /// The observer's model, uploaded where it differs from the firmware's own.
    pub observer: ModelFile,
    /// A contact patch in the observer in place of that model: no model file has this kind.
    pub patch_observer: bool,
    /// Read the capture of the full rate from the firmware's memory afterwards: 4 s more of virtual time.
    pub capture: bool,
}

impl Request {
    /// An experiment on the assumed rig with its assumed elements.
    ///
    /// # Errors
    /// There is no such experiment.
    pub fn assumed(experiment: &str) -> Result<Self, BenchError> {
        let model = ModelFile::read_or_assumed(None, &[])?;
        Ok(Self {
            experiment: ExperimentFile::named_or_read(experiment, &[])?,
            rig: RigFile::read_or_assumed(None, &[])?,
            observer: model.clone(),
            model,
            patch_observer: false,
            capture: true,
        })
    }

    /// The plant behind the pins.
    ///
    /// # Errors
    /// A parameter out of range.
    pub fn plant(&self) -> Result<HostPlant, BenchError> {
        let parameters = PlantParameters::from_files(&self.rig, &self.model, &self.experiment.plant);
        Ok(HostPlant::new(&parameters, self.experiment.seed)?)
    }

    /// Tick of the experiment at which the capture is triggered: it holds a second on either side. No later than the
    /// last row of the log, whose coming is the sign to trigger.
    fn capture_tick(&self, total: u32, every_ticks: u16) -> u32 {
        let start_s = phase_start_s(&self.experiment).unwrap_or_default();
        // The cast saturates.
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
        let tick = ((start_s + CAPTURE_AFTER_S) * f64::from(TICK_HZ)) as u32;
        tick.min(total.saturating_sub(u32::from(every_ticks)))
    }

    fn preparation(&self) -> Result<Vec<Command>, BenchError> {
        preparation(&self.rig, &self.observer, self.patch_observer)
    }
}

/// Requests that make the firmware know the rig and the observer's model.
pub(crate) fn preparation(
    rig: &RigFile,
    observer: &ModelFile,
    patch_observer: bool,
) -> Result<Vec<Command>, BenchError> {
    let (wanted, own) = (control_settings(rig, observer), ControlSettings::default());
    let mut commands: Vec<Command> = settings::ALL
        .iter()
        .filter(|info| info.get(&wanted).to_bits() != info.get(&own).to_bits())
        .map(|info| Command::SettingSet { key: info.key, value: info.get(&wanted) })
        .collect();
    let mut model = model_upload::record(observer)?;
    if patch_observer {
        model.friction = patch(&model.friction);
    }
    // What the firmware's observer runs without an upload.
    let resident = ModelRecord { friction: (&own.observer.model).into(), effects: heapless::Vec::new() };
    if model != resident {
        commands.push(Command::ModelSet(model));
    }
    Ok(commands)
}

/// A patch with the bristles of a series element: 10 mm long, under 88 N as stiff.
fn patch(friction: &FrictionRecord) -> FrictionRecord {
    friction.patch_like(0.01, 88.0).unwrap_or_else(|| friction.clone())
}

/// What the observer's model left unexplained of the friction torque, over the rows of the log.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct ObserverResidual {
    /// Root mean square of measured less predicted, N·m.
    pub rms_nm: f64,
    /// The same over the root mean square of the measured.
    pub nrmse: f64,
}

/// An experiment that was run.
#[derive(Debug)]
pub struct Done {
    /// What came over the link.
    pub run: RunRecord,
    /// The control ticks while it ran.
    pub ticks: Ticks,
    /// Two seconds at the full rate around the beginning of the phase the summary looks at; none after a fault.
    pub captured: Option<Captured>,
    /// The firmware's log.
    pub log: DefmtLog,
    /// The bench's record.
    pub record: Record,
}

impl Done {
    /// The log as the host tool writes it.
    #[must_use]
    pub fn csv(&self) -> Log {
        rows::log(&self.run.rows, &self.run.scale, rows::Zero::Experiment)
    }

    /// The log with the capture's friction and normal force in place of its own where there is one: what the
    /// summary is taken from, as a peak between two rows of the log would be missed by up to 2 %.
    ///
    /// # Errors
    /// The log lacks a column the summary needs.
    pub fn full_rate(&self) -> Result<Log, BenchError> {
        let log = self.csv();
        match (&self.captured, self.run.rows.first()) {
            (Some(captured), Some(first)) => {
                let start_tick = first.tick - u64::from(first.experiment_tick);
                full_rate::spliced(&log, captured, start_tick, self.run.scale.tick_hz)
            }
            _ => Ok(log),
        }
    }

    /// What the observer's model left unexplained.
    #[must_use]
    pub fn observer_residual(&self) -> ObserverResidual {
        let mean = |square: &dyn Fn(&TelemetryRow) -> f64| {
            self.run.rows.iter().map(square).sum::<f64>() / self.run.rows.len().max(1) as f64
        };
        let left = |row: &TelemetryRow| {
            f64::from(row.friction_torque_nm) - f64::from(row.predicted_friction_torque_nm)
        };
        let rms_nm = mean(&|row| left(row).powi(2)).sqrt();
        let measured_nm = mean(&|row| f64::from(row.friction_torque_nm).powi(2)).sqrt();
        ObserverResidual { rms_nm, nrmse: if measured_nm > 0.0 { rms_nm / measured_nm } else { 0.0 } }
    }

    /// A sentence for everything that must not be in a clean run.
    #[must_use]
    pub fn complaints(&self) -> Vec<String> {
        let health = self.run.health.unwrap_or_default();
        let counts = [
            (rows::missing(&self.run.rows), "telemetry rows are missing"),
            (u64::from(health.telemetry_lost), "telemetry rows found no room in the firmware"),
            (u64::from(self.run.frames_rejected), "frames came in damaged"),
            (u64::from(health.frames_rejected), "frames were thrown away by the firmware"),
            (u64::from(health.line_errors), "errors on the serial line"),
            (u64::from(health.events_lost), "events found no room in the firmware"),
            (u64::from(health.deadline_misses), "control ticks ended late by the firmware's count"),
            (u64::from(health.missed_scans), "scans came late or not at all"),
            (self.ticks.late, "control ticks ended late by the bench's count"),
            (u64::from(self.log.malformed), "frames of the log could not be decoded"),
            (self.log.missing_events(), "events are missing in the log"),
            (self.record.restarts.len() as u64, "restarts"),
        ];
        let mut complaints: Vec<String> = counts
            .into_iter()
            .filter(|(count, _)| *count > 0)
            .map(|(count, what)| format!("{count} {what}"))
            .collect();
        complaints.extend(self.run.fault_words().map(|words| format!("fault: {words}")));
        complaints
    }
}

/// Runs an experiment; `progress` gets the ticks done of all.
///
/// # Errors
/// Whatever kept it from its end. A fault of the rig ends it early and is no error: see [`Done::complaints`].
pub fn run(
    firmware: &Firmware,
    request: &Request,
    progress: impl FnMut(u32, u32) + Send,
) -> Result<Done, BenchError> {
    let plant = request.plant()?;
    run_with_plant(firmware, request, Box::new(plant), progress)
}

/// The same with another plant behind the pins than the request's.
///
/// # Errors
/// As [`run`].
pub fn run_with_plant(
    firmware: &Firmware,
    request: &Request,
    plant: Box<dyn PlantSide>,
    progress: impl FnMut(u32, u32) + Send,
) -> Result<Done, BenchError> {
    let outcome = bench::run(firmware, plant, |endpoint| operate(endpoint, request, progress))?;
    let Outcome { operator: Operated { run, ticks, captured }, record } = outcome;
    let log = defmt_log::decode(&firmware.bytes, &record.log)?;
    Ok(Done { run, ticks, captured, log, record })
}

fn operate(
    endpoint: &mut Endpoint,
    request: &Request,
    mut progress: impl FnMut(u32, u32),
) -> Result<Operated, BenchError> {
    let experiment = request.experiment.for_core(&request.rig)?;
    let total = experiment.duration_ticks;
    let every_ticks = u16::try_from(TICK_HZ / request.experiment.log_rate_hz.max(1)).unwrap_or(u16::MAX);
    let mut client = Client::new();
    boot(endpoint)?;
    let preparation = request.preparation()?;
    if !preparation.is_empty() {
        let answers = perform(endpoint, &mut client, &mut Ask::new(preparation), |_, _, _| Ok(()))?;
        answers.iter().try_for_each(words::accepted)?;
    }
    let mut capture_at = None;
    if request.capture {
        client.request(Command::CaptureArm(CaptureTrigger::Command));
        capture_at = Some(request.capture_tick(total, every_ticks));
    }
    let mut procedure = RunExperiment::new(experiment, RunOptions { every_ticks, ..RunOptions::default() });
    let mut ticks = None;
    let mut switch = ArmSwitch::default();
    let mut measuring = false;
    let run = perform(endpoint, &mut client, &mut procedure, |endpoint, client, procedure| {
        if procedure.wants_arm_switch() {
            switch.turn(endpoint)?;
        }
        let done = procedure.progress_ticks();
        if done > 0 && !measuring {
            measuring = true;
            endpoint.begin_measuring()?;
        }
        if measuring && ticks.is_none() && done + u32::from(every_ticks) >= total {
            ticks = Some(endpoint.end_measuring()?);
        }
        if capture_at.is_some_and(|at| done >= at) {
            capture_at = None;
            client.request(Command::CaptureTrigger);
        }
        progress(done, total);
        Ok(())
    })?;
    let ticks = match ticks {
        Some(ticks) => ticks,
        None => endpoint.end_measuring()?,
    };
    let captured = if request.capture && run.fault.is_none() {
        Some(perform(endpoint, &mut client, &mut ReadCapture::new(None), |_, _, _| Ok(()))?)
    } else {
        None
    };
    Ok(Operated { run, ticks, captured })
}

struct Operated {
    run: RunRecord,
    ticks: Ticks,
    captured: Option<Captured>,
}

/// The operator's hand on the arm switch: off, a moment later on.
#[derive(Debug, Default)]
pub struct ArmSwitch {
    on_at: Option<u64>,
    on: bool,
}

impl ArmSwitch {
    /// Whether it was turned on.
    #[must_use]
    pub fn is_on(&self) -> bool {
        self.on
    }

    /// To be called again and again until the rig arms.
    ///
    /// # Errors
    /// The run ended.
    pub fn turn(&mut self, endpoint: &mut Endpoint) -> Result<(), BenchError> {
        match self.on_at {
            None => {
                self.on_at = Some(endpoint.now_ns() + SWITCH_NS);
                endpoint.act(Action::ArmSwitch(false))
            }
            Some(at) if endpoint.now_ns() >= at && !self.on => {
                self.on = true;
                endpoint.act(Action::ArmSwitch(true))
            }
            Some(_) => Ok(()),
        }
    }
}

/// Waits until the firmware listens, and looks at its pins.
///
/// # Errors
/// The run ended, or a pin is not set up as the board needs it.
pub fn boot(endpoint: &mut Endpoint) -> Result<(), BenchError> {
    endpoint.wait_until(BOOT_NS)?;
    let wrong = endpoint.wrong_pins()?;
    if wrong.is_empty() { Ok(()) } else { Err(BenchError::Firmware(wrong.join("; "))) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_capture_is_triggered_by_a_row_that_comes_even_where_the_last_step_is_late() {
        let mut request = Request::assumed("fig20").unwrap();
        // The load's step at 4 s, and 0.9 s more.
        assert_eq!(request.capture_tick(100_000, 10), 49_000);
        request.experiment =
            ExperimentFile::named_or_read("fig20", &[("duration_s".into(), "4.5".into())]).unwrap();
        assert_eq!(request.capture_tick(45_000, 10), 44_990);
    }
}
