//! The diagnosis on logs of the independent generator: one case for each kind of answer. How often it is right over all
//! effects, laws and rigs is counted by `cargo rig trials`; these are the cases that must not be lost on the way.

use host_sim::files::log::Log;
use host_sim::files::model_file::ModelFile;
use host_sim::files::rig_file::RigFile;
use host_sim::files::signal::Signal;
use host_sim::identify::command::{Written, diagnose};
use rig_tests::{Base, Effect, Scenario, generate};

/// Half the usual rate: a test takes half as long. Two keep the usual one: at this rate their causes are named as well, but their
/// held-out errors are larger than is asked for.
const RATE_HZ: f64 = 500.0;

fn scenario(effects: &[Effect], seed: u64, base: Base) -> Scenario {
    Scenario { base, rate_hz: RATE_HZ, ..Scenario::new(effects, seed) }
}

fn answer(effects: &[Effect], seed: u64, base: Base) -> Written {
    answer_to(&scenario(effects, seed, base), |holdout| holdout)
}

/// The answer to a scenario whose held-out log is changed.
fn answer_to(scenario: &Scenario, change: impl Fn(Log) -> Log) -> Written {
    let case = generate(scenario).unwrap();
    let log = |name: &str, text: &String| Log::parse_csv(name, text.as_bytes()).unwrap();
    let train: Vec<Log> =
        case.train.iter().enumerate().map(|(i, text)| log(&format!("train{i}"), text)).collect();
    let holdout = change(log("holdout", &case.holdout));
    let rig = RigFile::parse("rig", &case.rig_toml).unwrap();
    let model = ModelFile::parse("model", &case.model_toml).unwrap();
    diagnose(&train, &[holdout], &rig, &model, &|| 0.0, &|_| ()).unwrap()
}

fn named(effects: &[Effect], seed: u64, base: Base) -> Written {
    named_in(&scenario(effects, seed, base))
}

fn named_in(scenario: &Scenario) -> Written {
    let written = answer_to(scenario, |holdout| holdout);
    let causes: Vec<&str> = written.diagnosis.causes.iter().map(|c| c.id.as_str()).collect();
    let hidden: Vec<&str> = scenario.effects.iter().map(|e| e.id()).collect();
    println!("{hidden:?} -> {} {causes:?}; {}", written.diagnosis.verdict, written.diagnosis.sentence);
    assert_eq!((written.diagnosis.verdict, causes), ("named", hidden));
    let sum: f64 = written.diagnosis.posterior.values().sum();
    assert!((sum - 1.0).abs() < 1e-9, "the posterior sums to {sum}");
    written
}

/// The causes of an answer, in the order of their names.
fn sorted_causes(written: &Written) -> Vec<&str> {
    let mut causes: Vec<&str> = written.diagnosis.causes.iter().map(|c| c.id.as_str()).collect();
    causes.sort_unstable();
    causes
}

#[test]
fn a_missing_block_is_named_where_the_baseline_is_bristles() {
    let written = named(&[Effect::ElementCompliance], 215, Base::Series);
    assert!(written.model.starts_with("kind = \"series\""), "{}", written.model);
    // The bristles keep their own stiffness, which is many times the new block's.
    let number = |name: &str| -> f64 {
        let line = written.model.lines().find_map(|line| line.strip_prefix(name)?.strip_prefix(" = "));
        line.unwrap().parse().unwrap()
    };
    assert!(number("sigma0_n_per_m") > 10.0 * number("k_u_n_per_m"), "{}", written.model);
}

