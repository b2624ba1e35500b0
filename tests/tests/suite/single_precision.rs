//! The core's models in f32, one step per control period, on the true motion of figs. 18–21: each model
//! on the motion that the rig makes with that model at its contact.
//!
//! The reference is the same model in f64 with steps of 2 µs on the motion interpolated between the
//! periods; that those steps solve the printed equations is shown in `model-core/tests/suite/ode_reference.rs`.

use host_sim::files::experiment_file::ExperimentFile;
use host_sim::files::model_file::ModelFile;
use host_sim::files::rig_file::RigFile;
use host_sim::lockstep::{Setup, run};
use model_core::friction::{Contact, FrictionModel, FrictionParameters, FrictionState, ModelKind};
use model_core::real::Real;

const RADIUS_M: f64 = 0.06;
const PERIOD_S: f64 = 1e-4;
/// Steps of the reference in a control period.
const FINE: usize = 50;

fn model<T: Real>(kind: ModelKind, step_s: f64) -> FrictionModel<T> {
    FrictionParameters::typical(kind).model(T::from_f64(step_s)).unwrap()
}

fn file(kind: ModelKind) -> ModelFile {
    let numbers: Vec<(&str, f64)> = kind.parameters().iter().map(|spec| (spec.name, spec.typical)).collect();
    ModelFile::new(kind.name(), kind, &numbers).unwrap()
}

/// Speed (m/s) and normal force (N) of the contact at every period.
fn motion(experiment: &str, kind: ModelKind) -> Vec<(f64, f64)> {
    let experiment = ExperimentFile::named_or_read(experiment, &[]).unwrap();
    let rig = RigFile::assumed_rig(&[]).unwrap();
    let model = file(kind);
    let setup = Setup::from_files(&experiment, &rig, &model, &model).unwrap();
    let recording = run(&setup, |_, _| {}).unwrap();
    assert!(recording.fault.is_none());
    let truth = recording.frames.iter().map(|f| f.truth);
    truth.map(|t| (t.disc_speed_rad_s * RADIUS_M, t.normal_force_n)).collect()
}

/// Steps a model through one control period from `a` to `b` in `n` steps; the force at its end.
///
/// In the period of touch the load at its end acts throughout: a contact with a memory of its load is born with the load of
/// its first step, whatever that step's size, and both are to be born with the same.
fn period<T: Real>(
    model: &FrictionModel<T>,
    state: &mut FrictionState<T>,
    (a, b): ((f64, f64), (f64, f64)),
    n: usize,
) -> f64 {
    let mut force = 0.0;
    let a = if a.1 > 0.0 { a } else { (a.0, b.1) };
    for k in 0..n {
        let middle = (k as f64 + 0.5) / n as f64;
        let end = (k as f64 + 1.0) / n as f64;
        let v = a.0 + (b.0 - a.0) * middle;
        let load = a.1 + (b.1 - a.1) * end;
        let contact = Contact::new(T::from_f64(v), T::from_f64(load));
        force = model.step(state, &contact).force_n.to_f64();
    }
    force
}

fn nrmse(kind: ModelKind, experiment: &str) -> f64 {
    let motion = motion(experiment, kind);
    let single = model::<f32>(kind, PERIOD_S);
    let fine = model::<f64>(kind, PERIOD_S / FINE as f64);
    let (mut state, mut reference) = (single.rest(), fine.rest());
    let (mut error, mut power) = (0.0, 0.0);
    for pair in motion.windows(2) {
        let seen = period(&single, &mut state, (pair[0], pair[1]), 1);
        let exact = period(&fine, &mut reference, (pair[0], pair[1]), FINE);
        error += (seen - exact).powi(2);
        power += exact.powi(2);
    }
    (error / power).sqrt()
}

#[track_caller]
fn within_a_thousandth(experiments: &[&str]) {
    // A trace of stick-slip can be compared with none: blocks with less damping than the falling curve takes at 10 rpm
    // are compared in `model-core/tests/suite/rivals.rs`.
    let damped = |kind: &ModelKind| {
        let damping = FrictionParameters::<f64>::typical(*kind).get("c_u_n_s_per_m");
        damping.is_none_or(|c_u| c_u > 100.0)
    };
    for &kind in ModelKind::ALL.iter().filter(|kind| damped(kind)) {
        for experiment in experiments {
            let found = nrmse(kind, experiment);
            let kind = kind.name();
            println!("{kind} {experiment}: {found:.2e}");
            assert!(found < 1e-3, "{kind} on {experiment}: {found}");
        }
    }
}

#[test]
fn every_model_in_f32_is_within_a_thousandth_of_f64_on_its_own_motion_of_fig18() {
    within_a_thousandth(&["fig18"]);
}

/// Those that take long: `cargo verify` runs them, and `cargo test long:: -- --ignored`.
mod long {
    use super::*;

    #[test]
    #[ignore = "long: cargo verify runs it"]
    fn every_model_in_f32_is_within_a_thousandth_of_f64_on_its_own_motion() {
        within_a_thousandth(&["fig19", "fig20", "fig21"]);
    }
}
