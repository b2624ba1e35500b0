//! `rig run` on the served bench, ended at a moment that nobody chose: by Ctrl-C, SIGTERM, a pulled cable, a full disk,
//! a killed host whose rig somebody looks at. The drives are off within the link's time limit or less, the file is whole
//! up to that moment and says why it ends, and nothing else is left.
//!
//! The moments come from a seed. All twenty of each kind take a quarter of an hour:
//! `cargo test --release -p virtual-bench --ignore-rust-version -- --ignored interrupted --nocapture`

use super::commission::{as_rig, tool};
use super::serve::Board;
use host_sim::files::journal;
use host_sim::files::log::Log;
use model_core::control::Fault;
use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

/// Silence of the host that is a fault, and the most that its last sign of life may be older than its last row, s.
const LINK_TIMEOUT_S: f64 = 0.5 + 0.1;
const EXPERIMENT: &str = "name = \"short\"\nduration_s = 2.5\n\
    [[m1]]\nstart_s = 0.0\ntorque_fraction = 0.4\n\
    [[m2]]\nstart_s = 0.0\nspeed_rad_s = 0.0\n[[m2]]\nstart_s = 0.1\nspeed_rad_s = 2.0\n";

/// How a run is ended.
#[derive(Debug, Clone, Copy, PartialEq)]
enum End {
    CtrlC,
    Terminate,
    PortGone,
    /// After so many kilobytes.
    DiskFull(u32),
    Killed,
}

/// A bench, and its log as it comes.
struct Bench {
    board: Board,
    lines: Receiver<String>,
    keyboard: std::process::ChildStdin,
}

impl Bench {
    fn new() -> Self {
        let mut board = Board::alone("interrupted", &["--arm-when-asked"]);
        let keyboard = board.bench.stdin.take().unwrap();
        let (to, lines) = channel();
        let stdout = board.take_lines();
        std::thread::spawn(move || stdout.lines().map_while(Result::ok).try_for_each(|line| to.send(line)));
        Self { board, lines, keyboard }
    }

    fn key(&mut self, key: u8) {
        self.keyboard.write_all(&[key]).unwrap();
    }

    /// Waits for a change of mode in the bench's log, and gives its tick.
    fn wait_for(&self, change: &str) -> u64 {
        let until = Instant::now() + Duration::from_secs(120);
        loop {
            let left = until.saturating_duration_since(Instant::now());
            let line = self.lines.recv_timeout(left).unwrap_or_else(|_| panic!("never {change}"));
            if line.contains(change) {
                let tick = line.split("tick ").nth(1).unwrap().split(':').next().unwrap();
                return tick.parse().unwrap();
            }
        }
    }

    /// The tick at which the drives went off.
    fn drives_off(&self) -> u64 {
        self.wait_for_any(&["-> Disabled", "-> Fault"])
    }

    fn wait_for_any(&self, changes: &[&str]) -> u64 {
        let until = Instant::now() + Duration::from_secs(120);
        loop {
            let left = until.saturating_duration_since(Instant::now());
            let line = self.lines.recv_timeout(left).unwrap_or_else(|_| panic!("never {changes:?}"));
            if changes.iter().any(|change| line.contains(change)) {
                return line.split("tick ").nth(1).unwrap().split(':').next().unwrap().parse().unwrap();
            }
        }
    }

    /// What is latched goes.
    fn clear(&self) {
        let mut tool = tool(&["rig", "settings", "clear-fault", "--port", self.board.link.to_str().unwrap()]);
        // Refused where nothing is latched.
        let _ = tool.stdout(Stdio::null()).stderr(Stdio::null()).status().unwrap();
    }
}

fn start(bench: &Bench, folder: &Path, end: End) -> Child {
    let file = folder.join("short.toml");
    std::fs::write(&file, EXPERIMENT).unwrap();
    let (file, out) = (file.display().to_string(), folder.join("out").display().to_string());
    let words =
        ["rig", "run", "--experiment", &file, "--out", &out, "--port", bench.board.link.to_str().unwrap()];
    let mut command = match end {
        End::DiskFull(kilobytes) => {
            let limited = format!("trap '' XFSZ; ulimit -f {kilobytes}; exec \"$0\" \"$@\"");
            let mut shell = Command::new("bash");
            shell.args(["-c", &limited]);
            as_rig(&mut shell, &words);
            shell
        }
        _ => tool(&words),
    };
    command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap()
}

fn names(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).unwrap();
    let mut names: Vec<String> = entries.map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

