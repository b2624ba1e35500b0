//! Each experiment on the bench against the same experiment on the PC rig: same plant, same seed, same core.

use super::runs::run;
use host_sim::demo::ClosedLoop;
use host_sim::files::signal::Signal;
use host_sim::lockstep::Setup;
use host_sim::summary::{RunFacts, summarise};
use virtual_bench::budget;

/// Friction torque over the whole log, RMS of the difference over RMS of the PC rig's.
const MOST_NRMSE: f64 = 0.02;
const MOST_OVERSHOOT_ERROR: f64 = 0.02;

fn compare(name: &'static str) {
    let request = budget::request(name).unwrap();
    let setup =
        Setup::from_files(&request.experiment, &request.rig, &request.model, &request.observer).unwrap();
    let pc = ClosedLoop::run(&request.experiment, &setup, |_, _| ()).unwrap();
    let done = run(name);
    assert_eq!(done.complaints(), Vec::<String>::new(), "{name}");

    let bench_log = done.csv();
    let pc_log = pc.recording.log(10, setup.plant.counts_per_rev);
    assert_eq!(bench_log.time_s(), pc_log.time_s(), "{name}: a row of the one is no row of the other");
    let friction = |log: &host_sim::files::log::Log| log.signal(Signal::FrictionTorque).unwrap().to_vec();
    let (bench, expected) = (friction(&bench_log), friction(&pc_log));
    let square = |values: &mut dyn Iterator<Item = f64>| values.map(|x| x * x).sum::<f64>().sqrt();
    let nrmse =
        square(&mut bench.iter().zip(&expected).map(|(a, b)| a - b)) / square(&mut expected.iter().copied());

    let summary = summarise(&request.experiment, &done.full_rate().unwrap(), RunFacts::default()).unwrap();
    let overshoots = (summary.friction_overshoot, pc.summary.friction_overshoot);
    println!(
        "{name}: friction NRMSE {:.2} %, overshoot {:.4} on the bench and {:.4} on the PC, {} ticks, {} rows",
        100.0 * nrmse,
        overshoots.0.unwrap_or(f64::NAN),
        overshoots.1.unwrap_or(f64::NAN),
        done.ticks.instructions.count,
        bench.len()
    );
    assert!(nrmse <= MOST_NRMSE, "{name}: friction torque differs by {nrmse}");
    match overshoots {
        (Some(bench), Some(pc)) => {
            assert!((bench - pc).abs() <= MOST_OVERSHOOT_ERROR, "{name}: {bench} and {pc}")
        }
        (None, None) => {}
        other => panic!("{name}: {other:?}"),
    }
}

#[test]
fn fig18_on_the_bench_is_that_of_the_pc_rig() {
    compare("fig18");
}

#[test]
fn fig19_on_the_bench_is_that_of_the_pc_rig() {
    compare("fig19");
}

#[test]
fn fig20_on_the_bench_is_that_of_the_pc_rig() {
    compare("fig20");
}

#[test]
fn fig21_on_the_bench_is_that_of_the_pc_rig() {
    compare("fig21");
}

#[test]
fn fig22_on_the_bench_is_that_of_the_pc_rig() {
    compare("fig22");
}

#[test]
fn fig23_on_the_bench_is_that_of_the_pc_rig() {
    compare("fig23");
}
