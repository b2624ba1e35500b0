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
    /// Done before this process began.
    before: u64,
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
            before: 0,
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

    /// So many steps were done by an earlier process: what is left is estimated from those of this one.
    pub fn goes_on_from(&mut self, done: u64) {
        self.before = done;
        self.done = done;
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

    /// Seconds until all is done at this pace; none before the first step.
    fn left_s(&self, elapsed_s: f64) -> Option<f64> {
        let steps = self.done.checked_sub(self.before).filter(|steps| *steps > 0)?;
        Some(elapsed_s / steps as f64 * self.total.saturating_sub(self.done) as f64)
    }

    fn show(&mut self) {
        if !self.terminal {
            let percent = 100 * self.done / self.total.max(1);
            let elapsed = self.started.elapsed().as_secs_f64();
            let left = match self.left_s(elapsed) {
                Some(left) => format!(", some {left:.0} s left"),
                None => String::new(),
            };
            eprintln!("{}: {percent} % after {elapsed:.0} s{left}", self.what);
            return;
        }
        let (total, before) = (self.total, self.before);
        let bar = self.bar.get_or_insert_with(|| {
            let bar = ProgressBar::with_draw_target(Some(total), ProgressDrawTarget::stderr());
            if let Ok(style) = ProgressStyle::with_template("{msg} {wide_bar} {percent} % {eta}") {
                bar.set_style(style);
            }
            bar.set_position(before);
            bar.reset_eta();
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_left_counts_from_the_steps_of_this_process() {
        let mut progress = Progress::new("x", 100);
        assert_eq!(progress.left_s(3.0), None);
        progress.set(25);
        assert_eq!(progress.left_s(5.0), Some(15.0));
        progress.goes_on_from(80);
        assert_eq!(progress.left_s(1.0), None);
        progress.set(90);
        assert_eq!(progress.left_s(5.0), Some(5.0));
    }
}
