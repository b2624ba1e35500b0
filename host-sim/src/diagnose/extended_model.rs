//! `model-extended.toml`: the fitted baseline with the named effects in it.
//!
//! For contact logs a model file that `simulate`, `predict` and the firmware read: the friction model's parameters as
//! fitted, and an `[[extension]]` for each cause, in the core's parameters where the fit has others.
//! `element_compliance` is no extension: it makes LuGre the series model. For
//! drive logs the drive's parameters under `kind = "drive"`, with the same extensions.

use super::analysis::{Analysis, Fit};
use super::contact::ContactAnalysis;
use super::verdict::Judged;
use crate::files::effect_id::Subsystem;
use crate::files::model_file::{Extension, ModelFile};
use crate::files::number;
use crate::input_error::InputError;

/// A channel that clips.
const CLIPPING: &str = "adc_saturation";
/// An encoder off centre.
const RUN_OUT: &str = "encoder_eccentricity";
/// Torque that no channel reaches, N·m: an end where there is none.
const NO_END_NM: f64 = 1e4;

/// The file's text. `contact` is the analysis of the contact where the logs have one.
pub fn text(judged: &[Judged], contact: Option<&ContactAnalysis>) -> Result<String, InputError> {
    match contact {
        Some(contact) => with_contact(judged, contact),
        None => Ok(drive(judged)),
    }
}

