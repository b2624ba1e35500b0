//! Progress of trials on stderr: a line for each case, and how long the rest will take.

use std::io::IsTerminal;
use std::time::Instant;

use indicatif::{HumanDuration, ProgressBar, ProgressDrawTarget, ProgressStyle};

/// Progress over a number of cases.
#[derive(Debug)]
pub struct Progress {
    bar: ProgressBar,
    terminal: bool,
    started: Instant,
}

impl Progress {
    /// Nothing is done yet.
    #[must_use]
    pub fn new(cases: usize) -> Self {
        let terminal = std::io::stderr().is_terminal();
        let target = if terminal { ProgressDrawTarget::stderr() } else { ProgressDrawTarget::hidden() };
        let bar = ProgressBar::with_draw_target(Some(cases as u64), target);
        if let Ok(style) = ProgressStyle::with_template("{wide_bar} {pos} of {len}, {eta} left") {
            bar.set_style(style);
        }
        Self { bar, terminal, started: Instant::now() }
    }

    /// One more case is done.
    pub fn line(&mut self, words: &str) {
        self.bar.inc(1);
        let (done, all) = (self.bar.position(), self.bar.length().unwrap_or(0));
        let line = format!("{done:>4}/{all} {words}");
        if self.terminal {
            self.bar.println(line);
            return;
        }
        let left = self.started.elapsed().mul_f64((all.saturating_sub(done)) as f64 / done as f64);
        eprintln!("{line}, {} left", HumanDuration(left));
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}
