//! What to run next, from what is left open.
//!
//! Two causes of the contact that the logs do not tell apart: both models as fitted are put against each other, and
//! the experiment on which they differ most is searched for ([`crate::design`], with the smaller effort). Where there
//! is no such pair, or no model can be run, the choice is by the signatures of the causes: a named cause asks for the
//! experiment that shows it best, a clean log for one that excludes its closest rival. Drives without contact have no
//! experiment file: there is no rig whose limits are known.

use super::contact::ContactAnalysis;
use super::selection::without;
use super::verdict::{Judged, Verdict};
use crate::design::family::{Family, Setting};
use crate::design::{self, Effort, text};
use crate::files::effect_id::Subsystem;
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
/// Relative standard deviation of a parameter that the logs leave open.
const OPEN: f64 = 0.5;
/// Separation below which a repetition or a longer log is needed to tell two models apart.
const CLEAR: f64 = 1.0;
/// Separation below which no repetition helps.
const HOPELESS: f64 = 0.1;

/// What is known about the rig where the logs have contact.
#[derive(Clone, Copy)]
pub struct Bench<'a> {
    /// Its limits.
    pub rig: &'a RigFile,
    /// The baseline as it was given.
    pub model: &'a ModelFile,
    /// The contact's fits.
    pub contact: &'a ContactAnalysis,
}

/// A proposal.
pub struct NextExperiment {
    /// One sentence.
    pub sentence: String,
    /// The experiment file's text, for the rig.
    pub file: Option<String>,
}

/// Proposes what to run next; `bench` is there where the logs have contact. `progress` is told the number of
/// experiments tried, and of all to be tried.
pub fn propose(
    judged: &[Judged],
    bench: Option<Bench<'_>>,
    progress: impl Fn(usize, usize) + Sync,
) -> NextExperiment {
    if let Some(found) = bench.and_then(|bench| tell_apart(judged, bench, progress)) {
        return found;
    }
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
    let Some(Bench { rig, model, .. }) = bench else {
        return NextExperiment { sentence: format!("{why}: {motion}"), file: None };
    };
    let load_n = LOAD_SHARE * text::largest_load_n(rig, std::slice::from_ref(model));
    let setting = Setting { family, load_n, speed_rpm: SPEED_RPM, hold_s: HOLD_S };
    NextExperiment {
        sentence: format!("{why}: {motion}; {FILE} holds {}", family.words()),
        file: Some(text::toml("next", &why, &setting.course(), rig)),
    }
}

/// The experiment on which two causes of the contact differ most that these logs do not tell apart; `None` where
/// there are none, or no model of them runs on this rig.
fn tell_apart(
    judged: &[Judged],
    bench: Bench<'_>,
    progress: impl Fn(usize, usize) + Sync,
) -> Option<NextExperiment> {
    let part = judged.iter().find(|part| part.analysis.subsystem() == Subsystem::Friction)?;
    let [named, rival] = part.indistinguishable.first()?.as_slice() else { return None };
    let chosen = &part.selection.chosen;
    let instead = [without(chosen, named), vec![*rival]].concat();
    let models: Vec<ModelFile> = [chosen, &instead]
        .into_iter()
        .map(|effects| bench.contact.to_model_file(part.selection.fit(effects)?).ok().map(bounded))
        .collect::<Option<_>>()?;
    let best = design::propose(bench.rig, &models, Effort::QUICK, progress).ok()?.into_iter().next()?;
    let why = format!("to tell {named} and {rival} apart");
    let predicted = predicted(best.separation(), best.sentence());
    Some(NextExperiment {
        sentence: format!("{why}: {predicted}; {FILE} holds it"),
        file: Some(text::toml("next", &why, &best.setting.course(), bench.rig)),
    })
}

/// The model with parameters that the logs leave open known to half of their size: beyond it, what a parameter's change
/// does to a prediction is no longer in proportion to it, and the search takes it to be.
fn bounded(mut model: ModelFile) -> ModelFile {
    let sizes: Vec<(&str, f64)> = model.parameters().filter(|(_, value)| *value != 0.0).collect();
    for (name, value) in sizes {
        if let Some(interval) = model.intervals.get_mut(name) {
            interval.std = interval.std.min(OPEN * value.abs());
        }
    }
    model
}

