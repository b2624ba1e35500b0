//! The bench as a board: the link code of `rig` on the pseudo-terminal of a bench in a process of its own.

use super::runs;
use host_sim::files::experiment_file::ExperimentFile;
use host_sim::files::rig_file::RigFile;
use host_sim::input_error::InputError;
use host_sim::link::client::Client;
use host_sim::link::procedure::{Procedure, perform};
use host_sim::link::record::Record;
use host_sim::link::rows;
use host_sim::link::run_experiment::{RunExperiment, RunOptions};
use host_sim::link::serial::Serial;
use model_core::control::{Fault, Mode};
use rig_link::telemetry::TelemetryRow;
use std::io::{BufRead, BufReader, Write};
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::time::Duration;
use virtual_bench::firmware_build;

/// A served bench, as long as this lives.
pub(super) struct Board {
    pub(super) bench: Child,
    lines: BufReader<std::process::ChildStdout>,
    pub(super) link: PathBuf,
}

impl Board {
    /// A bench whose arm switch is turned when the rig asks for it.
    fn new(name: &str, more: &[&str]) -> Self {
        Self::alone(name, &[&["--arm-when-asked"], more].concat())
    }

    /// A bench at which nothing happens by itself.
    pub(super) fn alone(name: &str, more: &[&str]) -> Self {
        let link = std::env::temp_dir().join(format!("rig-serve-{name}-{}", std::process::id()));
        let mut bench = Command::new(env!("CARGO_BIN_EXE_virtual-bench"))
            .args(["--serve", "--speed", "max", "--link"])
            .arg(&link)
            .arg("--elf")
            .arg(firmware_build::release_elf().unwrap())
            .args(more)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let mut lines = BufReader::new(bench.stdout.take().unwrap());
        let mut first = String::new();
        lines.read_line(&mut first).unwrap();
        assert_eq!(first.trim(), format!("port: {}", link.display()));
        Self { bench, lines, link }
    }

    /// The rest of its log, for somebody else to read.
    pub(super) fn take_lines(&mut self) -> BufReader<std::process::ChildStdout> {
        let nothing = Command::new("true").stdout(Stdio::piped()).spawn().unwrap().stdout.take().unwrap();
        std::mem::replace(&mut self.lines, BufReader::new(nothing))
    }

    pub(super) fn perform<P: Procedure>(
        &self,
        procedure: &mut P,
        each: impl FnMut(&mut P),
    ) -> Result<P::Outcome, InputError> {
        let mut serial = Serial::open(self.link.to_str().unwrap()).unwrap();
        perform(&mut serial, &mut Client::new(), procedure, |_| {}, each)
    }

    /// Presses q, and gives the rest of the log.
    fn quit(mut self) -> String {
        self.bench.stdin.take().unwrap().write_all(b"q").unwrap();
        let rest: Vec<String> = BufRead::lines(&mut self.lines).map(Result::unwrap).collect();
        assert!(self.bench.wait().unwrap().success());
        assert!(self.link.symlink_metadata().is_err(), "the link goes with the bench");
        rest.join("\n")
    }
}

impl Drop for Board {
    fn drop(&mut self) {
        // Both fail where it has ended already.
        let _ = self.bench.kill();
        let _ = self.bench.wait();
    }
}

fn procedure(experiment: &str) -> RunExperiment {
    let file = ExperimentFile::named_or_read(experiment, &[]).unwrap();
    let rig = RigFile::assumed_rig(&[]).unwrap();
    RunExperiment::new(file.for_core(&rig).unwrap(), RunOptions::default())
}

/// Root mean square of a difference between two runs' friction torque, over that of the friction torque.
fn friction_nrmse(one: &[TelemetryRow], other: &[TelemetryRow]) -> f64 {
    let square = |torque: f32| f64::from(torque).powi(2);
    let pairs = one.iter().zip(other);
    let off: f64 = pairs.map(|(a, b)| square(a.friction_torque_nm - b.friction_torque_nm)).sum();
    let all: f64 = other.iter().map(|row| square(row.friction_torque_nm)).sum();
    (off / all).sqrt()
}

