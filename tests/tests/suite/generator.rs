//! The generated logs: valid, repeatable, within the rig's limits, and changed by each effect.

use rig_tests::{
    Base, Effect, Form, GeneratedCase, Imperfection, Plan, Scenario, ScenarioError, effect::Subsystem,
    generate,
};

/// A CSV log as columns.
struct Table {
    names: Vec<String>,
    columns: Vec<Vec<f64>>,
}

impl Table {
    fn read(text: &str) -> Self {
        let mut lines = text.lines();
        let names: Vec<String> = lines.next().unwrap().split(',').map(str::to_owned).collect();
        let mut columns = vec![Vec::new(); names.len()];
        for line in lines {
            let cells: Vec<f64> = line.split(',').map(|cell| cell.parse().unwrap()).collect();
            assert_eq!(cells.len(), names.len());
            for (column, cell) in columns.iter_mut().zip(cells) {
                column.push(cell);
            }
        }
        Self { names, columns }
    }

    fn column(&self, name: &str) -> &[f64] {
        &self.columns[self.names.iter().position(|n| n == name).unwrap()]
    }
}

fn logs(case: &GeneratedCase) -> Vec<Table> {
    case.train.iter().chain([&case.holdout]).map(|text| Table::read(text)).collect()
}

fn rms_between(a: &[f64], b: &[f64]) -> f64 {
    (a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>() / a.len() as f64).sqrt()
}

const CONTACT_COLUMNS: [&str; 10] = [
    "time_s",
    "m1_torque_ref_nm",
    "m1_torque_nm",
    "m1_angle_rad",
    "m2_torque_ref_nm",
    "m2_torque_nm",
    "m2_angle_rad",
    "m2_speed_rad_s",
    "normal_force_n",
    "friction_torque_nm",
];

#[test]
fn a_scenario_gives_the_same_bytes_twice_and_another_seed_gives_others() {
    let scenario = Scenario { duration_s: 4.0, ..Scenario::new(&[Effect::ThermalFade], 7) };
    let (one, two) = (generate(&scenario).unwrap(), generate(&scenario).unwrap());
    assert_eq!(one.train, two.train);
    assert_eq!(one.holdout, two.holdout);
    assert_eq!(one.rig_toml, two.rig_toml);
    assert_eq!(one.model_toml, two.model_toml);
    assert_eq!(one.truth.to_json().unwrap(), two.truth.to_json().unwrap());
    let other = generate(&Scenario { seed: 8, ..scenario }).unwrap();
    assert_ne!(one.holdout, other.holdout);
    assert_ne!(one.rig_toml, other.rig_toml);
    assert_ne!(one.model_toml, other.model_toml);
}

#[test]
fn the_logs_of_a_case_run_different_courses_from_different_encoder_origins() {
    let case = generate(&Scenario::new(&[], 5)).unwrap();
    let logs = logs(&case);
    for (i, one) in logs.iter().enumerate() {
        for other in &logs[i + 1..] {
            let speed = rms_between(one.column("m2_speed_rad_s"), other.column("m2_speed_rad_s"));
            assert!(speed > 1.0, "courses differ by {speed} rad/s only");
            let m1 = one.column("m1_angle_rad")[0] - other.column("m1_angle_rad")[0];
            assert!(m1.abs() > 1e-3);
        }
    }
}

#[test]
fn a_speed_loop_that_hunts_is_turned_down() {
    // A late drive on a soft shaft: with the bandwidth drawn the torque goes from limit to limit.
    let scenario = Scenario {
        duration_s: 4.0,
        plan: Plan::Random,
        ..Scenario::new(&[Effect::ShaftTorsion, Effect::DriveDelay], 101_013_014)
    };
    for log in logs(&generate(&scenario).unwrap()) {
        let torque = log.column("m2_torque_ref_nm");
        let at_limit = torque.iter().filter(|t| t.abs() > 7.9).count();
        assert!(10 * at_limit <= torque.len(), "{at_limit} of {}", torque.len());
    }
}

