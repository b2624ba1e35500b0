//! `rig simulate`: an experiment in closed loop on the PC.

use std::path::PathBuf;
use std::time::Instant;

use model_core::error::ParameterError;
use model_core::friction::series::SeriesParameters;

use super::common::{SetArgs, say};
use super::progress::Progress;
use crate::demo::ClosedLoop;
use crate::files::experiment_file::{ExperimentFile, Segment, Study};
use crate::files::log::Log;
use crate::files::model_file::ModelFile;
use crate::files::output_dir::OutputDir;
use crate::files::rig_file::RigFile;
use crate::files::strain_gauges::{FRICTION_ZERO, NORMAL_ZERO};
use crate::input_error::InputError;
use crate::lockstep::Setup;
use crate::plant::two_motor_file;
use crate::plant::two_motors::TwoMotorParameters;
use crate::plant::{ElementParameters, PERIOD_S, PERIODS_PER_S, left_out};
use crate::provenance;
use crate::report::{Block, Chart, Page, value};
use crate::studies::candidate_models::rubber_of;
use crate::studies::{patch_crossing, speed_sweep, two_motors};
use crate::summary::{RunFacts, Summary};

/// Run an experiment in closed loop on the PC: the firmware's control core, the plant behind it
#[derive(clap::Args, Debug)]
#[command(after_long_help = "\
Example:
  rig simulate --experiment fig20 --out target/fig20
  rig simulate --experiment fig20 --set model.parameters.c_u_n_s_per_m=300 --out target/stiffer
  rig simulate --experiment original --set rig.shaft.backlash_rad=0.01 --out target/original

Writes log.csv (what the firmware would send, 1 kHz unless the experiment says otherwise), summary.json (its
figures, taken at the full 10 kHz) and report.html (plots). fig26 and fig27 need no motors: they write
curves.csv in place of the log. original is the rig that the paper began with (host-sim/rigs/original.toml): its log is one
of a drive, which rig diagnose reads.")]
pub(super) struct Simulate {
    /// fig18 … fig23, fig26, fig27, original (two motors on a shaft), or an experiment file (TOML)
    #[arg(long, value_name = "NAME|FILE.toml")]
    experiment: String,
    /// Rig file (TOML); the assumed rig where left out
    #[arg(long, value_name = "RIG.toml")]
    rig: Option<PathBuf>,
    /// Model file (TOML) of the elements on the disc; the assumed series element where left out. Its
    /// extensions that act on friction (heat, wear, dwell …) act on the plant
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
        if let Study::TwoMotors { m1, m2 } = &experiment.study {
            let rig = two_motor_file::read_or_assumed(self.rig.as_deref(), &overrides.rig)?;
            provenance::note("seed of the sensors' noise", &experiment.seed.to_string());
            let mut output = OutputDir::new(&self.out)?;
            two_motors_run(&experiment, [m1, m2], &rig, &mut output)?;
            return output.finish();
        }
        let rig = RigFile::read_or_assumed(self.rig.as_deref(), &overrides.rig)?;
        let model = ModelFile::read_or_assumed(self.model.as_deref(), &overrides.model)?;
        let observer = match &self.observer {
            Some(path) => ModelFile::read(path, &[])?,
            None => model.clone(),
        };
        for id in left_out(&model) {
            eprintln!("rig: {}: extension {id} does not act on friction itself: left out", model.source);
        }
        if let Some(warning) = model.friction_model(PERIOD_S)?.warning() {
            eprintln!("rig: {}: {warning}", model.source);
        }
        provenance::note("seed of the sensors' noise", &experiment.seed.to_string());
        let bridges = [
            ("friction bridge", &rig.friction_bridge, "N m", FRICTION_ZERO),
            ("normal force bridge", &rig.normal_bridge, "N", NORMAL_ZERO),
        ];
        for (what, bridge, unit, zero_share) in bridges {
            if let Some(sensitivity) = bridge.sensitivity {
                say(&format!("{what:22} {}", sensitivity.words(unit, zero_share)));
            }
        }
        let mut output = OutputDir::new(&self.out)?;
        let started = Instant::now();
        match &experiment.study {
            // The original rig has been dealt with; whatever came here in its place, the core would refuse.
            Study::ClosedLoop { .. } | Study::TwoMotors { .. } => {
                closed_loop(&experiment, &rig, &model, &observer, &mut output)?;
            }
            Study::PatchCrossing(slip) => {
                let crossing = patch_crossing::run(slip, &rubber(&model)?).map_err(|e| named(e, &model))?;
                study(&experiment, &crossing.log(), crossing.chart(), started, &mut output)?;
            }
            Study::SpeedSweep(sweep) => {
                let sweep = speed_sweep::run(sweep, &rubber(&model)?).map_err(|e| named(e, &model))?;
                study(&experiment, &sweep.log(), sweep.chart(), started, &mut output)?;
            }
        }
        output.finish()
    }
}

