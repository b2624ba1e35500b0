//! `rig commission`: from a rig that was just wired to one that may run experiments.

use std::io::{BufRead, IsTerminal, Write};
use std::path::PathBuf;
use std::sync::mpsc::{Receiver, channel};

use sha2::{Digest, Sha256};

use super::common::say;
use super::interrupt;
use super::port::PortArgs;
use crate::commission::report::Signature;
use crate::commission::{FRICTION_LOADS_NM, NORMAL_LOADS_N, Options, Person, Report, Rig, commission, steps};
use crate::files::output_dir::OutputDir;
use crate::input_error::{InputError, Kind};
use crate::provenance;

/// Commission a rig step by step: wires, signs, scales, drives, loops, trips
#[derive(clap::Args, Debug)]
#[command(after_long_help = "\
Example:
  rig commission --port /dev/ttyACM0 --by \"A. Fitter\" --out commissioning
  cargo virtual-bench --serve --link /tmp/rig            (in another terminal; its keys are what a hand does)
  rig commission --port /tmp/rig --out commissioning

Ten steps, in this order: identity, timing, channels, switches, encoders, bridges, arming, torque, speed, trips. The
first six look on while the drives are off: what the chip reads, and what it reads when you press, turn and hang weights
as asked. Then the drives are enabled without torque, then each motor gets a small torque with its loop open, then M2
turns slowly. The first step in which something is wrong is the last one, so nothing moves before its signs are known.
Lines that begin with > ask you for something. It goes on when the rig sees it; Enter says that it is done, where only
you can tell, or that nothing came of it. Ctrl-C ends it with the drives off.

Lift the elements off the disc before you begin. Weights hang still when you press Enter; loads are in the unit of the
bridge: force times lever arm for the torque ring.

Writes commissioning.json (every check with what was found and what is allowed, the settings and the build id of the
firmware, with hashes) and report.html, to print and sign. Exit status 3 where a check failed.")]
pub(super) struct Commission {
    #[command(flatten)]
    port: PortArgs,
    /// Folder for the report
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Who commissions, for the report
    #[arg(long, value_name = "NAME")]
    by: Option<String>,
    /// The ELF that was flashed: its hash goes into the report, and its build id is compared
    #[arg(long, value_name = "ELF")]
    elf: Option<PathBuf>,
    /// Known torques to hang on the torque ring, N m
    #[arg(long, value_name = "NM", num_args = 1.., allow_negative_numbers = true, default_values_t = FRICTION_LOADS_NM)]
    friction_loads_nm: Vec<f64>,
    /// Known forces to hang on the frame, N
    #[arg(long, value_name = "N", num_args = 1.., allow_negative_numbers = true, default_values_t = NORMAL_LOADS_N)]
    normal_loads_n: Vec<f64>,
    /// Torque of M2 that surely turns the disc; up to 1.75 times as much is used
    #[arg(long, value_name = "NM", default_value_t = 0.4)]
    small_torque_nm: f64,
    /// How long to wait for each thing done by hand, s
    #[arg(long, value_name = "S", default_value_t = 300.0)]
    patience_s: f64,
    /// How far the control rate may be off by this computer's clock, in percent; more for a served bench that falls
    /// behind real time
    #[arg(long, value_name = "PERCENT", default_value_t = 1.0)]
    clock_tolerance: f64,
    /// Store the scales and zeros that the weights gave
    #[arg(long)]
    store: bool,
}

impl Commission {
    /// Runs the command.
    pub(super) fn run(self) -> Result<(), InputError> {
        let options = self.options()?;
        let elf = self.elf.as_deref().map(Elf::read).transpose()?;
        let mut output = OutputDir::new(&self.out)?;
        interrupt::count_signals();
        let mut port = self.port.open()?;
        let mut person = AtTheTerminal::new();
        let mut rig = Rig::new(port.transport(), &mut person, options.patience_s);
        let (mut report, error) = commission(&mut rig, &options);
        let settings = rig.settings_by_name();
        report.settings_at_the_end(settings);
        let failed =
            report.failed().map(|check| format!("step {}: {}: {}", check.step, check.what, check.found));
        let ended = error.as_ref().map(ToString::to_string).or_else(|| failed.clone());
        let signature = Signature {
            by: self.by.clone(),
            made: provenance::now(),
            elf: elf.map(|elf| (elf.sha256, elf.build_id == report.build_id())),
            ended,
        };
        summarise(&report, &signature);
        let file = report.to_json(&signature);
        let sha256 = file["sha256"].as_str().unwrap_or_default().to_owned();
        output.write_json("commissioning.json", &file)?;
        output.write("report.html", report.to_page(&signature, &sha256).to_html())?;
        output.finish()?;
        match (error, failed) {
            (Some(error), _) => Err(error),
            (None, Some(failed)) => Err(InputError::new(format!("not passed: {failed}")).of_kind(Kind::Run)),
            (None, None) => Ok(()),
        }
    }

