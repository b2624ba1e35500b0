//! `--set key=value`: changes single entries of the rig, model or experiment file before it is checked.

use super::toml_tree::Document;
use crate::input_error::InputError;

/// Entries to change, sorted by the file they belong to.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Overrides {
    /// Keys that began with `rig.`.
    pub rig: Vec<(String, String)>,
    /// Keys that began with `model.`.
    pub model: Vec<(String, String)>,
    /// Keys that began with `experiment.`.
    pub experiment: Vec<(String, String)>,
}

impl Overrides {
    /// Takes the `key=value` arguments of the command line.
    pub fn parse(arguments: &[String]) -> Result<Self, InputError> {
        let allowed = "KEY=VALUE with a key such as rig.pressure.mode_hz, model.parameters.a1 or \
                       experiment.m1.0.torque_fraction";
        let mut overrides = Self::default();
        for argument in arguments {
            let refuse = |what: &str| InputError::new(what).file("--set").value(argument).allowed(allowed);
            let (key, value) = argument.split_once('=').ok_or_else(|| refuse("has no '='"))?;
            let (file, key) = key.trim().split_once('.').ok_or_else(|| refuse("names no file"))?;
            let list = match file {
                "rig" => &mut overrides.rig,
                "model" => &mut overrides.model,
                "experiment" => &mut overrides.experiment,
                _ => return Err(refuse("the key begins with neither rig., model. nor experiment.")),
            };
            list.push((key.to_string(), value.trim().to_string()));
        }
        Ok(overrides)
    }

    /// Refuses what this command has no file for.
    pub fn only(&self, rig: bool, model: bool, experiment: bool) -> Result<(), InputError> {
        for (name, used, list) in [
            ("rig", rig, &self.rig),
            ("model", model, &self.model),
            ("experiment", experiment, &self.experiment),
        ] {
            if let (false, Some((key, value))) = (used, list.first()) {
                return Err(InputError::new(format!("this command reads no {name} file"))
                    .file("--set")
                    .key(format!("{name}.{key}"))
                    .value(value));
            }
        }
        Ok(())
    }
}

/// Applies changes to a parsed file.
pub fn apply(document: &mut Document, changes: &[(String, String)]) -> Result<(), InputError> {
    changes.iter().try_for_each(|(key, value)| document.set(key, value))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn changes_are_sorted_by_file_and_nonsense_is_refused() {
        let set = |text: &str| Overrides::parse(&[text.to_string()]);
        let expected = vec![("pressure.mode_hz".to_string(), "90".to_string())];
        assert_eq!(set("rig.pressure.mode_hz = 90").unwrap().rig, expected);
        assert!(
            set("rig.pressure.mode_hz")
                .unwrap_err()
                .to_string()
                .starts_with("--set: rig.pressure.mode_hz: has no '='")
        );
        assert!(set("a1=2").unwrap_err().to_string().contains("names no file"));
        assert!(set("plant.a1=2").unwrap_err().to_string().contains("begins with neither"));
        let error = set("experiment.seed=2").unwrap().only(true, true, false).unwrap_err();
        assert_eq!(error.to_string(), "--set: experiment.seed = 2: this command reads no experiment file");
    }
}
