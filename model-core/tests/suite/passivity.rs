//! Boundedness and passivity on random motion: what holds for every input must hold for these.

use crate::common::bristles;
use model_core::friction::Contact;
use model_core::friction::lugre::{Lugre, LugreState};
use model_core::friction::series::{Series, SeriesParameters, SeriesState};
use proptest::prelude::*;

/// Speeds held for a few steps each, of every size and sign.
fn speeds() -> impl Strategy<Value = Vec<f64>> {
    prop::collection::vec((-6.0f64..0.7, any::<bool>()), 20..60)
        .prop_map(|v| v.into_iter().map(|(e, s)| if s { 10f64.powf(e) } else { -10f64.powf(e) }).collect())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(100))]

    #[test]
    fn lugre_stays_within_its_largest_deflection_and_gives_back_no_more_than_it_stored(
        speeds in speeds(), load in 1.0f64..300.0, log_sigma in 3.0f64..8.0,
        a1 in 0.0f64..2.0, damping in 0.0f64..1.0,
    ) {
        let mut p = bristles(0.5, a1, 0.3, 0.5, 10f64.powf(log_sigma));
        p.sigma1_n_s_per_m = damping * 300.0;
        // The sufficient condition, with equality.
        p.a2_s_per_m = p.sigma1_n_s_per_m * a1 / 0.5 / load;
        prop_assume!(p.a2_s_per_m <= 100.0);
        let step = 1e-6;
        let model = Lugre::new(&p, step).unwrap();
        let bound = model.largest_deflection_m(load);
        let mut state = LugreState::<f64>::default();
        for v in speeds {
            for _ in 0..20 {
                let before = 0.5 * p.sigma0_n_per_m * state.deflection_m.powi(2);
                let out = model.step(&mut state, &Contact::new(v, load));
                let after = 0.5 * p.sigma0_n_per_m * state.deflection_m.powi(2);
                prop_assert!(state.deflection_m.abs() <= bound * (1.0 + 1e-12));
                // The step's own error: the force at the end of a step stands for the whole step.
                let allowed = 0.5 * p.sigma0_n_per_m * (step * v).powi(2)
                    + p.sigma1_n_s_per_m * v.abs() * step * v.abs() * (step * v.abs() * p.sigma0_n_per_m / load).min(1.0);
                prop_assert!(out.force_n * v * step - (after - before) >= -allowed - 1e-15,
                    "work {}, stored {}", out.force_n * v * step, after - before);
            }
        }
    }

    #[test]
    fn the_series_element_is_bounded_and_passive_in_f32_too(
        speeds in speeds(), load in 0.5f32..300.0, log_k in 3.0f32..6.0, c_u in 5.0f32..500.0,
    ) {
        let b = bristles(0.5, 0.7, 0.5, 0.5, 1.76e7);
        let p = SeriesParameters {
            k_u_n_per_m: 10f32.powf(log_k),
            c_u_n_s_per_m: c_u,
            bristles: model_core::friction::lugre::LugreParameters {
                sigma0_n_per_m: b.sigma0_n_per_m as f32,
                sigma1_n_s_per_m: 0.0,
                a2_s_per_m: 0.0,
                stribeck: model_core::friction::stribeck::StribeckParameters {
                    a0: 0.5, a1: 0.7, v0_m_s: 0.5, delta: 0.5, theta: 1.0,
                },
            },
        };
        let step = 1e-4f32;
        let element = Series::new(&p, step).unwrap();
        let mut state = SeriesState::default();
        let most = load * 1.2;
        let mut work = 0.0f64;
        for v in speeds {
            for _ in 0..40 {
                let out = element.step(&mut state, &Contact::new(v as f32, load));
                prop_assert!(out.force_n.is_finite() && out.force_n.abs() <= most * 1.000_01, "{}", out.force_n);
                // The root works against spring and damper: k_u u + c_u u̇ is the friction force.
                work += f64::from(out.force_n) * v * f64::from(step);
            }
        }
        let stored = 0.5 * f64::from(p.k_u_n_per_m) * f64::from(state.deformation_m).powi(2)
            + 0.5 * 1.76e7 * f64::from(state.deflection_m).powi(2);
        // Backward Euler dissipates; rounding of the sum is 1e-7 of the largest work.
        prop_assert!(work >= stored * (1.0 - 1e-3) - 1e-3, "work {work}, stored {stored}");
    }

    /// The solved step satisfies the balance it was solved for, on every branch.
    #[test]
    fn block_force_and_bristle_force_balance_after_every_step(
        speeds in speeds(), load in 1.0f64..300.0, c_u in 1.0f64..500.0,
    ) {
        let p = SeriesParameters { k_u_n_per_m: 3e4, c_u_n_s_per_m: c_u, bristles: bristles(0.5, 0.7, 0.5, 0.5, 1.76e7) };
        let element = Series::new(&p, 1e-4).unwrap();
        let mut state = SeriesState::<f64>::default();
        let mut last = None;
        for v in speeds {
            for _ in 0..40 {
                let out = element.step(&mut state, &Contact::new(v, load));
                // The root's speed at the end of the step, from its means over two equal steps.
                let root = v + 0.5 * (v - last.unwrap_or(v));
                last = Some(v);
                let block = 3e4 * state.deformation_m + c_u * (root - out.tip_speed_m_s);
                let scale = load + block.abs() + (3e4 * 1e-4 + c_u) * root.abs();
                prop_assert!((block - out.force_n).abs() < 1e-7 * scale, "{block} N, {} N", out.force_n);
            }
        }
    }
}
