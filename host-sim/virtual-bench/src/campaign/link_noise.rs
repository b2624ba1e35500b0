//! Noise on the serial line: one byte in fifty to the chip arrives damaged while an experiment runs.
//!
//! Damaged frames must be thrown away and counted, the run must go on, and nothing may be carried out that nobody
//! asked for.

use super::Verdict;
use super::listening_host::ListeningHost;
use crate::bench;
use crate::elf::Firmware;
use crate::error::BenchError;
use crate::outside::Action;
use crate::record::Saved;
use model_core::control::Mode;
use rig_link::message::{Command, EventKind};
use std::path::Path;

const DAMAGED_PER_MILLION: u32 = 20_000;
const NOISE_NS: u64 = 2_000_000_000;
/// Each some bytes long: enough of them that damaged ones are certain.
const REQUESTS: u32 = 300;

pub(super) fn verdict(firmware: &Firmware, running: &Saved, scratch: &Path) -> Result<Verdict, BenchError> {
    let outcome = bench::run_on(firmware, running, scratch, |endpoint| {
        let mut listener = ListeningHost::new();
        listener.listen(endpoint, endpoint.now_ns() + 5_000_000)?;
        endpoint.act(Action::LinkGarbled(DAMAGED_PER_MILLION))?;
        for _ in 0..REQUESTS {
            listener.send(&Command::SettingGet { key: 143 });
            listener.listen(endpoint, endpoint.now_ns() + NOISE_NS / u64::from(REQUESTS))?;
        }
        endpoint.act(Action::LinkGarbled(0))?;
        // A health record comes each 0.1 s.
        listener.health = None;
        listener.listen(endpoint, endpoint.now_ns() + 210_000_000)?;
        Ok(listener)
    })?;
    let listener = outcome.operator;
    let mut problems = Vec::new();
    let said = match listener.health {
        Some(health) => {
            if health.mode != Mode::Running.number() {
                problems.push(format!("the run did not go on: mode {}", health.mode));
            }
            if health.frames_rejected == 0 {
                problems.push("no damaged frame was counted".to_owned());
            }
            format!("the run goes on; {} damaged frames thrown away", health.frames_rejected)
        }
        None => {
            problems.push("it does not tell its health".to_owned());
            String::new()
        }
    };
    let unasked = |kind: &EventKind| {
        matches!(
            kind,
            EventKind::Mode { .. }
                | EventKind::ConfigChanged
                | EventKind::Refused { .. }
                | EventKind::FaultLatched(_)
        )
    };
    for event in listener.events.iter().filter(|event| unasked(&event.kind)) {
        problems.push(format!("it did something nobody asked for: {event:?}"));
    }
    if !outcome.record.restarts.is_empty() {
        problems.push(format!("it restarted: {:?}", outcome.record.restarts));
    }
    Ok(Verdict { name: "2 % of the bytes to the chip damaged", said, problems })
}
