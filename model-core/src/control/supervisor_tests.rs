//! Modes and commands, through `apply` and `step`.

use super::testbench::{Bench, Tamper, experiment, hold, steady};
use super::*;
use std::boxed::Box;
use std::vec::Vec;

fn refused(reason: Refusal) -> Result<(), Refused> {
    Err(Refused { reason, fault: None })
}

fn transitions(bench: &Bench) -> Vec<(Mode, Mode, Reason)> {
    let change = |event: &Event| match event.kind {
        EventKind::ModeChanged { from, to, reason } => Some((from, to, reason)),
        _ => None,
    };
    bench.events.iter().filter_map(change).collect()
}

fn short() -> Experiment {
    steady(1.0, M2Mode::Speed, 3.0, 0.3)
}

#[test]
fn a_run_goes_through_its_modes_each_with_its_reason() {
    let mut bench = Bench::new().running(&short());
    bench.run(0.6);
    bench.apply(Command::Disarm).unwrap();
    assert!(bench.tick().is_safe());
    assert_eq!(
        transitions(&bench),
        [
            (Mode::Boot, Mode::Disabled, Reason::SelfCheckDone),
            (Mode::Disabled, Mode::Armed, Reason::ArmCommand),
            (Mode::Armed, Mode::Running, Reason::StartCommand),
            (Mode::Running, Mode::Stopping, Reason::ExperimentFinished),
            (Mode::Stopping, Mode::Armed, Reason::AtRest),
            (Mode::Armed, Mode::Disabled, Reason::DisarmCommand),
        ]
    );
}

#[test]
fn a_stop_command_brings_the_motors_to_rest() {
    let mut bench = Bench::new().running(&steady(1.0, M2Mode::Speed, 12.0, 10.0));
    bench.run(0.5);
    bench.apply(Command::Stop).unwrap();
    assert_eq!(bench.run(0.01).record.mode, Mode::Stopping);
    let r = bench.run(1.0).record;
    assert_eq!((r.mode, r.sequencer), (Mode::Armed, SequencerState::Finished));
    assert!(transitions(&bench).contains(&(Mode::Running, Mode::Stopping, Reason::StopCommand)));
}

#[test]
fn the_arm_switch_takes_the_torque_away_in_its_tick_whatever_runs() {
    let mut bench = Bench::new().running(&steady(1.0, M2Mode::Speed, 12.0, 10.0));
    bench.run(0.5);
    bench.arm_switch = false;
    let outputs = bench.tick();
    assert!(outputs.is_safe() && outputs.record.mode == Mode::Disabled);
    assert_eq!(transitions(&bench).last(), Some(&(Mode::Running, Mode::Disabled, Reason::ArmSwitchOff)));
    bench.arm_switch = true;
    assert!(bench.run(0.5).is_safe(), "turned on again it does not arm");
}

#[test]
fn disarming_takes_the_torque_away_in_the_next_tick() {
    let mut bench = Bench::new().running(&steady(1.0, M2Mode::Speed, 12.0, 10.0));
    bench.run(0.5);
    bench.apply(Command::Disarm).unwrap();
    let outputs = bench.tick();
    assert!(outputs.is_safe());
    assert_eq!(outputs.record.sequencer, SequencerState::Finished);
}

#[test]
fn a_disc_that_does_not_come_to_rest_is_left_without_torque() {
    let mut bench = Bench::new().running(&short());
    // Something else turns the disc: the encoder goes on, and the ring's torque explains it.
    let mut count = 0_u32;
    bench.run(0.25);
    let last = bench.records[bench.records.len() - 1].m2_count as u32;
    bench.tamper = Some(Box::new(move |s| {
        count += 24;
        s.m2_count = last.wrapping_add(count);
        s.adc.friction_bridge = 2_800;
    }));
    bench.run(3.2);
    assert_eq!(transitions(&bench).last(), Some(&(Mode::Stopping, Mode::Disabled, Reason::StopTimeout)));
}

#[test]
fn a_switch_left_on_at_the_start_does_not_arm() {
    let mut bench = Bench::new();
    bench.arm_switch = true;
    bench.run(0.2);
    assert_eq!(bench.apply(Command::Arm), refused(Refusal::ArmSwitchNotReleased));
    assert!(bench.run(0.1).is_safe());
}

