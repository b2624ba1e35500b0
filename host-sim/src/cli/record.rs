//! `rig record`: what the rig does, without commanding it.

use std::path::PathBuf;

use rig_link::capture::CaptureTrigger;

use super::common::{say, warn};
use super::interrupt;
use super::keeper::Keeper;
use super::port::{Port, PortArgs, every_ticks, sign};
use crate::files::journal;
use crate::files::output_dir::{OutputDir, note_written};
use crate::input_error::{InputError, Kind};
use crate::link::capture::ReadCapture;
use crate::link::record::Record;
use crate::link::rows::{self, Zero};

/// Record what the rig does, without commanding it
#[derive(clap::Args, Debug)]
#[command(after_long_help = "\
Example:
  rig record --port /dev/ttyACM0 --seconds 10 --out runs/by-hand
  rig record --port /dev/ttyACM0 --capture fault --out runs/last-fault

Writes log.csv. Without --capture: telemetry for so many seconds. With --capture: every tick of the 10 kHz
loop for 1.024 s before and after the trigger, from the firmware's memory; time 0 is the trigger.
Triggers: start (of an experiment), fault, now, friction=CODE or normal=CODE (the bridge's 16 bit code rises
above it), armed (do not arm, read the capture that is armed already).")]
pub(super) struct RecordArgs {
    #[command(flatten)]
    port: PortArgs,
    /// How long
    #[arg(long, value_name = "S", default_value_t = 10.0, conflicts_with = "capture")]
    seconds: f64,
    /// Rows per second
    #[arg(long, value_name = "HZ", default_value_t = 1000, conflicts_with = "capture")]
    rate_hz: u32,
    /// Capture every tick around a trigger: start, fault, now, friction=CODE, normal=CODE, armed
    #[arg(long, value_name = "TRIGGER")]
    capture: Option<String>,
    /// Folder for the results
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

enum Wanted {
    Armed,
    Now,
    At(CaptureTrigger),
}

fn trigger(text: &str) -> Result<Wanted, InputError> {
    let refuse = || {
        InputError::new("is no trigger")
            .file("--capture")
            .value(text)
            .allowed("start, fault, now, friction=CODE, normal=CODE (0 … 65535), armed")
    };
    let code = |code: &str| code.parse::<u16>().map_err(|_| refuse());
    Ok(match text.split_once('=') {
        None if text == "start" => Wanted::At(CaptureTrigger::Start),
        None if text == "fault" => Wanted::At(CaptureTrigger::Fault),
        None if text == "now" => Wanted::Now,
        None if text == "armed" => Wanted::Armed,
        Some(("friction", above)) => Wanted::At(CaptureTrigger::FrictionAbove { code: code(above)? }),
        Some(("normal", above)) => Wanted::At(CaptureTrigger::NormalAbove { code: code(above)? }),
        _ => return Err(refuse()),
    })
}

impl RecordArgs {
    /// Runs the command.
    pub(super) fn run(self) -> Result<(), InputError> {
        if !(self.seconds > 0.0 && self.seconds <= 3600.0) {
            let error = InputError::new("out of range").file("--seconds").value(self.seconds);
            return Err(error.allowed("more than 0, up to 3600"));
        }
        let every_ticks = every_ticks(self.rate_hz)?;
        let wanted = self.capture.as_deref().map(trigger).transpose()?;
        let output = OutputDir::new(&self.out)?;
        interrupt::count_signals();
        let port = self.port.open()?;
        match wanted {
            None => telemetry(output, port, every_ticks, self.seconds),
            Some(wanted) => capture(output, port, &wanted),
        }
    }
}

fn telemetry(
    mut output: OutputDir,
    mut port: Port,
    every_ticks: u16,
    seconds: f64,
) -> Result<(), InputError> {
    let mut procedure = Record::new(every_ticks, seconds, true);
    let mut keeper = Keeper::new(output.folder(), &[], Zero::FirstRow);
    let mut full = None;
    let mut stopped = false;
    let done = port.perform_with(&mut procedure, |procedure| {
        if interrupt::count() > 0 {
            stopped = true;
            procedure.finish_early();
        }
        if let Some(so_far) = procedure.recorded()
            && !keeper.look(&so_far.rows, &so_far.scale, &so_far.hello)
            && full.is_none()
        {
            full = keeper.take_error();
            procedure.finish_early();
        }
    });
    let (recorded, lost) = match done {
        Ok(recorded) => (Some(recorded), None),
        Err(error) => (procedure.recorded().cloned(), Some(error)),
    };
    let Some(recorded) = recorded.filter(|recorded| !recorded.rows.is_empty()) else {
        let nothing = || InputError::new("ended before anything was recorded").of_kind(Kind::Run);
        return Err(lost.unwrap_or_else(nothing));
    };
    keeper.keep(&recorded.rows, &recorded.scale, &recorded.hello);
    let ended = match (&lost, stopped) {
        (Some(error), _) => error.to_string(),
        (None, true) => interrupt::BY_USER.to_owned(),
        (None, false) => "when it was long enough".to_owned(),
    };
    let mut log = rows::log(&recorded.rows, &recorded.scale, Zero::FirstRow);
    log.metadata.push((journal::KEY.into(), ended.clone()));
    sign(&mut log, &recorded.hello, rows::missing(&recorded.rows));
    match output.write_log(&log).and_then(|()| output.finish()) {
        Ok(()) => keeper.discard(),
        Err(error) => {
            if let Some(path) = keeper.leave(&ended) {
                warn(&format!("what was recorded is in {}", path.display()));
                note_written(path);
            }
            return Err(lost.unwrap_or(error));
        }
    }
    say(&format!("{} rows", log.len()));
    lost.or(full).map_or(Ok(()), Err)
}

fn capture(mut output: OutputDir, mut port: Port, wanted: &Wanted) -> Result<(), InputError> {
    let mut procedure = match wanted {
        Wanted::Armed => ReadCapture::new(None),
        Wanted::Now => ReadCapture::now(),
        Wanted::At(trigger) => ReadCapture::new(Some(*trigger)),
    };
    let captured = port.perform_with(&mut procedure, |procedure| {
        if interrupt::count() > 0 {
            procedure.give_up(interrupt::BY_USER);
        }
    })?;
    let mut log = captured.log();
    sign(&mut log, &captured.hello, 0);
    output.write_log(&log)?;
    output.finish()?;
    say(&format!("{} rows", log.len()));
    Ok(())
}
