//! One pass of the identification over 40 000 samples (two logs of 20 s at 1 kHz), on one core: `cargo bench
//! --bench observed_slip`. The requirement is 4 ms; a fit or a diagnosis is some hundreds to thousands of passes.

#![allow(clippy::unwrap_used, missing_docs)]

use criterion::{Criterion, criterion_group, criterion_main};
use host_sim::files::log::Log;
use host_sim::files::model_file::ModelFile;
use host_sim::files::rig_file::RigFile;
use host_sim::files::signal::Signal;
use host_sim::identify::contact::baseline::{KNOWN_WITHIN, baseline};
use host_sim::identify::contact::log::ContactLog;
use host_sim::identify::contact::problem::Problem;
use host_sim::predict::{ContactInputs, simulate_friction};

/// Samples of a log.
const SAMPLES: u32 = 20_000;

/// A log of the assumed element that sticks, slips and turns at changing speeds and loads.
fn log(rig: &RigFile, model: &ModelFile, phase: f64) -> Log {
    let time_s: Vec<f64> = (0..SAMPLES).map(|i| 1e-3 * f64::from(i)).collect();
    let speed = |t: &f64| (6.0 * (1.3 * t + phase).sin() + 3.0 * (3.1 * t).sin()).clamp(-7.0, 7.0);
    let load = |t: &f64| 70.0 + 25.0 * (0.7 * t + phase).sin();
    let mut log = Log::default();
    log.set_signal(Signal::M2Speed, time_s.iter().map(speed).collect());
    log.set_signal(Signal::NormalForce, time_s.iter().map(load).collect());
    log.set_signal(Signal::FrictionTorque, vec![0.0; time_s.len()]);
    log.set_signal(Signal::Time, time_s);
    let shown = simulate_friction(model, rig, &ContactInputs::new(&log.contact().unwrap(), rig)).unwrap();
    // A hundredth of a newton metre of noise, from the fractional part of an irrational rotation.
    let noise = |i: usize| 0.02 * ((i as f64 * 0.754_877_666).fract() - 0.5);
    log.set_signal(Signal::FrictionTorque, shown.iter().enumerate().map(|(i, t)| t + noise(i)).collect());
    log
}

fn pass(c: &mut Criterion) {
    let (rig, model) = (RigFile::assumed_rig(&[]).unwrap(), ModelFile::assumed(&[]).unwrap());
    let logs: Vec<ContactLog> =
        [0.0, 1.0].iter().map(|p| ContactLog::new(&log(&rig, &model, *p), &rig).unwrap()).collect();
    let baseline = baseline(&model, KNOWN_WITHIN);
    let problem = Problem::new(&logs, &baseline, &[]);
    let p: Vec<f64> = baseline.free.iter().map(|base| base.parameter.mean).collect();
    c.bench_function("observed slip, one pass over 40 000 samples", |b| b.iter(|| problem.predict(&[], &p)));
}

criterion_group!(benches, pass);
criterion_main!(benches);
