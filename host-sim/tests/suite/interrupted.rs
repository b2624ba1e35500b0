//! What is left of a recording that something ended at a moment nobody chose: the user, the system, the cable, the
//! disk, a killed host. The rig is safe, the log is whole up to its last line and says why it ends, nothing else is left.

use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

use crate::fake_rig::bench::Bench;
use host_sim::files::journal::{self, Unfinished};
use host_sim::files::log::Log;
use model_core::control::{Fault, Mode};
use rustix::process::{Pid, Signal, kill_process};

/// Moments after the first row, s: the golden ratio's multiples lie nowhere in particular.
const MOMENTS: [f64; 5] = [0.02, 0.618, 0.236, 0.854, 0.472];

const EXPERIMENT: &str = "name = \"short\"\nduration_s = 3.0\n\
    [[m1]]\nstart_s = 0.0\ntorque_fraction = 0.4\n\
    [[m2]]\nstart_s = 0.0\nspeed_rad_s = 0.0\n[[m2]]\nstart_s = 0.1\nspeed_rad_s = 2.0\n";

/// A run on its way.
struct Run {
    bench: Bench,
    folder: tempfile::TempDir,
    child: Option<Child>,
}

impl Run {
    /// Starts it; `wrap` may put something around the command.
    fn start(wrap: impl Fn(&Bench, &[&str]) -> Command) -> Self {
        let bench = Bench::new();
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("short.toml");
        std::fs::write(&file, EXPERIMENT).unwrap();
        let out = folder.path().join("out");
        let arguments = [
            "run",
            "--experiment",
            file.to_str().unwrap(),
            "--out",
            out.to_str().unwrap(),
            "--port",
            &bench.port,
        ];
        let mut command = wrap(&bench, &arguments);
        let child = command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
        Self { bench, folder, child: Some(child) }
    }

    fn plain() -> Self {
        Self::start(|bench, arguments| bench.command(arguments))
    }

    fn out(&self) -> PathBuf {
        self.folder.path().join("out")
    }

    fn mode(&self) -> Mode {
        self.bench.rig.lock().unwrap().state.mode()
    }

    fn wait_until_it_runs(&self, and_s: f64) {
        let begun = Instant::now();
        while self.mode() != Mode::Running {
            assert!(begun.elapsed() < Duration::from_secs(60), "it does not start");
            std::thread::sleep(Duration::from_millis(5));
        }
        std::thread::sleep(Duration::from_secs_f64(and_s));
    }

    fn signal(&self, signal: Signal) {
        let pid = Pid::from_child(self.child.as_ref().unwrap());
        kill_process(pid, signal).unwrap();
    }

    fn end(&mut self) -> ExitStatus {
        self.child.take().unwrap().wait().unwrap()
    }

    /// The rig has its drives off; a rig that has to find that out by itself has its link's time limit for it.
    fn is_safe_within(&self, limit: Duration) {
        let begun = Instant::now();
        while !matches!(self.mode(), Mode::Disabled | Mode::Fault) {
            // The rig of the test runs slower than real time on a busy computer.
            assert!(begun.elapsed() < limit * 20, "still {:?}", self.mode());
            std::thread::sleep(Duration::from_millis(5));
        }
        assert_eq!(self.bench.rig.lock().unwrap().drive.drive_enable, [false; 2]);
    }
}

fn names(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).unwrap();
    let mut names: Vec<String> = entries.map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

fn whole_log(path: &Path, why: &str) -> Log {
    let log = Log::read(path).unwrap();
    let reason = log.metadata(journal::KEY).unwrap().to_owned();
    assert!(reason.contains(why), "{reason}");
    log
}

#[test]
fn ctrl_c_and_sigterm_bring_the_rig_to_rest_and_keep_the_log() {
    for (at_s, signal) in MOMENTS.into_iter().zip([Signal::INT, Signal::TERM].into_iter().cycle()) {
        let mut run = Run::plain();
        run.wait_until_it_runs(at_s);
        run.signal(signal);
        assert_eq!(run.end().code(), Some(3));
        // It waited for the rest, and disarmed.
        assert_eq!(run.mode(), Mode::Disabled);
        run.is_safe_within(Duration::ZERO);
        let left = names(&run.out());
        assert!(left == ["log.csv", "summary.json"] || left == ["log.csv"], "{left:?}");
        whole_log(&run.out().join("log.csv"), "stopped by the user");
    }
}