fn closed_loop(
    experiment: &ExperimentFile,
    rig: &RigFile,
    model: &ModelFile,
    observer: &ModelFile,
    output: &mut OutputDir,
) -> Result<(), InputError> {
    let setup = Setup::from_files(experiment, rig, model, observer)?;
    let mut progress = Progress::new(&experiment.name, u64::from(setup.experiment.duration_ticks));
    let run = ClosedLoop::run(experiment, &setup, |done, _| progress.set(done as u64))?;
    drop(progress);
    let every = PERIODS_PER_S / experiment.log_rate_hz as usize;
    let mut log = run.recording.log(every, setup.plant.counts_per_rev);
    let mut note = |key: &str, value: String| log.metadata.push((key.into(), value));
    note("experiment", experiment.name.clone());
    note("elements", model.kind.name().into());
    note("seed", setup.seed.to_string());
    if let Some(fault) = run.recording.fault {
        note("fault", fault.to_string());
        let ended = run.summary.run.simulated_s;
        eprintln!("rig: {}: stopped after {ended} s: {fault}", experiment.name);
    }
    output.write_log(&log)?;
    output.write_json("summary.json", &run.summary)?;
    tell(&run.summary);
    output.write("report.html", run.page().to_html())
}

/// What came of it, in a few lines; `summary.json` has all of it.
fn tell(summary: &Summary) {
    let lines = [
        ("friction peak", summary.friction_peak_nm, "N m"),
        ("friction settled", summary.friction_settled_nm, "N m"),
        ("overshoot of friction", summary.friction_overshoot.map(|share| 100.0 * share), "%"),
        ("normal force settled", summary.normal_settled_n, "N"),
        ("lost in a period", summary.loop_energy_j.map(|energy| 1e3 * energy), "mJ"),
        ("damping ratio", summary.damping_ratio, ""),
    ];
    for (what, found, unit) in lines {
        if let Some(found) = found {
            say(format!("{what:22} {} {unit}", value::plain(found)).trim_end());
        }
    }
}

/// The original rig: no normal-load actuator, no rubber, and so neither model nor core.
fn two_motors_run(
    experiment: &ExperimentFile,
    segments: [&[Segment]; 2],
    rig: &TwoMotorParameters,
    output: &mut OutputDir,
) -> Result<(), InputError> {
    let started = Instant::now();
    let run = two_motors::run(experiment, segments, rig)?;
    let facts = RunFacts {
        wall_s: started.elapsed().as_secs_f64(),
        simulated_s: experiment.duration_s,
        ..RunFacts::default()
    };
    let mut log = run.log();
    log.metadata.push(("experiment".into(), experiment.name.clone()));
    log.metadata.push(("seed".into(), experiment.seed.to_string()));
    output.write_log(&log)?;
    output.write_json(
        "summary.json",
        &Summary { experiment: experiment.name.clone(), run: facts, ..Summary::default() },
    )?;
    let (torque_nm, twist_rad) = run.largest();
    say(&format!("{:22} {} N m", "largest shaft torque", value::plain(torque_nm)));
    say(&format!("{:22} {} mrad", "largest twist", value::plain(1e3 * twist_rad)));
    let chart = run.chart();
    let page = Page {
        title: experiment.title.clone(),
        lead: chart.caption.clone(),
        blocks: vec![Block::Chart(chart)],
    };
    output.write("report.html", page.to_html())
}

fn study(
    experiment: &ExperimentFile,
    log: &Log,
    chart: Chart,
    started: Instant,
    output: &mut OutputDir,
) -> Result<(), InputError> {
    let run = RunFacts { wall_s: started.elapsed().as_secs_f64(), ..RunFacts::default() };
    output.write("curves.csv", log.to_csv())?;
    output.write_json(
        "summary.json",
        &Summary { experiment: experiment.name.clone(), run, ..Summary::default() },
    )?;
    let lead = chart.caption.clone();
    let page = Page { title: experiment.title.clone(), lead, blocks: vec![Block::Chart(chart)] };
    output.write("report.html", page.to_html())
}

/// Block and bristles, which these studies compare.
fn rubber(model: &ModelFile) -> Result<SeriesParameters<f64>, InputError> {
    rubber_of(&ElementParameters::from_file(model)).ok_or_else(|| {
        InputError::new("this study needs block and bristles")
            .file(model.source.as_str())
            .key("kind")
            .value(model.kind.name())
            .allowed("series")
    })
}

fn named(error: ParameterError, model: &ModelFile) -> InputError {
    InputError::from(error).file(model.source.as_str())
}
