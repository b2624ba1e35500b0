//! `rig monitor`: what the rig does, as plots on the terminal or as lines.

// What only the screen reads is still kept without it.
#![cfg_attr(not(feature = "screen"), allow(dead_code))]

mod history;
mod plain;
#[cfg(feature = "screen")]
mod screen;
mod timing;

#[cfg(feature = "screen")]
use std::io::IsTerminal;
use std::time::{Duration, Instant};

use super::interrupt;
use super::port::{Port, PortArgs};
use crate::input_error::InputError;
use crate::link::client::Client;
use crate::link::procedure::Procedure;
use crate::link::record::{Record, Recorded};
use history::History;
#[cfg(feature = "screen")]
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
While another command holds the port, it shows what that command receives (Linux), at that command's rate.
Commands nothing, and does not keep a run alive whose host is gone: it then takes the port over and shows why the rig
stopped.")]
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

/// How long a port may take to be free once the command that held it is gone.
const TAKE_OVER: Duration = Duration::from_secs(2);

/// What is done after each step.
type Each<'a> = &'a mut dyn FnMut(&mut Watching);

/// A recording that keeps the last rows only.
pub(super) struct Watching {
    record: Record,
    history: History,
}

impl Watching {
    fn new(span_s: f64) -> Self {
        Self { record: Record::listening(), history: History::new(span_s) }
    }

    /// Begins with a port: asks the rig for telemetry, or listens to the command that holds the port.
    fn begin(&mut self, listens: bool, every_ticks: u16, seconds: f64) {
        self.record = if listens { Record::listening() } else { Record::new(every_ticks, seconds, true) };
        if listens {
            self.history.note("another command holds the port: what it receives is shown".into());
        }
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
        #[cfg(feature = "screen")]
        if !self.plain && std::io::stdout().is_terminal() {
            return self.draw();
        }
        plain::watch(&self)
    }

    #[cfg(feature = "screen")]
    fn draw(self) -> Result<(), InputError> {
        let (port, listens) = self.port.open_or_listen()?;
        let mut screen = Screen::open(&port.name())?;
        let mut watching = Watching::new(self.span);
        let quietly =
            |port: &mut Port, watching: &mut Watching, each: Each<'_>| port.perform_quietly(watching, each);
        let done = self.watch(port, listens, &mut watching, screen::EVERY_TICKS, quietly, |watching| {
            if screen.look(&mut watching.history) || interrupt::count() > 0 {
                watching.record.finish_early();
            }
        });
        drop(screen);
        done
    }

    /// Watches to the end. Where the command that holds the port goes, the port is taken over.
    fn watch(
        &self,
        mut port: Port,
        mut listens: bool,
        watching: &mut Watching,
        every_ticks: u16,
        perform: impl Fn(&mut Port, &mut Watching, Each<'_>) -> Result<Recorded, InputError>,
        mut each: impl FnMut(&mut Watching),
    ) -> Result<(), InputError> {
        let begun = Instant::now();
        loop {
            watching.begin(listens, every_ticks, self.seconds);
            let mut ended = false;
            let done = perform(&mut port, watching, &mut |watching| {
                each(watching);
                let over = listens && begun.elapsed().as_secs_f64() > self.seconds;
                ended |= over || interrupt::count() > 0;
                if over {
                    watching.record.finish_early();
                }
            });
            match done {
                Ok(_) => return Ok(()),
                // Ended before the rig had answered: nobody minds.
                Err(_) if ended => return Ok(()),
                Err(error) if !listens => return Err(error),
                // The holder is gone, or on its way.
                Err(_) => (port, listens) = self.take_over()?,
            }
        }
    }

    fn take_over(&self) -> Result<(Port, bool), InputError> {
        let begun = Instant::now();
        loop {
            match self.port.open_or_listen() {
                Err(_) if begun.elapsed() < TAKE_OVER => std::thread::sleep(TAKE_OVER / 50),
                opened => return opened,
            }
        }
    }
}
