//! The parts of the generator against closed forms and against the reference rig.

use std::f64::consts::TAU;

use rig_tests::contact_force::{Contact, Touch};
use rig_tests::curve::Curve;
use rig_tests::filters::{Delay, Mode};
use rig_tests::laws::ageing::StaticAgeing;
use rig_tests::laws::coupling::Coupling;
use rig_tests::laws::encoder::Eccentricity;
use rig_tests::laws::film::Film;
use rig_tests::laws::hysteresis::Hysteresis;
use rig_tests::laws::lateness::Lateness;
use rig_tests::laws::lever::LeverHysteresis;
use rig_tests::laws::load::LoadDependence;
use rig_tests::laws::outside::{LoadMemory, Memory};
use rig_tests::laws::ripple::Ripple;
use rig_tests::laws::springs::FoilHardening;
use rig_tests::laws::thermal::ThermalFade;
use rig_tests::laws::wear::WearDrift;
use rig_tests::laws::{Laws, Setting, Slide, Units};
use rig_tests::random::Stream;
use rig_tests::reference_rig::{ReferenceRig, Solver};
use rig_tests::rig::{Friction, Rig};
use rig_tests::{Base, Effect, LawFamily, Scenario};

const STEP_S: f64 = 25e-6;

fn assumed(base: Base) -> Friction {
    Friction {
        base,
        sigma0_n_per_m: 1.76e7,
        sigma1_n_s_per_m: 0.0,
        a0: 0.5,
        a1: 0.7,
        a2_s_per_m: 0.0,
        v0_m_s: 0.5,
        delta: 0.5,
        k_u_n_per_m: 3e4,
        c_u_n_s_per_m: 160.0,
    }
}

fn slide(speed: f64, time_s: f64) -> Slide {
    Slide {
        step_s: 1e-3,
        time_s,
        tip_speed_m_s: speed,
        root_speed_m_s: speed,
        normal_n: 80.0,
        force_n: 60.0 * speed.signum(),
        disc_angle_rad: 0.0,
    }
}

#[test]
fn the_small_step_contact_follows_the_ode_solution() {
    let rig = ReferenceRig::default();
    let m1: Vec<f64> = (0..3000).map(|k| if k < 1200 { 0.9 } else { 2.4 }).collect();
    let m2: Vec<f64> = (0..3000).map(|k| 4.0 * (k as f64 * 1e-4 * 40.0).sin()).collect();
    let states = rig.run(&rig.at_rest(), &m1, &m2, 1e-9, Solver::Automatic).unwrap();
    let friction = assumed(Base::Series);
    let mut contact = Contact::new(&friction, Curve::new(&friction, None, None), STEP_S);
    let (mut error, mut signal) = (0.0, 0.0);
    for pair in states.windows(2) {
        for part in 1..=4 {
            let share = f64::from(part) / 4.0;
            let between = |a: f64, b: f64| a + (b - a) * share;
            contact.step(&Touch {
                root_speed_m_s: 0.06 * between(pair[0].speed_rad_s, pair[1].speed_rad_s),
                normal_n: between(pair[0].pressure_n, pair[1].pressure_n).max(0.0),
                scale: 1.0,
            });
        }
        let torque = 0.06 * contact.force_n();
        error += (torque - pair[1].friction_torque_nm).powi(2);
        signal += pair[1].friction_torque_nm.powi(2);
    }
    let nrmse = (error / signal).sqrt();
    // Backward Euler at 25 µs lags by 12 µs: 1e-3 of a signal that changes within 10 ms.
    assert!(nrmse < 2e-3, "{nrmse}");
}

