//! `rig simulate`: an experiment in closed loop on the PC.

use std::path::PathBuf;
use std::time::Instant;

use super::common::SetArgs;
use super::progress::Progress;
use crate::files::experiment_file::ExperimentFile;
use crate::files::model_file::ModelFile;
use crate::files::output_dir::OutputDir;
use crate::files::rig_file::RigFile;
use crate::input_error::InputError;
use crate::lockstep::{self, Setup};
use crate::summary::{RunFacts, summarise};

/// Run an experiment in closed loop on the PC: the firmware's control core, the plant behind it
#[derive(clap::Args, Debug)]
#[command(after_long_help = "\
Example:
  rig simulate --experiment fig20 --out target/fig20
  rig simulate --experiment fig20 --set model.parameters.c_u_n_s_per_m=300 --out target/stiffer

Writes log.csv (what the firmware would send, 1 kHz unless the experiment says otherwise), summary.json (its
figures, taken at the full 10 kHz) and report.html (plots). fig26 and fig27 need no motors: they write
curves.csv in place of the log.")]
pub(super) struct Simulate {
    /// fig18 … fig23, fig26, fig27, or an experiment file (TOML)
    #[arg(long, value_name = "NAME|FILE.toml")]
    experiment: String,
    /// Rig file (TOML); the assumed rig where left out
    #[arg(long, value_name = "RIG.toml")]
    rig: Option<PathBuf>,
    /// Model file (TOML) of the elements on the disc; the assumed series element where left out
    #[arg(long, value_name = "MODEL.toml")]
    model: Option<PathBuf>,
    /// Model file (TOML) that the controller's observer runs; that of the elements where left out
    #[arg(long, value_name = "MODEL.toml")]
    observer: Option<PathBuf>,
    /// Folder for the results
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    #[command(flatten)]
    set: SetArgs,
}

impl Simulate {
    /// Runs the command.
    pub(super) fn run(self) -> Result<(), InputError> {
        let overrides = self.set.overrides()?;
        let experiment = ExperimentFile::named_or_read(&self.experiment, &overrides.experiment)?;
        let rig = RigFile::read_or_assumed(self.rig.as_deref(), &overrides.rig)?;
        let model = ModelFile::read_or_assumed(self.model.as_deref(), &overrides.model)?;
        let observer = match &self.observer {
            Some(path) => ModelFile::read(path, &[])?,
            None => model.clone(),
        };
        let mut output = OutputDir::new(&self.out)?;
        let started = Instant::now();
        let setup = Setup::from_files(&experiment, &rig, &model, &observer)?;
        let mut progress = Progress::new(&experiment.name, u64::from(setup.experiment.duration_ticks));
        let recording = lockstep::run(&setup, |done, _| progress.set(done as u64))?;
        let facts = RunFacts {
            wall_s: started.elapsed().as_secs_f64(),
            simulated_s: recording.time_s(recording.frames.len()),
            control_ticks: recording.control_ticks,
            deadline_misses: recording.deadline_misses,
        };
        let counts = setup.plant.counts_per_rev;
        let summary = summarise(&experiment, &recording.signals(counts), facts)?;
        output.write_log(&recording.log(10_000 / experiment.log_rate_hz as usize, counts))?;
        output.write_json("summary.json", &summary)?;
        if let Some(fault) = recording.fault {
            eprintln!("rig: {}: stopped after {} s: {fault}", experiment.name, facts.simulated_s);
        }
        output.finish()
    }
}
