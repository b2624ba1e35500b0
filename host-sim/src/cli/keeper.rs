//! Keeps what is recorded on disk while it is recorded: see [`crate::files::journal`].

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use rig_link::message::Hello;
use rig_link::telemetry::TelemetryRow;

use super::port::sign_firmware;
use crate::files::journal::Journal;
use crate::files::log::Log;
use crate::input_error::InputError;
use crate::link::rows::{self, Scale, Zero};

/// Rows wait for company no longer than this: the most that is lost with a killed host.
const EVERY: Duration = Duration::from_millis(50);

/// Writes new rows down, now and then.
#[derive(Debug)]
pub(super) struct Keeper {
    folder: PathBuf,
    about: Vec<(String, String)>,
    zero: Zero,
    journal: Option<Journal>,
    first_tick: u64,
    kept: usize,
    looked: Instant,
    error: Option<InputError>,
}

impl Keeper {
    /// Keeps rows in this folder.
    pub(super) fn new(folder: &Path, about: &[(String, String)], zero: Zero) -> Self {
        Self {
            folder: folder.to_path_buf(),
            about: about.to_vec(),
            zero,
            journal: None,
            first_tick: 0,
            kept: 0,
            looked: Instant::now(),
            error: None,
        }
    }

    /// Takes the rows so far, when it is time; says whether it can go on.
    pub(super) fn look(&mut self, rows: &[TelemetryRow], scale: &Scale, hello: &Hello) -> bool {
        if self.looked.elapsed() >= EVERY {
            self.looked = Instant::now();
            self.keep(rows, scale, hello);
        }
        self.error.is_none()
    }

    /// Takes the rows so far.
    pub(super) fn keep(&mut self, rows: &[TelemetryRow], scale: &Scale, hello: &Hello) {
        if self.error.is_none()
            && let Err(error) = self.try_keep(rows, scale, hello)
        {
            self.error = Some(error);
        }
    }

    fn try_keep(&mut self, rows: &[TelemetryRow], scale: &Scale, hello: &Hello) -> Result<(), InputError> {
        let Some(new @ [first, ..]) = rows.get(self.kept..) else { return Ok(()) };
        let journal = match &mut self.journal {
            Some(journal) => journal,
            None => {
                let mut about = Log::default();
                about.metadata.clone_from(&self.about);
                sign_firmware(&mut about, hello);
                self.first_tick = first.tick;
                self.journal.insert(Journal::begin(&self.folder, &about.metadata)?)
            }
        };
        let mut log = rows::log_from(new, scale, self.zero, self.first_tick);
        log.metadata.clear();
        journal.append(&log)?;
        self.kept = rows.len();
        Ok(())
    }

    /// What kept rows from being written, taken out.
    pub(super) fn take_error(&mut self) -> Option<InputError> {
        self.error.take()
    }

    /// The log stands elsewhere.
    pub(super) fn discard(self) {
        if let Some(journal) = self.journal {
            journal.discard();
        }
    }

    /// The log could not be written elsewhere: says in the file why it ends, and where it is.
    pub(super) fn leave(self, reason: &str) -> Option<PathBuf> {
        self.journal.map(|journal| journal.leave(reason))
    }
}