/// The experiment and what it is expected to show.
fn predicted(separation: f64, sentence: String) -> String {
    if separation >= CLEAR {
        return sentence;
    }
    if separation >= HOPELESS {
        return format!("{sentence}, so that even this one, the best of those tried, has to be repeated");
    }
    format!("no experiment that was tried does; on the best, {sentence}")
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

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;
    use std::sync::Arc;

    use super::super::analysis::{Analysis, Role};
    use super::super::score::Independent;
    use super::super::selection::Selection;
    use super::super::verdict::judge;
    use super::*;
    use crate::files::effect_id::EFFECTS;
    use crate::files::experiment_file::ExperimentFile;
    use crate::files::log::Log;
    use crate::files::model_file::Interval;
    use crate::lockstep::{self, Setup};

    const LUGRE: &str = r#"
kind = "lugre"
[parameters]
sigma0_n_per_m = 1e6
a0 = 0.6
a1 = 0.3
v0_m_s = 0.5
"#;
    const WEAR: &str = r#"
[[extension]]
id = "wear_drift"
change_per_m = -0.05
scale_m = 1e3
"#;
    /// Heat that never had the time to leave and distance that was slid look alike.
    const STEADY: &str = r#"
name = "steady"
title = "steady slide"
duration_s = 4.0
seed = 5
log_rate_hz = 500
[[m1]]
start_s = 0.0
torque_nm = 2.0
[[m2]]
start_s = 0.0
speed_rpm = 60.0
"#;

    fn run(experiment: &str, rig: &RigFile, model: &ModelFile) -> Log {
        let experiment = ExperimentFile::parse(FILE, experiment).unwrap();
        let setup = Setup::from_files(&experiment, rig, model, model).unwrap();
        let recording = lockstep::run(&setup, |_, _| {}).unwrap();
        assert_eq!(recording.fault, None);
        recording.log(20, setup.plant.counts_per_rev)
    }

    /// A slide at one speed and load that wears, with the fits of two causes, of which it cannot tell which is true.
    fn open_case(rig: &RigFile, model: &ModelFile) -> (Arc<ContactAnalysis>, Vec<Judged>) {
        let worn = ModelFile::parse("worn", &format!("{LUGRE}{WEAR}")).unwrap();
        let log = run(STEADY, rig, &worn);
        let contact = Arc::new(ContactAnalysis::new(rig, model, &[(&log, Role::Train)]).unwrap());
        let mut fits = BTreeMap::new();
        for effects in [vec![], vec!["thermal_fade"], vec!["wear_drift"]] {
            let fit = contact.fit(&effects, None).unwrap();
            fits.insert(effects, Arc::new(fit));
        }
        let independent = Independent::of(&fits[&vec!["wear_drift"]], Role::Train);
        let chosen = vec!["wear_drift"];
        let selection =
            Selection { fits, failed: BTreeMap::new(), chosen, unconfirmed: Vec::new(), independent };
        let mut part = judge(contact.clone(), selection, &[]);
        part.indistinguishable = vec![vec!["wear_drift", "thermal_fade"]];
        (contact, vec![part])
    }

    fn separation(sentence: &str) -> f64 {
        let (_, after) = sentence.split_once("would miss by ").unwrap();
        after.split(' ').next().unwrap().parse().unwrap()
    }

    #[test]
    fn two_causes_that_are_not_told_apart_get_the_experiment_on_which_their_models_differ() {
        let rig = RigFile::assumed_rig(&[]).unwrap();
        let model = ModelFile::parse("model", LUGRE).unwrap();
        let (contact, judged) = open_case(&rig, &model);
        let bench = Bench { rig: &rig, model: &model, contact: &contact };
        let told = std::sync::atomic::AtomicUsize::new(0);
        let started = std::time::Instant::now();
        let next = propose(&judged, Some(bench), |done, total| {
            assert!(done <= total);
            told.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
        });
        println!("{:.1} s: {}", started.elapsed().as_secs_f64(), next.sentence);
        assert!(
            next.sentence.starts_with("to tell wear_drift and thermal_fade apart: "),
            "{}",
            next.sentence
        );
        // Heat goes and wear stays: an experiment that lets it go is far beyond the noise of a sample.
        assert!(separation(&next.sentence) > 1.0, "{}", next.sentence);
        assert!(told.into_inner() > 10, "progress is told");
        let log = run(&next.file.unwrap(), &rig, &model);
        assert!(log.len() > 1000);
    }

    #[test]
    fn a_pair_whose_models_were_not_fitted_falls_back_on_the_family_that_shows_the_rival() {
        let rig = RigFile::assumed_rig(&[]).unwrap();
        let model = ModelFile::parse("model", LUGRE).unwrap();
        let (contact, mut judged) = open_case(&rig, &model);
        judged[0].indistinguishable = vec![vec!["wear_drift", "static_ageing"]];
        let next = propose(&judged, Some(Bench { rig: &rig, model: &model, contact: &contact }), |_, _| {});
        assert!(
            next.sentence.ends_with("next-experiment.toml holds dwells of growing length"),
            "{}",
            next.sentence
        );
        run(&next.file.unwrap(), &rig, &model);
    }

    #[test]
    fn a_parameter_that_the_logs_leave_open_is_known_to_half_of_its_size() {
        let mut model = ModelFile::parse("model", LUGRE).unwrap();
        let interval = |std| Interval { std, low: -1.0, high: 1.0 };
        model
            .intervals
            .extend([("a0", 0.01), ("a1", 80.0), ("a2_s_per_m", 3.0)].map(|(n, s)| (n.into(), interval(s))));
        let bounded = bounded(model);
        let std = |name: &str| bounded.intervals[name].std;
        assert_eq!((std("a0"), std("a1"), std("a2_s_per_m")), (0.01, 0.15, 3.0));
    }

    #[test]
    fn a_small_separation_is_not_told_as_a_clear_one() {
        let told = |separation| predicted(separation, "this".into());
        assert_eq!(told(5.1), "this");
        assert_eq!(told(0.4), "this, so that even this one, the best of those tried, has to be repeated");
        assert_eq!(told(0.01), "no experiment that was tried does; on the best, this");
    }

    #[test]
    fn every_effect_has_an_experiment_that_the_core_takes_and_words_of_its_own() {
        let rig = RigFile::assumed_rig(&[]).unwrap();
        let model = ModelFile::assumed(&[]).unwrap();
        let load_n = LOAD_SHARE * text::largest_load_n(&rig, &[model]);
        for (id, _) in EFFECTS {
            let (motion, family) = experiment(id);
            let setting = Setting { family, load_n, speed_rpm: SPEED_RPM, hold_s: HOLD_S };
            let toml = text::toml("next", motion, &setting.course(), &rig);
            ExperimentFile::parse(FILE, &toml).unwrap().for_core(&rig).unwrap();
            assert_ne!(motion, experiment("").0, "{id}");
        }
    }
}
