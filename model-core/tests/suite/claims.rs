//! The published claims about the models, each re-derived by the models themselves.

use crate::common::bristles;
use model_core::friction::lugre::Scheme as LugreScheme;
use model_core::friction::lugre::{Lugre, LugreState, Passivity};
use model_core::friction::lugre_patch::{
    LugrePatch, ModifiedLugrePatch, ModifiedPatchState, PatchParameters, PatchState,
};
use model_core::friction::modified_lugre::{ModifiedLugre, ModifiedLugreState, Scheme};
use model_core::friction::series::{Series, SeriesParameters, SeriesState};
use model_core::friction::{Contact, FrictionParameters, ModelKind, stribeck::Stribeck};
use proptest::prelude::*;

/// Overshoot of the series element at constant speed and load, and its final force over F_N g.
fn series_overshoot(c_u: f64, v: f64) -> (f64, f64) {
    let p = SeriesParameters {
        k_u_n_per_m: 3e4,
        c_u_n_s_per_m: c_u,
        bristles: bristles(0.6, 0.5, 0.05, 0.5, 2e7),
    };
    let element = Series::new(&p, 2e-6).unwrap();
    let mut state = SeriesState::default();
    let (mut peak, mut last) = (0.0f64, 0.0);
    for _ in 0..200_000 {
        last = element.step(&mut state, &Contact::new(v, 100.0)).force_n;
        peak = peak.max(last);
    }
    let steady = 100.0 * (0.6 + 0.5 * (-(v / 0.05f64).sqrt()).exp());
    (peak / steady - 1.0, last / steady)
}

#[test]
fn the_series_element_overshoots_and_settles_at_the_static_curve() {
    // SciPy's Radau at rtol 1e-8 on the same equations gives these figures to the last digit shown.
    for (c_u, v, expected) in [
        (50.0, 0.2, 0.3775),
        (50.0, 0.3, 0.3975),
        (50.0, 1.2, 0.3513),
        (300.0, 0.1, 0.3343),
        (300.0, 0.2, 0.3996),
        (300.0, 0.3, 0.2232),
        (300.0, 1.2, 0.0033),
    ] {
        let (overshoot, settled) = series_overshoot(c_u, v);
        // First order in the step of 2 µs: halving it moves the figures by at most 2e-4.
        assert!((overshoot - expected).abs() < 5e-4, "c_u {c_u}, v {v}: {overshoot}");
        assert!((settled - 1.0).abs() < 1e-6, "c_u {c_u}, v {v}: {settled}");
    }
}

#[test]
fn below_the_damping_of_the_falling_branch_the_series_element_sticks_and_slips() {
    let p = SeriesParameters {
        k_u_n_per_m: 3e4,
        c_u_n_s_per_m: 50.0,
        bristles: bristles(0.6, 0.5, 0.05, 0.5, 2e7),
    };
    let element = Series::new(&p, 2e-6).unwrap();
    assert!(element.least_damping_n_s_per_m(100.0, 0.1) > 50.0);
    let mut state = SeriesState::default();
    let (mut low, mut high) = (f64::MAX, 0.0f64);
    for k in 0..400_000 {
        let force = element.step(&mut state, &Contact::new(0.1, 100.0)).force_n;
        if k > 200_000 {
            (low, high) = (low.min(force), high.max(force));
        }
    }
    assert!(high / low > 1.3, "limit cycle between {low} and {high} N");
}

