//! `rig predict`'s engine on logs of another simulator.

use std::sync::LazyLock;

use host_sim::files::log::Log;
use host_sim::files::model_file::ModelFile;
use host_sim::files::rig_file::RigFile;
use host_sim::predict::{Accuracy, ContactInputs, StepPlan, nrmse, simulate_friction, simulate_planned};
use rig_tests::driven_rig::{Curve, Law, RADIUS, Sample, Sensor, record};

const CURVE: Curve = Curve { a0: 0.45, a1: 0.8, v0: 0.3 };

fn csv(samples: &[Sample]) -> String {
    let mut text = String::from("time_s,m2_speed_rad_s,normal_force_n,friction_torque_nm\n");
    for s in samples {
        text += &format!("{},{},{},{}\n", s.time, s.speed, s.load, s.torque);
    }
    text
}

fn model(kind: &str, more: &str) -> ModelFile {
    let Curve { a0, a1, v0 } = CURVE;
    let text = format!(
        "kind = \"{kind}\"\n[parameters]\na0 = {a0}\na1 = {a1}\nv0_m_s = {v0}\ndelta = 0.5\n{more}\n"
    );
    ModelFile::parse("model", &text).unwrap()
}

fn rig(more: &str) -> RigFile {
    RigFile::parse("rig", &format!("[geometry]\nfriction_radius_m = {RADIUS}\n{more}")).unwrap()
}

fn prediction_error(samples: &[Sample], model: &ModelFile, rig: &RigFile) -> f64 {
    let log = Log::parse_csv("log", csv(samples).as_bytes()).unwrap();
    let signals = log.contact().unwrap();
    let predicted = simulate_friction(model, rig, &ContactInputs::new(&signals, rig)).unwrap();
    nrmse(signals.friction_torque_nm, &predicted).unwrap()
}

fn at_10_khz(law: Law, sensor: Option<Sensor>) -> Vec<Sample> {
    record(law, CURVE, sensor, |microsecond| microsecond % 100 == 0)
}

/// A LuGre record at 20 kHz and at every uneven instant that the tests take from it.
static SOFT_LUGRE: LazyLock<Vec<Sample>> =
    LazyLock::new(|| record(Law::Lugre { s: 1e6 }, CURVE, None, |us| us % 50 == 0 || us % 130 == 0));

fn soft_lugre(keep: impl Fn(u64) -> bool) -> Vec<Sample> {
    let kept = |s: &&Sample| keep((s.time * 1e6).round() as u64);
    SOFT_LUGRE.iter().filter(kept).copied().collect()
}

// The figure that is asked for on logs of 10 kHz.
const ASKED: f64 = 1e-3;

#[test]
fn lugre_logs_are_predicted_whatever_the_bristles() {
    for s in [1e6, 2e7] {
        let error = prediction_error(
            &at_10_khz(Law::Lugre { s }, None),
            &model("lugre", &format!("sigma0_n_per_m = {s}")),
            &rig(""),
        );
        println!("lugre {s:e}: nrmse {error:.2e}");
        assert!(error < ASKED, "{s:e}: {error:e}");
    }
}

#[test]
fn the_fast_plan_of_fits_is_good_to_a_few_parts_in_a_thousand() {
    let (s, k, c) = (1.76e7, 3e4, 300.0);
    let text = format!("sigma0_n_per_m = {s}\nk_u_n_per_m = {k}\nc_u_n_s_per_m = {c}");
    let hard = at_10_khz(Law::Series { s, k, c }, None);
    let soft = soft_lugre(|us| us % 100 == 0);
    for (samples, model) in [(hard, model("series", &text)), (soft, model("lugre", "sigma0_n_per_m = 1e6"))] {
        let log = Log::parse_csv("log", csv(&samples).as_bytes()).unwrap();
        let (signals, rig) = (log.contact().unwrap(), rig(""));
        let inputs = ContactInputs::new(&signals, &rig);
        let element = model.friction_model(1e-4).unwrap();
        let plan = StepPlan::new(&element, &rig.friction_bridge, &inputs, Accuracy::Fast);
        let predicted = simulate_planned(&model, &rig, &inputs, &plan).unwrap();
        let error = nrmse(signals.friction_torque_nm, &predicted).unwrap();
        println!("{:?} fast: {} steps, nrmse {error:.2e}", model.kind, plan.steps());
        assert!(error < 5e-3, "{error:e}");
    }
}

