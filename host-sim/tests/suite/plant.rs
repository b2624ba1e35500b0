//! The plant against analytic answers, its energy balance, and what its options must do.

use host_sim::plant::parameters::{
    BridgeParameters, DiscParameters, NoiseParameters, ShaftParameters, Substeps,
};
use host_sim::plant::{Edge, PERIOD_S, Plant, PlantInput, PlantParameters, Truth};

const ZERO: u16 = 2048;

fn quiet() -> PlantParameters {
    PlantParameters { noise: NoiseParameters::none(), ..Default::default() }
}

/// Runs with constant torque commands and gives the truth after each period.
fn run(plant: &mut Plant, m1_nm: f64, m2_nm: f64, duration_s: f64) -> Vec<Truth> {
    (0..(duration_s / PERIOD_S) as u32)
        .map(|_| {
            plant.advance(m1_nm, m2_nm);
            plant.truth()
        })
        .collect()
}

#[test]
fn a_held_command_presses_with_lever_gain_times_torque_less_the_springs() {
    let mut plant = Plant::new(&quiet(), 1).unwrap();
    let end = *run(&mut plant, 3.2, 0.0, 1.0).last().unwrap();
    // 30 · 3.2 − 8 N; after 1 s the slowest part of the answer is e^{−188}.
    assert!((end.normal_force_n - 88.0).abs() < 1e-9, "{}", end.normal_force_n);
    assert!((end.m1_torque_nm - 3.2).abs() < 1e-12);
    // The mechanism yields by (88 + 8) N over 3000 N/rad.
    assert!((end.m1_angle_rad - 96.0 / 3000.0).abs() < 1e-12);
}

#[test]
fn the_normal_force_overshoots_by_what_its_damping_ratio_says() {
    // With a lag far faster than the mode: exp(−πζ/√(1−ζ²)) of the step.
    let mut p = quiet();
    p.m1.torque_lag_s = 0.0;
    let mut plant = Plant::new(&p, 1).unwrap();
    run(&mut plant, 1.0, 0.0, 1.0);
    let peak = run(&mut plant, 3.2, 0.0, 0.1).iter().fold(0.0f64, |m, t| m.max(t.normal_force_n));
    let zeta: f64 = 0.25;
    let overshoot = (-std::f64::consts::PI * zeta / (1.0 - zeta * zeta).sqrt()).exp();
    let expected = 88.0 + 66.0 * overshoot;
    // The peak is caught within half a period, 50 µs or 0.038 rad of the mode: 1 − cos = 7e-4 of 66·0.44 N.
    assert!(peak <= expected + 1e-6 && peak > expected - 0.05, "{peak} against {expected}");
}

#[test]
fn a_torque_turns_the_disc_at_the_speed_where_friction_and_bearing_take_it() {
    // With δ = 0.5 steady sliding is stable under a held torque only where viscous friction wins: lift off.
    let mut plant = Plant::new(&quiet(), 1).unwrap();
    let end = *run(&mut plant, 0.0, 0.25, 60.0).last().unwrap();
    assert_eq!(end.normal_force_n, 0.0);
    assert_eq!(end.friction_torque_nm, 0.0);
    // (0.25 − 0.15)/0.005; the approach has the time constant J/B = 4 s, so e^{−15} is left.
    assert!((end.disc_speed_rad_s - 20.0).abs() < 20.0 * 4e-7, "{}", end.disc_speed_rad_s);
}

#[test]
fn a_disc_held_at_speed_feels_the_static_curve() {
    // A disc so heavy that friction cannot slow it within the run.
    let mut p = quiet();
    p.disc = DiscParameters { inertia_kg_m2: 100.0, ..p.disc };
    p.m2.rated_torque_nm = 1e4;
    let mut plant = Plant::new(&p, 1).unwrap();
    run(&mut plant, 0.0, 1000.0, 0.5);
    let end = *run(&mut plant, 3.2, 0.0, 0.3).last().unwrap();
    let v = end.disc_speed_rad_s * 0.06;
    let steady = 0.06 * 88.0 * (0.5 + 0.7 * (-(v / 0.5).sqrt()).exp());
    // The disc slows down by 0.04 rad/s² meanwhile; the block follows within 5 ms.
    assert!(
        (end.friction_torque_nm / steady - 1.0).abs() < 1e-5,
        "{} against {steady}",
        end.friction_torque_nm
    );
}

