//! The command line of `cargo virtual-bench`.

use crate::budget::{Budget, Cost};
use crate::campaign::kept::{Campaign, Kept};
use crate::campaign::{self, Plan, Run};
use crate::elf::Firmware;
use crate::error::BenchError;
use crate::experiment::{self, Done, ObserverResidual, Request};
use crate::firmware_build;
use crate::serve::miswired::Mistake;
use crate::serve::pace::Speed;
use crate::serve::{self, Served};
use crate::soak;
use clap::{ArgGroup, Parser};
use host_sim::cli::common::{SetArgs, say, wrong_argument};
use host_sim::cli::interrupt;
use host_sim::cli::progress::Progress;
use host_sim::files::experiment_file::ExperimentFile;
use host_sim::files::model_file::ModelFile;
use host_sim::files::output_dir::{self, OutputDir};
use host_sim::files::rig_file::RigFile;
use host_sim::input_error::InputError;
use host_sim::summary::{RunFacts, Summary, summarise};
use serde::Serialize;
use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

/// Exit status for bad input, as in `rig`.
const BAD_INPUT: u8 = 2;

/// Runs the release ELF on an emulated STM32H743 in closed loop with the plant.
#[derive(Parser, Debug)]
#[command(
    name = "virtual-bench",
    version,
    group(ArgGroup::new("what").required(true)),
    after_long_help = "\
Examples:
  cargo virtual-bench --experiment fig20 --out target/bench/fig20
  cargo virtual-bench --serve --link /tmp/rig --arm-when-asked
  cargo virtual-bench --faults --out target/bench/faults
  cargo virtual-bench --soak 3600
  cargo virtual-bench --write-budget
  cargo virtual-bench --experiment fig20 --observer model-extended.toml --out target/bench/extended

An experiment writes log.csv (as the host tool recorded it from the serial link), capture.csv (two seconds at the full
10 kHz around the step, read from the firmware's memory afterwards), summary.json (figures at the full rate where the
capture has it; what the observer's model left unexplained) and defmt.log (the firmware's log, decoded). Time on the bench is instructions: figures in microseconds are not the chip's.

--faults writes each run to faults.jsonl in --out as soon as it is done, and all of them to faults.json at the end. Ctrl-C
ends it with the table so far; the same command with the same --out then makes the runs that are left. It fails where a
run failed, and where a fault acted in none of its runs: nothing is known of that one.

--serve makes a board of it: the ELF runs in real time, prints the name of its serial port and then its log, and every
command of rig works on that port as on a board's. The keyboard is what a person would touch at the rig; ? shows the
keys. The rig's own time limits count its time, the host's the wall's: far from --speed 1 one of them may run out.
Exit status: 0 on success, 2 for bad input, 1 for everything else."
)]
struct Cli {
    /// fig18 … fig23, or an experiment file (TOML)
    #[arg(long, value_name = "NAME|FILE.toml", group = "what", requires = "out")]
    experiment: Option<String>,
    /// Make everything go wrong that can, and see that the firmware ends it
    #[arg(long, group = "what")]
    faults: bool,
    /// With --faults: instants drawn in each of the five states, each fault at each of them
    #[arg(long, value_name = "N", default_value_t = 20, requires = "faults")]
    instants: usize,
    /// With --faults: branches of a run at a time
    #[arg(long, value_name = "N", default_value_t = 2, requires = "faults")]
    jobs: usize,
    /// With --faults: only those with this in their name
    #[arg(long, value_name = "TEXT", requires = "faults")]
    only: Option<String>,
    /// Run experiments and commands drawn by a seed for so many seconds of the bench's time, and see that nothing is lost
    #[arg(long, value_name = "S", group = "what")]
    soak: Option<f64>,
    /// Run all experiments and a soak, and record anew what a control tick costs and how deep the stack goes (budget.toml)
    #[arg(long, group = "what")]
    write_budget: bool,
    /// Be a board: offer the serial link as a pseudo-terminal, until q or Ctrl-C
    #[arg(long, group = "what", conflicts_with_all = ["out", "patch_observer"])]
    serve: bool,
    /// With --serve: seconds of the bench in one of the wall, or max
    #[arg(long, value_name = "X|max", default_value = "1", requires = "serve")]
    speed: Speed,
    /// With --serve: a fixed name for the serial port, a symbolic link
    #[arg(long, value_name = "PATH", requires = "serve")]
    link: Option<PathBuf>,
    /// With --serve: turn the arm switch off and on whenever the rig asks for it
    #[arg(long, requires = "serve")]
    arm_when_asked: bool,
    /// With --serve: seed of the sensors' noise; with --faults: of the instants and the bits
    #[arg(long, value_name = "N", default_value_t = 1, conflicts_with_all = ["experiment", "write_budget"])]
    seed: u64,
    /// With --serve: wire the bench wrongly, to see what commissioning says; may be given several times
    #[arg(long, value_name = "MISTAKE", requires = "serve")]
    miswired: Vec<Mistake>,
    /// With --serve: lose every N-th row of telemetry on the way to the host, to see that it is counted
    #[arg(long, value_name = "N", default_value_t = 0, requires = "serve")]
    lose_every: u32,
    /// With --serve: end by itself after so many seconds of the bench's time
    #[arg(long, value_name = "S", requires = "serve")]
    for_s: Option<f64>,
    /// A contact patch of 20 bristles in the firmware's observer, to see what it costs
    #[arg(long, conflicts_with = "observer")]
    patch_observer: bool,
    /// Folder for the results
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Rig file (TOML) of the plant; where it differs from the assumed rig the firmware gets it as settings
    #[arg(long, value_name = "RIG.toml")]
    rig: Option<PathBuf>,
    /// Model file (TOML) of the elements on the disc
    #[arg(long, value_name = "MODEL.toml")]
    model: Option<PathBuf>,
    /// Model file (TOML) for the firmware's observer, uploaded over the link; that of the elements where left out
    #[arg(long, value_name = "MODEL.toml")]
    observer: Option<PathBuf>,
    /// This ELF in place of the one built from firmware/
    #[arg(long, value_name = "ELF")]
    elf: Option<PathBuf>,
    /// Replace results that are in the folder already
    #[arg(long)]
    force: bool,
    #[command(flatten)]
    set: SetArgs,
}