#[test]
fn columns_are_complete_and_time_is_regular_at_every_rate() {
    for rate_hz in [200.0, 1000.0, 10_000.0] {
        let case = generate(&Scenario {
            rate_hz,
            duration_s: 3.0,
            temperature_sensor: true,
            imperfection: Imperfection::None,
            ..Scenario::new(&[Effect::DiscAngle], 3)
        })
        .unwrap();
        assert_eq!(case.train.len(), 2);
        for log in logs(&case) {
            assert_eq!(log.names[..10], CONTACT_COLUMNS);
            assert_eq!(log.names[10], "surface_temperature_c");
            assert!(log.columns.iter().flatten().all(|value| value.is_finite()));
            let time = log.column("time_s");
            assert_eq!(time.len(), (3.0 * rate_hz) as usize + 1);
            // Printed to the microsecond.
            assert!(time.windows(2).all(|pair| (pair[1] - pair[0] - 1.0 / rate_hz).abs() < 1.1e-6));
        }
    }
}

#[test]
fn drive_logs_hold_the_columns_of_a_drive() {
    for (form, header) in [
        (Form::Drive, "time_s,m2_torque_nm,m2_angle_rad\n"),
        (Form::LinearStage, "time_s,force_n,position_m\n"),
    ] {
        let case = generate(&Scenario { form, ..Scenario::new(&[Effect::Presliding], 3) }).unwrap();
        assert!(case.train.iter().chain([&case.holdout]).all(|text| text.starts_with(header)));
        assert!(case.model_toml.is_empty());
        assert_eq!(case.rig_toml.is_empty(), form == Form::LinearStage);
        let log = &logs(&case)[0];
        let travel = log.columns[2].iter().fold(0.0_f64, |most, x| most.max((x - log.columns[2][0]).abs()));
        let unit = if form == Form::Drive { 1.0 } else { 0.01 };
        assert!(travel > 2.0 * unit && travel < 40.0 * unit, "{form:?} travels {travel}");
    }
}

#[test]
fn without_an_effect_the_true_numbers_explain_the_log_to_the_noise() {
    for seed in 0..6 {
        let case = generate(&Scenario { duration_s: 10.0, ..Scenario::new(&[], seed) }).unwrap();
        // What is left is the lag of the normal bridge, which no model driven by the log can undo.
        assert!(case.truth.residual_to_noise.iter().all(|ratio| *ratio < 1.5), "seed {seed}");
    }
}

#[test]
fn the_model_file_is_near_the_truth_but_not_the_truth() {
    let case = generate(&Scenario { duration_s: 2.0, ..Scenario::new(&[], 11) }).unwrap();
    let (truth, nominal) = (case.truth.friction.unwrap(), case.truth.nominal.unwrap());
    assert_ne!(truth, nominal);
    let within = |nominal: f64, truth: f64| (nominal / truth).ln().abs() < 1.31_f64.ln();
    assert!(within(nominal.a0, truth.a0) && within(nominal.sigma0_n_per_m, truth.sigma0_n_per_m));
}

#[test]
fn a_hidden_block_comes_with_a_model_file_that_lacks_it() {
    let case = generate(&Scenario { plan: Plan::Paper, ..Scenario::new(&[Effect::ElementCompliance], 2) });
    let case = case.unwrap();
    assert!(case.model_toml.starts_with("kind = \"lugre\""));
    assert_eq!(case.train.len(), 3);
    let log = Table::read(&case.holdout);
    // 20 rpm after 3.5 s; 40 % of the rated torque after 4 s.
    let at = |name: &str, time: f64| log.column(name)[(time * 1000.0) as usize];
    assert!(at("m2_speed_rad_s", 3.4).abs() < 0.05);
    assert!((at("m2_speed_rad_s", 7.9) - 20.0 * std::f64::consts::TAU / 60.0).abs() < 0.05);
    assert!((at("m1_torque_nm", 7.9) - 3.2).abs() < 0.05);
    assert!((at("m1_torque_nm", 3.9) - 0.44).abs() < 0.05);
}

