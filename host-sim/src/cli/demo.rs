//! `rig demo`: the paper's experiments, one table, one page.

use std::path::PathBuf;

use super::common::say;
use super::progress::Progress;
use crate::demo::{demo, figure};
use crate::files::output_dir::OutputDir;
use crate::input_error::InputError;

/// Run the paper's experiments, find what LuGre lacks in them, and write one page with all of it
#[derive(clap::Args, Debug)]
#[command(after_long_help = "\
Example:
  rig demo
  rig demo --out target/demo

Writes report.html (opens in any browser, needs no network) and overshoot.svg (the figure of the README).")]
pub(super) struct Demo {
    /// Folder for the results
    #[arg(long, value_name = "DIR", default_value = "target/demo")]
    out: PathBuf,
}

impl Demo {
    /// Runs the command.
    pub(super) fn run(self) -> Result<(), InputError> {
        let mut output = OutputDir::replacing(&self.out)?;
        let mut progress = None;
        let made = demo(|done, total, what| {
            let bar = progress.get_or_insert_with(|| Progress::new("demo", total as u64));
            bar.say(what);
            bar.set(done as u64);
        })?;
        drop(progress);
        output.write("report.html", made.page.to_html())?;
        output.write("overshoot.svg", figure::overshoot_svg(&made.runs)?)?;
        let report = output.folder().join("report.html");
        output.finish()?;
        say(made.table.trim_end_matches('\n'));
        say(&format!("\nreport: {}", report.display()));
        Ok(())
    }
}