#[test]
fn every_contact_settles_on_its_curve_and_springs_before_it_slides() {
    for base in [Base::Lugre, Base::Series, Base::ModifiedLugre] {
        let friction = assumed(base);
        let curve = Curve::new(&friction, None, None);
        for v in [-0.9, -0.1, 0.05, 0.6] {
            let mut contact = Contact::new(&friction, curve.clone(), STEP_S);
            for _ in 0..60_000 {
                contact.step(&Touch { root_speed_m_s: v, normal_n: 70.0, scale: 0.9 });
            }
            let expected = f64::signum(v) * 70.0 * 0.9 * curve.at(v).0;
            // Settled after 1.5 s: what is left is the root search's tolerance.
            assert!((contact.force_n() / expected - 1.0).abs() < 1e-6, "{base:?} at {v}");
        }
        let mut contact = Contact::new(&friction, curve, STEP_S);
        // 0.02 µm of travel against bristles that slide after 5 µm, or of block.
        for _ in 0..8 {
            contact.step(&Touch { root_speed_m_s: 1e-4, normal_n: 70.0, scale: 1.0 });
        }
        let stiffness = contact.force_n() / (8.0 * STEP_S * 1e-4);
        if base == Base::Series {
            // The damper carries c·v beside the spring.
            assert!((contact.force_n() - 160e-4) / (8.0 * STEP_S * 1e-4) < 3.1e4);
        } else {
            assert!((stiffness / 1.76e7 - 1.0).abs() < 0.01, "{base:?} {stiffness}");
        }
    }
}

#[test]
fn a_mode_rings_as_its_closed_form_says() {
    let (hz, ratio) = (90.0, 0.01);
    let mut mode = Mode::new(hz, ratio, STEP_S, 0.0);
    let omega = TAU * hz;
    let damped = omega * (1.0_f64 - ratio * ratio).sqrt();
    for n in 1..=4000 {
        let value = mode.step(1.0);
        let t = f64::from(n) * STEP_S;
        let decay = (-ratio * omega * t).exp();
        let exact =
            1.0 - decay * ((damped * t).cos() + ratio / (1.0 - ratio * ratio).sqrt() * (damped * t).sin());
        // The step is exact: rounding only.
        assert!((value - exact).abs() < 1e-9, "{n}: {value} {exact}");
    }
}

#[test]
fn a_delay_gives_back_what_went_in_that_long_ago() {
    let mut delay = Delay::new(3.31e-3, STEP_S, 0.0);
    for n in 0..1000 {
        let out = delay.step(f64::from(n) * STEP_S);
        let expected = (f64::from(n) * STEP_S - 3.31e-3).max(0.0);
        // A ramp is interpolated exactly, but for the corner at its start.
        assert!((out - expected).abs() < if n < 140 { STEP_S } else { 1e-12 }, "{n}");
    }
}

const FAMILIES: [LawFamily; 2] = [LawFamily::Common, LawFamily::Reserved];

fn setting(rig: &Rig, family: LawFamily) -> Setting<'_> {
    Setting { rig, rate_hz: 1000.0, duration_s: 20.0, greatest_normal_n: 80.0, units: Units::ROTARY, family }
}

/// Draws of a law by seed, twelve of the common ones and four of the reserved one.
fn each<L>(mut draw: impl FnMut(&mut Stream, LawFamily) -> L) -> Vec<L> {
    let of = |family, seeds: u64| (0..seeds).map(move |seed| (Stream::new(seed, "test"), family));
    of(LawFamily::Common, 12)
        .chain(of(LawFamily::Reserved, 4))
        .map(|(mut stream, family)| draw(&mut stream, family))
        .collect()
}

#[test]
fn every_nameable_effect_has_three_laws_or_more_and_one_of_them_is_reserved() {
    let rig = Rig::draw(1);
    for effect in Effect::known() {
        let names = |family: LawFamily| -> std::collections::BTreeSet<String> {
            (0..60)
                .map(|seed| Laws::draw(&[effect], seed, &setting(&rig, family)).names()[effect.id()].clone())
                .collect()
        };
        let (common, reserved) = (names(LawFamily::Common), names(LawFamily::Reserved));
        assert!(common.len() >= 3, "{}: {common:?}", effect.id());
        assert_eq!(reserved.len(), 1, "{}: {reserved:?}", effect.id());
        assert!(common.is_disjoint(&reserved), "{}: {reserved:?} is developed on", effect.id());
    }
}

