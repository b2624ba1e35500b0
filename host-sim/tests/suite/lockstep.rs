//! The core against the plant: what must be seen in Figs. 18–23, asked, reported and true with their signs, identical runs.

use host_sim::files::experiment_file::ExperimentFile;
use host_sim::files::model_file::ModelFile;
use host_sim::files::rig_file::RigFile;
use host_sim::lockstep::{Frame, Recording, Setup, run};
use host_sim::summary::{RunFacts, Summary, summarise};
use model_core::control::{Fault, Mode};

fn set(changes: &[(&str, &str)]) -> Vec<(String, String)> {
    changes.iter().map(|(key, value)| ((*key).to_string(), (*value).to_string())).collect()
}

fn setup(experiment: &ExperimentFile) -> Setup {
    let rig = RigFile::assumed_rig(&[]).unwrap();
    let model = ModelFile::assumed(&[]).unwrap();
    Setup::from_files(experiment, &rig, &model, &model).unwrap()
}

fn simulate(name: &str) -> (Recording, Summary) {
    let experiment = ExperimentFile::named_or_read(name, &[]).unwrap();
    let recording = run(&setup(&experiment), |_, _| {}).unwrap();
    assert_eq!(recording.fault, None, "{name}");
    assert_eq!(recording.frames.len(), 100_000, "{name}");
    let summary = summarise(&experiment, &recording.signals(480_000), RunFacts::default()).unwrap();
    (recording, summary)
}

#[test]
fn friction_overshoots_in_figs_18_to_21_and_at_low_speed_after_the_normal_force_has_settled() {
    for (name, slow) in [("fig18", true), ("fig19", true), ("fig20", true), ("fig21", false)] {
        let (_, s) = simulate(name);
        assert!(s.friction_overshoot.unwrap() > 0.05, "{name}: {s:?}");
        let (peak, settled) = (s.friction_peak_time_s.unwrap(), s.normal_settled_time_s.unwrap());
        if slow {
            // A margin of a millisecond, so that noise does not decide.
            assert!(peak > settled + 1e-3, "{name}: {s:?}");
        } else {
            assert!(s.friction_coefficient_ratio.unwrap() < 0.95, "{name}: {s:?}");
        }
        // The torque settles at the static curve.
        let v = s.friction_settled_nm.unwrap() / (0.06 * s.normal_settled_n.unwrap());
        let speed = [("fig18", 10.0), ("fig19", 20.0), ("fig20", 30.0), ("fig21", 120.0)]
            .iter()
            .find(|(n, _)| *n == name)
            .map_or(0.0, |(_, rpm)| rpm * std::f64::consts::TAU / 60.0 * 0.06);
        let static_curve = 0.5 + 0.7 * (-(speed / 0.5f64).sqrt()).exp();
        assert!((v / static_curve - 1.0).abs() < 2e-3, "{name}: {v} against {static_curve}");
    }
}

#[test]
fn bridges_given_by_beams_and_gauges_read_what_is_there() {
    let rig = RigFile::parse("gauged.toml", include_str!("../../rigs/gauged.toml")).unwrap();
    let model = ModelFile::assumed(&[]).unwrap();
    let experiment = ExperimentFile::named_or_read("fig20", &[]).unwrap();
    let setup = Setup::from_files(&experiment, &rig, &model, &model).unwrap();
    // 1.65 V over 256 · 5 V · 2 · 53.57 µm/m per N m; 3.3 V over 1000 · 5 V · 2 · 1.1905 µm/m per N.
    let analogue = setup.plant.analogue;
    assert!((analogue.friction_full_scale_nm - 12.031_25).abs() < 1e-9, "{analogue:?}");
    assert!((analogue.normal_high_n - analogue.normal_low_n - 277.2).abs() < 1e-9, "{analogue:?}");
    let recording = run(&setup, |_, _| {}).unwrap();
    assert_eq!(recording.fault, None);
    let mean = |of: &dyn Fn(&Frame) -> f64| recording.frames[90_000..].iter().map(of).sum::<f64>() / 10_000.0;
    // Noise over ten thousand samples, and half a code.
    let normal_n = mean(&|f| f64::from(f.record.normal_force_n) - f.truth.normal_force_n);
    let friction_nm = mean(&|f| f64::from(f.record.friction_torque_nm) - f.truth.friction_torque_nm);
    assert!(normal_n.abs() < 5e-3 && friction_nm.abs() < 5e-4, "{normal_n} N, {friction_nm} N m");
}

#[test]
fn a_rocked_disc_loses_energy_in_the_elements_without_gross_sliding() {
    let (recording, s) = simulate("fig22");
    assert!(s.loop_energy_j.unwrap() > 0.0, "{s:?}");
    // Gross sliding would carry the disc away by more than the blocks yield: 2.4 N·m/(k_u r²) = 22 mrad.
    let angle = recording.column(|f| f.truth.disc_angle_rad);
    let far = angle.iter().fold(0.0f64, |m, a| m.max(a.abs()));
    assert!(far < 2.0 * 2.4 / (3e4 * 0.06 * 0.06), "{far} rad");
}

#[test]
fn a_torque_step_dies_out_within_a_few_oscillations() {
    let (_, s) = simulate("fig23");
    // c_u r²/(2 √(k_u r² J)) = 0.196 is the block's own damping; the bearing adds to it.
    let zeta = s.damping_ratio.unwrap();
    assert!(zeta > 0.19 && zeta < 0.3, "{zeta}");
}

