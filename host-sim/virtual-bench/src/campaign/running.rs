//! A run of fig20 in the middle of its load phase, kept for the faults to start from.

use crate::bench;
use crate::desk_link::perform;
use crate::elf::Firmware;
use crate::error::BenchError;
use crate::experiment::{ArmSwitch, Request, boot};
use crate::record::Saved;
use host_sim::link::client::Client;
use host_sim::link::run_experiment::{RunExperiment, RunOptions};

/// Speed step at 3.5 s, load step at 4 s: by then both motors push and the disc turns.
const KEPT_TICK: u32 = 45_000;

/// The whole bench at [`KEPT_TICK`].
pub(super) fn kept(firmware: &Firmware) -> Result<Saved, BenchError> {
    let request = Request::assumed("fig20")?;
    let experiment = request.experiment.for_core(&request.rig)?;
    let outcome = bench::run(firmware, Box::new(request.plant()?), |desk| {
        boot(desk)?;
        let mut client = Client::new();
        let mut switch = ArmSwitch::default();
        let mut kept = false;
        let mut procedure = RunExperiment::new(experiment, RunOptions::default());
        // Whatever ends the procedure early is said below: nothing was kept.
        let ended = perform(desk, &mut client, &mut procedure, |desk, _, procedure| {
            if procedure.wants_arm_switch() {
                switch.turn(desk)?;
            }
            if procedure.progress_ticks() >= KEPT_TICK {
                desk.snapshot()?;
                kept = true;
                return Err(BenchError::Rig("kept".to_owned()));
            }
            Ok(())
        });
        match ended {
            Err(_) if kept => Ok(()),
            Err(error) => Err(error),
            Ok(run) => Err(BenchError::Rig(format!("fig20 ended early: {:?}", run.fault_words()))),
        }
    })?;
    outcome.record.saved.ok_or_else(|| BenchError::Emulator("nothing was kept".to_owned()))
}
