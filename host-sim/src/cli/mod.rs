//! The command line of `rig`: one file a subcommand.
//!
//! A subcommand is a `clap::Args` struct with `fn run(self) -> Result<(), InputError>` in its own file
//! and one line in `Command` here.

mod commission;
pub mod common;
mod convert;
mod demo;
mod design;
mod diagnose;
mod fit;
pub mod interrupt;
mod keeper;
mod monitor;
mod port;
mod predict;
mod prediction_page;
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

use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};

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
    Commission(commission::Commission),
    Convert(convert::Convert),
    Completions(convert::Completions),
}

/// The command line. What reads no log does not show the options for logs of other tools.
fn command_line() -> clap::Command {
    let mut command = Cli::command();
    // Gives the subcommands the options of every command.
    command.build();
    command.mut_subcommands(without_logs)
}

/// Whether a subcommand reads logs: one of its arguments is a log.
fn reads_logs(command: &clap::Command) -> bool {
    let values = command.get_arguments().filter_map(clap::Arg::get_value_names).flatten();
    values.into_iter().any(|name| name.starts_with("LOG"))
}

fn without_logs(command: clap::Command) -> clap::Command {
    if reads_logs(&command) {
        return command;
    }
    let of_logs = |arg: &clap::Arg| arg.get_help_heading() == Some(session::LOGS_OF_OTHER_TOOLS);
    command.mut_args(|arg| if of_logs(&arg) { arg.hide(true) } else { arg }).mut_subcommands(without_logs)
}

/// Runs the tool with the arguments of the process.
pub fn main() -> ExitCode {
    run(std::env::args_os())
}

/// Runs the tool with these arguments, its name first.
pub fn run(arguments: impl IntoIterator<Item = impl Into<OsString> + Clone>) -> ExitCode {
    let arguments: Vec<OsString> = arguments.into_iter().map(Into::into).collect();
    let line = command_line();
    let parsed = line.clone().try_get_matches_from(&arguments);
    let cli = match parsed.and_then(|matches| Cli::from_arg_matches(&matches)) {
        Ok(cli) => cli,
        Err(error) => return refuse_arguments(&error),
    };
    same_logs::warn_of(&arguments);
    let name = cli.command.name();
    let reads_logs = line.find_subcommand(&name).is_some_and(reads_logs);
    let result = cli.shared.begin(reads_logs).and_then(|()| cli.command.run());
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
        for command in command_line().get_subcommands().filter(|command| command.get_name() != "help") {
            let help = command.clone().render_long_help().to_string();
            assert!(help.contains("Example"), "{}", command.get_name());
        }
    }

    #[test]
    fn options_for_logs_are_shown_and_taken_where_logs_are_read_and_nowhere_else() {
        let shown = |name: &str| {
            let line = command_line();
            let command = line.find_subcommand(name).unwrap();
            (reads_logs(command), command.clone().render_long_help().to_string().contains("--map"))
        };
        for name in ["fit", "predict", "diagnose", "convert"] {
            assert_eq!(shown(name), (true, true), "{name}");
        }
        for name in ["simulate", "run", "monitor", "settings", "demo", "completions"] {
            assert_eq!(shown(name), (false, false), "{name}");
        }
        let arguments = ["rig", "simulate", "--experiment", "fig20", "--out", "x", "--unit", "theta=deg"];
        let refused = Cli::try_parse_from(arguments).unwrap().shared.begin(false).unwrap_err().to_string();
        assert!(refused.contains("--unit") && refused.contains("reads no log"), "{refused}");
    }
}