#[test]
fn reported_estimated_and_true_agree_with_sign() {
    for rpm in ["30.0", "-30.0"] {
        let changes = set(&[("m2.1.speed_rpm", rpm), ("duration_s", "5.0")]);
        let experiment = ExperimentFile::named_or_read("fig20", &changes).unwrap();
        let recording = run(&setup(&experiment), |_, _| {}).unwrap();
        let from = 45_000;
        let frames = &recording.frames[from..];
        let mean = |f: &dyn Fn(usize) -> f64| (0..frames.len()).map(f).sum::<f64>() / frames.len() as f64;
        let close = |name: &str, values: [f64; 3], size: f64, tolerance: f64| {
            assert!(values.iter().all(|v| v.abs() > size), "{name}: {values:?} shows no sign");
            for v in values {
                assert!((v - values[2]).abs() < tolerance * values[2].abs(), "{name}: {values:?}");
            }
        };
        // Reported by a sensor, estimated by the core from something else, true in the plant.
        let speed_by_counts = (frames[frames.len() - 1].record.m2_count - frames[0].record.m2_count) as f64
            / 480_000.0
            * std::f64::consts::TAU
            / ((frames.len() - 1) as f64 * 1e-4);
        let estimated = mean(&|k| f64::from(frames[k].record.m2_speed_rad_s));
        let speed = [speed_by_counts, estimated, mean(&|k| frames[k].truth.m2_speed_rad_s)];
        close("speed", speed, 3.0, 1e-3);
        let friction = [
            mean(&|k| f64::from(frames[k].record.friction_torque_nm)),
            mean(&|k| f64::from(frames[k].record.predicted_friction_torque_nm)),
            mean(&|k| frames[k].truth.friction_torque_nm),
        ];
        close("friction torque", friction, 4.0, 2e-3);
        let by_torque = |nm: f64| 30.0 * nm - 8.0;
        let normal = [
            mean(&|k| f64::from(frames[k].record.normal_force_n)),
            by_torque(mean(&|k| f64::from(frames[k].record.m1_torque_nm))),
            mean(&|k| frames[k].truth.normal_force_n),
        ];
        close("normal force", normal, 80.0, 2e-3);
        let m1_angle = [
            mean(&|k| f64::from(frames[k].record.m1_angle_rad)),
            mean(&|k| (f64::from(frames[k].record.normal_force_n) + 8.0) / 3000.0),
            mean(&|k| frames[k].truth.m1_angle_rad),
        ];
        close("angle of M1", m1_angle, 0.03, 2e-3);
        // At constant speed the motor carries friction and bearing: reported, by balance of the reports, true.
        let sign = speed[2].signum();
        let m2_torque = [
            mean(&|k| f64::from(frames[k].record.m2_torque_nm)),
            friction[0] + sign * 0.15 + 0.005 * speed[0],
            mean(&|k| frames[k].truth.m2_torque_nm),
        ];
        close("torque of M2", m2_torque, 4.0, 5e-3);
        assert_eq!(sign, rpm.parse::<f64>().unwrap().signum());
        assert!(friction[2] * speed[2] > 0.0, "friction must resist");
    }
}

#[test]
fn the_observer_with_the_right_model_leaves_what_the_sensors_add() {
    let (recording, _) = simulate("fig18");
    let square = |f: &dyn Fn(usize) -> f64| (50_000..100_000).map(|k| f(k).powi(2)).sum::<f64>() / 50_000.0;
    let residual = square(&|k| f64::from(recording.frames[k].record.residual_nm)).sqrt();
    // 4 mN·m of noise on the friction channel, and the normal force's 0.05 N times 0.06 m and a coefficient of 1.
    assert!(residual < 0.01, "{residual} N·m");
}

#[test]
fn two_runs_of_an_experiment_give_identical_bytes() {
    let changes = set(&[("duration_s", "4.3")]);
    let experiment = ExperimentFile::named_or_read("fig19", &changes).unwrap();
    let text = || run(&setup(&experiment), |_, _| {}).unwrap().log(1, 480_000).to_csv();
    let (a, b) = (text(), text());
    assert!(a == b);
    let other =
        ExperimentFile::named_or_read("fig19", &set(&[("duration_s", "4.3"), ("seed", "99")])).unwrap();
    assert!(a != run(&setup(&other), |_, _| {}).unwrap().log(1, 480_000).to_csv());
}

#[test]
fn a_run_that_ends_in_a_fault_says_so_and_keeps_what_came_before() {
    // A lever with twice the gain the controller knows presses with 280 N instead of 136 N.
    let changes = set(&[("m1.1.torque_fraction", "0.60"), ("duration_s", "5.0")]);
    let experiment = ExperimentFile::named_or_read("fig18", &changes).unwrap();
    let rig = RigFile::assumed_rig(&[]).unwrap();
    let model = ModelFile::assumed(&[]).unwrap();
    let mut setup = Setup::from_files(&experiment, &rig, &model, &model).unwrap();
    setup.plant.geometry.lever_gain_n_per_nm = 60.0;
    let recording = run(&setup, |_, _| {}).unwrap();
    assert!(
        matches!(recording.fault, Some(Fault::OverForce | Fault::NormalBridgeSaturated)),
        "{:?}",
        recording.fault
    );
    let last = recording.frames.last().unwrap();
    assert_eq!(last.record.mode, Mode::Running);
    assert!(recording.frames.len() > 40_000 && recording.frames.len() < 40_500);
}

#[test]
fn progress_is_told_up_to_the_end() {
    let experiment = ExperimentFile::named_or_read(
        "fig18",
        &set(&[("m2.1.start_s", "1.0"), ("m1.1.start_s", "1.5"), ("duration_s", "2.0")]),
    )
    .unwrap();
    let mut progress = Vec::new();
    run(&setup(&experiment), |done, total| progress.push((done, total))).unwrap();
    assert_eq!(progress, [(5_000, 20_000), (10_000, 20_000), (15_000, 20_000), (20_000, 20_000)]);
}
