//! The control core in lockstep with the plant: one tick of the core, one control period of the plant.
//!
//! In tick `k` the core reads what the plant was sampled at the instant `k`; what it writes drives the plant from
//! `k + 1` on, one period late, as on the rig, where the converter holds the last value until the tick is through.
//! Time is the tick counter. Nothing waits, nothing asks for the time of day, so two runs give identical bytes.
//!
//! The run begins like the firmware's: self-check, arm switch, arm, load, start. Only the ticks in which the
//! experiment runs are recorded.

mod recording;
mod settings;

pub use recording::{Frame, Recording};
pub use settings::control_settings;

use crate::files::experiment_file::ExperimentFile;
use crate::files::model_file::ModelFile;
use crate::files::rig_file::RigFile;
use crate::input_error::InputError;
use crate::plant::{Plant, PlantInput, PlantOutput, PlantParameters};
use model_core::control::sequencer::Experiment;
use model_core::control::tick::{ControlState, apply, step};
use model_core::control::{Command, ControlConfig, Mode, Samples};

/// Ticks that arming may take before something is wrong.
const MOST_ARMING_TICKS: u32 = 50_000;
/// How often progress is reported.
const PROGRESS_TICKS: usize = 5_000;

/// What is run.
#[derive(Debug, Clone)]
pub struct Setup {
    /// The rig behind the controller.
    pub plant: PlantParameters,
    /// The controller.
    pub config: ControlConfig,
    /// What both motors are asked for.
    pub experiment: Experiment,
    /// Seed of the sensor noise.
    pub seed: u64,
}

impl Setup {
    /// An experiment on a rig whose elements follow `model`, with the observer on `observer`.
    ///
    /// # Errors
    /// What a file asks for and the plant or the core refuses.
    pub fn from_files(
        experiment: &ExperimentFile,
        rig: &RigFile,
        model: &ModelFile,
        observer: &ModelFile,
    ) -> Result<Self, InputError> {
        let config = control_settings(rig, observer)
            .build()
            .map_err(|e| InputError::from(e).file(rig.source.as_str()))?;
        Ok(Self {
            plant: PlantParameters::from_files(rig, model, &experiment.plant),
            config,
            experiment: experiment.for_core(rig)?,
            seed: experiment.seed,
        })
    }
}

/// The core and the plant, one tick after another.
#[derive(Debug, Clone)]
pub struct Lockstep {
    config: ControlConfig,
    state: ControlState,
    plant: Plant,
    output: PlantOutput,
    input: PlantInput,
    arm_switch: bool,
    tick: u64,
}

impl Lockstep {
    /// Powers up controller and plant.
    ///
    /// # Errors
    /// The first plant parameter out of range.
    pub fn new(config: ControlConfig, plant: &PlantParameters, seed: u64) -> Result<Self, InputError> {
        let mut plant = Plant::new(plant, seed)?;
        let output = plant.sample();
        let state = ControlState::new(&config);
        Ok(Self { config, state, plant, output, input: PlantInput::OFF, arm_switch: false, tick: 0 })
    }

    /// One control period: the core ticks on the present samples while the plant moves under the last outputs.
    pub fn tick(&mut self) -> Frame {
        let samples = Samples {
            m1_count: self.output.counts[0],
            m2_count: self.output.counts[1],
            adc: self.output.codes,
            adc_fresh: true,
            arm_switch: self.arm_switch,
            link_heard: true,
            ..Samples::default()
        };
        let truth = self.output.truth;
        let outputs = step(&self.config, &mut self.state, &samples);
        self.output = self.plant.step(&self.input);
        self.input = PlantInput { dac: outputs.dac, drive_enable: outputs.drive_enable };
        self.tick += 1;
        Frame { record: outputs.record, truth }
    }

    /// Turns the arm switch.
    pub fn set_arm_switch(&mut self, on: bool) {
        self.arm_switch = on;
    }

    /// Gives the core a command between two ticks.
    ///
    /// # Errors
    /// Why the core refused it.
    pub fn command(&mut self, command: Command<'_>) -> Result<(), InputError> {
        apply(&mut self.config, &mut self.state, command).map_err(|refused| {
            let fault = refused.fault.map_or(String::new(), |fault| format!(" ({fault})"));
            InputError::new(format!("the controller refused: {}{fault}", refused.reason))
        })
    }

    /// Mode of the core.
    #[must_use]
    pub fn mode(&self) -> Mode {
        self.state.mode()
    }

    /// Asks until the core arms: its inputs permit only once they have been steady for a while.
    fn arm(&mut self) -> Result<(), InputError> {
        let mut refused = Ok(());
        for _ in 0..MOST_ARMING_TICKS {
            self.tick();
            refused = self.command(Command::Arm);
            if refused.is_ok() {
                break;
            }
        }
        refused
    }

    fn wait_for(&mut self, mode: Mode) -> Result<(), InputError> {
        for _ in 0..MOST_ARMING_TICKS {
            let frame = self.tick();
            if self.mode() == mode {
                return Ok(());
            }
            if let Some(fault) = frame.record.fault {
                return Err(InputError::new(format!("the controller does not arm: {fault}")));
            }
        }
        Err(InputError::new("the controller does not arm"))
    }
}

/// Runs an experiment to its end, or to the fault that ends it. `progress` gets the ticks done of all.
///
/// # Errors
/// A plant parameter out of range, an experiment beyond the limits of the core, or a core that does not arm.
pub fn run(setup: &Setup, mut progress: impl FnMut(usize, usize)) -> Result<Recording, InputError> {
    let mut rig = Lockstep::new(setup.config, &setup.plant, setup.seed)?;
    let prepared = setup
        .experiment
        .prepare(&rig.config)
        .map_err(|e| InputError::new(format!("the controller refused: {e}")))?;
    rig.wait_for(Mode::Disabled)?;
    // The switch must be seen off, then on, before the command is accepted.
    rig.set_arm_switch(true);
    rig.arm()?;
    rig.wait_for(Mode::Armed)?;
    rig.command(Command::LoadExperiment(&prepared))?;
    rig.command(Command::Start)?;
    let total = setup.experiment.duration_ticks as usize;
    let mut recording = Recording { frames: Vec::with_capacity(total), ..Recording::default() };
    while recording.frames.len() < total {
        let frame = rig.tick();
        recording.fault = frame.record.fault;
        recording.limits = recording.limits.union(frame.record.limits);
        recording.deadline_misses = u64::from(frame.record.deadline_misses);
        if frame.record.mode != Mode::Running {
            break;
        }
        recording.frames.push(frame);
        if recording.frames.len().is_multiple_of(PROGRESS_TICKS) {
            progress(recording.frames.len(), total);
        }
    }
    recording.control_ticks = rig.tick;
    Ok(recording)
}
