//! The core's models in f32, one step per control period, on the true motion of figs. 18–21: each model
//! on the motion that the rig makes with that model at its contact.
//!
//! The reference is the same model in f64 with steps of 2 µs on the motion interpolated between the
//! periods; that those steps solve the printed equations is shown in `model-core/tests/ode_reference.rs`.

#![allow(clippy::unwrap_used, missing_docs)]

use host_sim::files::experiment_file::ExperimentFile;
use host_sim::files::model_file::ModelFile;
use host_sim::files::rig_file::RigFile;
use host_sim::lockstep::{Setup, run};
use model_core::friction::Contact;
use model_core::friction::brush::BrushParameters;
use model_core::friction::lugre::LugreParameters;
use model_core::friction::series::SeriesParameters;
use model_core::friction::stribeck::StribeckParameters;
use model_core::friction::{FrictionModel, FrictionState};
use model_core::real::Real;

const RADIUS_M: f64 = 0.06;
const PERIOD_S: f64 = 1e-4;
/// Steps of the reference in a control period.
const FINE: usize = 50;

fn bristles<T: Real>() -> LugreParameters<T> {
    LugreParameters {
        sigma0_n_per_m: T::from_f64(1.76e7),
        sigma1_n_s_per_m: T::ZERO,
        a2_s_per_m: T::ZERO,
        stribeck: StribeckParameters {
            a0: T::from_f64(0.5),
            a1: T::from_f64(0.7),
            v0_m_s: T::from_f64(0.5),
            delta: T::HALF,
            theta: T::ONE,
        },
    }
}

fn model<T: Real>(kind: &str, step_s: f64) -> FrictionModel<T> {
    let step = T::from_f64(step_s);
    let made = match kind {
        "brush" => {
            let p = BrushParameters {
                c_n_per_m: T::from_f64(3e4),
                mu_s: T::from_f64(1.2),
                mu_c: T::from_f64(0.8),
            };
            FrictionModel::brush(&p, step)
        }
        "lugre" => FrictionModel::lugre(&bristles(), step),
        "modified_lugre" => FrictionModel::modified_lugre(&bristles(), step),
        _ => {
            let p = SeriesParameters {
                k_u_n_per_m: T::from_f64(3e4),
                c_u_n_s_per_m: T::from_f64(160.0),
                bristles: bristles(),
            };
            FrictionModel::series(&p, step)
        }
    };
    made.unwrap()
}

fn file(kind: &str) -> ModelFile {
    let bristles = "sigma0_n_per_m = 1.76e7\na0 = 0.5\na1 = 0.7\nv0_m_s = 0.5\ndelta = 0.5\n";
    let parameters = match kind {
        "brush" => "c_n_per_m = 3e4\nmu_s = 1.2\nmu_c = 0.8\n".to_owned(),
        "series" => format!("{bristles}k_u_n_per_m = 3e4\nc_u_n_s_per_m = 160.0\n"),
        _ => bristles.to_owned(),
    };
    ModelFile::parse(kind, &format!("kind = \"{kind}\"\n[parameters]\n{parameters}")).unwrap()
}

/// Speed (m/s) and normal force (N) of the contact at every period.
fn motion(experiment: &str, kind: &str) -> Vec<(f64, f64)> {
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
fn period<T: Real>(
    model: &FrictionModel<T>,
    state: &mut FrictionState<T>,
    (a, b): ((f64, f64), (f64, f64)),
    n: usize,
) -> f64 {
    let mut force = 0.0;
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

fn nrmse(kind: &str, experiment: &str) -> f64 {
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

#[test]
fn every_model_in_f32_is_within_a_thousandth_of_f64_on_its_own_motion() {
    for kind in ["brush", "lugre", "modified_lugre", "series"] {
        for experiment in ["fig18", "fig19", "fig20", "fig21"] {
            let found = nrmse(kind, experiment);
            println!("{kind} {experiment}: {found:.2e}");
            assert!(found < 1e-3, "{kind} on {experiment}: {found}");
        }
    }
}
