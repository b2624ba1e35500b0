//! A model file as the record that the firmware stores and its observer runs.

use rig_link::model::{EffectRecord, MOST_EFFECTS, ModelRecord};

use model_core::extension::Extension;

use crate::files::model_file::ModelFile;
use crate::input_error::InputError;

/// The record of a model file.
///
/// # Errors
/// The file has an effect that does not extend the friction model, or more effects than fit.
pub fn record(model: &ModelFile) -> Result<ModelRecord, InputError> {
    let refuse = |problem: String| InputError::new(problem).file(model.source.as_str());
    let mut effects = heapless::Vec::new();
    for extension in &model.extensions {
        let effect = Extension::with_id(&extension.id).ok_or_else(|| {
            refuse("the observer has no such effect".into())
                .key("extension.id")
                .value(&extension.id)
                .allowed(ids())
        })?;
        let mut values = heapless::Vec::new();
        for name in effect.names() {
            let value = extension
                .get(name)
                .ok_or_else(|| refuse(format!("has no {name}")).key(format!("extension.{}", extension.id)))?;
            let _ = values.push(single(value)); // `MOST_VALUES` is what the longest effect has
        }
        let id = heapless::String::try_from(effect.id()).unwrap_or_default();
        effects.push(EffectRecord { id, values }).map_err(|_| {
            refuse("more effects than the firmware takes".into())
                .key("extension")
                .allowed(format!("up to {MOST_EFFECTS}"))
        })?;
    }
    Ok(ModelRecord { friction: (&model.friction().cast()).into(), effects })
}

#[allow(clippy::cast_possible_truncation)]
fn single(value: f64) -> f32 {
    value as f32
}

fn ids() -> String {
    Extension::ALL.iter().map(|effect| effect.id()).collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_assumed_model_file_is_what_the_firmware_assumes() {
        let file = ModelFile::assumed(&[]).unwrap();
        assert_eq!(record(&file).unwrap(), ModelRecord::default());
    }

    #[test]
    fn a_model_file_with_an_effect_keeps_its_values_in_the_order_of_their_names() {
        let names = Extension::ViscousFilm.names();
        let lines: String = names.iter().enumerate().map(|(k, name)| format!("{name} = {k}.5\n")).collect();
        let assumed = ModelFile::assumed(&[]).unwrap().to_toml();
        let file =
            ModelFile::parse("m.toml", &format!("{assumed}\n[[extension]]\nid = \"viscous_film\"\n{lines}"))
                .unwrap();
        let record = record(&file).unwrap();
        assert_eq!(record.effects[0].id.as_str(), "viscous_film");
        let expected: Vec<f32> = (0..names.len()).map(|k| k as f32 + 0.5).collect();
        assert_eq!(record.effects[0].values.as_slice(), expected);
    }

    #[test]
    fn an_effect_of_another_subsystem_is_refused_by_name() {
        let assumed = ModelFile::assumed(&[]).unwrap().to_toml();
        let text = format!("{assumed}\n[[extension]]\nid = \"backlash\"\ngap_rad = 0.01\n");
        if let Ok(file) = ModelFile::parse("m.toml", &text) {
            let error = record(&file).unwrap_err().to_string();
            assert!(
                error.starts_with("m.toml: extension.id = backlash: the observer has no such effect"),
                "{error}"
            );
        }
    }
}
