//! The rig in each of the states that faults start from, kept: a fault then costs only its own time.

use super::listening_host::ListeningHost;
use crate::bench;
use crate::elf::Firmware;
use crate::endpoint::Endpoint;
use crate::endpoint_link::perform;
use crate::error::BenchError;
use crate::experiment::{ArmSwitch, Request, boot};
use crate::outside::Action;
use crate::plant_side::HostPlant;
use crate::record::Saved;
use host_sim::files::experiment_file::ExperimentFile;
use host_sim::link::client::Client;
use host_sim::link::run_experiment::{RunExperiment, RunOptions};
use rig_link::message::{Answer, Command};
use serde::{Deserialize, Serialize};

/// Tick of the experiment at which the state is reached: its last step was 0.3 s before.
const TAKEN_AT: u32 = 6_000;
/// Distance of two rows of telemetry in all of them.
const EVERY_TICKS: u16 = 10;

/// What the rig does when the fault comes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub enum State {
    /// Drives off.
    Idle,
    /// Drives on, at zero torque.
    Armed,
    /// M1 presses, the disc is held at rest by its speed loop.
    Pressing,
    /// M1 presses, the disc turns under it at 30 rpm.
    Sliding,
    /// M1 presses, M2 gives a torque.
    Torque,
}

impl State {
    /// All of them.
    pub const ALL: [Self; 5] = [Self::Idle, Self::Armed, Self::Pressing, Self::Sliding, Self::Torque];

    /// In a word.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Idle => "idle",
            Self::Armed => "armed",
            Self::Pressing => "pressing",
            Self::Sliding => "sliding",
            Self::Torque => "torque",
        }
    }

    /// The drives are on.
    #[must_use]
    pub const fn is_live(self) -> bool {
        !matches!(self, Self::Idle)
    }

    /// The experiment that leads there: its second halves are what the rig does, and the state is taken from them.
    const fn on_the_way(self) -> Option<&'static str> {
        match self {
            Self::Idle | Self::Armed => None,
            Self::Pressing => {
                Some("[[m1]]\nstart_s = 0.2\ntorque_fraction = 0.4\n[[m2]]\nstart_s = 0.0\nspeed_rpm = 0.0\n")
            }
            Self::Sliding => Some(
                "[[m1]]\nstart_s = 0.2\ntorque_fraction = 0.4\n[[m2]]\nstart_s = 0.0\nspeed_rpm = 0.0\n\
                 [[m2]]\nstart_s = 0.1\nspeed_rpm = 30.0\n",
            ),
            Self::Torque => Some(
                "[[m1]]\nstart_s = 0.2\ntorque_fraction = 0.6\n[[m2]]\nstart_s = 0.0\ntorque_fraction = 0.0\n\
                 [[m2]]\nstart_s = 0.3\ntorque_fraction = 0.6\n",
            ),
        }
    }

    /// The whole bench in this state.
    ///
    /// # Errors
    /// The firmware does not get there.
    pub fn kept(self, firmware: &Firmware) -> Result<Saved, BenchError> {
        let outcome = bench::run(firmware, Box::new(self.plant()?), |endpoint| {
            self.reach(endpoint)?;
            endpoint.snapshot()
        })?;
        outcome.record.saved.ok_or_else(|| BenchError::Emulator("nothing was kept".to_owned()))
    }

    /// The whole bench in the middle of other motion, as an experiment's steps.
    ///
    /// # Errors
    /// The firmware does not get there.
    pub fn kept_during(firmware: &Firmware, motion: &str) -> Result<Saved, BenchError> {
        let outcome = bench::run(firmware, Box::new(Self::Sliding.plant()?), |endpoint| {
            boot(endpoint)?;
            during(endpoint, motion)?;
            endpoint.snapshot()
        })?;
        outcome.record.saved.ok_or_else(|| BenchError::Emulator("nothing was kept".to_owned()))
    }

    /// The plant it is reached with.
    ///
    /// # Errors
    /// The assumed rig's files are damaged.
    pub fn plant(self) -> Result<HostPlant, BenchError> {
        Request::assumed("fig20")?.plant()
    }

    /// Brings the rig there from power-on, through faults and their clearing: the emulator has then translated what the
    /// firmware does at one, and a run that branches off later need not.
    ///
    /// # Errors
    /// The firmware does not get there.
    pub fn reach(self, endpoint: &mut Endpoint) -> Result<(), BenchError> {
        boot(endpoint)?;
        through_faults(endpoint)?;
        match self.on_the_way() {
            Some(motion) => during(endpoint, motion),
            None => before_any(endpoint, self == Self::Armed),
        }
    }
}

