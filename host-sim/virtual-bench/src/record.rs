//! What a run leaves behind, and what it keeps for runs that go on from it.

use crate::outside::{DriveInputs, Motion, Outside, PlantSide, Sensors};
use crate::sighting::Seen;
use rigless::device::ResetCause;
use rigless::session::Reset;
use rigless::snapshot::Snapshot;
use std::sync::{Mutex, OnceLock};

/// A restart of the chip.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Restart {
    /// When, ns.
    pub at_ns: u64,
    /// Why, in the emulator's words.
    pub cause: String,
}

/// The run's record.
#[derive(Default)]
pub struct Record {
    /// The log's bytes, one entry for each start of the firmware.
    pub log: Vec<Vec<u8>>,
    /// Every change of what the drives are asked for, with its instant in ns.
    pub outputs: Vec<(u64, DriveInputs)>,
    /// Restarts.
    pub restarts: Vec<Restart>,
    /// The last instant, ns.
    pub last_at: u64,
    /// Instructions at that instant.
    pub instructions: u64,
    /// The state kept by the operator's wish.
    pub saved: Option<Saved>,
    /// The first access that saw the fault the operator looked for.
    pub seen: Option<Seen>,
    /// When the core arrived at code that was put in its way, ns.
    pub arrivals: Vec<u64>,
    /// How deep the stack went in each crash that was measured, bytes ([`Action::MeasureCrash`](crate::outside::Action)).
    pub crash_depths: Vec<u64>,
    /// How the plant moved at the end of each control period since the operator began to look, ns.
    pub motion: Vec<(u64, Motion)>,
}

impl std::fmt::Debug for Record {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Record")
            .field("restarts", &self.restarts)
            .field("last_at", &self.last_at)
            .finish_non_exhaustive()
    }
}

/// The whole bench at one instant.
pub struct Saved {
    /// Given up when it is first restored: the emulator's reading of it stays for good.
    pub(crate) file: Mutex<Vec<u8>>,
    pub(crate) read: OnceLock<Snapshot>,
    pub(crate) plant: Box<dyn PlantSide>,
    pub(crate) sensors: Sensors,
    pub(crate) outside: Outside,
    pub(crate) next: u64,
    pub(crate) resets_seen: usize,
}

impl Record {
    pub(crate) fn log_bytes(&mut self, bytes: &[u8]) {
        if self.log.is_empty() {
            self.log.push(Vec::new());
        }
        if let Some(current) = self.log.last_mut() {
            current.extend_from_slice(bytes);
        }
    }

    pub(crate) fn note_outputs(&mut self, at: u64, outputs: DriveInputs) {
        if self.outputs.last().is_none_or(|(_, last)| *last != outputs) {
            self.outputs.push((at, outputs));
        }
    }

    pub(crate) fn restarted(&mut self, resets: &[Reset]) {
        self.log.push(Vec::new());
        self.restarts.extend(resets.iter().map(|reset| Restart {
            at_ns: reset.at.0,
            cause: match reset.cause {
                ResetCause::Core => "software".to_owned(),
                ResetCause::Model(instance) => instance.to_owned(),
                ResetCause::Pin => "reset pin".to_owned(),
                ResetCause::PowerOn => "power on".to_owned(),
                other => format!("{other:?}"),
            },
        }));
    }

    /// The first instant from `from_ns` on at which the outputs are safe and stay so until `until_ns`.
    #[must_use]
    pub fn safe_from(&self, from_ns: u64, until_ns: u64) -> Option<u64> {
        let before = self.outputs.partition_point(|(at, _)| *at < until_ns);
        let outputs = self.outputs.get(..before).unwrap_or_default();
        match outputs.iter().rposition(|(_, outputs)| !outputs.is_safe()) {
            None => Some(from_ns),
            Some(index) => outputs.get(index + 1).map(|(at, _)| (*at).max(from_ns)),
        }
    }

    /// The first instant from `from_ns` on at which the outputs are safe and stay so to the end of the run.
    #[must_use]
    pub fn safe_for_good_from(&self, from_ns: u64) -> Option<u64> {
        let last_unsafe = self.outputs.iter().rposition(|(_, outputs)| !outputs.is_safe());
        match last_unsafe {
            None => Some(from_ns),
            Some(index) => self.outputs.get(index + 1).map(|(at, _)| (*at).max(from_ns)),
        }
    }
}
