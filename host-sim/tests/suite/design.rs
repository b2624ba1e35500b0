//! A case that one log leaves open is settled by the experiment that `design` proposes.
//!
//! Synthetic: the plant's rubber loses grip with heat. In a steady slide heat and distance go together.

use host_sim::design::separation::Reach;
use host_sim::design::{self, Effort, Proposal};
use host_sim::files::experiment_file::ExperimentFile;
use host_sim::files::model_file::ModelFile;
use host_sim::files::rig_file::RigFile;
use host_sim::files::signal::Signal;
use host_sim::identify::noise;
use host_sim::lockstep::{self, Setup};
use host_sim::predict::ContactInputs;

const LUGRE: &str =
    "kind = \"lugre\"\n[parameters]\nsigma0_n_per_m = 1e6\na0 = 0.5\na1 = 0.7\nv0_m_s = 0.5\n";
/// A tenth of the grip for 70 J, which leak away in 8 s.
const HEAT: &str = "[[extension]]\nid = \"thermal_fade\"\nfade_per_j = 0.0015\ncooling_s = 8.0\n\
                    slow_fade_per_j = 0.0\nslow_cooling_s = 100.0\nsaturation = 0.0\nexponent = 1.0\n";
/// The like for distance, so that a steady slide of a few seconds looks the same.
const WEAR: &str = "[[extension]]\nid = \"wear_drift\"\nchange_per_m = -0.08\nscale_m = 5.0\n";

/// A steady slide under one load.
const STEADY: &str = "name = \"steady\"\nduration_s = 6.0\n[[m1]]\nstart_s = 0.0\ntorque_fraction = 0.3\n\
                      [[m2]]\nstart_s = 0.0\nspeed_rpm = 0.0\n[[m2]]\nstart_s = 0.5\nspeed_rpm = 60.0\n";

/// Errors of both models, refitted, on a run whose truth is the first: RMS over the noise.
fn errors(rig: &RigFile, models: &[ModelFile], experiment: &str) -> Vec<f64> {
    let experiment = ExperimentFile::parse("experiment", experiment).unwrap();
    let setup = Setup::from_files(&experiment, rig, &models[0], &models[0]).unwrap();
    let recording = lockstep::run(&setup, |_, _| {}).unwrap();
    assert_eq!(recording.fault, None);
    let log = recording.log(10, setup.plant.counts_per_rev);
    let measured = log.require(Signal::FrictionTorque).unwrap();
    let inputs = ContactInputs::new(&log.contact().unwrap(), rig);
    let noise_nm = noise::standard_deviation(measured);
    let error =
        |model: &ModelFile| Reach::new(model, rig, &inputs).unwrap().distance_from(measured, noise_nm);
    models.iter().map(error).collect()
}

#[test]
fn the_proposed_experiment_settles_what_a_steady_slide_leaves_open() {
    let rig = RigFile::assumed_rig(&[]).unwrap();
    let models = [HEAT, WEAR].map(|effect| ModelFile::parse("model", &format!("{LUGRE}{effect}")).unwrap());

    let open = errors(&rig, &models, STEADY);
    // Both within the same few per cent of each other: the log cannot say which it is.
    assert!(open[1] < 1.1 * open[0], "{open:?}");

    let proposals = design::propose(&rig, &models, Effort::THOROUGH, |_, _| {}).unwrap();
    let best: &Proposal = &proposals[0];
    assert!(best.separation() > 2.0, "{}", best.sentence());
    let settled = errors(&rig, &models, &best.toml);
    assert!(settled[1] > 2.0 * settled[0], "{settled:?}");
    println!("steady slide {open:.2?}, proposed {settled:.2?}: {}", best.sentence());
}