/// Ends a run after so many seconds, and looks at what is left.
fn interrupt(bench: &mut Bench, number: usize, end: End, at_s: f64) {
    let folder = std::env::temp_dir().join(format!("rig-interrupted-{}-{number}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let mut run = start(bench, &folder, end);
    let began = bench.wait_for("Armed -> Running");
    std::thread::sleep(Duration::from_secs_f64(at_s));
    // Somebody looks on, from before the end of the host: that keeps nothing alive.
    let watcher = (end == End::Killed).then(|| {
        let words = ["rig", "monitor", "--plain", "--port", bench.board.link.to_str().unwrap()];
        let mut monitor =
            tool(&words).stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::null()).spawn().unwrap();
        let mut lines = BufReader::new(monitor.stdout.take().unwrap()).lines().map_while(Result::ok);
        assert!(lines.any(|line| line.contains("running")), "it sees the run");
        (monitor, lines)
    });
    let signal = |run: &Child, signal: &str| {
        let sent = Command::new("kill").args([signal, &run.id().to_string()]).status().unwrap();
        assert!(sent.success());
    };
    match end {
        End::CtrlC => signal(&run, "-INT"),
        End::Terminate => signal(&run, "-TERM"),
        End::Killed => signal(&run, "-KILL"),
        End::PortGone => bench.key(b'u'),
        End::DiskFull(_) => {}
    }
    let off = bench.drives_off();
    if let Some((mut monitor, mut lines)) = watcher {
        let said = format!("fault {}", Fault::LinkLost.number());
        assert!(lines.any(|line| line.contains(&said)), "the monitor took the port over and shows why");
        monitor.kill().unwrap();
        monitor.wait().unwrap();
    }
    let code = run.wait().unwrap().code();
    let (name, why, expected) = match end {
        End::CtrlC | End::Terminate => ("log.csv", "stopped by the user", Some(3)),
        End::PortGone => ("log.csv", "silent", Some(4)),
        End::DiskFull(_) => (journal::NAME, "could not be stored", Some(5)),
        End::Killed => (journal::NAME, "the host went away", None),
    };
    assert_eq!(code, expected, "{end:?} after {at_s} s");
    let out: PathBuf = folder.join("out");
    let left = names(&out);
    // What could not be added to the one file may fit as a whole into the other, without what stands before its rows.
    let whole = matches!(end, End::DiskFull(_)) && left.iter().any(|name| name == "log.csv");
    let name = if whole { "log.csv" } else { name };
    let log = Log::read(&out.join(name)).unwrap();
    let reason = log.metadata(journal::KEY).unwrap();
    assert!(reason.contains(why), "{end:?}: {reason}");
    let allowed: &[&str] = if name == "log.csv" { &["log.csv", "summary.json"] } else { &[journal::NAME] };
    assert!(left.iter().all(|name| allowed.contains(&name.as_str())), "{end:?}: {left:?}");
    // Where nobody could ask it to stop, the rig has found out by itself.
    let last_row_s = log.time_s().last().copied().unwrap();
    let off_s = (off - began) as f64 * 1e-4;
    if matches!(end, End::PortGone | End::Killed) {
        assert!(off_s - last_row_s < LINK_TIMEOUT_S + 0.1, "{end:?}: last row {last_row_s} s, off {off_s} s");
    }
    println!(
        "{end:?} after {at_s:.3} s of the wall: {} rows, last at {last_row_s:.3} s, drives off at {off_s:.3} s",
        log.len()
    );
    if end == End::PortGone {
        bench.key(b'u');
    }
    std::thread::sleep(Duration::from_millis(300));
    bench.clear();
    std::fs::remove_dir_all(&folder).unwrap();
}

/// Uniform numbers from 0 to 1 by a linear congruential generator (Knuth's MMIX).
struct Moments(u64);

impl Moments {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }
}

fn times(count: usize, seed: u64) {
    let mut bench = Bench::new();
    let mut moments = Moments(seed);
    for number in 0..count {
        for (kind, end) in
            [End::CtrlC, End::Terminate, End::PortGone, End::DiskFull(0), End::Killed].into_iter().enumerate()
        {
            let moment = moments.next();
            // The bench goes at its own speed: a moment after 1.5 s of the wall could come after the end.
            let (end, at_s) = match end {
                // A row is some 110 bytes.
                End::DiskFull(_) => (End::DiskFull(4 + (140.0 * moment) as u32), 0.0),
                end => (end, 0.05 + 0.9 * moment),
            };
            interrupt(&mut bench, 5 * number + kind, end, at_s);
        }
    }
}

#[test]
fn a_run_that_is_ended_at_any_moment_leaves_the_rig_safe_and_a_whole_file() {
    times(2, 1);
}

#[test]
#[ignore = "a quarter of an hour; see the head of this file"]
fn twenty_moments_of_each_kind() {
    times(20, 20);
}