fn with_contact(judged: &[Judged], contact: &ContactAnalysis) -> Result<String, InputError> {
    let friction = judged.iter().find(|part| part.analysis.subsystem() == Subsystem::Friction);
    let Some((friction, fit)) = friction.and_then(|part| Some((part, part.result()?))) else {
        return Ok(drive(judged));
    };
    let mut extended = contact.to_model_file(fit)?;
    let mut remarks = String::new();
    if friction.causes.iter().any(|cause| cause.id == CLIPPING) {
        let (extension, remark) = clipping(&contact.constants(CLIPPING));
        extended.extensions.retain(|known| known.id != CLIPPING);
        extended.extensions.extend(extension);
        remarks += &remark;
    }
    for part in judged.iter().filter(|part| part.analysis.subsystem() != Subsystem::Friction) {
        let Some(fit) = part.result() else { continue };
        for cause in &part.causes {
            let found = extension(fit, cause.id);
            let (other, remark) = if cause.id == RUN_OUT { run_out(&found) } else { (found, String::new()) };
            extended.extensions.push(other);
            let Err(why) = ModelFile::parse("model-extended.toml", &extended.to_toml()) else {
                remarks += &remark;
                continue;
            };
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

/// A clipped channel as the core's effect, which has the ends of the friction channel; what it cannot hold is a remark.
fn clipping(ends: &[(&'static str, f64)]) -> (Option<Extension>, String) {
    let end = |name: &str| ends.iter().find(|(known, _)| *known == name).map(|(_, value)| *value);
    let (low, high) = (end("friction_low_nm"), end("friction_high_nm"));
    let parameters = vec![
        ("friction_low_nm".to_string(), low.unwrap_or(-NO_END_NM)),
        ("friction_high_nm".to_string(), high.unwrap_or(NO_END_NM)),
    ];
    let extension = (low.is_some() || high.is_some()).then(|| Extension { id: CLIPPING.into(), parameters });
    let normal: String = ends
        .iter()
        .filter(|(name, _)| name.starts_with("normal"))
        .map(|(name, value)| format!("# {}", line(name, *value)))
        .collect();
    if normal.is_empty() {
        return (extension, normal);
    }
    let remark = format!(
        "\n# {CLIPPING} of the normal force channel is no extension, which has the ends of the friction channel alone.\n\
         # Beyond its ends the load is not known to the observer; friction computed from it is wrong there:\n{normal}"
    );
    (extension, remark)
}

/// The encoder's run-out as the core's effect.
///
/// The fit has φ = q + a cos(q − q₀) + b sin(q − q₀) with the measured angle q, and q₀ = 0 for the first log; the core
/// φ = q − e sin(q − φ₀) ([`model_core::extension::encoder_eccentricity`]). So e sin φ₀ = a and e cos φ₀ = −b.
fn run_out(found: &Extension) -> (Extension, String) {
    let get = |name: &str| found.get(name).unwrap_or(0.0);
    let (cos, sin) = (get("cos_1_rad"), get("sin_1_rad"));
    let names = ["amplitude_rad", "origin_rad"].map(String::from);
    let parameters = names.into_iter().zip([cos.hypot(sin), cos.atan2(-sin)]).collect();
    let second_rad = get("cos_2_rad").hypot(get("sin_2_rad"));
    let remark = format!(
        "\n# {RUN_OUT}: origin_rad counts from the zero of the first training log's angle. An incremental encoder has\n\
         # its zero wherever it was switched on, so another log's and the board's are elsewhere: origin_rad must be\n\
         # shifted by the difference there. A second harmonic of {second_rad:.1e} rad is left out.\n"
    );
    (Extension { id: RUN_OUT.into(), parameters }, remark)
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

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use model_core::extension::encoder_eccentricity::EncoderEccentricity;

    use super::super::synthetic::{contact_of, said, sliding_log};
    use super::super::verdict::Verdict;
    use super::*;
    use crate::files::signal::Signal;

    fn extension(id: &str, values: &[(&str, f64)]) -> Extension {
        Extension {
            id: id.into(),
            parameters: values.iter().map(|(name, x)| (name.to_string(), *x)).collect(),
        }
    }

    /// A model file with one more extension and the remark.
    fn with(extension: Option<Extension>, remark: &str) -> Result<ModelFile, InputError> {
        let mut model = ModelFile::assumed(&[])?;
        model.extensions.extend(extension);
        ModelFile::parse("model-extended.toml", &(model.to_toml() + remark))
    }

    #[test]
    fn the_cores_run_out_turns_the_disc_as_the_fitted_one_does() {
        for (cos, sin) in [(0.06, -0.034), (0.06, 0.034), (-0.06, 0.034), (-0.02, -0.05), (0.0, 0.03)] {
            let fitted = extension(RUN_OUT, &[("cos_1_rad", cos), ("sin_1_rad", sin), ("cos_2_rad", 2e-5)]);
            let (core, remark) = run_out(&fitted);
            let read = with(Some(core), &remark).unwrap();
            let core = &read.extensions[0];
            let values = ["amplitude_rad", "origin_rad"].map(|name| core.get(name).unwrap());
            let effect = EncoderEccentricity::new(&values).unwrap();
            for angle in (-40..40).map(|i| 0.3 * f64::from(i)) {
                // φ = q + a cos q + b sin q by q.
                let factor = 1.0 - cos * angle.sin() + sin * angle.cos();
                assert!((effect.speed_factor(angle) - factor).abs() < 1e-12, "{cos} {sin} {angle}");
            }
        }
    }

    #[test]
    fn a_clipped_friction_channel_is_an_extension_with_its_ends() {
        let (extension, remark) = clipping(&[("friction_high_nm", 3.2)]);
        assert_eq!(remark, "");
        let read = with(extension, &remark).unwrap();
        assert_eq!(read.extensions[0].get("friction_high_nm"), Some(3.2));
        assert!(read.extensions[0].get("friction_low_nm").unwrap() < -1e3, "no end there");
    }

    #[test]
    fn the_ends_written_are_those_that_the_training_logs_show() {
        let clipped = |limit| sliding_log(Some((Signal::FrictionTorque, limit)));
        let contact = contact_of(&clipped(2.5), &clipped(2.0));
        assert_eq!(contact.constants(CLIPPING), [("friction_high_nm", 2.5)]);
        assert_eq!(contact.constants("thermal_fade"), []);

        let mut part = said(Subsystem::Friction, Verdict::Named, &[CLIPPING]);
        // Seen in the channel itself: the fit is the baseline's.
        part.selection.fits.insert(Vec::new(), Arc::new(contact.fit(&[], None).unwrap()));
        let written =
            ModelFile::parse("model-extended.toml", &text(&[part], Some(&contact)).unwrap()).unwrap();
        assert_eq!(written.extensions.len(), 1);
        assert_eq!(written.extensions[0].get("friction_high_nm"), Some(2.5));
    }

    #[test]
    fn a_clipped_normal_channel_is_told_in_a_remark() {
        let (extension, remark) = clipping(&[("normal_force_high_n", 93.1)]);
        assert_eq!(extension, None);
        assert!(remark.contains("\n# normal_force_high_n = 93.1\n"), "{remark}");
        assert!(with(extension, &remark).unwrap().extensions.is_empty());
    }
}