#[test]
fn a_clean_log_is_answered_with_nothing() {
    let written = answer(&[], 103, Base::Series);
    assert_eq!(written.diagnosis.verdict, "none", "{}", written.diagnosis.sentence);
    assert!(written.diagnosis.posterior["none"] > 0.5);
    assert!(
        !written.diagnosis.notes.iter().any(|note| note.contains(APART)),
        "{:?}",
        written.diagnosis.notes
    );
    // What is left is what noise alone leaves, as well as noise is known.
    for (part, of_part) in &written.diagnosis.subsystems {
        let errors = &of_part.extended;
        let over = errors.holdout_nrmse.unwrap() / errors.noise_floor_nrmse.unwrap();
        assert!((1.0 / 1.5..1.5).contains(&over), "{part}: {over} times the noise");
    }
}

const APART: &str = "the held-out runs show something that the training runs do not";

/// A gain that another run was made with decides nothing, and is not passed over.
#[test]
fn a_held_out_log_that_the_answer_does_not_hold_for_is_told() {
    let written = answer_to(&scenario(&[], 103, Base::Series), |mut log| {
        let torque = log.contact().unwrap().friction_torque_nm.iter().map(|t| 1.1 * t).collect();
        log.set_signal(Signal::FrictionTorque, torque);
        log
    });
    let diagnosis = &written.diagnosis;
    assert_eq!(diagnosis.verdict, "none", "{}", diagnosis.sentence);
    assert!(diagnosis.notes.iter().any(|note| note.contains(APART)), "{:?}", diagnosis.notes);
    assert!(diagnosis.next_experiment.contains("to --train as well"), "{}", diagnosis.next_experiment);
}

#[test]
fn a_training_log_is_no_held_out_log() {
    let case = generate(&Scenario { duration_s: 2.0, ..Scenario::new(&[], 5) }).unwrap();
    let log = Log::parse_csv("same.csv", case.train[0].as_bytes()).unwrap();
    let rig = RigFile::parse("rig", &case.rig_toml).unwrap();
    let model = ModelFile::parse("model", &case.model_toml).unwrap();
    let refused =
        diagnose(std::slice::from_ref(&log), std::slice::from_ref(&log), &rig, &model, &|| 0.0, &|_| ())
            .map(|_| ())
            .unwrap_err()
            .to_string();
    assert!(refused.contains("is the same log as same.csv of --train"), "{refused}");
}

/// Those that take long: `cargo verify` runs them, and `cargo test long:: -- --ignored`.
mod long {
    use super::*;

    #[test]
    #[ignore = "long: cargo verify runs it"]
    fn friction_that_fades_with_heat_is_named_and_its_law_read_back() {
        let written = named(&[Effect::ThermalFade], 101, Base::Lugre);
        let model = ModelFile::parse("model-extended.toml", &written.model).unwrap();
        assert_eq!(model.extensions[0].id, "thermal_fade");
        let part = &written.diagnosis.subsystems["friction"];
        assert!(part.extended.gain.unwrap() > 0.3, "{:?}", part.extended);
    }

    #[test]
    #[ignore = "long: cargo verify runs it"]
    fn a_drifting_bridge_is_told_from_wear_by_the_drive() {
        named(&[Effect::BridgeDrift], 211, Base::Series);
    }

    /// Through stick-slip, and the elements have just touched where each log begins: the first breakaway is not that of a contact
    /// that is a second old.
    #[test]
    #[ignore = "long: cargo verify runs it"]
    fn how_old_the_contact_is_at_first_is_no_wear() {
        named(&[Effect::StaticAgeing], 205_010_006, Base::Series);
    }

    #[test]
    #[ignore = "long: cargo verify runs it"]
    fn cogging_is_named_with_its_orders() {
        let written = named(&[Effect::M2Ripple], 101, Base::Lugre);
        assert!(written.diagnosis.causes[0].parameters.keys().any(|name| name.starts_with("order")));
    }

    /// The first seed for which this entry of the effect's drawn law has this value.
    fn first_with(effect: Effect, entry: &str, value: &str) -> u64 {
        let has = |seed: &u64| {
            let case = generate(&Scenario { duration_s: 2.0, ..Scenario::new(&[effect], *seed) }).unwrap();
            serde_json::to_value(&case.truth.laws).unwrap()[effect.id()][entry] == value
        };
        (101..).find(has).unwrap()
    }

