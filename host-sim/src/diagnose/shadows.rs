//! What one subsystem's fault does to another one's residual.
//!
//! The subsystems are fitted one by one on the same logs, so a fault can be seen twice: a shaft that twists makes the disc's angle differ
//! from the logged one, and the contact looks elastic; a drifting or clipped bridge makes the press or the drive look wrong.
//! Where the fault itself is named, the subsystem in its shadow is not asked. What the shadow hides is left to
//! another diagnosis, with the fault repaired. A channel that clips is named from the channel itself ([`super::saturation`]):
//! fits leave its samples out.

use super::contact::ContactAnalysis;
use super::verdict::{Cause, Judged, Verdict};
use crate::files::effect_id::{Subsystem, subsystem_of};
use crate::files::signal::Signal;

/// Share of the residual that a correction of the motion may leave over.
const LEFT_OVER: f64 = 0.25;
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
///
/// `unrepaired` is the structured part of the contact's residual before the disc's motion was corrected for
/// what the drive puts between it and the encoder, where it was.
pub fn settle(
    judged: &mut [Judged],
    contact: Option<&ContactAnalysis>,
    unrepaired: Option<f64>,
) -> Vec<String> {
    let clipped = contact.and_then(|contact| name_clipping(judged, contact));
    let drifting_load = judged.iter().any(|part| {
        let fit = part.selection.extended();
        fit.is_some_and(|fit| fit.get(Some("bridge_drift"), "normal_gain").is_some())
    });
    let mut named: Vec<(Subsystem, &'static str)> = judged
        .iter()
        .flat_map(|part| part.causes.iter().map(|cause| (part.analysis.subsystem(), cause.id)))
        .collect();
    let mut notes = Vec::new();
    // The strongest last: two that look like each other must not silence each other.
    let strength = |part: &Judged| part.causes.iter().map(|cause| cause.weight).fold(0.0, f64::max);
    let mut parts: Vec<&mut Judged> =
        judged.iter_mut().filter(|part| part.verdict != Verdict::None).collect();
    parts.sort_by(|a, b| strength(a).total_cmp(&strength(b)));
    for part in parts {
        let own = part.analysis.subsystem();
        let only = |ids: &[&str]| part.causes.iter().all(|cause| ids.contains(&cause.id));
        // What a correction of the motion has taken away was the drive's; a small rest is what it left over.
        let left_over = unrepaired.is_none_or(|before| part.structured_before() < LEFT_OVER * before);
        let shadow = named.iter().filter(|(from, _)| *from != own).find(|(_, id)| match (own, *id) {
            (Subsystem::Friction, "encoder_eccentricity") => left_over && only(&["disc_angle"]),
            (Subsystem::Friction, "shaft_torsion" | "backlash") => left_over && only(&LIKE_A_SHAFT),
            (Subsystem::Pressure, "bridge_drift") => drifting_load || part.verdict == Verdict::Unknown,
            (Subsystem::Pressure, "adc_saturation") => clipped == Some(Signal::NormalForce),
            // A load that comes at the wrong moment is wrong where it changes: at reversals and steps.
            (Subsystem::Drive, "friction_delay" | "ring_resonance") => {
                part.verdict == Verdict::Unknown || only(&LIKE_A_LATE_LOAD)
            }
            (Subsystem::Drive, id) => {
                part.verdict == Verdict::Unknown && subsystem_of(id) == Some(Subsystem::Measurement)
            }
            _ => false,
        });
        if let Some((_, id)) = shadow.copied() {
            named.retain(|(from, _)| *from != own);
            notes.push(format!("{}: what is left is taken for the shadow of {id}", own.name()));
            part.verdict = Verdict::None;
            part.causes.clear();
            part.indistinguishable.clear();
        }
    }
    notes
}

/// Names a channel that clips; gives which one it is.
fn name_clipping(judged: &mut [Judged], contact: &ContactAnalysis) -> Option<Signal> {
    let part = judged.iter_mut().find(|part| part.analysis.subsystem() == Subsystem::Friction)?;
    let (channel, samples) = contact.clipped()?;
    let name = if channel == Signal::FrictionTorque { "friction" } else { "normal force" };
    if part.causes.iter().any(|cause| cause.id == "adc_saturation") {
        return Some(channel);
    }
    let evidence = vec![format!(
        "the {name} channel shows exactly its extreme value in {samples} samples of the training logs, in runs too long for its noise"
    )];
    part.verdict = Verdict::Named;
    // It is seen, not inferred: it stands first.
    let weight = part.causes.iter().map(|cause| cause.weight).fold(samples as f64, f64::max);
    part.causes.insert(0, Cause { id: "adc_saturation", probability: 0.99, weight, evidence });
    Some(channel)
}

#[cfg(test)]
mod tests {
    use super::super::structure::Structure;
    use super::super::synthetic::{contact_of, said, sliding_log};
    use super::*;
    use crate::files::log::Log;
    use crate::files::signal::Signal;

    /// Names that a subsystem has got.
    type Names = &'static [&'static str];

    fn named(subsystem: Subsystem, ids: Names) -> Judged {
        said(subsystem, Verdict::Named, ids)
    }

    fn unknown(subsystem: Subsystem) -> Judged {
        said(subsystem, Verdict::Unknown, &[])
    }

    fn settled(judged: &mut [Judged], contact: Option<&ContactAnalysis>) -> Vec<String> {
        settle(judged, contact, None)
    }

    /// The first is taken for a shadow of the second, which stays.
    #[track_caller]
    fn is_silenced(shadow: Judged, fault: Judged) {
        let (own, id) = (shadow.analysis.subsystem().name(), fault.causes[0].id);
        let mut judged = [shadow, fault];
        judged[0].indistinguishable = vec![vec!["a", "b"]];
        let notes = settled(&mut judged, None);
        assert_eq!(notes, [format!("{own}: what is left is taken for the shadow of {id}")]);
        let [shadow, fault] = judged;
        assert_eq!(shadow.verdict, Verdict::None);
        assert!(shadow.causes.is_empty() && shadow.indistinguishable.is_empty());
        assert_eq!((fault.verdict, fault.causes[0].id), (Verdict::Named, id));
    }

    /// Both stay as they are.
    #[track_caller]
    fn stays(part: Judged, beside: Judged) {
        let before = [part.causes.clone(), beside.causes.clone()];
        let verdicts = [part.verdict, beside.verdict];
        let mut judged = [part, beside];
        assert_eq!(settled(&mut judged, None), Vec::<String>::new());
        assert_eq!(judged.each_ref().map(|part| part.causes.clone()), before);
        assert_eq!(judged.each_ref().map(|part| part.verdict), verdicts);
    }

    use Subsystem::{Drive, Friction, Pressure};

    #[test]
    fn an_eccentric_encoder_makes_friction_look_as_if_it_varied_over_the_disc() {
        let encoder = || named(Drive, &["encoder_eccentricity"]);
        is_silenced(named(Friction, &["disc_angle"]), encoder());
        stays(named(Friction, &["thermal_fade"]), encoder());
        stays(named(Friction, &["disc_angle", "thermal_fade"]), encoder());
        stays(named(Friction, &["element_compliance"]), encoder());
    }

    #[test]
    fn a_soft_shaft_makes_the_contact_look_elastic() {
        let shafts: [Names; 2] = [&["shaft_torsion"], &["backlash"]];
        for shaft in shafts {
            let looks: [Names; 4] = [
                &["element_compliance"],
                &["rubber_relaxation"],
                &["static_ageing"],
                &["load_dependence", "element_compliance"],
            ];
            for look in looks {
                is_silenced(named(Friction, look), named(Drive, shaft));
            }
            is_silenced(unknown(Friction), named(Drive, shaft));
            stays(named(Friction, &["wear_drift"]), named(Drive, shaft));
            stays(named(Friction, &["element_compliance", "wear_drift"]), named(Drive, shaft));
            stays(named(Pressure, &["foil_hardening"]), named(Drive, shaft));
        }
    }

    #[test]
    fn what_is_large_even_under_the_discs_own_motion_is_the_contacts() {
        let settled_after = |unrepaired: f64| {
            let mut contact = named(Friction, &["element_compliance"]);
            contact.before = vec![Structure {
                channel: "friction torque",
                mean_square: 101.0,
                structured: 100.0,
                nrmse: 0.1,
                deviations: 50.0,
                views: Vec::new(),
            }];
            let mut judged = [contact, named(Drive, &["shaft_torsion"])];
            settle(&mut judged, None, Some(unrepaired));
            judged[0].verdict
        };
        assert_eq!(settled_after(150.0), Verdict::Named);
        assert_eq!(settled_after(1000.0), Verdict::None);
    }

    #[test]
    fn a_late_friction_channel_makes_the_drive_look_wrong_where_the_load_changes() {
        let channels: [Names; 2] = [&["friction_delay"], &["ring_resonance"]];
        for channel in channels {
            is_silenced(named(Drive, &["presliding"]), named(Friction, channel));
            is_silenced(named(Drive, &["bearing_stribeck", "presliding"]), named(Friction, channel));
            is_silenced(unknown(Drive), named(Friction, channel));
            stays(named(Drive, &["m2_ripple"]), named(Friction, channel));
            stays(named(Drive, &["presliding", "m2_ripple"]), named(Friction, channel));
            stays(named(Pressure, &["lever_hysteresis"]), named(Friction, channel));
        }
    }

    #[test]
    fn of_two_that_look_like_each_other_the_stronger_stays() {
        for stronger in [0, 1] {
            let mut judged = [named(Friction, &["friction_delay"]), named(Drive, &["shaft_torsion"])];
            judged[stronger].causes[0].weight = 500.0;
            let notes = settled(&mut judged, None);
            assert_eq!(notes.len(), 1);
            assert_eq!(judged[stronger].verdict, Verdict::Named);
            assert_eq!(judged[1 - stronger].verdict, Verdict::None);
        }
    }

    #[test]
    fn a_drive_that_nothing_explains_is_a_wrong_channels_shadow_and_no_frictions() {
        is_silenced(unknown(Drive), named(Friction, &["bridge_crosstalk"]));
        stays(named(Drive, &["torque_offset"]), named(Friction, &["bridge_crosstalk"]));
        stays(unknown(Drive), named(Friction, &["thermal_fade"]));
    }

    #[test]
    fn a_press_that_nothing_explains_is_the_shadow_of_a_drifting_bridge() {
        is_silenced(unknown(Pressure), named(Friction, &["bridge_drift"]));
        stays(unknown(Pressure), named(Friction, &["thermal_fade"]));
        stays(unknown(Pressure), named(Drive, &["shaft_torsion"]));
    }

    /// Settles with the channels of a training log; the held-out one is whole.
    fn settled_with(train: &Log, judged: &mut [Judged]) -> Vec<String> {
        settled(judged, Some(&contact_of(train, &sliding_log(None))))
    }

    #[test]
    fn a_channel_that_clips_is_named_first_with_its_samples() {
        let mut judged = [named(Friction, &["thermal_fade"])];
        settled_with(&sliding_log(Some((Signal::FrictionTorque, 2.5))), &mut judged);
        let ids: Vec<&str> = judged[0].causes.iter().map(|cause| cause.id).collect();
        assert_eq!(ids, ["adc_saturation", "thermal_fade"]);
        assert!(judged[0].causes[0].weight >= judged[0].causes[1].weight);
        let evidence = &judged[0].causes[0].evidence[0];
        // 2.5 N·m are 59.5 N of friction at 0.7: sin(2t) is above 0.476 for 34 % of 2500 samples.
        let samples: f64 = evidence.split(' ').find_map(|word| word.parse().ok()).unwrap();
        assert!(
            evidence.starts_with("the friction channel shows exactly its extreme value in "),
            "{evidence}"
        );
        assert!((samples - 0.4 * 2500.0).abs() < 300.0, "{evidence}");
    }

    #[test]
    fn a_clipped_load_is_named_in_a_contact_without_other_causes_and_silences_the_press() {
        let mut judged = [said(Friction, Verdict::None, &[]), named(Pressure, &["lever_hysteresis"])];
        let notes = settled_with(&sliding_log(Some((Signal::NormalForce, 60.0))), &mut judged);
        assert_eq!((judged[0].verdict, judged[0].causes[0].id), (Verdict::Named, "adc_saturation"));
        assert!(judged[0].causes[0].evidence[0].starts_with("the normal force channel "));
        assert_eq!(judged[1].verdict, Verdict::None);
        assert_eq!(notes, ["pressure: what is left is taken for the shadow of adc_saturation"]);
    }

    #[test]
    fn a_clipped_friction_channel_says_nothing_about_the_press() {
        let mut judged = [said(Friction, Verdict::None, &[]), named(Pressure, &["lever_hysteresis"])];
        let notes = settled_with(&sliding_log(Some((Signal::FrictionTorque, 2.5))), &mut judged);
        assert_eq!((judged[1].verdict, notes.len()), (Verdict::Named, 0));
    }

    #[test]
    fn whole_channels_and_clips_of_held_out_logs_are_not_named() {
        let mut judged = [said(Friction, Verdict::None, &[])];
        settled_with(&sliding_log(None), &mut judged);
        assert!(judged[0].causes.is_empty());
        let held_out = contact_of(&sliding_log(None), &sliding_log(Some((Signal::FrictionTorque, 2.5))));
        settled(&mut judged, Some(&held_out));
        assert!(judged[0].causes.is_empty());
    }

    #[test]
    fn a_clip_that_a_fit_has_found_is_not_named_twice() {
        let mut judged = [named(Friction, &["adc_saturation"])];
        settled_with(&sliding_log(Some((Signal::FrictionTorque, 2.5))), &mut judged);
        assert_eq!(judged[0].causes.len(), 1);
    }
}