#[test]
fn armed_means_enabled_at_exactly_zero_torque() {
    let mut bench = Bench::new().armed();
    for _ in 0..1000 {
        let outputs = bench.tick();
        assert_eq!((outputs.dac, outputs.drive_enable), ([DAC_ZERO; 2], [true; 2]));
    }
}

#[test]
fn commands_that_do_not_fit_the_mode_are_refused_with_their_reason() {
    let mut bench = Bench::new();
    let config = bench.config;
    let prepared = short().prepare(&config).unwrap();
    let mut seen = Vec::new();
    let mut expect = |bench: &mut Bench, command: Command<'_>, reason: Refusal| {
        assert_eq!(bench.apply(command).map_err(|r| r.reason), Err(reason), "{command:?}");
        seen.push(reason);
    };
    expect(&mut bench, Command::Arm, Refusal::Starting);
    expect(&mut bench, Command::Tare, Refusal::Starting);
    expect(&mut bench, Command::SetConfig(&config), Refusal::Starting);
    bench.run(0.11);
    expect(&mut bench, Command::Arm, Refusal::ArmSwitchOff);
    expect(&mut bench, Command::Start, Refusal::NotArmed);
    expect(&mut bench, Command::Stop, Refusal::NotRunning);
    expect(&mut bench, Command::ClearFault, Refusal::NoFault);
    bench.arm_switch = true;
    bench.run(0.01);
    bench.apply(Command::Arm).unwrap();
    expect(&mut bench, Command::Arm, Refusal::NotDisabled);
    expect(&mut bench, Command::Start, Refusal::NoExperiment);
    expect(&mut bench, Command::SetConfig(&config), Refusal::NotDisabled);
    bench.apply(Command::LoadExperiment(&prepared)).unwrap();
    bench.apply(Command::Start).unwrap();
    bench.run(0.2);
    expect(&mut bench, Command::Start, Refusal::Running);
    expect(&mut bench, Command::Tare, Refusal::Running);
    expect(&mut bench, Command::LoadExperiment(&prepared), Refusal::Running);
    bench.apply(Command::Disarm).unwrap();
    bench.tick();
    expect(&mut bench, Command::Tare, Refusal::NotAtRest);
    bench.apply(Command::Arm).unwrap();
    bench.tamper = Some(Box::new(|s| s.emergency_stop = true));
    bench.tick();
    expect(&mut bench, Command::Arm, Refusal::FaultLatched);
    expect(&mut bench, Command::Start, Refusal::FaultLatched);
    expect(&mut bench, Command::ClearFault, Refusal::CausePresent);
    bench.tamper = None;
    bench.run(0.01);
    bench.apply(Command::ClearFault).unwrap();
    bench.tick();
    expect(&mut bench, Command::Arm, Refusal::ArmSwitchNotReleased);
    seen.sort_by_key(|reason| reason.number());
    seen.dedup();
    assert_eq!(seen, Refusal::ALL, "every refusal was seen");
    let reported = bench.events.iter().filter(|e| matches!(e.kind, EventKind::CommandRefused(_))).count();
    assert_eq!(reported, 17, "and every one reported in the events");
}

#[test]
fn a_tare_makes_the_bridges_read_zero_and_tells_the_codes() {
    let mut bench = Bench::new();
    let offset: Tamper = Box::new(|s| {
        s.adc.friction_bridge += 500;
        s.adc.normal_bridge += 700;
    });
    bench.tamper = Some(offset);
    let r = bench.run(0.2).record;
    assert!(
        (r.friction_torque_nm - 0.183).abs() < 0.001 && (r.normal_force_n - 2.563).abs() < 0.005,
        "{r:?}"
    );
    bench.apply(Command::Tare).unwrap();
    let r = bench.run(0.6).record;
    assert!(r.friction_torque_nm.abs() < 1e-6 && r.normal_force_n.abs() < 1e-6, "{r:?}");
    let reported = bench.events.iter().any(|e| {
        matches!(e.kind, EventKind::TareDone { friction_zero_code, normal_zero_code }
            if friction_zero_code == 33268.0 && normal_zero_code == 6161.0)
    });
    assert!(reported, "{:?}", bench.events);
}