#[test]
fn series_logs_are_predicted() {
    let (s, k, c) = (1.76e7, 3e4, 160.0);
    let text = format!("sigma0_n_per_m = {s}\nk_u_n_per_m = {k}\nc_u_n_s_per_m = {c}");
    let error =
        prediction_error(&at_10_khz(Law::Series { s, k, c }, None), &model("series", &text), &rig(""));
    println!("series: nrmse {error:.2e}");
    assert!(error < ASKED, "{error:e}");
}

/// Ring of 500 Hz, hardly damped, and an amplifier of 800 Hz.
const SENSOR: Sensor = [(500.0, 0.03), (800.0, std::f64::consts::FRAC_1_SQRT_2)];
const BRIDGE: &str = "[friction_bridge]\nmode_hz = 500\ndamping_ratio = 0.03\nlowpass_hz = 800";

#[test]
fn the_friction_bridge_of_the_rig_file_is_followed() {
    let samples = at_10_khz(Law::Lugre { s: 2e7 }, Some(SENSOR));
    let lugre = model("lugre", "sigma0_n_per_m = 2e7");
    let (with, without) =
        (prediction_error(&samples, &lugre, &rig(BRIDGE)), prediction_error(&samples, &lugre, &rig("")));
    println!("bridge: nrmse {with:.2e}, taken for ideal {without:.2e}");
    assert!(with < ASKED, "{with:e}");
    assert!(without > 10.0 * ASKED, "the bridge would not matter: {without:e}");
}

#[test]
fn other_rates_and_uneven_sampling_work() {
    let lugre = model("lugre", "sigma0_n_per_m = 1e6");
    // The generator starts and reverses within a few milliseconds, and what the speed did between samples is
    // not in the log: at 1 kHz and below the asked figure cannot be had.
    type Keep = fn(u64) -> bool;
    let rates: [(&str, Keep, f64); 4] = [
        ("20 kHz", |us| us % 50 == 0, ASKED),
        ("uneven, 10 to 130 us", |us| us % 130 == 0 || us % 350 == 0, ASKED),
        ("1 kHz", |us| us % 1000 == 0, 1e-2),
        ("200 Hz", |us| us % 5000 == 0, 0.1),
    ];
    for (name, keep, limit) in rates {
        let samples = soft_lugre(keep);
        let error = prediction_error(&samples, &lugre, &rig(""));
        println!("{name}: {} samples, nrmse {error:.2e}", samples.len());
        assert!(error < limit, "{name}: {error:e}");
    }
}

#[test]
fn a_record_that_begins_in_motion_is_predicted_from_its_first_sample() {
    let lugre = model("lugre", "sigma0_n_per_m = 1e6");
    let samples = soft_lugre(|us| us % 100 == 0);
    for start_s in [0.6, 2.4] {
        let part: Vec<Sample> = samples.iter().filter(|s| s.time >= start_s).copied().collect();
        let error = prediction_error(&part, &lugre, &rig(""));
        println!("from {start_s} s: nrmse {error:.2e}");
        assert!(error < ASKED, "{start_s}: {error:e}");
    }
}

#[test]
fn a_wrong_parameter_shows_in_the_error() {
    let samples = soft_lugre(|us| us % 100 == 0);
    let mut wrong = model("lugre", "sigma0_n_per_m = 1e6");
    wrong.set("a0", 1.05 * CURVE.a0).unwrap();
    let error = prediction_error(&samples, &wrong, &rig(""));
    assert!(error > 10.0 * ASKED, "{error:e}");
}

/// Those that take long: `cargo verify` runs them, and `cargo test long:: -- --ignored`.
mod long {
    use super::*;

    #[test]
    #[ignore = "long: cargo verify runs it"]
    fn modified_lugre_logs_are_predicted() {
        for s in [1e6, 2e7] {
            let error = prediction_error(
                &at_10_khz(Law::Modified { s }, None),
                &model("modified_lugre", &format!("sigma0_n_per_m = {s}")),
                &rig(""),
            );
            println!("modified {s:e}: nrmse {error:.2e}");
            assert!(error < ASKED, "{s:e}: {error:e}");
        }
    }
}
