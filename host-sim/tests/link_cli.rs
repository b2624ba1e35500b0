//! `rig run`, `record`, `monitor` and `settings` as a user runs them, against a rig behind a pseudo-terminal.
#![cfg(unix)]
#![allow(clippy::unwrap_used)]

mod fake_rig;

use std::os::fd::AsRawFd;
use std::path::PathBuf;
use std::process::{Command, Output};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::Duration;

use fake_rig::{Rig, setup};
use host_sim::files::log::Log;
use host_sim::files::signal::Signal;
use serial2::SerialPort;

/// A rig behind a port of its own, as long as this lives.
struct Bench {
    port: String,
    /// Keeps the terminal there between two commands.
    _end: SerialPort,
    rig: Arc<Mutex<Rig>>,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Bench {
    fn new() -> Self {
        let (_, setup) = setup("fig20");
        let mut rig = Rig::new(&setup);
        rig.willing = true;
        let rig = Arc::new(Mutex::new(rig));
        let (mut rig_end, tool_end) = SerialPort::pair().unwrap();
        let link = format!("/proc/self/fd/{}", tool_end.as_raw_fd());
        let port = std::fs::read_link(link).unwrap().display().to_string();
        rig_end.set_read_timeout(Duration::from_millis(1)).unwrap();
        let stop = Arc::new(AtomicBool::new(false));
        let (shared, ends) = (Arc::clone(&rig), Arc::clone(&stop));
        let thread = std::thread::spawn(move || {
            let mut buffer = [0; 4096];
            while !ends.load(Ordering::Relaxed) {
                let count = rig_end.read(&mut buffer).unwrap_or(0);
                let out = shared.lock().unwrap().millisecond(&buffer[..count]);
                rig_end.write_all(&out).unwrap();
            }
        });
        Self { port, _end: tool_end, rig, stop, thread: Some(thread) }
    }

    fn rig(&self, arguments: &[&str]) -> Output {
        let mut command = Command::new(env!("CARGO_BIN_EXE_rig"));
        let (subcommand, rest) = arguments.split_first().unwrap();
        command.arg(subcommand).arg("--port").arg(&self.port).args(rest).output().unwrap()
    }
}

impl Drop for Bench {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            thread.join().unwrap();
        }
    }
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).unwrap()
}

fn folder() -> (tempfile::TempDir, PathBuf) {
    let parent = tempfile::tempdir().unwrap();
    let out = parent.path().join("out");
    (parent, out)
}

#[test]
fn settings_are_listed_changed_and_refused() {
    let bench = Bench::new();
    let list = bench.rig(&["settings", "list"]);
    assert!(list.status.success(), "{}", text(&list.stderr));
    assert_eq!(text(&list.stdout).lines().count(), rig_link::settings::ALL.len() + 1);
    let set = bench.rig(&["settings", "set", "geometry.friction_radius_m=0.07"]);
    let line = text(&set.stdout);
    let words: Vec<&str> = line.split_whitespace().collect();
    assert_eq!(words, ["geometry.friction_radius_m", "0.07", "0.07", "0.06", "m"]);
    let refused = bench.rig(&["settings", "set", "geometry.friction_radius_m=-1"]);
    assert_eq!(refused.status.code(), Some(2));
    let error = text(&refused.stderr);
    assert!(error.contains("geometry.friction_radius_m = -1: refused by the rig; allowed: 0.001"), "{error}");
    assert_eq!(bench.rig.lock().unwrap().config.settings().geometry.friction_radius_m, 0.07);
}

#[test]
fn a_model_file_reaches_the_rig() {
    let bench = Bench::new();
    let (parent, _) = folder();
    let file = parent.path().join("model.toml");
    std::fs::write(&file, host_sim::files::model_file::ModelFile::assumed(&[]).unwrap().to_toml()).unwrap();
    let output = bench.rig(&["settings", "model", file.to_str().unwrap()]);
    assert!(output.status.success(), "{}", text(&output.stderr));
    assert_eq!(bench.rig.lock().unwrap().model, Some(rig_link::model::ModelRecord::default()));
}

#[test]
fn a_recording_becomes_a_log() {
    let bench = Bench::new();
    let (_parent, out) = folder();
    let output = bench.rig(&["record", "--seconds", "0.3", "--out", out.to_str().unwrap()]);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let log = Log::read(&out.join("log.csv")).unwrap();
    assert_eq!(log.len(), 301);
    assert_eq!(log.metadata("rows_missing"), Some("0"));
    // Nothing presses and nothing turns.
    assert!(log.signal(Signal::NormalForce).unwrap().iter().all(|force| force.abs() < 1.0));
}

#[test]
fn an_experiment_is_run_recorded_and_summarised() {
    let bench = Bench::new();
    let (parent, out) = folder();
    let file = parent.path().join("short.toml");
    let text_of = "name = \"short\"\nduration_s = 1.0\n\
        [[m1]]\nstart_s = 0.0\ntorque_fraction = 0.4\n\
        [[m2]]\nstart_s = 0.0\nspeed_rad_s = 0.0\n[[m2]]\nstart_s = 0.4\nspeed_rad_s = 2.0\n";
    std::fs::write(&file, text_of).unwrap();
    let arguments = ["run", "--experiment", file.to_str().unwrap(), "--out", out.to_str().unwrap()];
    let output = bench.rig(&arguments);
    assert!(output.status.success(), "{}", text(&output.stderr));
    assert!(text(&output.stderr).contains("turn its arm switch off and on"));
    let log = Log::read(&out.join("log.csv")).unwrap();
    assert_eq!(log.time_s().last().copied(), Some(0.999));
    assert!(log.signal(Signal::FrictionTorque).unwrap().iter().any(|torque| *torque > 1.0));
    let summary = std::fs::read_to_string(out.join("summary.json")).unwrap();
    assert!(summary.contains("\"deadline_misses\": 0"), "{summary}");
}

#[test]
fn watching_shows_mode_and_values() {
    let bench = Bench::new();
    let output = bench.rig(&["monitor", "--seconds", "1.2"]);
    assert!(output.status.success(), "{}", text(&output.stderr));
    assert!(text(&output.stdout).contains("disabled"), "{}", text(&output.stdout));
    assert!(text(&output.stderr).contains("firmware"));
}
