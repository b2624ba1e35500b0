//! One experiment on the virtual bench, from power-on to the disarmed rig, over the serial link.

use crate::bench::{self, Outcome};
use crate::defmt_log::{self, DefmtLog};
use crate::desk::Desk;
use crate::desk_link::perform;
use crate::elf::Firmware;
use crate::error::BenchError;
use crate::meter::Ticks;
use crate::outside::Action;
use crate::plant_side::HostPlant;
use crate::record::Record;
use host_sim::files::experiment_file::ExperimentFile;
use host_sim::files::log::Log;
use host_sim::files::model_file::ModelFile;
use host_sim::files::rig_file::RigFile;
use host_sim::link::ask::Ask;
use host_sim::link::client::Client;
use host_sim::link::run_experiment::{RunExperiment, RunOptions, RunRecord};
use host_sim::link::{model_upload, rows, words};
use host_sim::lockstep::control_settings;
use host_sim::plant::PlantParameters;
use model_core::control::ControlSettings;
use rig_link::message::Command;
use rig_link::model::ModelRecord;
use rig_link::settings;

/// From power-on until the firmware surely listens: clocks, settings in flash, self-check of 0.1 s.
pub const BOOT_NS: u64 = 300_000_000;
/// How long the switch stays off before it is turned on.
const SWITCH_NS: u64 = 20_000_000;
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
        })
    }

    fn plant(&self) -> Result<HostPlant, BenchError> {
        let parameters = PlantParameters::from_files(&self.rig, &self.model, &self.experiment.plant);
        Ok(HostPlant::new(&parameters, self.experiment.seed)?)
    }

    /// Requests that make the firmware know the rig and the observer's model.
    fn preparation(&self) -> Result<Vec<Command>, BenchError> {
        let (wanted, own) = (control_settings(&self.rig, &self.observer), ControlSettings::default());
        let mut commands: Vec<Command> = settings::ALL
            .iter()
            .filter(|info| info.get(&wanted).to_bits() != info.get(&own).to_bits())
            .map(|info| Command::SettingSet { key: info.key, value: info.get(&wanted) })
            .collect();
        let model = model_upload::record(&self.observer)?;
        // What the firmware's observer runs without an upload.
        let resident = ModelRecord { friction: (&own.observer.model).into(), effects: heapless::Vec::new() };
        if model != resident {
            commands.push(Command::ModelSet(model));
        }
        Ok(commands)
    }
}

/// An experiment that was run.
#[derive(Debug)]
pub struct Done {
    /// What came over the link.
    pub run: RunRecord,
    /// The control ticks while it ran.
    pub ticks: Ticks,
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

/// Runs an experiment; `progress` is told the ticks done of all.
///
/// # Errors
/// Whatever kept it from its end. A fault of the rig ends it early and is no error: see [`Done::complaints`].
pub fn run(
    firmware: &Firmware,
    request: &Request,
    progress: impl FnMut(u32, u32) + Send,
) -> Result<Done, BenchError> {
    let plant = request.plant()?;
    let outcome = bench::run(firmware, Box::new(plant), |desk| operate(desk, request, progress))?;
    let Outcome { operator: (run, ticks), record } = outcome;
    let log = defmt_log::decode(&firmware.bytes, &record.log)?;
    Ok(Done { run, ticks, log, record })
}

fn operate(
    desk: &mut Desk,
    request: &Request,
    mut progress: impl FnMut(u32, u32),
) -> Result<(RunRecord, Ticks), BenchError> {
    let experiment = request.experiment.for_core(&request.rig)?;
    let total = experiment.duration_ticks;
    let every_ticks = u16::try_from(TICK_HZ / request.experiment.log_rate_hz.max(1)).unwrap_or(u16::MAX);
    let mut client = Client::new();
    boot(desk)?;
    let preparation = request.preparation()?;
    if !preparation.is_empty() {
        let answers = perform(desk, &mut client, &mut Ask::new(preparation), |_, _| Ok(()))?;
        answers.iter().try_for_each(words::accepted)?;
    }
    let mut procedure = RunExperiment::new(experiment, RunOptions { every_ticks, ..RunOptions::default() });
    let mut ticks = None;
    let mut switch_on_at = None;
    let mut measuring = false;
    let run = perform(desk, &mut client, &mut procedure, |desk, procedure| {
        if procedure.wants_arm_switch() && switch_on_at.is_none() {
            desk.act(Action::ArmSwitch(false))?;
            switch_on_at = Some(desk.now_ns() + SWITCH_NS);
        }
        if switch_on_at.is_some_and(|at| desk.now_ns() >= at) {
            desk.act(Action::ArmSwitch(true))?;
            switch_on_at = Some(u64::MAX);
        }
        let done = procedure.progress_ticks();
        if done > 0 && !measuring {
            measuring = true;
            desk.begin_measuring()?;
        }
        if measuring && ticks.is_none() && done + u32::from(every_ticks) >= total {
            ticks = Some(desk.end_measuring()?);
        }
        progress(done, total);
        Ok(())
    })?;
    let ticks = match ticks {
        Some(ticks) => ticks,
        None => desk.end_measuring()?,
    };
    Ok((run, ticks))
}

/// Waits until the firmware listens, and looks at its pins.
///
/// # Errors
/// The run ended, or a pin is not set up as the board needs it.
pub fn boot(desk: &mut Desk) -> Result<(), BenchError> {
    desk.wait_until(BOOT_NS)?;
    let wrong = desk.wrong_pins()?;
    if wrong.is_empty() { Ok(()) } else { Err(BenchError::Firmware(wrong.join("; "))) }
}
