//! The command line of `rig`: one file a subcommand.
//!
//! A subcommand is a `clap::Args` struct with `fn run(self) -> Result<(), InputError>` in its own file
//! and one line in `Command` here.

pub mod common;
mod convert;
mod demo;
mod design;
mod diagnose;
mod fit;
mod interrupt;
mod keeper;
mod monitor;
mod port;
mod predict;
mod record;
mod rivals;
mod run;
mod same_logs;
mod session;
mod settings;
mod simulate;
mod trials;
mod vehicle;

pub mod progress;

use std::ffi::OsString;
use std::process::ExitCode;

use clap::{Parser, Subcommand};

use self::session::Shared;
use crate::input_error::{InputError, Kind};

/// Exit status for wrong arguments.
const BAD_INPUT: u8 = Kind::Input.exit_status();

#[derive(Parser)]
#[command(
    name = "rig",
    version,
    about = "Simulate, identify and diagnose the rubber-asphalt friction rig",
    long_about = "Simulate, identify and diagnose the rubber-asphalt friction rig.\n\n\
                  All quantities are in SI units, and every name carries its unit: normal_force_n, time_s.\n\
                  Exit status: 0 done; 2 bad input; 3 the run failed or ended before its time; 4 the rig is lost or \
                  does not answer; 5 no space left for the results. One line on stderr says why."
)]
struct Cli {
    #[command(subcommand)]
    command: Command,
    #[command(flatten)]
    shared: Shared,
}

/// Declares the subcommands: one line each.
macro_rules! commands {
    ($($(#[$meta:meta])* $name:ident($args:ty)),* $(,)?) => {
        #[derive(Subcommand)]
        #[allow(clippy::large_enum_variant, reason = "made once")]
        enum Command {
            $($(#[$meta])* $name($args),)*
        }

        impl Command {
            fn run(self) -> Result<(), InputError> {
                match self {
                    $(Self::$name(args) => args.run(),)*
                }
            }

            fn name(&self) -> String {
                match self {
                    $(Self::$name(_) => stringify!($name).to_lowercase(),)*
                }
            }
        }
    };
}

commands! {
    Demo(demo::Demo),
    Predict(predict::Predict),
    Fit(fit::Fit),
    Design(design::Design),
    Diagnose(diagnose::Diagnose),
    Simulate(simulate::Simulate),
    Trials(trials::Trials),
    Rivals(rivals::Rivals),
    Vehicle(vehicle::Vehicle),
    Record(record::RecordArgs),
    Run(run::Run),
    Monitor(monitor::Monitor),
    Settings(settings::Settings),
    Convert(convert::Convert),
    Completions(convert::Completions),
}

/// The command line, for what describes it: completions, tests.
fn command_line() -> clap::Command {
    <Cli as clap::CommandFactory>::command()
}

/// Runs the tool with the arguments of the process.
pub fn main() -> ExitCode {
    run(std::env::args_os())
}

/// Runs the tool with these arguments, its name first.
pub fn run(arguments: impl IntoIterator<Item = impl Into<OsString> + Clone>) -> ExitCode {
    let arguments: Vec<OsString> = arguments.into_iter().map(Into::into).collect();
    let cli = match Cli::try_parse_from(&arguments) {
        Ok(cli) => cli,
        Err(error) => return refuse_arguments(&error),
    };
    same_logs::warn_of(&arguments);
    let name = cli.command.name();
    let result = cli.shared.begin().and_then(|()| cli.command.run());
    cli.shared.end(&name, &result);
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => ExitCode::from(error.kind().exit_status()),
    }
}

/// Help and version go out as they are; a wrong argument becomes one line.
fn refuse_arguments(error: &clap::Error) -> ExitCode {
    use clap::error::ErrorKind;
    if matches!(error.kind(), ErrorKind::DisplayHelp | ErrorKind::DisplayVersion) {
        // Nobody is left to tell where even the help cannot be printed.
        let _ = error.print();
        return ExitCode::SUCCESS;
    }
    if error.kind() == ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand {
        let _ = error.print();
        return ExitCode::from(BAD_INPUT);
    }
    eprintln!("rig: {}; see rig --help", common::wrong_argument(error));
    ExitCode::from(BAD_INPUT)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_command_line_is_consistent_and_every_subcommand_shows_an_example() {
        command_line().debug_assert();
        for command in command_line().get_subcommands() {
            let help = command.clone().render_long_help().to_string();
            assert!(help.contains("Example"), "{}", command.get_name());
        }
    }
}