#[test]
fn a_second_ctrl_c_disarms_at_once() {
    let mut run = Run::plain();
    run.wait_until_it_runs(0.6);
    run.signal(Signal::INT);
    std::thread::sleep(Duration::from_millis(20));
    run.signal(Signal::INT);
    assert_eq!(run.end().code(), Some(3));
    run.is_safe_within(Duration::ZERO);
}

#[test]
fn a_signal_before_the_run_leaves_nothing_at_all() {
    let mut run = Run::plain();
    // While it waits for the switch, or asks for the rig's name.
    std::thread::sleep(Duration::from_millis(100));
    if run.mode() != Mode::Running {
        run.bench.rig.lock().unwrap().willing = false;
    }
    run.signal(Signal::INT);
    assert!(!run.end().success());
    run.is_safe_within(Duration::from_millis(500));
}

#[test]
fn a_port_that_is_gone_ends_the_run_with_its_log() {
    for at_s in MOMENTS {
        let mut run = Run::plain();
        run.wait_until_it_runs(at_s.max(0.1));
        run.bench.unplug();
        assert_eq!(run.end().code(), Some(4));
        let left = names(&run.out());
        assert!(left == ["log.csv", "summary.json"] || left == ["log.csv"], "{left:?}");
        whole_log(&run.out().join("log.csv"), "the port is gone");
    }
}

#[test]
fn a_full_disk_stops_the_rig_and_keeps_what_was_there_already() {
    for kilobytes in [8, 20, 33, 50, 64] {
        let mut run = Run::start(|_, arguments| {
            // A file may grow to so many blocks of 512 bytes, as on a full disk; the signal that goes with it is ignored.
            let limit = format!("trap '' XFSZ; ulimit -f {}; exec \"$0\" \"$@\"", 2 * kilobytes);
            let mut command = Command::new("sh");
            command.args(["-c", &limit, env!("CARGO_BIN_EXE_rig")]).args(arguments);
            command
        });
        assert_eq!(run.end().code(), Some(5), "{kilobytes} kB");
        run.is_safe_within(Duration::ZERO);
        // Where the last rows were few enough, what could not be added to the one file fits as a whole into the other.
        let left = names(&run.out());
        let whole = left.iter().any(|name| name == "log.csv");
        assert!(whole || left == [journal::NAME], "{kilobytes} kB: {left:?}");
        let name = if whole { "log.csv" } else { journal::NAME };
        let log = whole_log(&run.out().join(name), "could not be stored");
        assert!(log.len() > 10, "{}", log.len());
    }
}

#[test]
#[cfg(target_os = "linux")]
fn a_monitor_that_is_open_while_the_host_is_killed_sees_the_run_and_the_stop() {
    let mut run = Run::plain();
    run.wait_until_it_runs(0.3);
    let arguments = ["monitor", "--plain", "--seconds", "60", "--port", &run.bench.port];
    let mut monitor = run.bench.command(&arguments);
    let mut monitor = monitor.stdout(Stdio::piped()).stderr(Stdio::null()).spawn().unwrap();
    let mut lines = BufReader::new(monitor.stdout.take().unwrap()).lines().map_while(Result::ok);
    assert!(lines.any(|line| line.starts_with("running")), "it sees the run of the other command");
    run.signal(Signal::KILL);
    run.end();
    run.is_safe_within(Duration::from_millis(500));
    let said = format!("fault {}", Fault::LinkLost.number());
    assert!(lines.any(|line| line.contains(&said)), "it took the port over and shows why the rig stopped");
    monitor.kill().unwrap();
    monitor.wait().unwrap();
}

#[test]
fn a_killed_host_leaves_its_log_and_the_rig_stops_by_itself() {
    for at_s in MOMENTS {
        let mut run = Run::plain();
        run.wait_until_it_runs(at_s.max(0.5));
        run.signal(Signal::KILL);
        run.end();
        run.is_safe_within(Duration::from_millis(500));
        assert_eq!(names(&run.out()), [journal::NAME]);
        let log = whole_log(&run.out().join(journal::NAME), "the host went away");
        assert!(log.len() > 20, "{}", log.len());
        // The next run names it, and does not write over it.
        let out = run.out();
        let file = run.folder.path().join("short.toml");
        let next = ["run", "--experiment", file.to_str().unwrap(), "--out", out.to_str().unwrap()];
        let refused = run.bench.rig(&next);
        assert_eq!(refused.status.code(), Some(2));
        let said = String::from_utf8(refused.stderr).unwrap();
        assert!(said.contains("a recording that was never finished") && said.contains("--force"), "{said}");
        assert_eq!(Unfinished::beside(&run.folder.path().join("elsewhere")).len(), 1);
    }
}