/// The noise of the sensors began at another moment; what is measured is the same. Noise alone makes 0.2 to 0.35 %.
const NOISE_NRMSE: f64 = 0.01;

/// When the host is kept from running, and for how long.
const STARVED_AT: u32 = 30_000;
const STARVED: Duration = Duration::from_secs(2);

/// Runs an experiment on a served bench, and as `cargo virtual-bench` runs it.
fn is_the_same_run(experiment: &'static str) {
    let board = Board::new(experiment, &[]);
    let mut starved = false;
    let record = board.perform(&mut procedure(experiment), |procedure| {
        // A computer that has no time for the host for a while: several times the rig's limit for a silent one.
        if procedure.progress_ticks() > STARVED_AT && !std::mem::replace(&mut starved, true) {
            std::thread::sleep(STARVED);
        }
    });
    let record = record.unwrap();
    assert!(starved);
    let log = board.quit();
    assert_eq!(
        (record.fault, rows::missing(&record.rows), record.frames_rejected),
        (None, 0, 0),
        "{experiment}"
    );
    let own = runs::run(experiment);
    assert_eq!(record.rows.len(), own.run.rows.len(), "{experiment}");
    let nrmse = friction_nrmse(&record.rows, &own.run.rows);
    println!("{experiment}: {} rows, none lost, friction NRMSE {:.2} %", record.rows.len(), 100.0 * nrmse);
    assert!(nrmse < NOISE_NRMSE, "{experiment}: {nrmse}");
    assert!(log.contains("info start after PowerOn") && log.contains("Armed -> Running"), "{log}");
}

#[test]
fn a_run_on_the_served_bench_is_the_run_of_the_bench_and_loses_nothing() {
    is_the_same_run("fig22");
}

#[test]
#[ignore = "three minutes: cargo test --release -p virtual-bench --ignore-rust-version -- --ignored served --nocapture"]
fn each_figure_on_the_served_bench_is_that_of_the_bench() {
    runs::FIGURES.into_iter().for_each(is_the_same_run);
}

#[test]
fn rows_lost_on_the_way_are_counted_exactly() {
    let board = Board::new("lose", &["--lose-every", "50"]);
    let recorded = board.perform(&mut Record::new(10, 1.02, true), |_| {}).unwrap();
    let sent = u64::from(recorded.rows.last().unwrap().sequence) + 1;
    assert_eq!(rows::missing(&recorded.rows), sent / 50);
    assert_eq!(recorded.rows.len() as u64 + rows::missing(&recorded.rows), sent);
}

#[test]
fn a_rig_whose_host_is_gone_stops_although_somebody_looks_on() {
    let board = Board::new("gone", &[]);
    let mut run = procedure("fig20");
    let mut serial = Serial::open(board.link.to_str().unwrap()).unwrap();
    // The host vanishes in the middle of the run: its port closes, and nobody says anything to the rig.
    perform(&mut serial, &mut Client::new(), &mut UntilItMoves(&mut run), |_| {}, |_| {}).unwrap();
    drop(serial);
    let mut watch = Record::new(10, 1.5, true);
    let recorded = board.perform(&mut watch, |_| {}).unwrap();
    let last = recorded.rows.last().unwrap();
    assert_eq!((last.mode, last.fault), (Mode::Fault.number(), Fault::LinkLost.number()));
}

/// A run that is left alone after half a second.
struct UntilItMoves<'a>(&'a mut RunExperiment);

impl Procedure for UntilItMoves<'_> {
    type Outcome = ();

    fn step(&mut self, now_s: f64, client: &mut Client) -> Result<(), InputError> {
        self.0.step(now_s, client)
    }

    fn outcome(&mut self) -> Option<()> {
        (self.0.progress_ticks() >= 5_000).then_some(())
    }
}
