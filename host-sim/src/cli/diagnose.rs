//! `rig diagnose`: what the simulation gets wrong, why, and what it gains.

use std::path::PathBuf;
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

use super::common::{SetArgs, say};
use super::progress::Progress;
use crate::files::log::Log;
use crate::files::model_file::ModelFile;
use crate::files::output_dir::OutputDir;
use crate::files::rig_file::RigFile;
use crate::identify::command::{Written, diagnose};
use crate::identify::results::Diagnosis;
use crate::input_error::InputError;
use crate::report::value;

/// Show what the simulation gets wrong in logs, name the cause, extend the model, measure the gain
#[derive(clap::Args, Debug)]
#[command(after_long_help = "\
Examples:
  rig diagnose --rig rig.toml --model model.toml --train run1.csv run2.csv --holdout run3.csv --out target/why
  rig diagnose --train drive.csv --out target/why

Contact logs are looked at for friction, measurement, pressure and drive; drive logs (time_s, m2_torque_nm,
m2_angle_rad, or time_s, force_n, position_m) for the drive alone, and need no --rig and --model. Where no log
is held out, the last part of each training log is.

The slip is observed from the measured friction force, not simulated, so that nothing loses its phase through
stick-slip. Every effect enters each balance that it touches (friction, drive, pressure); sets of effects are compared by
their evidence, and an effect that changes less than 0.4 % of the signal is not named.

Writes diagnosis.json (verdict named, none or unknown; causes with probabilities, parameters and evidence; the
posterior over all sets compared; what remains; rejected rivals with reasons; errors on the held-out logs
against the noise), model-extended.toml and report.html (opens in any browser, needs no network).")]
pub(super) struct Diagnose {
    /// Rig file (TOML); the assumed rig where left out
    #[arg(long, value_name = "RIG.toml")]
    rig: Option<PathBuf>,
    /// Model file (TOML) of the baseline; the assumed model where left out
    #[arg(long, value_name = "MODEL.toml")]
    model: Option<PathBuf>,
    /// Logs to fit (CSV, or Parquet by their names), all of one kind
    #[arg(long, value_name = "LOG.csv", num_args = 1.., required = true)]
    train: Vec<PathBuf>,
    /// Logs that nothing is fitted to, which show the gain
    #[arg(long, value_name = "LOG.csv", num_args = 1..)]
    holdout: Vec<PathBuf>,
    /// Folder for the results
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    #[command(flatten)]
    set: SetArgs,
}

/// Steps where none is taken twice.
const STEPS: u64 = 9;

/// How many of these steps had been taken before.
fn repeated(taken: &[String]) -> u64 {
    taken.iter().enumerate().filter(|(at, step)| taken[..*at].contains(step)).count() as u64
}

impl Diagnose {
    /// Runs the command.
    pub(super) fn run(self) -> Result<(), InputError> {
        let started = Instant::now();
        let overrides = self.set.overrides()?;
        overrides.only(true, true, false)?;
        let rig = RigFile::read_or_assumed(self.rig.as_deref(), &overrides.rig)?;
        let model = ModelFile::read_or_assumed(self.model.as_deref(), &overrides.model)?;
        let read = |paths: &[PathBuf]| {
            paths.iter().map(|path| Log::read_as_sampled(path)).collect::<Result<Vec<_>, _>>()
        };
        let (train, holdout) = (read(&self.train)?, read(&self.holdout)?);
        let mut output = OutputDir::new(&self.out)?;
        // Drive, the contact's singles, pairs, triples, evidence, normal load, table, held out, extended model.
        let steps = Mutex::new((Progress::new("looking at", STEPS), Vec::new()));
        let progress = |what: &str| {
            let mut steps = steps.lock().unwrap_or_else(PoisonError::into_inner);
            let (bar, taken) = &mut *steps;
            taken.push(what.to_string());
            // The contact is searched again where the drive denies what it says of a channel.
            bar.of(STEPS + repeated(taken));
            bar.say(&format!("looking at: {what}"));
            bar.advance(1);
        };
        let wall_s = || started.elapsed().as_secs_f64();
        let Written { diagnosis, model, page, .. } =
            diagnose(&train, &holdout, &rig, &model, &wall_s, &progress)?;
        drop(steps);
        output.write_json("diagnosis.json", &diagnosis)?;
        output.write("model-extended.toml", model)?;
        output.write("report.html", page.to_html())?;
        let folder = output.folder().to_path_buf();
        output.finish()?;
        summary(&diagnosis);
        say(&format!("report: {}", folder.join("report.html").display()));
        Ok(())
    }
}

fn summary(diagnosis: &Diagnosis) {
    say(&diagnosis.sentence);
    for cause in &diagnosis.causes {
        say(&format!("\n{} ({}), probability {:.1} %", cause.id, cause.subsystem, 100.0 * cause.probability));
        for (name, p) in &cause.parameters {
            match p.std {
                Some(std) if std > 0.0 => {
                    say(&format!("  {name:32} {}", value::with_uncertainty(p.value, std)));
                }
                _ => say(&format!("  {name:32} {}", value::plain(p.value))),
            }
        }
        cause.evidence.iter().for_each(|sentence| say(&format!("  – {sentence}")));
    }
    for group in &diagnosis.indistinguishable {
        say(&format!("\nthese logs do not tell apart: {}", group.join(", ")));
    }
    let percent = |x: Option<f64>| x.map_or("–".to_string(), |x| format!("{:.2} %", 100.0 * x));
    say(&format!("\n{:12} {:>10} {:>10} {:>10}", "held out", "baseline", "extended", "noise"));
    for (name, part) in &diagnosis.subsystems {
        say(&format!(
            "{name:12} {:>10} {:>10} {:>10}",
            percent(part.baseline.holdout_nrmse),
            percent(part.extended.holdout_nrmse),
            percent(part.extended.noise_floor_nrmse)
        ));
    }
    say(&format!("left: {}", diagnosis.remaining.sentence));
    diagnosis.rejected.iter().take(3).for_each(|r| say(&format!("not {}: {}", r.id, r.why)));
    diagnosis.notes.iter().for_each(|note| say(&format!("note: {note}")));
    say(&format!("next: {}", diagnosis.next_experiment));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_that_are_taken_twice_are_more_work() {
        let taken = ["drive", "single causes", "evidence", "single causes", "evidence"].map(String::from);
        assert_eq!([repeated(&taken[..3]), repeated(&taken)], [0, 2]);
    }
}
