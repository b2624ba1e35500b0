//! Arguments that several subcommands share.

use crate::files::overrides::Overrides;
use crate::input_error::InputError;

pub use crate::notices::warn;

/// Prints a line on stdout, or keeps it for `--json`.
pub fn say(line: &str) {
    super::session::say(line);
}

/// What is wrong with the arguments, without usage and hints, in one line.
pub fn wrong_argument(error: &clap::Error) -> String {
    let text = error.to_string();
    let said: Vec<&str> = text
        .lines()
        .map(str::trim)
        .take_while(|line| !line.starts_with("Usage:") && !line.starts_with("For more information"))
        .filter(|line| !line.is_empty())
        .collect();
    let said = said.join(" ");
    said.strip_prefix("error: ").unwrap_or(&said).to_string()
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
