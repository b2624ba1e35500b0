//! A whole experiment in closed loop, on one core: `cargo bench --bench experiment`.
//!
//! 10 s of Fig. 20 at 10 kHz: 101 003 ticks of the control core with its observer (three series elements in `f32`), and
//! the plant in `f64`. The requirement is 0.05 s on a quiet core, 200 times as fast as the rig. On a busy one count instructions:
//! `valgrind --tool=callgrind target/release/rig simulate --experiment fig20 --out DIR`.

#![allow(clippy::unwrap_used, missing_docs)]

use criterion::{Criterion, criterion_group, criterion_main};
use host_sim::files::experiment_file::ExperimentFile;
use host_sim::files::model_file::ModelFile;
use host_sim::files::rig_file::RigFile;
use host_sim::lockstep::{Setup, run};
use host_sim::plant::{Plant, PlantInput, PlantParameters};

fn experiment(c: &mut Criterion) {
    let rig = RigFile::assumed_rig(&[]).unwrap();
    let model = ModelFile::assumed(&[]).unwrap();
    let mut group = c.benchmark_group("experiment");
    group.sample_size(20);
    for name in ["fig18", "fig20", "fig21", "fig22"] {
        let experiment = ExperimentFile::named_or_read(name, &[]).unwrap();
        let setup = Setup::from_files(&experiment, &rig, &model, &model).unwrap();
        group.bench_function(format!("10 s of {name}"), |b| b.iter(|| run(&setup, |_, _| {}).unwrap()));
    }
    group.finish();
}

fn plant(c: &mut Criterion) {
    let mut sliding = Plant::new(&PlantParameters::default(), 1).unwrap();
    let input = PlantInput { dac: [2048 + 819, 2048 + 1900], drive_enable: [true; 2] };
    (0..3000).for_each(|_| {
        sliding.step(&input);
    });
    c.bench_function("plant, one control period of sliding", |b| b.iter(|| sliding.step(&input)));
}

criterion_group!(benches, experiment, plant);
criterion_main!(benches);
