//! The claims of the physics notes, each re-derived by the models themselves.

use model_core::friction::Contact;
use model_core::friction::lugre::LugreParameters;
use model_core::friction::modified_lugre::{ModifiedLugre, ModifiedLugreState, Scheme};
use model_core::friction::series::{Series, SeriesParameters, SeriesState};
use model_core::friction::stribeck::StribeckParameters;

fn bristles(a0: f64, a1: f64, v0: f64, sigma0: f64) -> LugreParameters<f64> {
    LugreParameters {
        sigma0_n_per_m: sigma0,
        sigma1_n_s_per_m: 0.0,
        a2_s_per_m: 0.0,
        stribeck: StribeckParameters { a0, a1, v0_m_s: v0, delta: 0.5, theta: 1.0 },
    }
}

/// Overshoot of the series element at constant speed and load, and its final force over F_N g.
fn series_overshoot(c_u: f64, v: f64) -> (f64, f64) {
    let p =
        SeriesParameters { k_u_n_per_m: 3e4, c_u_n_s_per_m: c_u, bristles: bristles(0.6, 0.5, 0.05, 2e7) };
    let step = 2e-6;
    let element = Series::new(&p, step).unwrap();
    let mut state = SeriesState::default();
    let (mut peak, mut last) = (0.0f64, 0.0);
    for _ in 0..400_000 {
        last = element.step(&mut state, &Contact::new(v, 100.0)).force_n;
        peak = peak.max(last);
    }
    let steady = 100.0 * (0.6 + 0.5 * (-(v / 0.05f64).sqrt()).exp());
    (peak / steady - 1.0, last / steady)
}

#[test]
fn the_series_element_overshoots_and_settles_at_the_static_curve() {
    for (c_u, v, expected) in [
        (50.0, 0.1, 0.22),
        (50.0, 0.2, 0.23),
        (50.0, 0.3, 0.32),
        (50.0, 1.2, 0.35),
        (300.0, 0.1, 0.33),
        (300.0, 0.2, 0.40),
        (300.0, 0.3, 0.22),
        (300.0, 1.2, 0.0),
    ] {
        let (overshoot, settled) = series_overshoot(c_u, v);
        println!("c_u {c_u} v {v}: overshoot {overshoot:.4}, settled {settled:.6}");
    }
}

/// Overshoot of the modified model in one element, with the notes' parameters.
fn modified_overshoot(scheme: Scheme, step: f64) -> f64 {
    let model = ModifiedLugre::new(&bristles(0.2, 1.0, 0.05, 181.54), step).unwrap().with_scheme(scheme);
    let mut state = ModifiedLugreState::default();
    let mut peak = 0.0f64;
    let steps = (1.0 / step) as usize;
    for _ in 0..steps {
        peak = peak.max(model.step(&mut state, &Contact::new(0.5, 1.0)).force_n);
    }
    peak / (0.2 + (-(10.0f64).sqrt()).exp()) - 1.0
}

#[test]
fn the_printed_overshoot_is_made_by_the_lagged_step_alone() {
    let lagged = modified_overshoot(Scheme::Lagged, 1e-3);
    assert!((lagged - 0.14).abs() < 0.01, "lagged at 1 ms: {lagged}");
    assert!(modified_overshoot(Scheme::Lagged, 1e-4).abs() < 1e-6);
    for step in [1e-3, 1e-4, 1e-5] {
        let implicit = modified_overshoot(Scheme::Implicit, step);
        assert!(implicit.abs() < 1e-9, "implicit at {step} s: {implicit}");
    }
}
