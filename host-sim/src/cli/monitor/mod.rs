//! `rig monitor`: what the rig does, as plots on the terminal or as lines.

mod history;
mod plain;
mod screen;

use std::io::IsTerminal;

use super::interrupt;
use super::port::{Port, PortArgs};
use crate::input_error::InputError;
use crate::link::client::Client;
use crate::link::procedure::Procedure;
use crate::link::record::{Record, Recorded};
use history::History;
use screen::Screen;

/// Show what the rig does: live plots on the terminal, or lines
#[derive(clap::Args, Debug)]
#[command(after_long_help = "\
Example:
  rig monitor --port /dev/ttyACM0
  rig monitor --port /dev/ttyACM0 --plain

On a terminal: forces, speed, torques and what the observer leaves of the friction torque over the last --span
seconds; mode, fault and limits in words; load of the control loop, rows and frames that were lost. Keys: q ends
it, + and - change the time shown, the space bar holds the picture. NO_COLOR is respected.
With --plain, or where the output is no terminal: a line twice a second, and a line for each event.
Commands nothing, and does not keep a run alive whose host is gone.")]
pub(super) struct Monitor {
    #[command(flatten)]
    port: PortArgs,
    /// Lines in place of the screen
    #[arg(long)]
    plain: bool,
    /// Time shown, in seconds
    #[arg(long, value_name = "S", default_value_t = 10.0)]
    span: f64,
    /// End by itself after so many seconds
    #[arg(long, value_name = "S", default_value_t = 86400.0)]
    seconds: f64,
}

/// A recording that keeps the last rows only.
pub(super) struct Watching {
    record: Record,
    history: History,
}

impl Watching {
    fn new(every_ticks: u16, seconds: f64, span_s: f64) -> Self {
        Self { record: Record::new(every_ticks, seconds, true), history: History::new(span_s) }
    }
}

impl Procedure for Watching {
    type Outcome = Recorded;

    fn step(&mut self, now_s: f64, client: &mut Client) -> Result<(), InputError> {
        self.record.step(now_s, client)?;
        self.history.frames_rejected = client.frames_rejected();
        for note in self.record.notes() {
            self.history.note(note);
        }
        let rows = self.record.take_rows();
        if let Some(recorded) = self.record.recorded() {
            self.history.health = recorded.health;
            self.history.tick_hz = recorded.scale.tick_hz;
        }
        self.history.take(&rows);
        Ok(())
    }

    fn outcome(&mut self) -> Option<Recorded> {
        self.record.outcome()
    }

    fn notes(&mut self) -> Vec<String> {
        self.history.take_notes()
    }
}

impl Monitor {
    /// Runs the command.
    pub(super) fn run(self) -> Result<(), InputError> {
        if !(0.5..=3600.0).contains(&self.span) {
            let error = InputError::new("out of range").file("--span").value(self.span);
            return Err(error.allowed("0.5 to 3600, in seconds"));
        }
        interrupt::count_signals();
        let mut port = self.port.open()?;
        if self.plain || !std::io::stdout().is_terminal() {
            return plain::watch(&mut port, self.seconds);
        }
        self.on_screen(&mut port)
    }

    fn on_screen(&self, port: &mut Port) -> Result<(), InputError> {
        let mut watching = Watching::new(screen::EVERY_TICKS, self.seconds, self.span);
        let mut screen = Screen::open(&port.name())?;
        let done = port.perform_quietly(&mut watching, |watching| {
            let ended = screen.look(&mut watching.history) || interrupt::count() > 0;
            if ended {
                watching.record.finish_early();
            }
        });
        drop(screen);
        match done {
            // Ended before the rig had answered: nobody minds.
            Err(_) if interrupt::count() > 0 => Ok(()),
            done => done.map(|_| ()),
        }
    }
}
