//! What to run next, from what is left open.
//!
//! For a named or rejected effect the experiment that shows it best, for two that are not told apart the one in which they
//! differ: a few words, from the signature that each effect's file states.

use super::verdict::{Judged, Verdict};

/// A proposal.
pub struct NextExperiment {
    /// One sentence.
    pub sentence: String,
    /// Name and text of the file written for it.
    pub file: Option<(&'static str, String)>,
}

/// Proposes what to run next.
pub fn propose(judged: &[Judged<'_>]) -> NextExperiment {
    let pair = judged.iter().flat_map(|part| &part.indistinguishable).next();
    let named = judged.iter().filter(|p| p.verdict == Verdict::Named).flat_map(|p| &p.causes).next();
    let closest = judged.iter().flat_map(|part| &part.rejected).next();
    let sentence = match (pair, named, closest) {
        (Some(pair), ..) => {
            format!("to tell {} apart: {}", pair.join(" and "), motion(pair.last().copied().unwrap_or("")))
        }
        (None, Some(cause), _) => format!("to confirm {}: {}", cause.id, motion(cause.id)),
        (None, None, Some(rival)) => format!("to exclude {}: {}", rival.id, motion(rival.id)),
        _ => "repeat the motion at other speeds and loads".into(),
    };
    NextExperiment { sentence, file: None }
}

fn motion(id: &str) -> &'static str {
    match id {
        "thermal_fade" => "slide fast under high load for 10 s, rest for 10 s, slide again: heat recovers",
        "wear_drift" => "slide far at one slow speed and load, rest, slide again: wear does not recover",
        "static_ageing" => "break away after rests of 0.1, 1 and 10 s at the same load",
        "disc_angle" | "m2_ripple" | "encoder_eccentricity" => {
            "turn slowly at one speed for five revolutions, at two loads"
        }
        "load_dependence" | "bridge_crosstalk" => {
            "hold one speed in each direction and step through five loads"
        }
        "direction_asymmetry" | "bearing_asymmetry" | "torque_offset" => {
            "the same ramp of speed in both directions, at rest between"
        }
        "bell_curve" | "bearing_stribeck" => {
            "a slow ramp of speed from rest through the whole range, up and down"
        }
        "viscous_film" => "a slow ramp of speed at two loads: a film does not scale with load",
        "element_compliance" | "rubber_relaxation" => {
            "load steps under torque below breakaway, and slow sines of torque"
        }
        "friction_delay" | "ring_resonance" | "drive_delay" | "shaft_torsion" => {
            "sines of speed from 2 to 60 Hz at small amplitude"
        }
        "bridge_drift" => "one slow speed and one load for 60 s, with the elements lifted every 10 s",
        "presliding" | "backlash" => "reversals of small amplitude at several speeds",
        "lever_hysteresis" | "foil_hardening" | "m1_ripple" => {
            "a slow triangle of M1's torque over its whole range, without sliding"
        }
        _ => "the same motion at half and at twice the load",
    }
}
