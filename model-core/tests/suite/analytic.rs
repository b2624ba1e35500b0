//! Answers known in closed form: the first thing a friction model must get right.

use crate::common::bristles;
use model_core::friction::brush::{Brush, BrushParameters, BrushState};
use model_core::friction::brush_patch::{BrushPatch, BrushPatchState};
use model_core::friction::lugre::{Lugre, LugreParameters, LugreState};
use model_core::friction::lugre_patch::{LugrePatch, PatchParameters, PatchState};
use model_core::friction::modified_lugre::{ModifiedLugre, ModifiedLugreState};
use model_core::friction::series::{Series, SeriesParameters, SeriesState};
use model_core::friction::static_curve::{Bell, BellParameters};
use model_core::friction::stribeck::{Stribeck, StribeckParameters};
use model_core::friction::{Contact, FrictionModel, FrictionParameters, ModelKind};
use model_core::real::Real;

fn as_f32(p: &LugreParameters<f64>) -> LugreParameters<f32> {
    LugreParameters {
        sigma0_n_per_m: p.sigma0_n_per_m as f32,
        sigma1_n_s_per_m: p.sigma1_n_s_per_m as f32,
        a2_s_per_m: p.a2_s_per_m as f32,
        stribeck: StribeckParameters {
            a0: p.stribeck.a0 as f32,
            a1: p.stribeck.a1 as f32,
            v0_m_s: p.stribeck.v0_m_s as f32,
            delta: p.stribeck.delta as f32,
            theta: p.stribeck.theta as f32,
        },
    }
}

fn models<T: Real>(p: LugreParameters<T>) -> [FrictionModel<T>; 3] {
    let step = T::from_f64(1e-4);
    let series =
        SeriesParameters { k_u_n_per_m: T::from_f64(3e4), c_u_n_s_per_m: T::from_f64(160.0), bristles: p };
    [
        FrictionModel::lugre(&p, step).unwrap(),
        FrictionModel::modified_lugre(&p, step).unwrap(),
        FrictionModel::series(&series, step).unwrap(),
    ]
}

#[test]
fn every_bristle_model_settles_at_load_times_the_stribeck_curve_in_both_directions() {
    let mut p = bristles(0.5, 0.7, 0.5, 0.5, 1.76e7);
    p.a2_s_per_m = 0.01;
    let curve = Stribeck::new(&p.stribeck).unwrap();
    for v in [0.08, 0.2, 0.75, -0.75, -0.08] {
        let steady = 88.0 * (curve.coefficient(v).copysign(v) + 0.01 * v);
        for (model, single) in models(p).into_iter().zip(models(as_f32(&p))) {
            let mut state = model.rest();
            let mut state_single = single.rest();
            let (mut force, mut force_single) = (0.0, 0.0);
            for _ in 0..20_000 {
                force = model.step(&mut state, &Contact::new(v, 88.0)).force_n;
                force_single = single.step(&mut state_single, &Contact::new(v as f32, 88.0)).force_n;
            }
            assert!((force / steady - 1.0).abs() < 1e-9, "{model:?} at {v}: {force} N, not {steady} N");
            // f32 carries 24 bits; the exponential of libm is good to one unit in the last place.
            let error = (f64::from(force_single) / steady - 1.0).abs();
            assert!(error < 2e-6, "{single:?} at {v}: {error}");
        }
    }
}

#[test]
fn creep_at_a_step_of_1e_minus_8_of_the_bristle_length_does_not_vanish_in_f32() {
    let p = as_f32(&bristles(0.5, 0.7, 0.5, 0.5, 1.76e7));
    let model = Lugre::new(&p, 1e-4).unwrap();
    let load = 88.0f32;
    // λ = Δt σ0 v/(F_N g) = 1e-8
    let v = 1e-8 * load * 1.2 / 1.76e7 / 1e-4;
    let mut state = LugreState::default();
    for _ in 0..1000 {
        model.step(&mut state, &Contact::new(v, load));
    }
    let travel = 1000.0 * f64::from(v) * 1e-4;
    let error = (f64::from(state.deflection_m) / travel - 1.0).abs();
    // 1000 additions, each rounded to 2^-24.
    assert!(error < 1000.0 * 6e-8, "{error}");
}