#[test]
fn work_of_the_motor_is_kinetic_energy_plus_what_friction_and_bearing_take() {
    for shaft in [None, Some(ShaftParameters { damping_nm_s: 0.0, ..Default::default() })] {
        let p = PlantParameters { shaft, ..quiet() };
        let mut plant = Plant::new(&p, 1).unwrap();
        let (mut work, mut lost) = (0.0, 0.0);
        let mut before = plant.truth();
        for k in 0..20_000 {
            let t = f64::from(k) * PERIOD_S;
            plant.advance(3.2, 6.0 * (20.0 * t).sin());
            let now = plant.truth();
            let mean = |f: fn(&Truth) -> f64| 0.5 * (f(&before) + f(&now));
            work += PERIOD_S * mean(|s| s.m2_torque_nm) * mean(|s| s.m2_speed_rad_s);
            lost += PERIOD_S
                * mean(|s| s.friction_torque_nm + s.bearing_torque_nm)
                * mean(|s| s.disc_speed_rad_s);
            before = now;
        }
        let disc = 0.02 - shaft.map_or(0.0, |s| s.motor_inertia_kg_m2);
        let stored = 0.5 * disc * before.disc_speed_rad_s.powi(2)
            + shaft.map_or(0.0, |s| {
                let twist = before.m2_angle_rad - before.disc_angle_rad;
                0.5 * s.motor_inertia_kg_m2 * before.m2_speed_rad_s.powi(2)
                    + 0.5 * s.stiffness_nm_per_rad * twist * twist
            });
        assert!(work > 3.0, "the run must do work: {work} J");
        // Quadrature of the torque, which jumps where the elements break loose, over 100 µs.
        assert!((work - stored - lost).abs() < 2e-3 * work, "{work} J in, {stored} stored, {lost} lost");
    }
}

#[test]
fn friction_resists_in_both_directions_and_mirrors() {
    let mut forward = Plant::new(&quiet(), 1).unwrap();
    let mut backward = Plant::new(&quiet(), 1).unwrap();
    let a = run(&mut forward, 3.2, 7.5, 0.5);
    let b = run(&mut backward, 3.2, -7.5, 0.5);
    let (a, b) = (a.last().unwrap(), b.last().unwrap());
    assert!(a.disc_speed_rad_s > 1.0 && a.friction_torque_nm > 1.0 && a.deformation_m > 0.0);
    assert_eq!(a.disc_speed_rad_s, -b.disc_speed_rad_s);
    assert_eq!(a.friction_torque_nm, -b.friction_torque_nm);
    assert_eq!(a.normal_force_n, b.normal_force_n);
}

#[test]
fn elements_that_lift_off_carry_nothing_and_the_disc_runs_free() {
    let mut plant = Plant::new(&quiet(), 1).unwrap();
    run(&mut plant, 3.2, 7.0, 0.5);
    let lifted = run(&mut plant, 0.0, 0.0, 0.5);
    // The force swings back above zero once or twice, then the springs hold the elements off.
    let touching = lifted.iter().rposition(|s| s.normal_force_n > 0.0).unwrap();
    assert!((touching as f64) * PERIOD_S < 0.05, "still in contact after {touching} periods");
    for s in &lifted {
        assert!(s.normal_force_n >= 0.0);
        assert!(s.normal_force_n > 0.0 || s.friction_torque_nm == 0.0);
    }
    let end = lifted.last().unwrap();
    let slower = lifted[touching + 1].disc_speed_rad_s - end.disc_speed_rad_s;
    let time = (lifted.len() - touching - 2) as f64 * PERIOD_S;
    let coasting = 0.5 * (lifted[touching + 1].disc_speed_rad_s + end.disc_speed_rad_s);
    // Only the bearing brakes.
    let expected = time * (0.15 + 0.005 * coasting) / 0.02;
    assert!((slower / expected - 1.0).abs() < 1e-2, "{slower} against {expected}");
}

#[test]
fn inertia_discs_slow_the_start_in_proportion() {
    let speed = |discs| {
        let mut p = quiet();
        p.disc.inertia_discs = discs;
        p.bearing.coulomb_nm = 0.0;
        p.bearing.viscous_nm_s = 0.0;
        let mut plant = Plant::new(&p, 1).unwrap();
        run(&mut plant, 0.0, 1.0, 0.1).last().unwrap().disc_speed_rad_s
    };
    // Impulse 1 N·m · (0.1 s − lag 1 ms) over 0.02 + n · 0.01 kg·m².
    for (discs, inertia) in [(0, 0.02), (1, 0.03), (2, 0.04)] {
        assert!((speed(discs) / (0.099 / inertia) - 1.0).abs() < 1e-12, "{discs} discs");
    }
}

