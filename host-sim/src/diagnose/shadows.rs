//! What one subsystem's fault does to another one's residual.
//!
//! The subsystems are fitted one by one on the same logs, so a fault can be seen twice: a shaft that twists makes the disc's angle differ
//! from the logged one, and the contact looks elastic; a drifting or clipped bridge makes the press or the drive look wrong.
//! Where the fault itself is named, the subsystem in its shadow is not asked. What the shadow hides is left to
//! another diagnosis, with the fault repaired. A channel that clips is named from the channel itself ([`super::saturation`]):
//! fits leave its samples out.

use super::analysis::Role;
use super::contact::ContactAnalysis;
use super::record::Measured;
use super::verdict::{Cause, Judged, Verdict};
use crate::files::effect_id::{Subsystem, subsystem_of};

/// Fewest clipped samples in the training logs.
const FEWEST_CLIPPED: usize = 20;
/// Effects of the contact that a moving disc behind a soft shaft looks like.
const LIKE_A_SHAFT: [&str; 6] = [
    "element_compliance",
    "rubber_relaxation",
    "friction_delay",
    "ring_resonance",
    "static_ageing",
    "load_dependence",
];

/// Effects of the drive that a load of which the timing is not quite right looks like.
const LIKE_A_LATE_LOAD: [&str; 4] = ["presliding", "shaft_torsion", "backlash", "bearing_stribeck"];

/// Names clipped channels and silences what stands in another fault's shadow; gives a note for each.
pub fn settle(judged: &mut [Judged], contact: Option<&ContactAnalysis>) -> Vec<String> {
    if let Some(contact) = contact {
        name_clipping(judged, contact);
    }
    let named: Vec<(Subsystem, &'static str)> = judged
        .iter()
        .flat_map(|part| part.causes.iter().map(|cause| (part.analysis.subsystem(), cause.id)))
        .collect();
    let mut notes = Vec::new();
    for part in judged.iter_mut().filter(|part| part.verdict != Verdict::None) {
        let own = part.analysis.subsystem();
        let only = |ids: &[&str]| part.causes.iter().all(|cause| ids.contains(&cause.id));
        let shadow = named.iter().filter(|(from, _)| *from != own).find(|(_, id)| match (own, *id) {
            (Subsystem::Friction, "encoder_eccentricity") => only(&["disc_angle"]),
            (Subsystem::Friction, "shaft_torsion" | "backlash") => only(&LIKE_A_SHAFT),
            (Subsystem::Pressure, "bridge_drift" | "adc_saturation") => true,
            // A load that comes at the wrong moment is wrong where it changes: at reversals and steps.
            (Subsystem::Drive, "friction_delay" | "ring_resonance") => {
                part.verdict == Verdict::Unknown || only(&LIKE_A_LATE_LOAD)
            }
            (Subsystem::Drive, id) => {
                part.verdict == Verdict::Unknown && subsystem_of(id) == Some(Subsystem::Measurement)
            }
            _ => false,
        });
        if let Some((_, id)) = shadow {
            notes.push(format!("{}: what is left is taken for the shadow of {id}", own.name()));
            part.verdict = Verdict::None;
            part.causes.clear();
            part.indistinguishable.clear();
        }
    }
    notes
}

fn name_clipping(judged: &mut [Judged], contact: &ContactAnalysis) {
    let Some(part) = judged.iter_mut().find(|part| part.analysis.subsystem() == Subsystem::Friction) else {
        return;
    };
    let train = || contact.records().iter().filter(|record| record.role == Role::Train);
    let count = |channel: &Measured| (0..channel.values.len()).filter(|i| channel.clipped(*i)).count();
    let friction: usize = train().map(|record| count(&record.friction_nm)).sum();
    let normal: usize = train().map(|record| count(&record.normal_n)).sum();
    let known = part.causes.iter().any(|cause| cause.id == "adc_saturation");
    if friction.max(normal) < FEWEST_CLIPPED || known {
        return;
    }
    let (name, samples) = if friction > normal { ("friction", friction) } else { ("normal force", normal) };
    let evidence = vec![format!(
        "the {name} channel shows exactly its extreme value in {samples} samples of the training logs, in runs too long for its noise"
    )];
    part.verdict = Verdict::Named;
    // It is seen, not inferred: it stands first.
    let weight = part.causes.iter().map(|cause| cause.weight).fold(samples as f64, f64::max);
    part.causes.insert(0, Cause { id: "adc_saturation", probability: 0.99, weight, evidence });
}
