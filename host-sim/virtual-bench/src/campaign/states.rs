//! The rig in each of the states that faults start from, kept: a fault then costs only its own time.

use super::listening_host::ListeningHost;
use crate::bench;
use crate::elf::Firmware;
use crate::endpoint_link::perform;
use crate::error::BenchError;
use crate::experiment::{ArmSwitch, Request, boot};
use crate::record::Saved;
use host_sim::link::client::Client;
use host_sim::link::run_experiment::{RunExperiment, RunOptions};
use rig_link::message::{Answer, Command};

/// What the rig does when the fault comes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
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

    /// The experiment that leads there, and at which tick of it.
    const fn on_the_way(self) -> Option<(&'static str, u32)> {
        match self {
            Self::Idle | Self::Armed => None,
            // The speed step comes at 3.5 s, the load step at 4 s.
            Self::Pressing => Some(("fig20", 10_000)),
            Self::Sliding => Some(("fig20", 45_000)),
            // The torque step comes at 4 s.
            Self::Torque => Some(("fig23", 41_000)),
        }
    }

    /// The whole bench in this state.
    ///
    /// # Errors
    /// The firmware does not get there.
    pub fn kept(self, firmware: &Firmware) -> Result<Saved, BenchError> {
        match self.on_the_way() {
            Some((experiment, tick)) => during(firmware, experiment, tick),
            None => before_any(firmware, self == Self::Armed),
        }
    }
}

/// Switched on, and armed if asked for.
fn before_any(firmware: &Firmware, armed: bool) -> Result<Saved, BenchError> {
    let outcome = bench::run(firmware, Box::new(Request::assumed("fig20")?.plant()?), |endpoint| {
        boot(endpoint)?;
        let mut listener = ListeningHost::new();
        if armed {
            let mut switch = ArmSwitch::default();
            while !switch.is_on() {
                switch.turn(endpoint)?;
                listener.listen(endpoint, endpoint.now_ns() + 5_000_000)?;
            }
            match listener.ask(endpoint, &Command::Arm)? {
                Answer::Done => {}
                other => return Err(BenchError::Rig(format!("it does not arm: {other:?}"))),
            }
        }
        listener.listen(endpoint, endpoint.now_ns() + 50_000_000)?;
        endpoint.snapshot()
    })?;
    outcome.record.saved.ok_or_else(nothing)
}

/// In the middle of an experiment.
fn during(firmware: &Firmware, experiment: &str, tick: u32) -> Result<Saved, BenchError> {
    let request = Request::assumed(experiment)?;
    let experiment = request.experiment.for_core(&request.rig)?;
    let outcome = bench::run(firmware, Box::new(request.plant()?), |endpoint| {
        boot(endpoint)?;
        let mut client = Client::new();
        let mut switch = ArmSwitch::default();
        let mut kept = false;
        let mut procedure = RunExperiment::new(experiment, RunOptions::default());
        // Whatever ends the procedure early is said below: nothing was kept.
        let ended = perform(endpoint, &mut client, &mut procedure, |endpoint, _, procedure| {
            if procedure.wants_arm_switch() {
                switch.turn(endpoint)?;
            }
            if procedure.progress_ticks() >= tick {
                endpoint.snapshot()?;
                kept = true;
                return Err(BenchError::Rig("kept".to_owned()));
            }
            Ok(())
        });
        match ended {
            Err(_) if kept => Ok(()),
            Err(error) => Err(error),
            Ok(run) => Err(BenchError::Rig(format!(
                "{}: it ended early: {:?}",
                request.experiment.name,
                run.fault_words()
            ))),
        }
    })?;
    outcome.record.saved.ok_or_else(nothing)
}

fn nothing() -> BenchError {
    BenchError::Emulator("nothing was kept".to_owned())
}
