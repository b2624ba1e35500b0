//! The parts of the generator against closed forms and against the reference rig.

#![allow(clippy::unwrap_used)]

use std::f64::consts::TAU;

use rig_tests::contact_force::{Contact, Touch};
use rig_tests::curve::Curve;
use rig_tests::filters::{Delay, Mode};
use rig_tests::laws::drive::{Coupling, Units, Yielding};
use rig_tests::laws::friction::{Slide, StaticAgeing, ThermalFade, WearDrift};
use rig_tests::laws::measurement::Eccentricity;
use rig_tests::laws::outside::Memory;
use rig_tests::laws::pressure::LeverHysteresis;
use rig_tests::laws::{Laws, Setting};
use rig_tests::random::Stream;
use rig_tests::reference_rig::{ReferenceRig, Solver};
use rig_tests::rig::{Friction, Rig};
use rig_tests::{Base, Effect};

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

#[test]
fn heat_lowers_friction_and_rest_brings_it_back() {
    let mut law = ThermalFade::draw(&mut Stream::new(1, "test"));
    let after = |law: &mut ThermalFade, speed: f64, seconds: usize| {
        (0..1000 * seconds).fold(1.0, |_, _| law.factor(&slide(speed, 0.0)))
    };
    let hot = after(&mut law, 0.8, 4);
    let cool = after(&mut law, 0.0, 3);
    assert!(hot < 0.9 && cool > hot + 0.05, "{hot} {cool}");
}

#[test]
fn wear_stays_after_the_slide() {
    let mut law = WearDrift::draw(&mut Stream::new(1, "test"));
    let worn = (0..10_000).fold(1.0, |_, _| law.factor(&slide(0.5, 0.0)));
    let later = (0..10_000).fold(1.0, |_, _| law.factor(&slide(0.0, 0.0)));
    assert!((worn - 1.0).abs() > 0.08 && (later - worn).abs() < 1e-12, "{worn} {later}");
}

#[test]
fn breakaway_grows_about_with_the_logarithm_of_dwell() {
    let law = StaticAgeing::draw(&mut Stream::new(1, "test"));
    let after = |dwell_s: f64| {
        let mut law = law.clone();
        (0..(dwell_s * 1000.0) as usize).fold(1.0, |_, _| law.factor(&slide(0.0, 0.0)))
    };
    let gains: Vec<f64> = [0.05, 0.2, 0.8, 3.2].iter().map(|dwell| after(*dwell)).collect();
    let steps: Vec<f64> = gains.windows(2).map(|pair| pair[1] - pair[0]).collect();
    // Equal ratios of time give about equal steps: within a factor of two over a factor of 64.
    let (least, most) = steps.iter().fold((f64::MAX, 0.0_f64), |(l, m), s| (l.min(*s), m.max(*s)));
    assert!(least > 0.02 && most < 2.0 * least, "{steps:?}");
}

#[test]
fn the_lever_keeps_a_band_that_does_not_depend_on_rate() {
    let loop_area = |steps: usize| {
        let mut law = LeverHysteresis::draw(&mut Stream::new(1, "test"));
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
    let (slow, fast) = (loop_area(40_000), loop_area(4_000));
    assert!(slow > 0.2, "{slow} (N·m)²");
    // Euler's error only.
    assert!((slow / fast - 1.0).abs() < 0.01);
}

#[test]
fn the_bearing_yields_over_travel_and_holds_its_drag_after_a_reversal() {
    let mut law = Yielding::draw(&mut Stream::new(1, "test"), Units::ROTARY);
    let reach = law.sliders.last().unwrap().0;
    let forwards = (0..1000).map(|_| law.share(reach / 500.0)).last().unwrap();
    assert!((forwards - 1.0).abs() < 1e-9);
    let just_back = law.share(-reach / 20.0);
    assert!(just_back > 0.0 && just_back < 1.0);
    let backwards = (0..1000).map(|_| law.share(-reach / 200.0)).last().unwrap();
    assert!((backwards + 1.0).abs() < 1e-9);
}

#[test]
fn an_eccentric_encoder_reads_the_derivative_of_its_angle_as_speed() {
    let law = Eccentricity::draw(&mut Stream::new(1, "test"));
    for n in 0..100 {
        let (angle, h) = (0.1 * f64::from(n), 1e-6);
        let slope = (law.angle(angle + h) - law.angle(angle - h)) / (2.0 * h);
        // Rounding of angles of 10 rad over 2e-6 rad.
        assert!((slope - law.rate(angle)).abs() < 1e-8);
        assert!((law.angle(angle + TAU) - law.angle(angle) - TAU).abs() < 1e-12);
    }
}

#[test]
fn play_is_free_in_the_middle_and_stiff_outside() {
    let rig = Rig::draw(1);
    let setting = Setting { rig: &rig, rate_hz: 1000.0, greatest_normal_n: 80.0, units: Units::ROTARY };
    let laws = Laws::draw(&[Effect::Backlash], 1, &setting);
    let law: &Coupling = laws.backlash.as_ref().unwrap();
    let slope = |twist: f64| (law.torque(twist + 1e-6, 0.0) - law.torque(twist - 1e-6, 0.0)) / 2e-6;
    assert!(slope(0.0) < 1e-3 * law.stiffness);
    assert!(slope(4.0 * law.play) > 0.9 * law.stiffness);
    assert!((law.torque(0.01, 0.0) + law.torque(-0.01, 0.0)).abs() < 1e-12);
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