#[test]
fn impossible_scenarios_are_refused() {
    let scenario = Scenario::new(&[], 1);
    let refused = |scenario: &Scenario| generate(scenario).map(|_| ()).unwrap_err();
    assert_eq!(refused(&Scenario { rate_hz: 300.0, ..scenario.clone() }), ScenarioError::Rate(300.0));
    assert_eq!(refused(&Scenario { duration_s: 1.0, ..scenario }), ScenarioError::Duration(1.0));
    let drive = Scenario { form: Form::Drive, ..Scenario::new(&[Effect::ThermalFade], 1) };
    assert_eq!(refused(&drive), ScenarioError::NeedsContact(Effect::ThermalFade));
    let both = [Effect::BellCurve, Effect::DirectionAsymmetry];
    assert_eq!(refused(&Scenario::new(&both, 1)), ScenarioError::Exclusive(both[0], both[1]));
}

#[test]
fn there_are_27_names_and_each_is_found_by_its_id() {
    assert_eq!(Effect::known().len(), 27);
    assert!(Effect::outside().len() >= 6);
    assert!(Effect::ALL.iter().all(|effect| Effect::from_id(effect.id()) == Some(*effect)));
    for seed in 0..200 {
        let [one, other] = Effect::random_pair(seed);
        assert!(one.tells_apart_from(other) && one.is_known() && other.is_known());
    }
}

/// What a sample shares with the next one of the noise of both bridges.
#[test]
fn some_converters_average_their_noise() {
    let mut averaging = 0;
    for seed in 0..8 {
        let of = |noise_factor| {
            let scenario = Scenario { duration_s: 6.0, noise_factor, ..Scenario::new(&[], seed) };
            generate(&Scenario { imperfection: Imperfection::None, ..scenario }).unwrap()
        };
        let (with, without) = (of(1.0), of(0.0));
        let noise = with.truth.noise;
        for (column, kept) in ["friction_torque_nm", "normal_force_n"].iter().zip(noise.kept) {
            let [with, without] = [&with, &without].map(|case| logs(case)[0].column(column).to_vec());
            let error: Vec<f64> = with.iter().zip(&without).map(|(a, b)| a - b).collect();
            let zero = error.iter().sum::<f64>() / error.len() as f64;
            let product = |lag: usize| -> f64 {
                error.iter().zip(&error[lag..]).map(|(a, b)| (a - zero) * (b - zero)).sum()
            };
            // What flickers changes little from one millisecond to the next, and is in part no more than the zero of a short log.
            let flicker = noise.flicker_share.powi(2);
            let expected = kept - 0.05..(kept + flicker) / (1.0 + flicker) + 0.05;
            let found = product(1) / product(0);
            assert!(expected.contains(&found), "{seed} {column}: {found}, not in {expected:?}");
            averaging += usize::from(kept > 0.0);
        }
    }
    assert!((2..14).contains(&averaging), "{averaging} of 16");
}

#[test]
fn strong_imperfections_leave_out_rows_and_shift_instants_and_mild_ones_are_below_the_noise() {
    let of = |imperfection| {
        let scenario = Scenario { imperfection, duration_s: 6.0, ..Scenario::new(&[], 4) };
        let case = generate(&scenario).unwrap();
        (case.truth.imperfections, case.truth.noise, logs(&case))
    };
    let (_, _, perfect) = of(Imperfection::None);
    let (numbers, _, strong) = of(Imperfection::Strong);
    assert!(numbers.friction_hum_nm > 0.0 && numbers.bounce_share > 0.0);
    for (perfect, strong) in perfect.iter().zip(&strong) {
        let (all, kept) = (perfect.column("time_s"), strong.column("time_s"));
        assert!(
            kept.len() < all.len() - 3 && kept.len() > all.len() * 9 / 10,
            "{} of {}",
            kept.len(),
            all.len()
        );
        let steps: Vec<f64> = kept.windows(2).map(|pair| pair[1] - pair[0]).collect();
        // Eight rows missing at most, each instant a third of a period off at most.
        assert!(steps.iter().all(|step| (0.3e-3..9.8e-3).contains(step)));
        assert!(steps.iter().any(|step| *step > 1.9e-3), "rows are missing");
        assert!(steps.iter().filter(|step| (*step - 1e-3).abs() > 2e-5).count() > steps.len() / 10, "jitter");
    }
    for seed in 0..20 {
        let case = generate(&Scenario { duration_s: 2.0, ..Scenario::new(&[], seed) }).unwrap();
        let (mild, noise) = (case.truth.imperfections, case.truth.noise);
        assert!(
            mild.friction_hum_nm < noise.friction_nm && mild.normal_hum_n < noise.normal_n,
            "seed {seed}"
        );
    }
}

