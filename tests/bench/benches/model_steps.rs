//! Time of one step of every model, in f32 as on the chip: `cargo bench --bench model_steps`.
//!
//! The inputs sweep creep, stick-slip and gross sliding, so that no branch is predicted away.

#![allow(clippy::unwrap_used, missing_docs)]

use criterion::{BatchSize, Criterion, criterion_group, criterion_main};
use model_core::friction::lugre_patch::{LugrePatch, PatchParameters, PatchState};
use model_core::friction::stribeck::StribeckParameters;
use model_core::friction::{Contact, FrictionParameters, ModelKind};
use std::hint::black_box;

/// Steps per measurement; the time printed is for all of them.
const STEPS: usize = 1000;

fn motion() -> Vec<Contact<f32>> {
    (0..STEPS)
        .map(|k| {
            let t = k as f32 * 1e-4;
            Contact::new(0.3 * (60.0 * t).sin() + 0.1, 88.0 + 10.0 * (90.0 * t).cos())
        })
        .collect()
}

fn steps(c: &mut Criterion) {
    let stribeck = StribeckParameters { a0: 0.5, a1: 0.7, v0_m_s: 0.5, delta: 0.5, theta: 1.0 };
    let motion = motion();
    let mut group = c.benchmark_group("step_x1000");
    for &kind in ModelKind::ALL {
        let model = FrictionParameters::typical(kind).model(1e-4).unwrap();
        let mut state = model.rest();
        group.bench_function(kind.name(), |b| {
            b.iter(|| {
                for contact in &motion {
                    black_box(model.step(&mut state, black_box(contact)));
                }
            });
        });
    }
    let patch = PatchParameters {
        sigma0_per_m: 2e3f32,
        a2_s_per_m: 0.0,
        stribeck,
        length_m: 0.01,
        largest_transport_speed_m_s: 3.0,
    };
    let patch = LugrePatch::<f32, 20>::new(&patch, 1e-4).unwrap();
    group.bench_function("lugre_patch_20", |b| {
        b.iter_batched_ref(
            PatchState::default,
            |state| {
                for contact in &motion {
                    black_box(patch.step(state, black_box(contact), 1.0));
                }
            },
            BatchSize::SmallInput,
        );
    });
    group.finish();
}

criterion_group!(benches, steps);
criterion_main!(benches);
