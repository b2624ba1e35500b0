//! `rig convert`: a log of any form in the tool's own, as Parquet, or for a viewer.

use std::path::{Path, PathBuf};

use super::common::say;
use crate::files::import::ASSUMED;
use crate::files::log::Log;
use crate::files::output_dir::{OutputDir, note_written};
use crate::input_error::InputError;

/// Convert a log: of another tool into this one's form, to Parquet, to MCAP for a viewer
#[derive(clap::Args, Debug)]
#[command(after_long_help = "\
Example:
  rig convert recording.csv --map time_s=Zeit m2_angle_rad=theta --unit Zeit=ms theta=deg --out imported
  rig convert run/log.csv --to parquet --out run-parquet
  rig convert run/log.csv --to mcap --out run-mcap

Reads CSV (commas, semicolons, tabs or bars; decimal commas; a row of units; UTF-8, UTF-16, Windows-1252) and
Parquet. Writes log.csv, log.parquet or log.mcap, and prints what was assumed, which stands in its metadata too.
A file NAME.toml beside the log NAME.csv, or columns.toml in its folder, may say the same as the options, and every
command that reads logs heeds it:

  [columns]
  time_s = { from = \"Zeit\", unit = \"ms\" }
  m2_angle_rad = { from = \"theta\", unit = \"deg\" }
  normal_force_n = { from = \"Fz\", unit = \"-kN\" }      # the sensor counts pressing as negative
  friction_torque_nm = { from = \"U2\", unit = \"2.5*Nm\" } # 2.5 N m a volt

Units: s ms us ns min; rad mrad deg rev counts/N; rad/s deg/s rpm rev/s; N kN mN lbf kgf; Nm mNm Ncm lbf.ft;
m mm um; C K F. A minus turns the sign, FACTOR* scales.")]
pub(super) struct Convert {
    /// The log
    #[arg(value_name = "LOG")]
    log: PathBuf,
    /// Form of the result
    #[arg(long, value_name = "FORM", default_value = "csv", value_parser = ["csv", "parquet", "mcap"])]
    to: String,
    /// Folder for the result
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

impl Convert {
    /// Runs the command.
    pub(super) fn run(self) -> Result<(), InputError> {
        let mut output = OutputDir::new(&self.out)?;
        let mut log = Log::read(&self.log)?;
        log.sort_columns();
        for (_, note) in log.metadata.iter().filter(|(key, _)| key == ASSUMED) {
            say(&format!("assumed: {note}"));
        }
        let named = |error: InputError| error.file(self.log.display().to_string());
        match self.to.as_str() {
            "parquet" => output.write("log.parquet", log.to_parquet().map_err(named)?)?,
            "mcap" => output.write("log.mcap", log.to_mcap().map_err(named)?)?,
            _ => output.write_log(&log)?,
        }
        output.finish()?;
        say(&format!("{} samples, {}", log.len(), span(&log)));
        Ok(())
    }
}

fn span(log: &Log) -> String {
    match log.time_s() {
        [first, .., last] => format!("{first} s to {last} s"),
        _ => "no span".into(),
    }
}

/// Print the script that completes commands and options in a shell
#[derive(clap::Args, Debug)]
#[command(after_long_help = "\
Example:
  rig completions bash > ~/.local/share/bash-completion/completions/rig
  rig completions bash --out completions

Shells: bash, elvish, fish, powershell, zsh.")]
pub(super) struct Completions {
    /// The shell
    #[arg(value_name = "SHELL")]
    shell: clap_complete::Shell,
    /// Folder to write the script into, in place of standard output
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

impl Completions {
    /// Runs the command.
    pub(super) fn run(self) -> Result<(), InputError> {
        let mut command = super::command_line();
        match &self.out {
            Some(folder) => {
                let io = |error: std::io::Error| InputError::io(Path::new(folder), "write into it", &error);
                std::fs::create_dir_all(folder).map_err(io)?;
                note_written(
                    clap_complete::generate_to(self.shell, &mut command, "rig", folder).map_err(io)?,
                );
            }
            None => {
                let mut script = Vec::new();
                clap_complete::generate(self.shell, &mut command, "rig", &mut script);
                say(String::from_utf8_lossy(&script).trim_end());
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    #[test]
    fn every_shell_gets_a_script_that_knows_the_subcommands() {
        for shell in [clap_complete::Shell::Bash, clap_complete::Shell::Zsh, clap_complete::Shell::Fish] {
            let mut script = Vec::new();
            clap_complete::generate(shell, &mut crate::cli::command_line(), "rig", &mut script);
            let script = String::from_utf8(script).unwrap();
            assert!(script.contains("convert") && script.contains("diagnose"), "{shell}");
        }
    }
}