#[test]
fn an_elastic_shaft_rings_at_the_frequency_of_two_masses() {
    let mut p = quiet();
    p.bearing.coulomb_nm = 0.0;
    p.bearing.viscous_nm_s = 0.0;
    p.shaft = Some(ShaftParameters { damping_nm_s: 0.0, ..Default::default() });
    let mut plant = Plant::new(&p, 1).unwrap();
    let twist: Vec<f64> =
        run(&mut plant, 0.0, 1.0, 1.0).iter().map(|s| s.m2_angle_rad - s.disc_angle_rad).collect();
    let mean = twist[1000..].iter().sum::<f64>() / (twist.len() - 1000) as f64;
    let rising = |k: &usize| twist[*k] < mean && twist[*k + 1] >= mean;
    let crossings: Vec<usize> = (1000..twist.len() - 1).filter(rising).collect();
    let (first, last) = (crossings[0], crossings[crossings.len() - 1]);
    let seen = (crossings.len() - 1) as f64 / ((last - first) as f64 * PERIOD_S);
    let expected = (400.0f64 * (1.0 / 0.002 + 1.0 / 0.018)).sqrt() / std::f64::consts::TAU;
    // Counting whole periods over 0.9 s: one sample in 9000; Verlet at 0.047 rad a step: 1e-4.
    assert!((seen / expected - 1.0).abs() < 5e-4, "{seen} Hz against {expected} Hz");
}

#[test]
fn a_backlash_lets_the_motor_run_free_before_the_disc_follows() {
    let mut p = quiet();
    p.shaft = Some(ShaftParameters { backlash_rad: 0.02, ..Default::default() });
    let mut plant = Plant::new(&p, 1).unwrap();
    let trace = run(&mut plant, 0.0, 0.5, 0.3);
    // From the middle of the gap the motor alone covers half the backlash: t = √(2·0.01·0.002/0.5) ≈ 8.9 ms + lag.
    let touch = trace.iter().position(|s| s.disc_speed_rad_s > 1e-3).unwrap() as f64 * PERIOD_S;
    assert!((touch - 9.9e-3).abs() < 3e-4, "flanks meet at {touch} s");
    assert!(trace.iter().all(|s| s.m2_angle_rad - s.disc_angle_rad < 0.011 + 0.5 * 0.02));
    // Turned back, the disc stays until the whole gap is crossed.
    let back = run(&mut plant, 0.0, -3.0, 0.3);
    assert!(back.iter().any(|s| s.m2_angle_rad - s.disc_angle_rad < -0.01));
}

#[test]
fn a_disabled_drive_makes_no_torque_whatever_the_reference() {
    let mut plant = Plant::new(&quiet(), 1).unwrap();
    for _ in 0..1000 {
        let output = plant.step(&PlantInput { dac: [4095, 0], drive_enable: [false; 2] });
        // The matrix exponential leaves rounding of 1e-17 where a zero belongs.
        assert!(output.truth.m1_torque_nm.abs() < 1e-12 && output.truth.m2_torque_nm.abs() < 1e-12);
    }
}

#[test]
fn what_the_controller_reads_has_the_sign_and_size_of_the_truth() {
    let mut plant = Plant::new(&quiet(), 1).unwrap();
    let mut last = plant.sample();
    for k in 0..20_000u32 {
        let dac = [ZERO + 819, if k < 10_000 { ZERO } else { ZERO + 1900 }];
        last = plant.step(&PlantInput { dac, drive_enable: [true; 2] });
    }
    let t = &last.truth;
    let code = |value: f64, low: f64, high: f64| ((value - low) / (high - low) * 65536.0).round();
    // One code of quantisation, and 0.5 % for the bridges' lag behind a friction torque that still falls.
    assert!((f64::from(last.codes.m1_torque) - code(t.m1_torque_nm, -10.0, 10.0)).abs() <= 1.0);
    assert!((f64::from(last.codes.m2_torque) - code(t.m2_torque_nm, -10.0, 10.0)).abs() <= 1.0);
    assert!((f64::from(last.codes.normal_bridge) - code(t.normal_force_n, -20.0, 220.0)).abs() <= 1.0);
    let friction = f64::from(last.codes.friction_bridge) - 32768.0;
    assert!((friction / (code(t.friction_torque_nm, -12.0, 12.0) - 32768.0) - 1.0).abs() < 5e-3);
    assert!(t.friction_torque_nm > 2.0 && t.m2_angle_rad > 1.0);
    let counts = (t.m2_angle_rad / std::f64::consts::TAU * 480_000.0).floor();
    assert_eq!(f64::from(last.counts[1]), counts);
    assert_eq!(f64::from(last.counts[0]), (t.m1_angle_rad / std::f64::consts::TAU * 480_000.0).floor());
}

