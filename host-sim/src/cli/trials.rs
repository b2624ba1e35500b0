//! `rig trials`: how often a diagnosis is right, over logs with hidden effects.
//!
//! The generators of these logs share no code with this tool and live in a crate that it does not depend on.
//! So this subcommand has cargo build and run that crate's program, and tells it which tool to try: this one.

use std::path::Path;
use std::process::Command;

use crate::input_error::InputError;

/// Hide effects in simulated logs, diagnose them, print the confusion table
#[derive(clap::Args, Debug)]
#[command(after_long_help = "\
Examples:
  rig trials --seeds 2
  rig trials --seeds 5 --effects thermal_fade wear_drift
  rig trials --effects thermal_fade+m2_ripple
  rig trials --seeds 3 --singles --noise 3

Needs cargo and the project's sources: the generators are a program of their own. rig trials --list shows all
of its options.")]
pub(super) struct Trials {
    /// --seeds N, --singles, --effects ID…, --pairs, --outside, --none, --rate-hz HZ, --noise FACTOR, --form, --keep DIR
    #[arg(trailing_var_arg = true, allow_hyphen_values = true, value_name = "OPTIONS")]
    options: Vec<String>,
}

impl Trials {
    /// Runs the command.
    pub(super) fn run(self) -> Result<(), InputError> {
        let manifest = Path::new(env!("CARGO_MANIFEST_DIR")).with_file_name("Cargo.toml");
        if !manifest.exists() {
            return Err(InputError::in_file(&manifest, "not found: trials need the project's sources"));
        }
        let own = std::env::current_exe().map_err(|e| InputError::new(format!("cannot find itself: {e}")))?;
        let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
        let mut command = Command::new(cargo);
        command.args(["run", "--quiet", "--manifest-path"]).arg(&manifest);
        if !cfg!(debug_assertions) {
            command.arg("--release");
        }
        command.args(["--package", "rig-tests", "--bin", "trials", "--"]);
        command.args(self.options.iter().map(|o| if o == "--list" { "--help" } else { o.as_str() }));
        let status = command.env("RIG_BIN", own).status();
        match status {
            Ok(status) if status.success() => Ok(()),
            Ok(_) => Err(InputError::new("the trials did not run to their end")),
            Err(e) => Err(InputError::new(format!("cannot run cargo: {e}"))),
        }
    }
}
