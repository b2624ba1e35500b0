//! `rig trials`: how often a diagnosis is right, over logs with hidden effects.
//!
//! The generators of these logs share no code with this tool and live in a crate that it does not depend on.
//! So this subcommand has cargo build and run that crate's program, and tells it which tool to try: this one.

use std::path::Path;
use std::process::Command;

use crate::input_error::InputError;

/// Hide effects in simulated logs, diagnose them, print how often the answer is right
#[derive(clap::Args, Debug)]
#[command(after_long_help = "\
Examples:
  rig trials --rounds 2 --jobs 2
  rig trials --rounds 5 --effects thermal_fade wear_drift
  rig trials --effects thermal_fade+m2_ripple
  rig trials --rounds 3 --singles --noise 3
  rig trials --rounds 4 --laws reserved --seeds-from-commit    a table to publish: cases known by nobody before
  rig trials --rounds 4 --case 3/20 --json-lines shard3.jsonl  one of 20 shards, for a cluster's job array
  rig trials --collect shard1.jsonl shard2.jsonl …             their table
  rig trials --fit-coverage 200                                how many 95 % intervals of rig fit hold the truth

The table gives shares with exact 95 % intervals, for rigs that stick and slip and for those that do not, how well
the probabilities are calibrated, and what was answered to what. host-sim/docs/trials-on-a-cluster.md tells how to
spread the cases over machines.

Needs cargo and the project's sources: the generators are a program of their own. rig trials --list shows all
of its options.")]
pub(super) struct Trials {
    /// --rounds N, --seeds-from-commit, --laws, --singles, --effects ID…, --pairs, --outside, --none, --jobs N, --case I/N, --json-lines FILE, --collect FILE…, --fit-coverage N, --plan, --rate-hz HZ, --noise FACTOR, --form, --keep DIR
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