#[test]
fn edges_of_each_period_lead_from_count_to_count() {
    let mut plant = Plant::new(&quiet(), 1).unwrap().with_edges();
    let mut edges: Vec<Edge> = Vec::new();
    let mut counts = [0i64; 2];
    let mut seen = 0;
    for k in 0..8000u32 {
        let turn = if k < 5000 { 4000 } else { 300 };
        let output = plant.step(&PlantInput { dac: [ZERO + 500, turn], drive_enable: [true; 2] });
        for (motor, count) in counts.iter_mut().enumerate() {
            plant.edges(motor, &mut edges);
            for edge in &edges {
                assert_eq!((edge.count - *count).abs(), 1);
                assert!((0.0..=PERIOD_S * (1.0 + 1e-12)).contains(&edge.offset_s));
                *count = edge.count;
            }
            assert!(edges.windows(2).all(|w| w[0].offset_s <= w[1].offset_s));
            assert_eq!(*count as u32, output.counts[motor]);
            seen += edges.len();
        }
    }
    assert!(seen > 100_000, "{seen} edges");
}

#[test]
fn counters_wrap_below_zero() {
    let mut plant = Plant::new(&quiet(), 1).unwrap();
    let mut last = plant.sample();
    for _ in 0..3000 {
        last = plant.step(&PlantInput { dac: [ZERO, 1000], drive_enable: [true; 2] });
    }
    let counts = (last.truth.m2_angle_rad / std::f64::consts::TAU * 480_000.0).floor() as i64;
    assert!(counts < 0);
    assert_eq!(last.counts[1], counts as u32);
}

#[test]
fn an_ideal_sensor_reads_the_truth_without_delay() {
    let mut p = quiet();
    p.friction_bridge = BridgeParameters::IDEAL;
    let mut plant = Plant::new(&p, 1).unwrap();
    for k in 0..4000u32 {
        let output =
            plant.step(&PlantInput { dac: [ZERO + 800, ZERO + (k / 3) as u16], drive_enable: [true; 2] });
        let read = (f64::from(output.codes.friction_bridge) - 32768.0) * 24.0 / 65536.0;
        assert!((read - output.truth.friction_torque_nm).abs() <= 12.01 / 65536.0);
    }
}

#[test]
fn two_plants_with_one_seed_give_identical_bits_and_another_seed_does_not() {
    let trace = |seed| {
        let mut plant = Plant::new(&PlantParameters::default(), seed).unwrap();
        (0..5000u16)
            .map(|k| plant.step(&PlantInput { dac: [ZERO + 819, ZERO + k / 4], drive_enable: [true; 2] }))
            .collect::<Vec<_>>()
    };
    let (a, b, c) = (trace(3), trace(3), trace(4));
    assert!(a == b);
    assert!(a.iter().zip(&c).any(|(x, y)| x.codes != y.codes));
    // Noise is the sensors' alone.
    assert!(a.iter().zip(&c).all(|(x, y)| x.truth == y.truth));
}

#[test]
fn dividing_only_busy_periods_costs_a_tenth_of_what_is_allowed() {
    let friction = |substeps| {
        let mut plant = Plant::new(&PlantParameters { substeps, ..quiet() }, 1).unwrap();
        let mut trace = run(&mut plant, 0.44, 0.0, 0.2);
        trace.extend(run(&mut plant, 0.44, 0.9, 0.1));
        trace.extend(run(&mut plant, 3.2, 6.0, 0.2));
        trace.iter().map(|s| s.friction_torque_nm).collect::<Vec<_>>()
    };
    let fine = friction(Substeps { calm: 200, busy: 200 });
    let usual = friction(PlantParameters::default().substeps);
    let error: f64 = fine.iter().zip(&usual).map(|(a, b)| (a - b) * (a - b)).sum();
    let power: f64 = fine.iter().map(|a| a * a).sum();
    // 1e-3 is allowed over 10 s; half a second that is all transient may have more per second.
    let nrmse = (error / power).sqrt();
    assert!(nrmse < 1e-3, "{nrmse}");
}

#[test]
fn each_parameter_out_of_range_is_named_with_what_is_allowed() {
    let check = |change: fn(&mut PlantParameters), name: &str| {
        let mut p = PlantParameters::default();
        change(&mut p);
        let error = Plant::new(&p, 1).unwrap_err();
        assert_eq!(error.name, name);
        assert!(!error.allowed.is_empty());
    };
    check(|p| p.geometry.friction_radius_m = 0.0, "geometry.friction_radius_m");
    check(|p| p.m2.torque_lag_s = f64::NAN, "m2.torque_lag_s");
    check(|p| p.disc.inertia_kg_m2 = -1.0, "disc.inertia_kg_m2");
    check(|p| p.pressure.mode_hz = 0.0, "pressure.mode_hz");
    check(|p| p.load_shares = [0.5, 0.5, 0.5], "load_shares");
    check(|p| p.substeps.busy = 0, "substeps.busy");
    check(
        |p| p.shaft = Some(ShaftParameters { motor_inertia_kg_m2: 1.0, ..Default::default() }),
        "shaft.motor_inertia_kg_m2",
    );
}
