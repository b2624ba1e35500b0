//! Progress on stderr for work that lasts longer than a second.
//!
//! On a terminal a bar, elsewhere a plain line now and then. Nothing for short work. Standard output
//! stays free for results.

use std::io::IsTerminal;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// Work shorter than this shows nothing.
const SILENT: Duration = Duration::from_secs(1);
/// Time between plain lines.
const LINE_EVERY: Duration = Duration::from_secs(5);
/// Time between redraws of the bar.
const REDRAW_EVERY: Duration = Duration::from_millis(100);

/// Progress of one piece of work, counted in steps.
#[derive(Debug)]
pub struct Progress {
    what: String,
    total: u64,
    done: u64,
    started: Instant,
    shown: Option<Instant>,
    terminal: bool,
    bar: Option<ProgressBar>,
}

impl Progress {
    /// Starts counting; nothing is shown yet.
    pub fn new(what: &str, total: u64) -> Self {
        Self {
            what: what.into(),
            total,
            done: 0,
            started: Instant::now(),
            shown: None,
            terminal: std::io::stderr().is_terminal(),
            bar: None,
        }
    }

    /// So many steps are done now, of all.
    pub fn set(&mut self, done: u64) {
        self.done = done;
        let now = Instant::now();
        let pause = if self.terminal { REDRAW_EVERY } else { LINE_EVERY };
        let due = match self.shown {
            None => now - self.started >= SILENT,
            Some(shown) => now - shown >= pause,
        };
        if due {
            self.shown = Some(now);
            self.show();
        }
    }

    /// The number of all steps, where it was not known at the start.
    pub fn of(&mut self, total: u64) {
        self.total = total;
    }

    /// So many more steps are done.
    pub fn advance(&mut self, steps: u64) {
        self.set(self.done + steps);
    }

    /// Changes the words.
    pub fn say(&mut self, what: &str) {
        self.what = what.into();
        self.advance(0);
    }

    fn show(&mut self) {
        if !self.terminal {
            let percent = 100 * self.done / self.total.max(1);
            eprintln!("{}: {percent} % after {:.0} s", self.what, self.started.elapsed().as_secs_f64());
            return;
        }
        let total = self.total;
        let bar = self.bar.get_or_insert_with(|| {
            let bar = ProgressBar::with_draw_target(Some(total), ProgressDrawTarget::stderr());
            if let Ok(style) = ProgressStyle::with_template("{msg} {wide_bar} {percent} % {eta}") {
                bar.set_style(style);
            }
            bar
        });
        bar.set_message(self.what.clone());
        bar.set_position(self.done);
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}