/// `summary.json` of the bench: that of the PC rig, and what only the bench knows.
#[derive(Serialize)]
struct BenchSummary {
    #[serde(flatten)]
    summary: Summary,
    instructions_per_tick: Cost,
    observer_residual: ObserverResidual,
    elf_sha256: String,
}

/// Parses the command line and does what it says.
#[must_use]
pub fn main() -> ExitCode {
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(error) => return refuse_arguments(&error),
    };
    match run(cli) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("virtual-bench: {error}");
            match error {
                BenchError::Input(_) => ExitCode::from(BAD_INPUT),
                _ => ExitCode::FAILURE,
            }
        }
    }
}

/// Help and version go out as they are; a wrong argument becomes one line.
fn refuse_arguments(error: &clap::Error) -> ExitCode {
    if !error.use_stderr() {
        // Nobody is left to tell where even the help cannot be printed.
        let _ = error.print();
        return ExitCode::SUCCESS;
    }
    eprintln!("virtual-bench: {}; see --help", wrong_argument(error));
    ExitCode::from(BAD_INPUT)
}

fn run(cli: Cli) -> Result<(), BenchError> {
    if cli.faults {
        return run_faults(&cli, &firmware(cli.elf.clone())?);
    }
    if let Some(seconds) = cli.soak {
        return run_soak(&cli, seconds, &firmware(cli.elf.clone())?);
    }
    if cli.write_budget {
        return Budget::write(&firmware(cli.elf)?, &mut |name, cost| {
            say(&format!("{name:<12} {cost}"));
        });
    }
    if cli.serve {
        return run_service(cli);
    }
    let experiment = cli.experiment.clone().unwrap_or_default();
    run_experiment(cli, &experiment)
}

fn run_service(cli: Cli) -> Result<(), BenchError> {
    let overrides = cli.set.overrides()?;
    overrides.only(true, true, false)?;
    if let Some(for_s) = cli.for_s.filter(|s| !(*s > 0.0 && *s < 1e9)) {
        let error = InputError::new("out of range").file("--for-s").value(for_s);
        return Err(error.allowed("more than 0, in seconds").into());
    }
    let model = ModelFile::read_or_assumed(cli.model.as_deref(), &overrides.model)?;
    let served = Served {
        rig: RigFile::read_or_assumed(cli.rig.as_deref(), &overrides.rig)?,
        observer: match &cli.observer {
            Some(path) => ModelFile::read(path, &[])?,
            None => model.clone(),
        },
        model,
        seed: cli.seed,
        speed: cli.speed,
        link: cli.link,
        arm_when_asked: cli.arm_when_asked,
        mistakes: cli.miswired,
        lose_every: cli.lose_every,
        for_s: cli.for_s,
    };
    serve::serve(&firmware(cli.elf)?, &served)
}

fn run_faults(cli: &Cli, firmware: &Firmware) -> Result<(), BenchError> {
    let plan = Plan {
        instants: cli.instants,
        seed: cli.seed,
        at_once: cli.jobs,
        only: cli.only.clone(),
        ..Plan::whole()
    };
    let total = plan.runs();
    let (mut stored, known) = match &cli.out {
        Some(out) => Stored::open(out, &Campaign::new(&plan, firmware)?, cli.force)
            .map(|(stored, known)| (Some(stored), known))?,
        None => (None, BTreeMap::new()),
    };
    let mut done = known.len();
    if done > 0 {
        eprintln!("virtual-bench: {done} of {total} runs are there already");
    }
    interrupt::count_signals();
    let started = Instant::now();
    let mut progress = Progress::new("faults", total as u64);
    progress.goes_on_from(done as u64);
    let runs = campaign::run(firmware, &plan, known, &mut |new| {
        if let Some(stored) = &mut stored {
            stored.kept.add(&new)?;
        }
        done += 1;
        progress.set(done as u64);
        if campaign::table::has_failed(new.run) {
            let Run { fault, state, at_ns, row } = new.run;
            eprintln!("{fault}, {}, at {at_ns} ns: {}", state.name(), row.problems.join("; "));
        }
        Ok(if interrupt::count() > 0 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) })
    })?;
    drop(progress);
    say(&campaign::table::table(&runs));
    say(&format!("{:.0} s", started.elapsed().as_secs_f64()));
    if runs.len() < total {
        let next = match &cli.out {
            Some(_) => "the same command goes on from there",
            None => "with --out the same command would go on from there",
        };
        return Err(BenchError::Stopped(format!("{} of {total} runs are done; {next}", runs.len())));
    }
    if let Some(Stored { mut output, .. }) = stored {
        output.write_json("faults.json", &runs)?;
        output.finish()?;
    }
    let failed = campaign::table::failed(&runs).len();
    let never = campaign::table::never_acted(&runs);
    if failed > 0 {
        Err(BenchError::Check(format!("{failed} of {} runs", campaign::table::counted(&runs))))
    } else if never.is_empty() {
        Ok(())
    } else {
        Err(BenchError::Check(format!("acted in none of their runs: {}", never.join(", "))))
    }
}