#[test]
fn heat_lowers_friction_and_rest_brings_it_back() {
    for mut law in each(ThermalFade::draw) {
        let after = |law: &mut ThermalFade, speed: f64, seconds: usize| {
            (0..1000 * seconds).fold(1.0, |_, _| law.factor(&slide(speed, 0.0)))
        };
        let hot = after(&mut law, 0.8, 4);
        let cool = after(&mut law, 0.0, 30);
        // Cooling takes 40 s at most: half of what was lost is back after 30 s.
        assert!(hot < 0.99 && cool > hot + 0.5 * (1.0 - hot), "{law:?}: {hot} {cool}");
    }
}

#[test]
fn wear_stays_after_the_slide() {
    for mut law in each(|s, family| WearDrift::draw(s, family, 6.0)) {
        let worn = (0..10_000).fold(1.0, |_, _| law.factor(&slide(0.5, 0.0)));
        let later = (0..10_000).fold(1.0, |_, _| law.factor(&slide(0.0, 0.0)));
        assert!((worn - 1.0).abs() > 0.015 && (later - worn).abs() < 1e-12, "{law:?}: {worn} {later}");
    }
}

#[test]
fn breakaway_grows_with_dwell_at_a_falling_rate_and_sliding_renews_the_contact() {
    for law in each(StaticAgeing::draw) {
        let after = |dwell_s: f64| {
            let mut law = law.clone();
            let aged = (0..(dwell_s * 1000.0) as usize).fold(1.0, |_, _| law.factor(&slide(0.0, 0.0)));
            let slid = (0..200).fold(1.0, |_, _| law.factor(&slide(0.5, 0.0)));
            assert!(slid - 1.0 < 0.6 * (aged - 1.0), "{law:?}: {slid} of {aged}");
            aged
        };
        let gains: Vec<f64> = [0.2, 0.8, 3.2].iter().map(|dwell| after(*dwell)).collect();
        assert!(gains[0] > 1.02 && gains[1] > gains[0] && gains[2] > gains[1], "{law:?}: {gains:?}");
        // Four times the dwell never gives four times the growth.
        assert!(gains[2] - 1.0 < 2.5 * (gains[1] - 1.0), "{law:?}: {gains:?}");
    }
}

#[test]
fn friction_per_load_falls_with_load_and_is_one_at_a_middling_load() {
    for law in each(LoadDependence::draw) {
        let at = |normal_n: f64| law.factor(&Slide { normal_n, ..slide(0.5, 0.0) });
        let factors: Vec<f64> = [10.0, 30.0, 60.0, 100.0].iter().map(|n| at(*n)).collect();
        assert!(factors.windows(2).all(|pair| pair[1] < pair[0]), "{law:?}: {factors:?}");
        assert!(at(40.0) > 0.999 && at(60.0) < 1.001, "{law:?}");
    }
}

#[test]
fn curves_and_films_have_the_slope_of_their_values() {
    for seed in 0..24 {
        let rig = Rig::draw(seed);
        let friction = Friction::draw(seed, Base::Series);
        for family in FAMILIES {
            let laws = |effect| Laws::draw(&[effect], seed, &setting(&rig, family));
            let bell = Curve::new(&friction, laws(Effect::BellCurve).bell_curve, None);
            let sided = laws(Effect::DirectionAsymmetry).direction_asymmetry;
            let sided = Curve::new(&friction, None, sided);
            let film = Film::draw(&mut Stream::new(seed, "film"), family);
            for v in [-0.7, -0.2, 0.15, 0.5, 1.0] {
                let h = 1e-6;
                let slope = |f: &dyn Fn(f64) -> f64| (f(v + h) - f(v - h)) / (2.0 * h);
                // The joint of the directions, some mm/s wide, is left out of the slope.
                for (curve, allowed) in [(&bell, 1e-4), (&sided, 3e-3)] {
                    let numeric = slope(&|v| curve.at(v).0);
                    assert!((numeric - curve.at(v).1).abs() < allowed, "seed {seed} {family:?} at {v}");
                }
                let numeric = slope(&|v| film.at(v, 60.0).0);
                assert!((numeric - film.at(v, 60.0).1).abs() < 1e-4 * numeric, "{film:?} at {v}");
                assert!(numeric > 0.0);
            }
        }
    }
}