/// Those that take long: `cargo verify` runs them, and `cargo test long:: -- --ignored`.
mod long {
    use super::*;

    #[test]
    #[ignore = "long: cargo verify runs it"]
    fn each_effect_changes_the_signals_of_its_subsystem_well_beyond_noise() {
        for (i, effect) in Effect::ALL.iter().enumerate() {
            // The same seed draws the same rig, course and noise: what differs is the effect.
            let seed = 100 + i as u64;
            let base = match effect {
                Effect::ElementCompliance => Base::Lugre,
                Effect::RubberRelaxation => Base::Series,
                _ => Base::BySeed,
            };
            let of = |effects: &[Effect]| {
                generate(&Scenario { base, duration_s: 8.0, ..Scenario::new(effects, seed) }).unwrap()
            };
            let (with, without) = (of(&[*effect]), of(&[]));
            let noise = with.truth.noise;
            let signals: &[(&str, f64)] = match effect.subsystem() {
                Subsystem::Friction => &[("friction_torque_nm", noise.friction_nm)],
                Subsystem::Pressure => {
                    &[("normal_force_n", noise.normal_n), ("m1_torque_nm", noise.m1_torque_nm)]
                }
                Subsystem::Drive => &[("m2_torque_nm", noise.m2_torque_nm)],
                Subsystem::Measurement => &[
                    ("friction_torque_nm", noise.friction_nm),
                    ("normal_force_n", noise.normal_n),
                    ("m2_torque_nm", noise.m2_torque_nm),
                ],
            };
            let (with, without) = (logs(&with), logs(&without));
            for (log, (with, without)) in with.iter().zip(&without).enumerate() {
                let most = signals
                    .iter()
                    .map(|(name, sigma)| rms_between(with.column(name), without.column(name)) / sigma)
                    .fold(0.0, f64::max);
                // Twice the standard deviation of the noise of a single sample as RMS, in every log: weak effects are
                // 2 % of a channel whose noise is 0.4 to 0.7 %.
                assert!(most > 2.0, "{} log {log}: {most:.1} times the noise", effect.id());
            }
        }
    }

    #[test]
    #[ignore = "long: cargo verify runs it"]
    fn every_effect_keeps_the_rig_within_its_limits() {
        for (i, effect) in Effect::ALL.iter().enumerate() {
            let scenario = Scenario { duration_s: 6.0, ..Scenario::new(&[*effect], 300 + i as u64) };
            let case = generate(&scenario).unwrap();
            for log in logs(&case) {
                let greatest = |name: &str| log.column(name).iter().fold(0.0_f64, |m, x| m.max(x.abs()));
                let id = effect.id();
                let speed = greatest("m2_speed_rad_s");
                // 300 rpm is the rig's own limit; courses ask for 19 rad/s, play and ripple add to it.
                assert!(speed < 31.4, "{id}: {speed} rad/s");
                assert!(greatest("m2_torque_ref_nm") <= 8.0, "{id}: beyond the rated torque");
                assert!(greatest("m1_torque_ref_nm") <= 8.0, "{id}: beyond the rated torque");
                // Ranges of the two bridges.
                assert!(greatest("friction_torque_nm") < 12.0, "{id}: {}", greatest("friction_torque_nm"));
                assert!(greatest("normal_force_n") < 220.0, "{id}: {}", greatest("normal_force_n"));
            }
        }
    }