#[test]
fn bristles_that_creep_carry_the_stiffness_times_the_travel() {
    let p = bristles(0.5, 0.7, 0.5, 0.5, 1e6);
    let model = Lugre::new(&p, 1e-4).unwrap();
    let mut state = LugreState::default();
    let mut force = 0.0;
    for _ in 0..100 {
        force = model.step(&mut state, &Contact::new(1e-6, 88.0)).force_n;
    }
    // z = z_ss (1 − e^{−x/z_ss}): the closed form at constant speed.
    let g = Stribeck::new(&p.stribeck).unwrap().coefficient(1e-6);
    let reach = 88.0 * g / 1e6;
    let exact = 1e6 * reach * -(-(100.0 * 1e-6 * 1e-4) / reach).exp_m1();
    assert!((force / exact - 1.0).abs() < 1e-10, "{force} N, not {exact} N");
}

#[test]
fn a_series_element_that_sticks_is_a_spring_in_series_with_the_bristles() {
    let p = SeriesParameters {
        k_u_n_per_m: 3e4,
        c_u_n_s_per_m: 160.0,
        bristles: bristles(0.5, 0.7, 0.5, 0.5, 1.76e7),
    };
    let element = Series::new(&p, 1e-4).unwrap();
    let mut state = SeriesState::default();
    let mut force = 0.0;
    // 1 µm/s for one second, then rest until the damper has let go.
    for k in 0..40_000 {
        let v = if k < 10_000 { 1e-6 } else { 0.0 };
        force = element.step(&mut state, &Contact::new(v, 88.0)).force_n;
    }
    let stiffness = 1.0 / (1.0 / 3e4 + 1.0 / 1.76e7);
    // The bristles are bent to 3e-4 of their limit and yield by that share of their travel.
    assert!((force / (stiffness * 1e-6) - 1.0).abs() < 1e-5, "{force}");
}

#[test]
fn without_load_nothing_is_carried_and_the_block_relaxes_by_its_time_constant() {
    let p = SeriesParameters {
        k_u_n_per_m: 3e4,
        c_u_n_s_per_m: 160.0,
        bristles: bristles(0.5, 0.7, 0.5, 0.5, 1.76e7),
    };
    let element = Series::new(&p, 1e-6).unwrap();
    let mut state = SeriesState { deformation_m: 1e-3, ..SeriesState::default() };
    for _ in 0..5_333 {
        assert_eq!(element.step(&mut state, &Contact::new(0.0, 0.0)).force_n, 0.0);
    }
    // 5.333 ms is one time constant c_u/k_u; backward Euler with 1 µs is 1e-4 off.
    assert!((state.deformation_m / (1e-3 * (-1.0f64).exp()) - 1.0).abs() < 2e-4);
    for model in models(bristles(0.5, 0.7, 0.5, 0.5, 1.76e7)) {
        let mut state = model.holding(20.0, &Contact::new(0.0, 88.0));
        assert_eq!(model.step(&mut state, &Contact::new(0.3, 0.0)).force_n, 0.0);
        assert_eq!(model.step(&mut state, &Contact::new(0.3, -5.0)).force_n, 0.0);
    }
}

#[test]
fn a_held_state_carries_the_force_it_was_given_and_no_more_than_the_load_allows() {
    for model in models(bristles(0.5, 0.7, 0.5, 0.5, 1.76e7)) {
        let contact = Contact::new(0.0, 88.0);
        let mut state = model.holding(20.0, &contact);
        assert!((model.step(&mut state, &contact).force_n - 20.0).abs() < 0.01, "{model:?}");
        let mut state = model.holding(1000.0, &contact);
        assert!(model.step(&mut state, &contact).force_n <= 88.0 * 1.2 * (1.0 + 1e-12), "{model:?}");
    }
}

#[test]
fn breakaway_of_the_brush_comes_at_the_static_limit_and_drops_to_the_sliding_one() {
    let brush = Brush::new(&BrushParameters { c_n_per_m: 3e4, mu_s: 1.2, mu_c: 0.8 }, 1e-5).unwrap();
    let mut state = BrushState::default();
    let (mut peak, mut last) = (0.0f64, 0.0);
    for _ in 0..200_000 {
        last = brush.step(&mut state, &Contact::new(0.01, 100.0)).force_n;
        peak = peak.max(last);
    }
    // One step of 10 µs at 10 mm/s adds 3 mN.
    assert!((peak - 120.0).abs() < 4e-3, "{peak}");
    assert!((last - 80.0).abs() < 1e-9);
}