#[test]
fn a_bell_rises_from_standstill_to_its_peak_and_falls_beyond() {
    for seed in 0..24 {
        let rig = Rig::draw(seed);
        let friction = Friction::draw(seed, Base::Series);
        for family in FAMILIES {
            let laws = Laws::draw(&[Effect::BellCurve], seed, &setting(&rig, family));
            let curve = Curve::new(&friction, laws.bell_curve, None);
            let speeds: Vec<f64> = (0..200).map(|i| 1e-3 * 1.04_f64.powi(i)).collect();
            let g: Vec<f64> = speeds.iter().map(|v| curve.at(*v).0).collect();
            let top = (0..g.len()).max_by(|a, b| g[*a].total_cmp(&g[*b])).unwrap();
            assert!((0.05..0.5).contains(&speeds[top]), "peak at {}", speeds[top]);
            assert!(g[top] > g[0] + 0.1 && g[top] > g[199] + 0.1);
        }
    }
}

#[test]
fn the_lever_keeps_a_band_that_does_not_depend_on_rate() {
    let rig = Rig::draw(1);
    for law in each(|s, family| LeverHysteresis::draw(s, &setting(&rig, family))) {
        let loop_area = |steps: usize| {
            let mut law = law.clone();
            let mut area = 0.0;
            for n in 0..4 * steps {
                let turn = TAU * n as f64 / steps as f64;
                let lost = law.lost(1.5 + turn.sin());
                if n >= 3 * steps {
                    area += lost * turn.cos() * TAU / steps as f64;
                }
            }
            area
        };
        let (slow, fast) = (loop_area(80_000), loop_area(8_000));
        assert!(slow > 0.02, "{law:?}: {slow} (N·m)²");
        // Euler's error only, over a band that yields within a hundredth of the swing.
        assert!((slow / fast - 1.0).abs() < 0.02, "{law:?}: {slow} {fast}");
    }
}

#[test]
fn a_hysteresis_yields_over_its_way_and_holds_after_a_reversal() {
    for mut law in each(|s, family| Hysteresis::draw(s, family, 0.05)) {
        let forwards = (0..10_000).map(|_| law.step(0.05 / 500.0)).last().unwrap();
        // Dahl's law nears 1 as an exponential.
        assert!((forwards - 1.0).abs() < 1e-3, "{law:?}: {forwards}");
        let just_back = law.step(-0.05 / 20.0);
        assert!(just_back > 0.0 && just_back < 1.0, "{law:?}: {just_back}");
        let backwards = (0..10_000).map(|_| law.step(-0.05 / 200.0)).last().unwrap();
        assert!((backwards + 1.0).abs() < 1e-3, "{law:?}: {backwards}");
    }
}

#[test]
fn the_virgin_curve_follows_its_power() {
    let law = Hysteresis::draw(&mut Stream::new(3, "test"), LawFamily::Reserved, 1.0);
    let text = serde_json::to_value(&law).unwrap();
    let power = text["power"].as_f64().unwrap();
    let mut law = law;
    let curve: Vec<f64> = (0..1000).map(|_| law.step(1e-3)).collect();
    for at in [0.25_f64, 0.5, 0.75, 1.0] {
        // Stops at (i/12)² of the way: between them the curve is a chord, up to 3 % low here.
        let found = curve[(at * 1000.0) as usize - 1];
        assert!((found / at.powf(power) - 1.0).abs() < 0.03, "{at}: {found} for {}", at.powf(power));
    }
}

