//! A model file of a diagnosis runs in the firmware's observer, and explains what the baseline left.

use super::firmware;
use host_sim::files::experiment_file::ExperimentFile;
use host_sim::files::model_file::ModelFile;
use host_sim::files::rig_file::RigFile;
use host_sim::predict::{ContactInputs, nrmse, simulate_friction};
use virtual_bench::experiment::{self, ObserverResidual, Request};

/// fig20 on a rig whose rubber is `model`: what is left by this observer on the chip, and by `rig predict` with the same
/// file on the log of the same run.
fn residual(model: &ModelFile, observer: &ModelFile) -> (ObserverResidual, f64) {
    let request = Request {
        experiment: ExperimentFile::named_or_read("fig20", &[]).unwrap(),
        rig: RigFile::read_or_assumed(None, &[]).unwrap(),
        model: model.clone(),
        observer: observer.clone(),
        patch_observer: false,
        capture: false,
    };
    let done = experiment::run(firmware(), &request, |_, _| ()).unwrap();
    assert_eq!(done.complaints(), Vec::<String>::new());
    let log = done.csv();
    let signals = log.contact().unwrap();
    let inputs = ContactInputs::new(&signals, &request.rig);
    let predicted = simulate_friction(observer, &request.rig, &inputs).unwrap();
    (done.observer_residual(), nrmse(signals.friction_torque_nm, &predicted).unwrap())
}

/// The assumed rubber, whose friction fades by a third within seconds of sliding, as a file of a diagnosis says it.
fn fading() -> ModelFile {
    let assumed = ModelFile::assumed(&[]).unwrap().to_toml();
    let effect = "id = \"thermal_fade\"\nfade_per_j = 0.005\ncooling_s = 5.0\nslow_fade_per_j = 0.0\n\
                  slow_cooling_s = 50.0\nsaturation = 0.0\nexponent = 1.0\n";
    ModelFile::parse("model-extended.toml", &format!("{assumed}\n[[extension]]\n{effect}")).unwrap()
}

/// LuGre with the same bristles: no block, no effect.
fn lugre() -> ModelFile {
    let text = "kind = \"lugre\"\n[parameters]\nsigma0_n_per_m = 1.76e7\nsigma1_n_s_per_m = 0.0\na0 = 0.5\na1 = 0.7\n\
                a2_s_per_m = 0.0\nv0_m_s = 0.5\ndelta = 0.5\ntheta = 1.0\n";
    ModelFile::parse("model.toml", text).unwrap()
}

#[test]
fn the_uploaded_extended_model_leaves_a_tenth_of_what_the_baseline_left() {
    let truth = fading();
    // Beside each other: no other check is left when these run.
    let ((baseline, baseline_pc), (extended, extended_pc)) = std::thread::scope(|scope| {
        let baseline = scope.spawn(|| residual(&truth, &lugre()));
        let extended = residual(&truth, &truth);
        (baseline.join().unwrap(), extended)
    });
    println!("observer on the chip: baseline {baseline:?}, extended {extended:?}");
    println!("rig predict: baseline {baseline_pc:.4}, extended {extended_pc:.4}");
    assert!(baseline.nrmse > 0.1, "{baseline:?}");
    assert!(extended.nrmse < 0.1 * baseline.nrmse, "{baseline:?} {extended:?}");
    // On the computer the model runs in f64 on rows of 1 kHz, on the chip in f32 on every tick: the peak of the
    // load step, 20 ms of 10 s, is met differently. A like amount all the same.
    for (chip, pc) in [(baseline.nrmse, baseline_pc), (extended.nrmse, extended_pc)] {
        assert!((chip - pc).abs() < 0.01, "{chip} on the chip, {pc} on the computer");
    }
}