#[test]
fn the_brush_sticks_again_on_reversal_and_breaks_loose_on_unloading() {
    let brush = Brush::new(&BrushParameters { c_n_per_m: 3e4, mu_s: 1.2, mu_c: 0.8 }, 1e-5).unwrap();
    let mut state = BrushState { deformation_m: 80.0 / 3e4, slipping: true };
    // Reversal: it unwinds elastically, 2·80 N/3e4 N/m of travel brings it to the other side.
    let travel_steps = (160.0f64 / 3e4 / (0.01 * 1e-5)) as usize;
    let mut force = 0.0;
    for _ in 0..travel_steps {
        force = brush.step(&mut state, &Contact::new(-0.01, 100.0)).force_n;
        assert!(!state.slipping);
    }
    assert!((force + 80.0).abs() < 0.01, "{force}");
    // Unloading below |c u|/µ_s = 66.7 N breaks it loose although it stands.
    assert!((brush.step(&mut state, &Contact::new(0.0, 70.0)).force_n - force).abs() < 1e-9);
    let loose = brush.step(&mut state, &Contact::new(0.0, 60.0)).force_n;
    assert!((loose + 48.0).abs() < 1e-9, "{loose}");
    // Standing, it sticks again; loaded again it keeps what it has.
    assert!((brush.step(&mut state, &Contact::new(0.0, 100.0)).force_n - loose).abs() < 1e-9);
    assert!(!state.slipping);
}

#[test]
fn the_lugre_patch_meets_its_closed_form_with_an_error_that_falls_with_the_element_length() {
    // Published parameters of a tyre (Canudas de Wit et al., 2003).
    let p = PatchParameters {
        sigma0_per_m: 181.54,
        a2_s_per_m: 0.0,
        stribeck: StribeckParameters { a0: 0.8, a1: 0.75, v0_m_s: 6.57, delta: 0.5, theta: 1.0 },
        length_m: 0.2,
        largest_transport_speed_m_s: 30.0,
    };
    fn error<const N: usize>(p: &PatchParameters<f64>, slip: f64, transport: f64) -> f64 {
        let patch = LugrePatch::<f64, N>::new(p, 1e-4).unwrap();
        let mut state = PatchState::default();
        let mut force = 0.0;
        for _ in 0..20_000 {
            force = patch.step(&mut state, &Contact::new(slip, 1000.0), transport);
        }
        force / (1000.0 * patch.steady_coefficient(slip, transport, 0.2)) - 1.0
    }
    for (slip, transport) in [(0.2, 20.0), (1.0, 20.0), (0.4, 10.0), (-1.0, 20.0), (1.0, -20.0)] {
        let coarse = error::<20>(&p, slip, transport);
        let fine = error::<80>(&p, slip, transport);
        assert!(coarse.abs() < 0.05 && fine.abs() < 0.013, "{slip} {transport}: {coarse}, {fine}");
        // First order: four times the elements, a quarter of the error.
        assert!((coarse / fine / 4.0 - 1.0).abs() < 0.15, "{slip} {transport}: {coarse}, {fine}");
    }
}

#[test]
fn the_patch_keeps_the_step_limit_of_eq_8_by_itself() {
    let mut p = PatchParameters {
        sigma0_per_m: 181.54,
        a2_s_per_m: 0.0,
        stribeck: StribeckParameters { a0: 0.8, a1: 0.75, v0_m_s: 6.57, delta: 0.5, theta: 1.0 },
        length_m: 0.02,
        largest_transport_speed_m_s: 50.0,
    };
    // rωΔt is 50 elements: without sub-steps the upwind scheme would blow up.
    let patch = LugrePatch::<f64, 20>::new(&p, 1e-3).unwrap();
    let mut state = PatchState::default();
    for k in 0..2000 {
        let slip = if k % 400 < 200 { 0.5 } else { -0.5 };
        patch.step(&mut state, &Contact::new(slip, 100.0), 50.0);
        let most = 1.55 / 181.54;
        assert!(state.deflection_m.iter().all(|u| u.abs() <= most));
    }
    p.largest_transport_speed_m_s = 1e4;
    let error = LugrePatch::<f64, 20>::new(&p, 1e-3).unwrap_err();
    assert_eq!(error.name, "largest_transport_speed_m_s");
}