#[test]
fn a_lateness_is_late_by_its_mean_delay_and_passes_what_is_slow() {
    for law in each(|s, family| Lateness::draw(s, family, 3e-3, 9e-3)) {
        let mut late = law.running(STEP_S, 0.0);
        let (mut sum, mut count) = (0.0, 0.0);
        for n in 0..40_000 {
            let t = f64::from(n) * STEP_S;
            let out = late.step(t);
            if t > 0.2 {
                sum += t - out;
                count += 1.0;
            }
        }
        // A ramp comes late by the delay of low frequencies; a hold rounds its period to whole steps.
        assert!((sum / count - law.delay_s).abs() < 2.0 * STEP_S, "{law:?}: {}", sum / count);
    }
}

#[test]
fn an_eccentric_encoder_reads_the_derivative_of_its_angle_as_speed() {
    for law in each(Eccentricity::draw) {
        for n in 0..100 {
            let (angle, h) = (0.1 * f64::from(n), 1e-6);
            let slope = (law.angle(angle + h) - law.angle(angle - h)) / (2.0 * h);
            // Rounding of angles of 10 rad over 2e-6 rad.
            assert!((slope - law.rate(angle)).abs() < 1e-8, "{law:?}");
            assert!((law.angle(angle + TAU) - law.angle(angle) - TAU).abs() < 1e-12, "{law:?}");
        }
    }
}

#[test]
fn play_is_free_in_the_middle_and_stiff_outside() {
    let rig = Rig::draw(1);
    for law in each(|s, family| Coupling::backlash(s, &setting(&rig, family))) {
        let slope = |twist: f64| (law.torque(twist + 1e-6, 0.0) - law.torque(twist - 1e-6, 0.0)) / 2e-6;
        assert!(slope(0.0) < 1e-3 * law.stiffness, "{law:?}");
        assert!(slope(4.0 * law.play) > 0.9 * law.stiffness, "{law:?}");
        assert!((law.torque(0.03, 0.0) + law.torque(-0.03, 0.0)).abs() < 1e-12, "{law:?}");
        // The teeth push; they do not pull.
        assert!(law.torque(1.01 * law.play, -1e3) <= 0.02 * law.damping * 1e3, "{law:?}");
    }
}

#[test]
fn a_shaft_springs_back_and_does_not_jump() {
    let rig = Rig::draw(1);
    for law in each(|s, family| Coupling::torsion(s, &setting(&rig, family))) {
        let torques: Vec<f64> = (-200..=200).map(|i| law.torque(f64::from(i) * 5e-4, 0.0)).collect();
        assert!(torques.windows(2).all(|pair| pair[1] > pair[0]), "{law:?}");
        assert!(torques[200].abs() < 1e-12, "{law:?}");
        let most = torques.windows(2).map(|pair| pair[1] - pair[0]).fold(0.0, f64::max);
        assert!(most < 20.0 * 5e-4 * law.stiffness, "{law:?}");
    }
}

#[test]
fn springs_take_no_extra_force_at_rest_and_more_than_in_proportion_under_load() {
    for law in each(|s, family| FoilHardening::draw(s, family, 80.0)) {
        let (half, full) = (law.at(40.0), law.at(80.0));
        assert!(law.at(0.0).abs() < 1e-12 && full > 2.5 * half, "{law:?}: {half} {full}");
        assert!((0.02..0.4).contains(&(full / 80.0)), "{law:?}: {full}");
    }
}