    #[test]
    #[ignore = "long: cargo verify runs it"]
    fn each_drive_effect_changes_the_torque_of_a_drive_log_well_beyond_noise() {
        for form in [Form::Drive, Form::LinearStage] {
            for (i, effect) in Effect::ALL.iter().filter(|e| e.works_without_contact()).enumerate() {
                let of = |effects: &[Effect]| {
                    generate(&Scenario { form, duration_s: 12.0, ..Scenario::new(effects, 200 + i as u64) })
                        .unwrap()
                };
                let (with, without) = (of(&[*effect]), of(&[]));
                let (name, unit) =
                    if form == Form::Drive { ("m2_torque_nm", 1.0) } else { ("force_n", 80.0) };
                let sigma = with.truth.noise.m2_torque_nm * unit;
                for (with, without) in logs(&with).iter().zip(&logs(&without)) {
                    let change = rms_between(with.column(name), without.column(name)) / sigma;
                    assert!(change > 2.0, "{form:?} {}: {change:.1} times the noise", effect.id());
                }
            }
        }
    }

    #[test]
    #[ignore = "long: cargo verify runs it"]
    fn an_amplifier_clips_before_the_noise_and_a_converter_after_it() {
        let mut seen = std::collections::BTreeSet::new();
        for seed in 0..40 {
            let case =
                generate(&Scenario { duration_s: 3.0, ..Scenario::new(&[Effect::AdcSaturation], seed) })
                    .unwrap();
            let law = case.truth.law_names["adc_saturation"].clone();
            let laws = serde_json::to_value(&case.truth.laws).unwrap();
            if laws["adc_saturation"]["channel"] != "friction"
                || !["rails", "converter"].contains(&law.as_str())
            {
                continue;
            }
            let logs = logs(&case);
            let values: Vec<f64> =
                logs.iter().flat_map(|log| log.column("friction_torque_nm")).copied().collect();
            let top = values.iter().fold(0.0_f64, |most, value| most.max(value.abs()));
            let at_top =
                values.iter().filter(|value| value.abs() == top).count() as f64 / values.len() as f64;
            // A tenth to a third of the samples clip; behind the noise hardly two of the largest are equal.
            assert_eq!(law == "converter", at_top > 0.05, "seed {seed} {law}: {at_top}");
            seen.insert(law);
        }
        assert_eq!(seen.len(), 2, "{seen:?}");
    }

    #[test]
    #[ignore = "long: cargo verify runs it"]
    fn every_course_excites_every_effect() {
        for seed in 0..4 {
            let case = generate(&Scenario { noise_factor: 0.0, ..Scenario::new(&[], seed) }).unwrap();
            for log in logs(&case) {
                let speed = log.column("m2_speed_rad_s");
                let normal = log.column("normal_force_n");
                let friction = log.column("friction_torque_nm");
                let share = |test: &dyn Fn(usize) -> bool| {
                    (0..speed.len()).filter(|i| test(*i)).count() as f64 / speed.len() as f64
                };
                // Dwells and parts in torque mode; slides in both directions, slow and fast; power; light load.
                assert!(share(&|i| speed[i].abs() < 0.05) > 0.15, "seed {seed}: dwell");
                assert!(share(&|i| speed[i] > 0.5) > 0.08, "seed {seed}: forwards");
                assert!(share(&|i| speed[i] < -0.5) > 0.08, "seed {seed}: backwards");
                assert!(share(&|i| speed[i].abs() > 8.0) > 0.03, "seed {seed}: fast");
                assert!(share(&|i| (0.2..2.0).contains(&speed[i].abs())) > 0.03, "seed {seed}: slow");
                assert!(share(&|i| friction[i] * speed[i] > 15.0) > 0.1, "seed {seed}: power");
                let top = normal.iter().fold(0.0_f64, |m, x| m.max(*x));
                assert!(share(&|i| normal[i] < 0.35 * top) > 0.04, "seed {seed}: light");
                assert!(share(&|i| normal[i] > 0.6 * top) > 0.1, "seed {seed}: heavy");
                let reversals = {
                    let signs: Vec<f64> =
                        speed.iter().filter(|w| w.abs() > 0.3).map(|w| w.signum()).collect();
                    signs.windows(2).filter(|pair| pair[0] != pair[1]).count()
                };
                assert!(reversals >= 4, "seed {seed}: {reversals} reversals");
                let turns = speed.iter().map(|w| w.abs()).sum::<f64>() * 1e-3 / std::f64::consts::TAU;
                assert!(turns > 5.0, "seed {seed}: {turns} turns");
            }
        }
    }
}