/// Where a campaign's runs go: each at once, and at the end all of them.
struct Stored {
    kept: Kept,
    output: OutputDir,
}

impl Stored {
    fn open(out: &Path, campaign: &Campaign, anew: bool) -> Result<(Self, BTreeMap<usize, Run>), InputError> {
        let is_begun = out.join(campaign::kept::NAME).exists();
        let mut output = if anew || is_begun { OutputDir::replacing(out)? } else { OutputDir::new(out)? };
        // Refused now and not at the end, if it is of a campaign whose runs are not there.
        output.write("faults.json", "")?;
        let (kept, known) = Kept::open(out, campaign, anew)?;
        Ok((Self { kept, output }, known))
    }
}

fn run_soak(cli: &Cli, seconds: f64, firmware: &Firmware) -> Result<(), BenchError> {
    let mut progress = Progress::new("soak", seconds as u64);
    let soaked = soak::soak(firmware, seconds, cli.seed, &mut |done| progress.set(done as u64))?;
    drop(progress);
    say(&format!("{soaked:#?}"));
    if soaked.problems.is_empty() { Ok(()) } else { Err(BenchError::Check(soaked.problems.join("; "))) }
}

fn firmware(elf: Option<PathBuf>) -> Result<Firmware, BenchError> {
    let path = match elf {
        Some(path) => path,
        None => firmware_build::release_elf()?,
    };
    Firmware::read(&path)
}

fn run_experiment(cli: Cli, name: &str) -> Result<(), BenchError> {
    let overrides = cli.set.overrides()?;
    let model = ModelFile::read_or_assumed(cli.model.as_deref(), &overrides.model)?;
    let request = Request {
        experiment: ExperimentFile::named_or_read(name, &overrides.experiment)?,
        rig: RigFile::read_or_assumed(cli.rig.as_deref(), &overrides.rig)?,
        observer: match &cli.observer {
            Some(path) => ModelFile::read(path, &[])?,
            None => model.clone(),
        },
        model,
        patch_observer: cli.patch_observer,
        capture: true,
    };
    let Some(out) = cli.out else { return Ok(()) };
    if cli.force {
        output_dir::allow_overwriting();
    }
    let mut output = OutputDir::new(&out)?;
    let firmware = firmware(cli.elf)?;
    let started = Instant::now();
    let mut progress: Option<Progress> = None;
    let done = experiment::run(&firmware, &request, |ticks, total| {
        progress
            .get_or_insert_with(|| Progress::new(&request.experiment.name, u64::from(total)))
            .set(u64::from(ticks));
    })?;
    let summary = summary(&request, &done, &firmware, started.elapsed().as_secs_f64())?;
    output.write_log(&done.csv())?;
    output.write_json("summary.json", &summary)?;
    if let Some(captured) = &done.captured {
        output.write("capture.csv", captured.log().to_csv())?;
    }
    output.write("defmt.log", done.log.lines.join("\n") + "\n")?;
    output.finish()?;
    let written: Vec<String> =
        output_dir::take_written().iter().map(|path| path.display().to_string()).collect();
    eprintln!("virtual-bench: wrote {}", written.join(", "));
    let complaints = done.complaints();
    if complaints.is_empty() { Ok(()) } else { Err(BenchError::Rig(complaints.join("; "))) }
}

fn summary(
    request: &Request,
    done: &Done,
    firmware: &Firmware,
    wall_s: f64,
) -> Result<BenchSummary, BenchError> {
    let health = done.run.health.unwrap_or_default();
    let facts = RunFacts {
        wall_s,
        simulated_s: done.record.last_at as f64 * 1e-9,
        control_ticks: health.tick,
        deadline_misses: u64::from(health.deadline_misses).max(done.ticks.late),
    };
    Ok(BenchSummary {
        summary: summarise(&request.experiment, &done.full_rate()?, facts)?,
        instructions_per_tick: Cost::of(&done.ticks),
        observer_residual: done.observer_residual(),
        elf_sha256: firmware.sha256.clone(),
    })
}