    /// At half the rate the drive of the held-out log is at five times the noise.
    #[test]
    #[ignore = "long: cargo verify runs it"]
    fn a_friction_channel_that_clips_leaves_the_drive_as_it_is() {
        let effects = [Effect::AdcSaturation];
        let seed = first_with(Effect::AdcSaturation, "channel", "friction");
        let written = named_in(&Scenario { base: Base::Series, ..Scenario::new(&effects, seed) });
        // Not by the gain: a baseline that is fitted better makes that smaller.
        let friction = &written.diagnosis.subsystems["friction"].extended;
        assert!(friction.holdout_nrmse < friction.noise_floor_nrmse.map(|noise| 2.0 * noise), "{friction:?}");
        // Held-out rows whose friction torque is not known are no error of the drive.
        for log in &written.diagnosis.subsystems["drive"].holdout {
            assert!(log.baseline_nrmse < 1.5 * log.noise_floor_nrmse, "{log:?}");
        }
    }

    #[test]
    #[ignore = "long: cargo verify runs it"]
    fn a_normal_channel_that_clips_is_named_with_its_end() {
        let effects = [Effect::AdcSaturation];
        let seed = first_with(Effect::AdcSaturation, "channel", "normal");
        let scenario = scenario(&effects, seed, Base::Series);
        let written = named_in(&scenario);
        let case = generate(&scenario).unwrap();
        let log = Log::parse_csv("train", case.train[0].as_bytes()).unwrap();
        let mut shown = log.contact().unwrap().normal_force_n.to_vec();
        shown.sort_by(f64::total_cmp);
        // Most of a clipped tenth lies at the end.
        let top = shown[shown.len() * 95 / 100];
        let found = written.diagnosis.causes[0].parameters["normal_high_n"].value;
        assert!((found / top - 1.0).abs() < 0.02, "{found} for {top}");
        assert!(!written.model.contains("friction_high_nm"), "{}", written.model);
    }

    #[test]
    #[ignore = "long: cargo verify runs it"]
    fn a_second_leaf_is_no_ripple() {
        named(&[Effect::FoilHardening], first_with(Effect::FoilHardening, "law", "stop"), Base::Series);
    }

    /// Beside the film the search has far to go, and what the ageing explains is seen only there.
    #[test]
    #[ignore = "long: cargo verify runs it"]
    fn a_film_and_ageing_are_named_together() {
        let written = answer(&[Effect::StaticAgeing, Effect::ViscousFilm], 111_013_013, Base::Series);
        let named = ["static_ageing", "viscous_film"];
        assert_eq!(sorted_causes(&written), named, "{}", written.diagnosis.sentence);
    }

    /// The drive hears a torque that the ring makes ring, and the contact turns with a disc that only the drive tells of. At half the
    /// rate the friction of the held-out log is at 1.9 times the noise.
    #[test]
    #[ignore = "long: cargo verify runs it"]
    fn a_soft_shaft_and_a_soft_ring_are_told_apart_and_predict_a_held_out_log() {
        let effects = [Effect::RingResonance, Effect::ShaftTorsion];
        let written = answer_to(&Scenario::new(&effects, 53_013_010), |holdout| holdout);
        let named = ["ring_resonance", "shaft_torsion"];
        assert_eq!(sorted_causes(&written), named, "{}", written.diagnosis.sentence);
        // What beats in the drive where the tip slips and sticks is more than its sensors' noise, in the training logs too.
        for (part, most) in [("drive", 1.25), ("friction", 1.2)] {
            let errors = &written.diagnosis.subsystems[part].extended;
            let over = errors.holdout_nrmse.unwrap() / errors.noise_floor_nrmse.unwrap();
            assert!(over < most, "{part}: {over} times the noise");
        }
    }
}
