//! Arguments that several subcommands share.

use std::io::Write;

use crate::files::overrides::Overrides;
use crate::input_error::InputError;

/// Prints a line on stdout. A reader that has gone away (`rig … | head`) is no error.
pub fn say(line: &str) {
    let _ = writeln!(std::io::stdout(), "{line}");
}

/// `--set`
#[derive(clap::Args, Debug, Default)]
pub struct SetArgs {
    /// Change one entry of the rig, model or experiment file, e.g. rig.pressure.mode_hz=90,
    /// model.parameters.a1=0.6, experiment.m1.1.torque_fraction=0.3; may be given several times
    #[arg(long = "set", value_name = "KEY=VALUE", num_args = 1.., action = clap::ArgAction::Append)]
    set: Vec<String>,
}

impl SetArgs {
    /// The changes, sorted by file.
    pub fn overrides(&self) -> Result<Overrides, InputError> {
        Overrides::parse(&self.set)
    }
}
