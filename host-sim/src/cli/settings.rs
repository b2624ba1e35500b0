//! `rig settings`: what is stored in the firmware.

use std::io::IsTerminal;
use std::path::PathBuf;

use rig_link::message::{Answer, Command};
use rig_link::settings::{ALL, SettingInfo, by_name};

use super::common::say;
use super::port::{Port, PortArgs};
use crate::files::model_file::ModelFile;
use crate::input_error::InputError;
use crate::link::ask::Ask;
use crate::link::{model_upload, words};

/// Show and change what is stored in the firmware: calibration, limits, the observer's model
#[derive(clap::Args, Debug)]
#[command(after_long_help = "\
Example:
  rig settings list
  rig settings list --port /dev/ttyACM0
  rig settings set friction_bridge.zero_code=32790 friction_bridge.unit_per_code=0.000366
  rig settings model                       shows the observer's model
  rig settings model model-extended.toml   gives it another one
  rig settings model forget                goes back to the default

Settings have SI units, shown in the list beside what is in force, what is stored and the default. Changes
are checked by the firmware against its limits, kept in its flash, and possible only while the rig is disabled.
The model is that of rig fit or rig diagnose; the firmware's observer runs it from then on.")]
pub(super) struct Settings {
    #[command(flatten)]
    port: PortArgs,
    #[command(subcommand)]
    action: Action,
}

#[derive(clap::Subcommand, Debug)]
enum Action {
    /// Every setting: in force, stored, default, unit
    List,
    /// Some settings
    Get {
        /// Names as in the list
        #[arg(required = true, value_name = "NAME")]
        names: Vec<String>,
    },
    /// Store values and use them
    Set {
        /// NAME=VALUE
        #[arg(required = true, value_name = "NAME=VALUE")]
        values: Vec<String>,
    },
    /// Go back to the defaults of some settings
    Forget {
        /// Names as in the list
        #[arg(required = true, value_name = "NAME")]
        names: Vec<String>,
    },
    /// Erase everything that is stored, the model too: the way out of damaged settings. Asks first
    Erase {
        /// Do not ask
        #[arg(long)]
        yes: bool,
    },
    /// Show the observer's model, give it another one, or go back to the default
    Model {
        /// Model file (TOML) to upload; `forget` for the default; nothing shows the model in force
        #[arg(value_name = "MODEL.toml|forget")]
        file: Option<PathBuf>,
    },
    /// Take what both bridges read now as zero, until the next start
    Tare,
    /// Clear latched faults whose causes are gone
    ClearFault,
}

fn find(name: &str) -> Result<&'static SettingInfo, InputError> {
    by_name(name).ok_or_else(|| {
        let alike: Vec<&str> = ALL.iter().map(|info| info.name).filter(|known| alike(known, name)).collect();
        let allowed =
            if alike.is_empty() { "a name from rig settings list".into() } else { alike.join(", ") };
        InputError::new("is no setting").key(name).allowed(allowed)
    })
}

/// Whether a known name has a part of the wanted one in it.
fn alike(known: &str, wanted: &str) -> bool {
    wanted.split('.').any(|part| part.len() > 3 && known.contains(part))
}

fn assignment(text: &str) -> Result<(&'static SettingInfo, f32), InputError> {
    let (name, value) =
        text.split_once('=').ok_or_else(|| InputError::new("is no NAME=VALUE").value(text))?;
    let info = find(name.trim())?;
    let value = value.trim();
    let number: f32 = value.parse().map_err(|_| {
        InputError::new("is no number").key(info.name).value(value).allowed("a decimal number")
    })?;
    if number.is_finite() {
        Ok((info, number))
    } else {
        Err(InputError::new("is not finite").key(info.name).value(value).allowed("a decimal number"))
    }
}

impl Settings {
    /// Runs the command.
    pub(super) fn run(self) -> Result<(), InputError> {
        // Everything is checked before the port is touched.
        let commands: Vec<Command> = match &self.action {
            Action::List => ALL.iter().map(|info| Command::SettingGet { key: info.key }).collect(),
            Action::Get { names } => each(names, |name| Ok(Command::SettingGet { key: find(name)?.key }))?,
            Action::Set { values } => each(values, |text| {
                assignment(text).map(|(info, value)| Command::SettingSet { key: info.key, value })
            })?,
            Action::Forget { names } => {
                each(names, |name| Ok(Command::SettingForget { key: find(name)?.key }))?
            }
            Action::Erase { yes } => {
                if !yes {
                    ask_before_erasing()?;
                }
                vec![Command::SettingsErase]
            }
            Action::Model { file: None } => vec![Command::ModelGet],
            Action::Model { file: Some(file) } if file.as_os_str() == "forget" => vec![Command::ModelForget],
            Action::Model { file: Some(file) } => {
                vec![Command::ModelSet(model_upload::record(&ModelFile::read(file, &[])?)?)]
            }
            Action::Tare => vec![Command::Tare],
            Action::ClearFault => vec![Command::ClearFault],
        };
        let mut port = self.port.open()?;
        greet(&mut port)?;
        if matches!(self.action, Action::List | Action::Get { .. }) {
            say(&format!("{:40} {:>14} {:>14} {:>14}  unit", "setting", "in force", "stored", "default"));
        }
        for command in commands {
            match port.ask(command)? {
                Answer::Setting(state) => say(&words::setting(&state)),
                Answer::Model(model) => say(&words::model(model.as_ref())),
                answer => words::accepted(&answer)?,
            }
        }
        Ok(())
    }
}

/// Asks the person at the terminal; without one, `--yes` is wanted.
fn ask_before_erasing() -> Result<(), InputError> {
    let refuse = |problem: &str| {
        Err(InputError::new(problem).file("settings erase").allowed("--yes, or the answer yes at a terminal"))
    };
    if !std::io::stdin().is_terminal() {
        return refuse("erases every stored setting and the model, and nobody can be asked");
    }
    eprint!("Erase every stored setting and the model, calibration too? [yes/no] ");
    let mut answer = String::new();
    let read = std::io::stdin().read_line(&mut answer);
    if read.is_ok() && answer.trim().eq_ignore_ascii_case("yes") {
        Ok(())
    } else {
        refuse("nothing was erased")
    }
}

fn each(
    texts: &[String],
    command: impl Fn(&str) -> Result<Command, InputError>,
) -> Result<Vec<Command>, InputError> {
    texts.iter().map(|text| command(text)).collect()
}

fn greet(port: &mut Port) -> Result<(), InputError> {
    let answers = port.perform(&mut Ask::new([Command::Hello]))?;
    let answer = answers.first().ok_or_else(|| InputError::new("the rig gave no answer"))?;
    let hello = crate::link::ask::check_hello(answer)?;
    if hello.settings_schema != rig_link::settings::SCHEMA_VERSION {
        return Err(InputError::new("the firmware has another list of settings")
            .key("settings_schema")
            .value(hello.settings_schema)
            .allowed(rig_link::settings::SCHEMA_VERSION.to_string()));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wrong_name_is_answered_with_names_like_it() {
        let error = find("friction_bridge.zero").unwrap_err().to_string();
        assert!(error.contains("friction_bridge.zero_code"), "{error}");
        let error = assignment("m1.reversed=maybe").unwrap_err().to_string();
        assert_eq!(error, "m1.reversed = maybe: is no number; allowed: a decimal number");
    }
}