/// Time in a rehearsed fault, and after it: some more than the 256 runs after which the emulator translates a block anew,
/// and better.
const REHEARSED_NS: u64 = 60_000_000;

/// Arms, has something go wrong, puts it right and clears it: once by an input of the supervisor, once by a sensor.
fn through_faults(endpoint: &mut Endpoint) -> Result<(), BenchError> {
    let mut listener = ListeningHost::new();
    accepted(endpoint, &mut listener, &Command::Telemetry { every_ticks: EVERY_TICKS })?;
    for (wrong, right) in [
        (Action::EmergencyStop(true), Action::EmergencyStop(false)),
        (Action::AnalogueInput(0, Some(0)), Action::AnalogueInput(0, None)),
    ] {
        armed(endpoint, &mut listener)?;
        endpoint.act(wrong)?;
        listener.listen(endpoint, endpoint.now_ns() + REHEARSED_NS)?;
        listener.ask(endpoint, &Command::Arm)?;
        endpoint.act(right)?;
        endpoint.act(Action::ArmSwitch(false))?;
        listener.listen(endpoint, endpoint.now_ns() + REHEARSED_NS)?;
        accepted(endpoint, &mut listener, &Command::ClearFault)?;
        listener.listen(endpoint, endpoint.now_ns() + REHEARSED_NS)?;
    }
    listener.ask(endpoint, &Command::CrashRecord)?;
    listener.ask(endpoint, &Command::SettingGet { key: 143 })?;
    Ok(())
}

/// Turns the switch on and arms.
fn armed(endpoint: &mut Endpoint, listener: &mut ListeningHost) -> Result<(), BenchError> {
    let mut switch = ArmSwitch::default();
    while !switch.is_on() {
        switch.turn(endpoint)?;
        listener.listen(endpoint, endpoint.now_ns() + 5_000_000)?;
    }
    // A line permits only when it did so for a while.
    listener.listen(endpoint, endpoint.now_ns() + 10_000_000)?;
    accepted(endpoint, listener, &Command::Arm)
}

fn accepted(
    endpoint: &mut Endpoint,
    listener: &mut ListeningHost,
    command: &Command,
) -> Result<(), BenchError> {
    match listener.ask(endpoint, command)? {
        Answer::Done => Ok(()),
        other => Err(BenchError::Rig(format!("{command:?}: {other:?}"))),
    }
}

/// Switched on, and armed if asked for.
fn before_any(endpoint: &mut Endpoint, arm: bool) -> Result<(), BenchError> {
    let mut listener = ListeningHost::new();
    if arm {
        armed(endpoint, &mut listener)?;
    }
    listener.listen(endpoint, endpoint.now_ns() + 50_000_000)
}

/// In the middle of an experiment.
fn during(endpoint: &mut Endpoint, motion: &str) -> Result<(), BenchError> {
    let request = Request::assumed("fig20")?;
    let head = "name = \"campaign\"\ntitle = \"A state of the campaign\"\nduration_s = 60.0\nseed = 1\n\
                log_rate_hz = 1000\n[[m1]]\nstart_s = 0.0\ntorque_fraction = 0.055\n";
    let experiment =
        ExperimentFile::parse("campaign.toml", &format!("{head}{motion}"))?.for_core(&request.rig)?;
    let mut client = Client::new();
    let mut switch = ArmSwitch::default();
    let mut there = false;
    let options = RunOptions { every_ticks: EVERY_TICKS, ..RunOptions::default() };
    let mut procedure = RunExperiment::new(experiment, options);
    // Whatever ends the procedure early is said below.
    let ended = perform(endpoint, &mut client, &mut procedure, |endpoint, _, procedure| {
        if procedure.wants_arm_switch() {
            switch.turn(endpoint)?;
        }
        if procedure.progress_ticks() >= TAKEN_AT {
            there = true;
            return Err(BenchError::Rig("there".to_owned()));
        }
        Ok(())
    });
    match ended {
        Err(_) if there => Ok(()),
        Err(error) => Err(error),
        Ok(run) => {
            Err(BenchError::Rig(format!("on the way to a state it ended early: {:?}", run.fault_words())))
        }
    }
}