#[test]
fn a_ripple_has_the_size_asked_for_and_no_mean() {
    for law in each(|s, family| Ripple::draw(s, family, &[4.0, 6.0, 9.0], 0.2)) {
        let values: Vec<f64> = (0..20_000).map(|i| law.at(TAU * f64::from(i) / 20_000.0)).collect();
        let mean = values.iter().sum::<f64>() / 20_000.0;
        let rms = (values.iter().map(|v| v * v).sum::<f64>() / 20_000.0).sqrt();
        assert!(mean.abs() < 0.1 * rms, "{law:?}: mean {mean}");
        assert!((0.15..0.3).contains(&rms), "{law:?}: {rms}");
        let gentle = law.clone().no_steeper_than(0.1);
        let steepest = (0..20_000)
            .map(|i| TAU * f64::from(i) / 20_000.0)
            .map(|angle| (gentle.at(angle + 1e-4) - gentle.at(angle)).abs() / 1e-4)
            .fold(0.0, f64::max);
        assert!((0.09..0.103).contains(&steepest), "{gentle:?}: {steepest}");
    }
}

#[test]
fn a_third_of_the_rigs_stick_and_slip() {
    let sticking = (0..600)
        .filter(|seed| {
            let series = Stream::new(*seed, "base").chance(0.8);
            series && Friction::draw(*seed, Base::Series).sticks_and_slips()
        })
        .count();
    // ln 2/ln 6 of four fifths: 0.31; four standard deviations of 600 draws are 0.075.
    assert!((140..=230).contains(&sticking), "{sticking} of 600");
    let friction = Friction { c_u_n_s_per_m: 121.0, ..assumed(Base::Series) };
    // 88 N·0.7·0.5/0.5 m/s·(0.0628/0.5)^−0.5·exp(−0.354) by hand.
    assert!((friction.steepest_fall() - 121.9).abs() < 0.5, "{}", friction.steepest_fall());
    assert!(friction.sticks_and_slips());
}

#[test]
fn friction_follows_a_load_step_only_as_it_slides() {
    let mut law = LoadMemory::draw(&mut Stream::new(1, "test"));
    law.factor(&Slide { normal_n: 20.0, ..slide(0.5, 0.0) });
    let at_rest = law.factor(&Slide { normal_n: 80.0, ..slide(0.0, 0.0) });
    let later = (0..3000).fold(1.0, |_, _| law.factor(&Slide { normal_n: 80.0, ..slide(0.5, 0.0) }));
    assert!(at_rest < 0.7 && (later - 1.0).abs() < 1e-3, "{at_rest} {later}");
}

#[test]
fn the_plan_is_drawn_by_the_seed_and_the_papers_only_where_it_shows_the_effect() {
    use rig_tests::Plan;
    let drawn = |effects: &[Effect]| -> Vec<(Plan, f64)> {
        (0..300)
            .map(|seed| Scenario { plan: Plan::Drawn, ..Scenario::new(effects, seed) }.with_plan_drawn())
            .map(|scenario| (scenario.plan, scenario.duration_s))
            .collect()
    };
    let (shown, hidden) = (drawn(&[Effect::FrictionDelay]), drawn(&[Effect::DirectionAsymmetry]));
    for duration in [10.0, 20.0, 60.0] {
        assert!(hidden.iter().filter(|d| **d == (Plan::Random, duration)).count() > 10, "{duration}");
    }
    assert!(shown.iter().any(|d| d.0 == Plan::Paper) && hidden.iter().all(|d| d.0 == Plan::Random));
}

#[test]
fn memory_restarts_at_a_reversal_and_not_at_a_stop() {
    let mut law = Memory::draw(&mut Stream::new(1, "test"));
    let run = |law: &mut Memory, speed: f64, steps: usize| {
        (0..steps).fold(1.0, |_, _| law.factor(&slide(speed, 0.0)))
    };
    let far = run(&mut law, 0.5, 4000);
    let stopped = run(&mut law, 0.0, 1000);
    let back = run(&mut law, -0.5, 20);
    assert!((far - 1.0).abs() > 0.1);
    assert!((stopped - far).abs() < 1e-12);
    assert!((back - 1.0).abs() < 0.03, "{back}");
}