    fn options(&self) -> Result<Options, InputError> {
        let refuse = |option: &str, value: &dyn std::fmt::Display, allowed: &str| {
            Err(InputError::new("out of range").file(option).value(value).allowed(allowed))
        };
        for (option, loads, most) in [
            ("--friction-loads-nm", &self.friction_loads_nm, 100.0),
            ("--normal-loads-n", &self.normal_loads_n, 1e4),
        ] {
            if let Some(load) = loads.iter().find(|load| !(load.abs() <= most && **load != 0.0)) {
                return refuse(option, load, &format!("loads other than 0, up to {most}"));
            }
        }
        if !(0.05..=2.0).contains(&self.small_torque_nm) {
            return refuse("--small-torque-nm", &self.small_torque_nm, "0.05 to 2, in N m");
        }
        if !(0.5..=1e5).contains(&self.patience_s) {
            return refuse("--patience-s", &self.patience_s, "0.5 to 100000, in seconds");
        }
        if !(0.001..=100.0).contains(&self.clock_tolerance) {
            return refuse("--clock-tolerance", &self.clock_tolerance, "0.001 to 100, in percent");
        }
        Ok(Options {
            friction_loads_nm: self.friction_loads_nm.clone(),
            normal_loads_n: self.normal_loads_n.clone(),
            small_torque_nm: self.small_torque_nm,
            patience_s: self.patience_s,
            clock_tolerance: 0.01 * self.clock_tolerance,
            store: self.store,
        })
    }
}

fn summarise(report: &Report, signature: &Signature) {
    report.checks.iter().for_each(|check| say(&check.line()));
    say(&format!("{} of {} steps passed", report.steps_done.len(), steps().len()));
    say(&format!("settings SHA-256 {}", report.settings_sha256()));
    if let Some((hash, same)) = &signature.elf {
        let is = if *same { "is" } else { "is NOT" };
        say(&format!("ELF SHA-256 {hash}: it {is} the firmware that answered"));
    }
}

/// The ELF that was flashed.
struct Elf {
    sha256: String,
    build_id: String,
}

impl Elf {
    fn read(path: &std::path::Path) -> Result<Self, InputError> {
        let hex = |bytes: &[u8]| bytes.iter().map(|byte| format!("{byte:02x}")).collect::<String>();
        let bytes = std::fs::read(path).map_err(|error| InputError::io(path, "read", &error))?;
        let id = build_id(&bytes)
            .ok_or_else(|| InputError::in_file(path, "is no ELF with a build id").allowed("rig-firmware"))?;
        Ok(Self { sha256: hex(&Sha256::digest(&bytes)), build_id: hex(id) })
    }
}

/// The 20 bytes of the note that the linker writes: name of 4 bytes, 20 bytes of contents, type 3, "GNU".
fn build_id(elf: &[u8]) -> Option<&[u8]> {
    const NOTE: &[u8] = b"\x04\0\0\0\x14\0\0\0\x03\0\0\0GNU\0";
    let at =
        elf.starts_with(b"\x7fELF").then(|| elf.windows(NOTE.len()).position(|bytes| bytes == NOTE))??;
    elf.get(at + NOTE.len()..at + NOTE.len() + 20)
}

/// The person who reads stderr and types.
struct AtTheTerminal {
    lines: Receiver<()>,
    live: bool,
}

impl AtTheTerminal {
    fn new() -> Self {
        let (to, lines) = channel();
        // Reading blocks; the thread ends with the process, or where standard input does.
        std::thread::spawn(move || {
            for line in std::io::stdin().lock().lines() {
                if line.is_err() || to.send(()).is_err() {
                    break;
                }
            }
        });
        Self { lines, live: false }
    }

    fn clear(&mut self) {
        if std::mem::take(&mut self.live) {
            eprint!("\r\x1b[K");
        }
    }
}

impl Person for AtTheTerminal {
    fn say(&mut self, line: &str) {
        self.clear();
        eprintln!("rig: {line}");
    }

    fn ask_to(&mut self, what: &str) {
        self.clear();
        eprintln!("> {what}");
    }

    fn live(&mut self, line: &str) {
        if std::io::stderr().is_terminal() {
            self.live = true;
            eprint!("\r\x1b[K{line}");
            // What cannot be shown is not missed.
            let _ = std::io::stderr().flush();
        }
    }

    fn entered(&mut self) -> bool {
        self.lines.try_iter().count() > 0
    }

    fn gives_up(&mut self) -> bool {
        interrupt::count() > 0
    }
}
