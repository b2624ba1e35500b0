//! The core in closed loop with the small rig of `testbench.rs`.

use super::testbench::{Bench, experiment, friction_step, hold, steady};
use super::*;
use std::f64::consts::TAU;
use std::vec::Vec;

const RPM: f64 = TAU / 60.0;

fn tick(seconds: f64) -> usize {
    (seconds * 1e4).round() as usize
}

fn largest(values: impl Iterator<Item = f64>) -> f64 {
    values.fold(0.0, |most, value| most.max(value.abs()))
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

fn limits_reached(bench: &Bench) -> Vec<Limit> {
    let reached = |event: &Event| match event.kind {
        EventKind::LimitReached(limit) => Some(limit),
        _ => None,
    };
    bench.events.iter().filter_map(reached).collect()
}

/// Largest relative deviation of the true speed after the step of the normal force.
fn worst_dip(settings: &ControlSettings, rpm: f64) -> f64 {
    let mut bench = Bench::with(settings).running(&friction_step(rpm));
    bench.run(2.4);
    let rise = bench.records[tick(0.99)..].iter().map(|r| f64::from(r.friction_torque_nm));
    assert!(largest(rise) > 5.0, "the friction rises by about 5 N·m");
    largest(bench.speeds_rad_s[tick(1.0)..].iter().map(|w| w / (rpm * RPM) - 1.0))
}

#[test]
fn the_disc_keeps_its_speed_while_friction_rises_by_5_newton_metres() {
    for (rpm, allowed) in [(10.0, 0.07), (20.0, 0.07), (30.0, 0.07), (120.0, 0.035)] {
        let dip = worst_dip(&ControlSettings::default(), rpm);
        assert!(dip < allowed, "{rpm} rpm: {dip}");
    }
}

#[test]
fn without_the_measured_friction_the_speed_falls_as_the_pi_alone_says() {
    let mut settings = ControlSettings::default();
    let with = worst_dip(&settings, 10.0);
    settings.speed_loop.friction_feed_forward = 0.0;
    let without = worst_dip(&settings, 10.0);
    // Friction rises by some 100 N·m/s at 10 rpm: 100/(0.02 · 157²) = 0.2 rad/s of 1.05.
    assert!(without > 3.0 * with && (0.15..0.4).contains(&without), "{with} {without}");
}

#[test]
fn the_speed_loop_settles_on_its_reference_from_1_to_300_rpm_in_both_directions() {
    for rpm in [1.0, 10.0, 120.0, 300.0, -1.0, -30.0, -300.0] {
        let mut bench = Bench::new().running(&steady(0.5, M2Mode::Speed, rpm * RPM, 2.0));
        bench.run(1.9);
        let truth = &bench.speeds_rad_s[tick(1.5)..];
        let error = mean(truth) / (rpm * RPM) - 1.0;
        // The integral leaves nothing; what is seen is one step of the DAC over 0.4 s: 2e-4 rad/s.
        assert!(error.abs() < 1e-3, "{rpm} rpm: {error}");
        let wander = largest(truth.iter().map(|w| w - rpm * RPM));
        assert!(wander < 0.012, "one edge of the encoder, 13 µrad, at the loop's bandwidth: {wander} rad/s");
    }
}

#[test]
fn a_step_of_speed_without_contact_follows_its_ramp() {
    let mut bench = Bench::new().running(&steady(0.0, M2Mode::Speed, 120.0 * RPM, 1.0));
    bench.run(0.9);
    let follows = bench.records.iter().zip(&bench.speeds_rad_s);
    let error = largest(follows.map(|(r, w)| w - f64::from(r.m2_speed_ref_rad_s)));
    // 100 rad/s² behind the drive's 1 ms and the delays: 0.12 rad/s, and as much again while the loop catches up.
    assert!(error < 0.2, "{error}");
    let overshoot = largest(bench.speeds_rad_s.iter().copied()) / (120.0 * RPM) - 1.0;
    assert!(overshoot < 0.02, "{overshoot}");
    assert_eq!(limits_reached(&bench), [Limit::M2Slew, Limit::SpeedSlew]);
}

#[test]
fn the_speed_loop_stays_stable_with_half_and_twice_the_inertia_it_was_told() {
    for inertia_kg_m2 in [0.01, 0.04] {
        let mut settings = ControlSettings::default();
        settings.speed_loop.inertia_kg_m2 = inertia_kg_m2;
        let mut bench = Bench::with(&settings).running(&friction_step(30.0));
        bench.run(2.4);
        let end = largest(bench.speeds_rad_s[tick(2.0)..].iter().map(|w| w / (30.0 * RPM) - 1.0));
        assert!(end < 0.01, "told {inertia_kg_m2}: {end}");
    }
}

#[test]
fn positive_means_the_same_everywhere() {
    for sign in [1.0, -1.0] {
        let mut bench = Bench::new().running(&steady(2.0, M2Mode::Speed, sign * 3.0, 2.0));
        let outputs = bench.run(1.0);
        let r = outputs.record;
        // Three redundant values: what was asked, what the core says, what the rig does.
        assert!(bench.rig.speed_rad_s * sign > 2.9 && f64::from(r.m2_speed_rad_s) * sign > 2.9, "{r:?}");
        assert!(bench.rig.angle_rad * sign > 2.0 && f64::from(r.m2_angle_rad) * sign > 2.0);
        assert!((r.m2_count as f64 / 480_000.0 * TAU - bench.rig.angle_rad).abs() < 0.01);
        assert!((r.m2_turns.to_num::<f64>() * TAU - bench.rig.angle_rad).abs() < 0.01);
        // Friction resists, the motor overcomes it, the drive is told so.
        assert!(bench.rig.friction_nm * sign > 1.0 && f64::from(r.friction_torque_nm) * sign > 1.0);
        assert!(f64::from(r.predicted_friction_torque_nm) * sign > 1.0);
        assert!(f64::from(r.m2_torque_nm) * sign > 1.0 && f64::from(r.m2_torque_ref_nm) * sign > 1.0);
        assert!((f64::from(outputs.dac[1]) - 2048.0) * sign > 256.0);
        // M1 presses whichever way the disc turns.
        assert!(bench.rig.force_n > 45.0 && r.normal_force_n > 45.0 && r.m1_angle_rad > 0.01);
        assert!(r.m1_torque_nm > 1.9 && r.m1_torque_ref_nm > 1.9 && outputs.dac[0] > 2048 + 480);
    }
}

#[test]
fn reversed_wiring_is_put_right_by_its_settings() {
    let mut settings = ControlSettings::default();
    for drive in [&mut settings.m1, &mut settings.m2] {
        drive.reversed = true;
        drive.monitor_nm_per_code = -drive.monitor_nm_per_code;
    }
    (settings.m1_encoder.reversed, settings.m2_encoder.reversed) = (true, true);
    settings.friction_bridge.unit_per_code = -settings.friction_bridge.unit_per_code;
    let mut bench = Bench::with(&settings);
    // The rig as wired: everything of its motors turned round.
    bench.mirrored = true;
    let mut bench = bench.running(&steady(2.0, M2Mode::Speed, 3.0, 2.0));
    let r = bench.run(1.0).record;
    assert_eq!(bench.state.mode(), Mode::Running, "{:?}", r.fault);
    assert!(
        (r.m2_speed_rad_s - 3.0).abs() < 0.1 && r.friction_torque_nm > 1.0 && r.m1_torque_nm > 1.9,
        "{r:?}"
    );
}

#[test]
fn in_torque_mode_the_sticking_element_takes_a_sine_without_gross_sliding() {
    // Fig. 22: M1 at 60 %, M2 a sine of 2 rad/s and 30 %.
    let sine = Shape::Sine { offset: 0.0, amplitude: 2.4, angular_frequency_rad_s: 2.0, phase_rad: 0.0 };
    let e = experiment(
        &[(0.0, hold(4.8))],
        &[(0.0, M2Mode::Torque, hold(0.0)), (0.5, M2Mode::Torque, sine)],
        5.0,
    );
    let mut bench = Bench::new().running(&e);
    bench.run(4.5);
    assert_eq!(bench.state.mode(), Mode::Running, "{:?}", bench.events);
    let late = &bench.records[tick(1.0)..];
    let error = largest(late.iter().map(|r| {
        let t = (r.experiment_tick as f64 - 1.0) * 1e-4 - 0.5;
        f64::from(r.m2_torque_nm) - 2.4 * (2.0 * t).sin()
    }));
    // The lag of 1.2 ms at 4.8 N·m/s makes 6 mN·m, micromath's sine 3, monitor and DAC 4.
    assert!(error < 0.015, "{error}");
    assert!(largest(late.iter().map(|r| f64::from(r.m2_angle_rad))) < 0.2);
}

#[test]
fn a_step_of_torque_is_damped_by_the_element() {
    // Fig. 23: both at 60 %.
    let e = experiment(
        &[(0.0, hold(4.8))],
        &[(0.0, M2Mode::Torque, hold(0.0)), (0.5, M2Mode::Torque, hold(4.8))],
        2.0,
    );
    let mut bench = Bench::new().running(&e);
    let r = bench.run(1.9).record;
    assert_eq!(bench.state.mode(), Mode::Running, "{:?}", bench.events);
    assert!((r.m2_torque_nm - 4.8).abs() < 0.01 && r.m2_speed_rad_s.abs() < 0.05, "{r:?}");
    assert!((r.friction_torque_nm - 4.8).abs() < 0.16, "held but for the bearing's 0.15 N·m: {r:?}");
}

#[test]
fn a_torque_that_would_run_the_free_disc_away_is_folded_back_before_over_speed() {
    let mut bench = Bench::new().running(&steady(0.0, M2Mode::Torque, 4.8, 3.0));
    bench.run(2.5);
    assert_eq!(bench.state.mode(), Mode::Running, "{:?}", bench.events);
    let most = largest(bench.speeds_rad_s.iter().copied());
    assert!((31.5..34.0).contains(&most), "{most}");
    assert!(limits_reached(&bench).contains(&Limit::SpeedFoldback));
}

#[test]
fn changing_between_speed_and_torque_goes_on_from_the_last_command() {
    let e = experiment(
        &[(0.0, hold(2.0))],
        &[(0.0, M2Mode::Speed, hold(3.0)), (1.0, M2Mode::Torque, hold(2.4)), (1.5, M2Mode::Speed, hold(0.0))],
        2.5,
    );
    let mut bench = Bench::new().running(&e);
    bench.run(2.4);
    let references: Vec<f64> = bench.records.iter().map(|r| f64::from(r.m2_torque_ref_nm)).collect();
    for at in [tick(1.0), tick(1.5)] {
        let bump = (references[at] - references[at - 1]).abs();
        // To torque the slew limit leads on (0.4 N·m a tick); to speed the loop goes on where it was.
        assert!(bump < if at == tick(1.0) { 0.401 } else { 0.02 }, "{at}: {bump}");
    }
    let end = mean(&bench.speeds_rad_s[tick(2.2)..]);
    assert!(end.abs() < 0.01, "{end}");
}

#[test]
fn an_experiment_ends_by_itself_at_rest_and_can_be_run_again() {
    let mut bench = Bench::new().running(&steady(2.0, M2Mode::Speed, 120.0 * RPM, 0.5));
    for _ in 0..2 {
        bench.run(0.55);
        assert_eq!(bench.state.mode(), Mode::Stopping);
        let outputs = bench.run(1.0);
        assert_eq!(outputs.record.mode, Mode::Armed);
        assert_eq!(outputs.record.sequencer, SequencerState::Finished);
        assert_eq!((outputs.dac, outputs.drive_enable), ([DAC_ZERO; 2], [true; 2]));
        assert!(bench.rig.speed_rad_s.abs() < 0.05);
        bench.apply(Command::Start).unwrap();
    }
}

#[test]
fn two_runs_give_the_same_bits() {
    let run = || {
        let mut bench = Bench::new().running(&friction_step(30.0));
        bench.run(1.5);
        bench.records
    };
    assert!(run() == run());
}

#[test]
fn the_observer_follows_the_friction_it_has_the_model_of() {
    for rpm in [10.0, 30.0, 120.0] {
        let mut bench = Bench::new().running(&friction_step(rpm));
        bench.run(2.4);
        let after = &bench.records[tick(1.0)..];
        let square = |f: fn(&Record) -> f32| after.iter().map(|r| f64::from(f(r)).powi(2)).sum::<f64>();
        let nrmse = (square(|r| r.residual_nm) / square(|r| r.friction_torque_nm)).sqrt();
        // The rig's amplifier is of first order here and the speed is quantised; the model itself is the same.
        assert!(nrmse < 0.02, "{rpm} rpm: {nrmse}");
        let settled = after[after.len() - 1].residual_rms_nm();
        assert!(settled < 0.02, "{rpm} rpm: {settled}");
    }
}

#[test]
fn a_wrong_model_shows_in_the_residual_and_the_right_one_takes_it_away() {
    let mut bench = Bench::new().running(&steady(3.0, M2Mode::Speed, 3.0, 3.0));
    let ModelParameters::Elements(p) = bench.config.settings().observer.model else { panic!() };
    let with_a0 = |a0| ObserverModel::new(&ModelParameters::Elements(p.with("a0", a0)), 0.06, 1e-4).unwrap();
    let wrong = with_a0(0.4);
    bench.apply(Command::SetModel(&wrong)).unwrap();
    let r = bench.run(1.5).record;
    // 0.1 of 82 N at 0.06 m is 0.49 N·m.
    assert!((r.residual_rms_nm() - 0.49).abs() < 0.03, "{}", r.residual_rms_nm());
    assert!(r.residual_nm > 0.4, "more friction than predicted");
    let right = with_a0(0.5);
    bench.apply(Command::SetModel(&right)).unwrap();
    let rms = bench.run(1.4).record.residual_rms_nm();
    assert!(rms < 0.02, "{rms}");
}