/// Overshoot of the modified model in one element over its own final value.
fn modified_overshoot(scheme: Scheme, step: f64) -> f64 {
    let p = bristles(0.2, 1.0, 0.05, 0.5, 181.54);
    let model = ModifiedLugre::new(&p, step).unwrap().with_scheme(scheme);
    let mut state = ModifiedLugreState::default();
    let mut peak = 0.0f64;
    for _ in 0..(1.0 / step) as usize {
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

/// Deflection's peak over its steady value, less one, and the span of the second half of the run over that value.
fn folded(v: f64) -> (f64, f64) {
    let p = bristles(0.3, 1.0, 0.1, 2.0, 1e4);
    assert_eq!(ModifiedLugre::new(&p, 1e-6).unwrap_err().name, "a0");
    let kind = ModelKind::ModifiedLugreFold;
    let p = FrictionParameters::new(kind, FrictionParameters::modified_lugre(&p).values()).unwrap();
    let model = p.model(1e-6).unwrap();
    assert!(model.warning().is_some());
    let steady = 88.0 * model.stribeck().unwrap().coefficient(v) / 1e4;
    let mut state = model.rest();
    let (mut peak, mut low, mut high) = (0.0f64, f64::MAX, 0.0f64);
    for k in 0..1_000_000 {
        model.step(&mut state, &Contact::new(v, 88.0));
        let u = state.deformation_m();
        peak = peak.max(u);
        if k > 500_000 {
            (low, high) = (low.min(u), high.max(u));
        }
    }
    (peak / steady - 1.0, (high - low) / steady)
}

#[test]
fn outside_the_condition_the_modified_model_overshoots_or_never_settles() {
    let (overshoot, span) = folded(0.2);
    assert!((overshoot - 0.05).abs() < 0.01 && span < 1e-9, "0.2 m/s: {overshoot} {span}");
    let (_, span) = folded(0.15);
    assert!(span > 0.05, "0.15 m/s: a limit cycle of {span}");
}

#[test]
fn where_there_is_one_root_the_folded_form_is_the_modified_model() {
    let p = FrictionParameters::<f64>::typical(ModelKind::ModifiedLugre);
    let (plain, folded) =
        (p.model(1e-4).unwrap(), ModelKind::ModifiedLugreFold.build(p.values(), 1e-4).unwrap());
    assert_eq!(folded.warning(), None);
    let (mut a, mut b) = (plain.rest(), folded.rest());
    for k in 0..3000 {
        let contact = Contact::new(0.2 * (0.01 * f64::from(k)).sin(), 88.0);
        let (x, y) = (plain.step(&mut a, &contact).force_n, folded.step(&mut b, &contact).force_n);
        assert!((x - y).abs() < 1e-9 * 88.0, "{k}: {x} {y}");
    }
}

#[test]
fn the_literal_patch_is_lugres_in_steady_rolling_and_the_material_one_is_not() {
    let p = bristles(0.5, 0.7, 0.5, 0.5, 3e4);
    let (v, roll, length, load) = (0.06, 0.8, 0.1, 88.0);
    let steady = |scheme| {
        let patch = ModifiedLugrePatch::<f64, 40>::new(&p, length, roll, 1e-4).unwrap().with_scheme(scheme);
        let mut state = ModifiedPatchState::default();
        (0..20_000).map(|_| patch.step(&mut state, &Contact::new(v, load), roll)).last().unwrap()
    };
    let lugre = PatchParameters {
        sigma0_per_m: 3e4 / load,
        a2_s_per_m: 0.0,
        stribeck: p.stribeck,
        length_m: length,
        largest_transport_speed_m_s: roll,
    };
    let lugre = LugrePatch::<f64, 40>::new(&lugre, 1e-4).unwrap();
    let mut state = PatchState::default();
    let lugre = (0..20_000).map(|_| lugre.step(&mut state, &Contact::new(v, load), roll)).last().unwrap();
    assert!((steady(Scheme::Literal) / lugre - 1.0).abs() < 1e-6, "{} {lugre}", steady(Scheme::Literal));
    // The material's speed is below v_r while it winds up: more friction, here by 2 %.
    assert!(steady(Scheme::Implicit) / lugre > 1.015, "{} {lugre}", steady(Scheme::Implicit));
}

#[test]
fn explicit_euler_diverges_where_the_exact_step_does_not() {
    // 5 µm bristles at 1 m/s and 100 µs: Δt σ0|v|/(F_N g) is 20, ten times the bound of 2.
    let p = bristles(0.5, 0.5, 0.5, 0.5, 2e7);
    let load = 100.0;
    let run = |scheme| {
        let model = Lugre::new(&p, 1e-4).unwrap().with_scheme(scheme);
        let mut state = LugreState::default();
        (0..20).map(|_| model.step(&mut state, &Contact::new(1.0, load)).force_n).last().unwrap()
    };
    let steady = load * Stribeck::new(&p.stribeck).unwrap().coefficient(1.0);
    assert!((run(LugreScheme::ExactHold) / steady - 1.0).abs() < 1e-12);
    assert!((run(LugreScheme::BackwardEuler) / steady - 1.0).abs() < 1e-12);
    assert!(run(LugreScheme::ExplicitEuler).abs() > 1e6 * steady);
}

#[test]
fn passivity_is_guaranteed_only_with_enough_viscous_friction() {
    let mut p = bristles(0.5, 0.7, 0.5, 0.5, 1e6);
    assert_eq!(p.passivity(88.0), Passivity::Guaranteed);
    p.sigma1_n_s_per_m = 100.0;
    let Passivity::NeedsViscous { a2_s_per_m } = p.passivity(88.0) else { panic!("should need more") };
    assert!((a2_s_per_m - 100.0 * 0.7 / 0.5 / 88.0).abs() < 1e-12);
    p.a2_s_per_m = a2_s_per_m;
    assert_eq!(p.passivity(88.0), Passivity::Guaranteed);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// The theorem: wherever s g(s) rises strictly the deflection rises monotonically to its end.
    #[test]
    fn the_printed_modified_model_never_overshoots_at_constant_speed(
        a1 in 0.01f64..2.0, excess in 1.02f64..20.0, v0 in 0.005f64..5.0, delta in 0.3f64..2.0,
        log_sigma in 2.0f64..7.3, v in 0.001f64..3.0, log_step in -6.0f64..-3.0,
    ) {
        let bound = a1 * delta * (-(1.0 + 1.0 / delta)).exp();
        prop_assume!(bound * excess < 10.0);
        let p = bristles(bound * excess, a1, v0, delta, 10f64.powf(log_sigma));
        let step = 10f64.powf(log_step);
        let model = ModifiedLugre::new(&p, step).unwrap();
        let end = Stribeck::new(&p.stribeck).unwrap().coefficient(v) / p.sigma0_n_per_m;
        let mut state = ModifiedLugreState::default();
        let mut last = 0.0;
        for _ in 0..2000 {
            model.step(&mut state, &Contact::new(v, 1.0));
            let u = state.deflection_m;
            prop_assert!(u >= last - 1e-12 * end && u <= end * (1.0 + 1e-9), "{u} after {last}, end {end}");
            last = u;
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]

    /// The same with the convection term and 40 elements.
    #[test]
    fn the_printed_modified_patch_never_overshoots_either(
        v in 0.05f64..2.0, transport in 0.05f64..5.0, v0 in 0.02f64..1.0,
    ) {
        let p = bristles(0.2, 1.0, v0, 0.5, 181.54);
        let patch = ModifiedLugrePatch::<f64, 40>::new(&p, 0.2, 5.0, 1e-4).unwrap();
        let mut state = ModifiedPatchState::default();
        let mut peak = 0.0f64;
        let mut last = 0.0;
        for _ in 0..5_000 {
            last = patch.step(&mut state, &Contact::new(v, 1.0), transport);
            peak = peak.max(last);
        }
        prop_assert!(peak <= last * (1.0 + 1e-9), "peak {peak}, settled {last}");
    }
}
