//! `rig run`: an experiment on the rig.

use std::path::PathBuf;
use std::time::Instant;

use super::common::{SetArgs, say};
use super::port::{PortArgs, every_ticks, sign};
use crate::files::experiment_file::ExperimentFile;
use crate::files::output_dir::OutputDir;
use crate::files::rig_file::RigFile;
use crate::input_error::InputError;
use crate::link::rows::{self, Zero};
use crate::link::run_experiment::{RunExperiment, RunOptions, RunRecord};
use crate::summary::{RunFacts, summarise};

/// Run an experiment on the rig: upload it, arm, run, record
#[derive(clap::Args, Debug)]
#[command(after_long_help = "\
Example:
  rig run --port /dev/ttyACM0 --experiment fig20 --out runs/fig20

The machine moves. Keep clear of it; the emergency stop and the arm switch are yours.
Uploads the experiment, waits until the arm switch is turned off and on, runs it and disarms. A fault ends
the run; what was recorded until then is written, and the fault is named on stderr.

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
        let started = Instant::now();
        let mut port = self.port.open()?;
        let record = port.perform(&mut RunExperiment::new(core, options))?;
        write(&mut output, &experiment, &record, started.elapsed().as_secs_f64())?;
        let folder = output.folder().to_path_buf();
        output.finish()?;
        if let Some(fault) = record.fault_words() {
            eprintln!("rig: {}: ended early by {fault}", experiment.name);
        }
        say(&format!("written to {}", folder.display()));
        Ok(())
    }
}

/// Writes log and summary of a run.
fn write(
    output: &mut OutputDir,
    experiment: &ExperimentFile,
    record: &RunRecord,
    wall_s: f64,
) -> Result<(), InputError> {
    let missing = rows::missing(&record.rows);
    let mut log = rows::log(&record.rows, &record.scale, Zero::Experiment);
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
    if log.is_empty() {
        return Err(InputError::new("nothing was recorded: the run ended before its first row"));
    }
    output.write_log(&log)?;
    output.write_json("summary.json", &summarise(experiment, &log, facts)?)
}