#[test]
fn the_brush_patch_carries_a_triangle_while_it_sticks() {
    let p = BrushParameters { c_n_per_m: 3e4, mu_s: 1.2, mu_c: 0.8 };
    let patch = BrushPatch::<f64, 100>::new(&p, 0.01, 1.0, 1e-4).unwrap();
    let mut state = BrushPatchState::default();
    let (slip, transport) = (0.01, 0.5);
    let mut force = 0.0;
    for _ in 0..2000 {
        force = patch.step(&mut state, &Contact::new(slip, 100.0), transport);
    }
    // u(s) = s v_r/(rω): mean L/2 · v_r/(rω), plus half an element for the end values of 100.
    let exact = 3e4 * 0.005 * slip / transport * (1.0 + 1.0 / 100.0);
    assert!((force / exact - 1.0).abs() < 1e-9, "{force}, not {exact}");
    // Ten times the slip breaks the rear loose: s* = F_N µ_s/c · rω/v_r, then µ_c.
    let slip = 0.3;
    for _ in 0..2000 {
        force = patch.step(&mut state, &Contact::new(slip, 100.0), transport);
    }
    let border = 100.0 * 1.2 / 3e4 * transport / slip / 0.01;
    let exact = 100.0 * (1.2 * border / 2.0 + 0.8 * (1.0 - border));
    // The border lies within an element of 1 % of the length.
    assert!((force / exact - 1.0).abs() < 0.015, "{force}, not {exact}");
}

#[test]
fn the_bell_is_highest_at_its_speed_and_symmetric_in_the_logarithm() {
    let bell = Bell::new(&BellParameters { mu_0: 0.4, mu_m: 1.1, v_m_m_s: 0.05, h_per_decade: 0.8 }).unwrap();
    assert!((bell.coefficient(0.05) - 1.1f64).abs() < 1e-15);
    assert!((bell.coefficient(0.5) - bell.coefficient(0.005)).abs() < 1e-12);
    assert!((bell.coefficient(0.5) - (0.4 + 0.7 * (-0.64f64).exp())).abs() < 1e-12);
    assert_eq!(bell.coefficient(0.0), 0.4);
}

#[test]
fn the_road_factor_scales_friction_and_nothing_else() {
    let p = bristles(0.5, 0.7, 0.5, 0.5, 1.76e7);
    let model = ModifiedLugre::new(&p, 1e-4).unwrap();
    let run = |road_factor: f64, load: f64| {
        let mut state = ModifiedLugreState::default();
        let contact = Contact { sliding_speed_m_s: 0.3, normal_force_n: load, road_factor };
        (0..2000).map(|_| model.step(&mut state, &contact).force_n).last().unwrap()
    };
    assert!((run(0.7, 100.0) / run(1.0, 100.0) - 0.7).abs() < 1e-9);
    assert_eq!(run(0.5, 100.0), run(1.0, 50.0));
}

