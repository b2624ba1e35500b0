//! What to run next, from what is left open.
//!
//! Two causes that the logs do not tell apart ask for the experiment in which they differ, a named cause for the one
//! that shows it best, a clean log for one that excludes its closest rival. The choice is by the signatures of the causes;
//! `rig design` looks for the best levels with the models themselves. Drives without contact have no experiment file: there
//! is no rig whose limits are known.

use super::verdict::{Judged, Verdict};
use crate::design::family::{Family, Setting};
use crate::design::text;
use crate::files::model_file::ModelFile;
use crate::files::rig_file::RigFile;

/// Name of the experiment file.
pub const FILE: &str = "next-experiment.toml";
/// Share of the largest possible load.
const LOAD_SHARE: f64 = 0.8;
/// Speed of experiments that do not ask for a special one, rpm.
const SPEED_RPM: f64 = 60.0;
/// Holds, s.
const HOLD_S: f64 = 1.5;

/// A proposal.
pub struct NextExperiment {
    /// One sentence.
    pub sentence: String,
    /// The experiment file's text, for the rig.
    pub file: Option<String>,
}

/// Proposes what to run next; `contact` is the rig and its model where the logs have contact.
pub fn propose(judged: &[Judged], contact: Option<(&RigFile, &ModelFile)>) -> NextExperiment {
    let pair = judged.iter().flat_map(|part| &part.indistinguishable).next();
    let named = judged.iter().filter(|p| p.verdict == Verdict::Named).flat_map(|p| &p.causes).next();
    let closest = judged.iter().flat_map(|part| &part.rejected).find(|r| r.probability < 0.5);
    let unknown = judged.iter().any(|part| part.verdict == Verdict::Unknown);
    let (why, id) = match (pair, named, closest) {
        (Some(pair), ..) => (format!("to tell {} apart", pair.join(" and ")), pair.last().copied()),
        (None, Some(cause), _) => (format!("to confirm {}", cause.id), Some(cause.id)),
        _ if unknown => ("to see what the rest follows".into(), None),
        (None, None, Some(rival)) => (format!("to exclude {}", rival.id), Some(rival.id)),
        _ => ("to look further".into(), None),
    };
    let (motion, family) = experiment(id.unwrap_or(""));
    let Some((rig, model)) = contact else {
        return NextExperiment { sentence: format!("{why}: {motion}"), file: None };
    };
    let load_n = LOAD_SHARE * text::largest_load_n(rig, std::slice::from_ref(model));
    let setting = Setting { family, load_n, speed_rpm: SPEED_RPM, hold_s: HOLD_S };
    NextExperiment {
        sentence: format!("{why}: {motion}; {FILE} holds {}", family.words()),
        file: Some(text::toml("next", &why, &setting.course(), rig)),
    }
}

fn experiment(id: &str) -> (&'static str, Family) {
    match id {
        "thermal_fade" => {
            ("slide fast under high load, rest, slide again: heat goes", Family::SlideRestSlide)
        }
        "wear_drift" => ("slide far, rest, slide again: wear stays", Family::SlideRestSlide),
        "bridge_drift" => ("rest with the elements lifted, again and again", Family::SlideRestSlide),
        "static_ageing" => ("break away after rests of growing length at the same load", Family::Dwells),
        "disc_angle" | "m2_ripple" | "encoder_eccentricity" => {
            ("turn slowly, some revolutions forward and as many back", Family::ThereAndBack)
        }
        "load_dependence" | "lever_hysteresis" | "foil_hardening" | "m1_ripple" | "adc_saturation" => {
            ("step through the whole range of loads, up and down", Family::LoadStaircase)
        }
        "bridge_crosstalk" => ("press at standstill, turn without load, then both", Family::PressThenTurn),
        "direction_asymmetry"
        | "bearing_asymmetry"
        | "torque_offset"
        | "bell_curve"
        | "bearing_stribeck"
        | "viscous_film" => {
            ("step through the whole range of speeds, in both directions", Family::SpeedStaircase)
        }
        "element_compliance" | "friction_delay" | "ring_resonance" => {
            ("steps of load while the disc turns", Family::LoadSteps)
        }
        "rubber_relaxation" | "presliding" | "backlash" | "drive_delay" | "shaft_torsion" => {
            ("reversals of growing frequency", Family::Reversals)
        }
        _ => ("the same motion at other loads", Family::LoadStaircase),
    }
}
