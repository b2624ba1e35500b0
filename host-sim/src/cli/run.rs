//! `rig run`: an experiment on the rig.

use std::path::PathBuf;
use std::time::Instant;

use rig_link::message::Command;
use serde::Serialize;

use super::common::{SetArgs, warn};
use super::interrupt;
use super::keeper::Keeper;
use super::port::{PortArgs, every_ticks, sign};
use super::progress::Progress;
use crate::files::experiment_file::ExperimentFile;
use crate::files::journal::{self, Unfinished};
use crate::files::output_dir::{OutputDir, note_written};
use crate::files::rig_file::RigFile;
use crate::input_error::{InputError, Kind};
use crate::link::rows::{self, Zero};
use crate::link::run_experiment::{RunExperiment, RunOptions, RunRecord};
use crate::summary::{RunFacts, Summary, summarise};

/// Run an experiment on the rig: upload it, arm, run, record
#[derive(clap::Args, Debug)]
#[command(after_long_help = "\
Example:
  rig run --port /dev/ttyACM0 --experiment fig20 --out runs/fig20

The machine moves. Keep clear of it; the emergency stop and the arm switch are yours.
Uploads the experiment, waits until the arm switch is turned off and on, runs it and disarms. A fault ends
the run. Ctrl-C stops it: both motors are brought to rest; a second one switches the drives off at once. What
was recorded until then is written in any case, and says why it ends (`# ended:`). While it records it stands in
unfinished.csv, an ordinary log, which stays there if this program is killed; the next rig run names it.

Writes log.csv (SI units, time from the start of the experiment, 1 kHz unless --rate-hz says otherwise) and
summary.json with the experiment's figures.")]
pub(super) struct Run {
    #[command(flatten)]
    port: PortArgs,
    /// fig18 … fig23, or an experiment file (TOML)
    #[arg(long, value_name = "NAME|FILE.toml")]
    experiment: String,
    /// Rig file (TOML) whose rated torques the experiment's fractions mean; the assumed rig where left out
    #[arg(long, value_name = "RIG.toml")]
    rig: Option<PathBuf>,
    /// Rows per second
    #[arg(long, value_name = "HZ", default_value_t = 1000)]
    rate_hz: u32,
    /// Folder for the results
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    #[command(flatten)]
    set: SetArgs,
}

/// `summary.json` of a run on the rig.
#[derive(Serialize)]
struct RunSummary {
    #[serde(flatten)]
    summary: Summary,
    ended: String,
    rows_missing: u64,
}

impl Run {
    /// Runs the command.
    pub(super) fn run(self) -> Result<(), InputError> {
        let overrides = self.set.overrides()?;
        overrides.only(true, false, true)?;
        let experiment = ExperimentFile::named_or_read(&self.experiment, &overrides.experiment)?;
        let rig = RigFile::read_or_assumed(self.rig.as_deref(), &overrides.rig)?;
        let core = experiment.for_core(&rig)?;
        let options = RunOptions { every_ticks: every_ticks(self.rate_hz)?, ..RunOptions::default() };
        let mut output = OutputDir::new(&self.out)?;
        Unfinished::beside(output.folder()).iter().for_each(|unfinished| warn(&unfinished.sentence()));
        interrupt::count_signals();
        let mut port = self.port.open()?;
        let started = Instant::now();
        let mut progress = Progress::new(&experiment.name, u64::from(core.duration_ticks));
        let mut procedure = RunExperiment::new(core, options);
        let about = [("experiment".to_owned(), experiment.name.clone())];
        let mut keeper = Keeper::new(output.folder(), &about, Zero::Experiment);
        let mut full = None;
        let done = port.perform_with(&mut procedure, |procedure| {
            match interrupt::count() {
                0 => {}
                1 => procedure.stop(interrupt::BY_USER),
                _ => procedure.abort(interrupt::BY_USER),
            }
            let record = procedure.record();
            if !keeper.look(&record.rows, &record.scale, &record.hello) && full.is_none() {
                full = keeper.take_error();
                procedure.stop("what is recorded could not be stored");
            }
            if procedure.progress_ticks() > 0 {
                progress.set(u64::from(procedure.progress_ticks()));
            }
        });
        drop(progress);
        if done.is_err() && procedure.is_live() {
            port.send_last(Command::Disarm);
        }
        let record = procedure.record();
        let lost = done.err();
        let ended = lost.as_ref().map_or_else(|| record.ended(), ToString::to_string);
        if record.rows.is_empty() {
            let nothing = || InputError::new(format!("nothing was recorded: {ended}")).of_kind(Kind::Run);
            return Err(lost.unwrap_or_else(nothing));
        }
        keeper.keep(&record.rows, &record.scale, &record.hello);
        let wall_s = started.elapsed().as_secs_f64();
        let written = write(&mut output, &experiment, record, &ended, wall_s).and_then(|()| output.finish());
        match written {
            Ok(()) => keeper.discard(),
            Err(error) => {
                if let Some(path) = keeper.leave(&ended) {
                    warn(&format!("what was recorded is in {}", path.display()));
                    note_written(path);
                }
                return Err(lost.unwrap_or(error));
            }
        }
        match lost.or(full) {
            Some(error) => Err(error),
            None if record.fault.is_some() || record.stopped.is_some() => {
                Err(InputError::new(format!("ended early: {ended}")).file(experiment.name).of_kind(Kind::Run))
            }
            None => Ok(()),
        }
    }
}

/// Writes log and summary of a run.
fn write(
    output: &mut OutputDir,
    experiment: &ExperimentFile,
    record: &RunRecord,
    ended: &str,
    wall_s: f64,
) -> Result<(), InputError> {
    let missing = rows::missing(&record.rows);
    let mut log = rows::log(&record.rows, &record.scale, Zero::Experiment);
    log.metadata.push((journal::KEY.into(), ended.into()));
    log.metadata.push(("experiment".into(), experiment.name.clone()));
    sign(&mut log, &record.hello, missing);
    let ticks = record.rows.last().map_or(0, |row| u64::from(row.experiment_tick));
    #[allow(clippy::cast_precision_loss)]
    let facts = RunFacts {
        wall_s,
        simulated_s: ticks as f64 / f64::from(record.scale.tick_hz.max(1)),
        control_ticks: record.health.map_or(ticks, |health| health.tick),
        deadline_misses: record.health.map_or(0, |health| u64::from(health.deadline_misses)),
    };
    output.write_log(&log)?;
    match summarise(experiment, &log, facts) {
        Ok(summary) => output
            .write_json("summary.json", &RunSummary { summary, ended: ended.into(), rows_missing: missing }),
        // A log that ends before the step has no figures; it is worth keeping all the same.
        Err(error) => {
            warn(&format!("no summary.json: {error}"));
            Ok(())
        }
    }
}