#[test]
fn a_tare_under_load_is_refused_and_changes_nothing() {
    let mut bench = Bench::new();
    bench.tamper = Some(Box::new(|s| s.adc.normal_bridge += 8000));
    bench.run(0.2);
    bench.apply(Command::Tare).unwrap();
    let r = bench.run(0.6).record;
    assert!((r.normal_force_n - 29.3).abs() < 0.05, "{r:?}");
    let reported = bench
        .events
        .iter()
        .any(|e| matches!(e.kind, EventKind::TareRefused { normal_n, .. } if normal_n > 29.0));
    assert!(reported, "{:?}", bench.events);
}

#[test]
fn a_tare_is_broken_off_when_the_rig_moves() {
    let mut bench = Bench::new();
    bench.run(0.2);
    bench.apply(Command::Tare).unwrap();
    bench.run(0.1);
    bench.rig.speed_rad_s = 1.0;
    bench.run(0.1);
    assert_eq!(bench.events.last().map(|e| e.kind), Some(EventKind::TareAborted));
}

#[test]
fn a_new_configuration_is_taken_while_disabled_and_forgets_the_experiment() {
    let mut bench = Bench::new();
    bench.run(0.2);
    let prepared = short().prepare(&bench.config).unwrap();
    bench.apply(Command::LoadExperiment(&prepared)).unwrap();
    let mut settings = ControlSettings::default();
    settings.limits.speed_rad_s = 5.0;
    let config = settings.build().unwrap();
    bench.apply(Command::SetConfig(&config)).unwrap();
    let r = bench.run(0.1).record;
    assert_eq!((r.mode, r.sequencer), (Mode::Disabled, SequencerState::Empty));
    assert_eq!(bench.config.settings().limits.speed_rad_s, 5.0);
}

#[test]
fn a_new_configuration_keeps_the_positions_unless_it_counts_otherwise() {
    let mut bench = Bench::new();
    bench.run(0.2);
    // Turned by hand: a turn and a quarter.
    bench.rig.angle_rad = 2.5 * std::f64::consts::PI;
    let mut settings = ControlSettings::default();
    settings.speed_loop.bandwidth_hz = 20.0;
    let before = bench.run(0.1).record.m2_count;
    bench.apply(Command::SetConfig(&settings.build().unwrap())).unwrap();
    assert_eq!((bench.run(0.1).record.m2_count, before), (600_000, 600_000));
    settings.m2_encoder.reversed = true;
    bench.apply(Command::SetConfig(&settings.build().unwrap())).unwrap();
    assert_eq!(bench.run(0.1).record.m2_count, 0);
}

#[test]
fn events_that_nobody_takes_are_counted() {
    let mut bench = Bench::new();
    bench.run(0.11);
    for _ in 0..40 {
        assert!(bench.apply(Command::Stop).is_err());
    }
    assert_eq!(bench.state.events_lost(), 40 - 32);
}

#[test]
fn limits_are_told_once_a_run_and_shown_in_every_tick() {
    // Beyond what a checked experiment can ask for: the limits of the running configuration are the last word.
    let mut bench = Bench::new();
    let e = experiment(&[(0.0, hold(5.0))], &[(0.0, M2Mode::Speed, hold(12.0))], 1.0);
    let mut bench_config = ControlSettings::default();
    bench_config.limits.normal_force_n = 100.0;
    bench_config.limits.speed_rad_s = 10.0;
    let prepared = e.prepare(&bench.config).unwrap();
    bench.config = bench_config.build().unwrap();
    let mut bench = bench.armed();
    bench.apply(Command::LoadExperiment(&prepared)).unwrap();
    bench.apply(Command::Start).unwrap();
    let r = bench.run(0.9).record;
    assert!(r.limits.contains(Limit::NormalForce) && r.limits.contains(Limit::SpeedReference), "{r:?}");
    assert!((r.m1_torque_ref_nm - 3.6).abs() < 1e-5 && (r.m2_speed_ref_rad_s - 10.0).abs() < 1e-5);
    let reported = |limit| bench.events.iter().filter(|e| e.kind == EventKind::LimitReached(limit)).count();
    assert_eq!((reported(Limit::NormalForce), reported(Limit::SpeedReference)), (1, 1));
    bench.apply(Command::Stop).unwrap();
    bench.run(1.0);
    bench.apply(Command::Start).unwrap();
    bench.run(0.5);
    let reported = |limit| bench.events.iter().filter(|e| e.kind == EventKind::LimitReached(limit)).count();
    assert_eq!(
        (reported(Limit::NormalForce), reported(Limit::SpeedReference)),
        (2, 2),
        "again in the next run"
    );
}
