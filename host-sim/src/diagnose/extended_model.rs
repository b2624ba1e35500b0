//! `model-extended.toml`: the fitted baseline with the named effects in it.
//!
//! For contact logs a model file that `simulate`, `predict` and the firmware read: the friction model's parameters as
//! fitted, and an `[[extension]]` for each cause. `element_compliance` is no extension: it makes LuGre the series model. For
//! drive logs the drive's parameters under `kind = "drive"`, with the same extensions.

use super::analysis::Fit;
use super::contact::ContactAnalysis;
use super::verdict::Judged;
use crate::files::effect_id::Subsystem;
use crate::files::model_file::{Extension, ModelFile};
use crate::files::number;
use crate::input_error::InputError;

/// The file's text. `contact` is the analysis of the contact where the logs have one.
pub fn text(judged: &[Judged], contact: Option<&ContactAnalysis>) -> Result<String, InputError> {
    match contact {
        Some(contact) => with_contact(judged, contact),
        None => Ok(drive(judged)),
    }
}

fn with_contact(judged: &[Judged], contact: &ContactAnalysis) -> Result<String, InputError> {
    let friction = judged.iter().find(|part| part.analysis.subsystem() == Subsystem::Friction);
    let Some(fit) = friction.and_then(Judged::result) else { return Ok(drive(judged)) };
    let mut extended = contact.to_model_file(fit)?;
    let mut others = Vec::new();
    for part in judged.iter().filter(|part| part.analysis.subsystem() != Subsystem::Friction) {
        let Some(fit) = part.result() else { continue };
        others.extend(part.causes.iter().map(|cause| extension(fit, cause.id)));
    }
    let mut remarks = String::new();
    for other in others {
        extended.extensions.push(other);
        if let Err(why) = ModelFile::parse("model-extended.toml", &extended.to_toml()) {
            // Found with other parameters than those that the observer on the chip takes: told, not run.
            let Some(other) = extended.extensions.pop() else { continue };
            remarks += &format!("\n# {} was found beside the friction model ({why}):\n", other.id);
            for (name, value) in &other.parameters {
                remarks += &format!("# {}", line(name, *value));
            }
        }
    }
    Ok(extended.to_toml() + &remarks)
}

fn extension(fit: &Fit, id: &str) -> Extension {
    let own = fit.parameters.iter().filter(|p| p.effect == Some(id) && p.log.is_none());
    Extension { id: id.into(), parameters: own.map(|p| (p.name.clone(), p.value)).collect() }
}

fn drive(judged: &[Judged]) -> String {
    let mut text = "kind = \"drive\"\n".to_string();
    for part in judged {
        let Some(fit) = part.result() else { continue };
        text += "\n[parameters]\n";
        for p in fit.parameters.iter().filter(|p| p.effect.is_none() && p.log.is_none()) {
            text += &line(&p.name, p.value);
        }
        for cause in &part.causes {
            let extension = extension(fit, cause.id);
            text += &format!("\n[[extension]]\nid = \"{}\"\n", extension.id);
            extension.parameters.iter().for_each(|(name, value)| text += &line(name, *value));
        }
    }
    text
}

fn line(name: &str, value: f64) -> String {
    let value = number::text(value);
    let point = if value.contains(['.', 'e']) { "" } else { ".0" };
    format!("{name} = {value}{point}\n")
}