#[test]
fn the_road_factor_is_in_g_alone_as_eqs_13_and_14_have_it() {
    let (v, load) = (0.3, 90.0);
    for &kind in ModelKind::ALL
        .iter()
        .filter(|kind| FrictionParameters::<f64>::typical(**kind).get("a2_s_per_m").is_some())
    {
        let steady = |road_factor: f64, a2: f64| {
            // Slid for 1.5 m, past every memory; damped so that no block sticks and slips.
            let damped = FrictionParameters::<f64>::typical(kind).with("c_u_n_s_per_m", 160.0);
            let model = damped.with("a2_s_per_m", a2).model(1e-4).unwrap();
            let contact = Contact { sliding_speed_m_s: v, normal_force_n: load, road_factor };
            let mut state = model.rest();
            (0..50_000).map(|_| model.step(&mut state, &contact).force_n).last().unwrap()
        };
        for road_factor in [0.6, 1.0, 1.4] {
            let (with, without) = (steady(road_factor, 0.4), steady(road_factor, 0.0));
            let expected = load * 0.4 * v;
            // The slowest branch of filled rubber still relaxes: 1.3e-5. All others are within 1e-6.
            assert!(
                (with - without - expected).abs() < 1e-4 * expected,
                "{} at {road_factor}: {with} {without}",
                kind.name()
            );
            assert!(
                (without / steady(1.0, 0.0) - road_factor).abs() < 1e-4,
                "{} at {road_factor}: {without}",
                kind.name()
            );
        }
    }
    let p = PatchParameters {
        sigma0_per_m: 2e5,
        a2_s_per_m: 0.4,
        stribeck: StribeckParameters { a0: 0.5, a1: 0.7, v0_m_s: 0.5, delta: 0.5, theta: 1.0 },
        length_m: 0.1,
        largest_transport_speed_m_s: 1.0,
    };
    let patch = LugrePatch::<f64, 8>::new(&p, 1e-4).unwrap();
    let mut state = PatchState::default();
    let contact = Contact { sliding_speed_m_s: v, normal_force_n: load, road_factor: 0.6 };
    let force = (0..20_000).map(|_| patch.step(&mut state, &contact, 0.0)).last().unwrap();
    let expected = load * (0.6 * (0.5 + 0.7 * (-(v / 0.5f64).sqrt()).exp()) + 0.4 * v);
    assert!((force / expected - 1.0).abs() < 1e-9, "patch: {force} {expected}");
    assert!((patch.force_under_n(&state, &contact, &[0.125; 8]) / expected - 1.0).abs() < 1e-9);
}

#[test]
fn every_parameter_out_of_range_is_refused_by_name() {
    let p = bristles(0.5, 0.7, 0.5, 0.5, 1.76e7);
    let series = SeriesParameters { k_u_n_per_m: 3e4, c_u_n_s_per_m: 160.0, bristles: p };
    let name = |error: Option<model_core::error::ParameterError>| {
        let error = error.unwrap();
        assert!(error.to_string().contains("allowed"), "{error}");
        error.name
    };
    let lugre = |p: LugreParameters<f64>| name(Lugre::new(&p, 1e-4).err());
    assert_eq!(lugre(LugreParameters { sigma0_n_per_m: -1.0, ..p }), "sigma0_n_per_m");
    assert_eq!(lugre(LugreParameters { sigma1_n_s_per_m: -1.0, ..p }), "sigma1_n_s_per_m");
    assert_eq!(lugre(LugreParameters { a2_s_per_m: f64::NAN, ..p }), "a2_s_per_m");
    assert_eq!(name(Lugre::new(&p, 0.0).err()), "step_s");
    assert_eq!(
        name(Series::new(&SeriesParameters { k_u_n_per_m: -3e4, ..series }, 1e-4).err()),
        "k_u_n_per_m"
    );
    assert_eq!(
        name(Series::new(&SeriesParameters { c_u_n_s_per_m: 0.0, ..series }, 1e-4).err()),
        "c_u_n_s_per_m"
    );
    let folded = bristles(0.02, 1.0, 0.5, 0.5, 1.76e7);
    assert_eq!(name(ModifiedLugre::new(&folded, 1e-4).err()), "a0");
    let brush = BrushParameters { c_n_per_m: 3e4, mu_s: 1.2, mu_c: 0.8 };
    assert_eq!(name(Brush::new(&BrushParameters { c_n_per_m: -1.0, ..brush }, 1e-4).err()), "c_n_per_m");
    assert_eq!(name(Brush::new(&BrushParameters { mu_s: 0.7, ..brush }, 1e-4).err()), "mu_s");
    assert_eq!(name(Brush::new(&BrushParameters { mu_c: 0.0, ..brush }, 1e-4).err()), "mu_c");
    let bell = BellParameters { mu_0: 0.4, mu_m: 1.1, v_m_m_s: 0.05, h_per_decade: 0.8 };
    assert_eq!(name(Bell::new(&BellParameters { mu_0: 0.0, ..bell }).err()), "mu_0");
    assert_eq!(name(Bell::new(&BellParameters { mu_m: 0.1, ..bell }).err()), "mu_m");
    assert_eq!(name(Bell::new(&BellParameters { v_m_m_s: 0.0, ..bell }).err()), "v_m_m_s");
    assert_eq!(name(Bell::new(&BellParameters { h_per_decade: 0.0, ..bell }).err()), "h_per_decade");
}
