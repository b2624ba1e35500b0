//! The real supervisor, loops and guard under arbitrary commands and inputs in any order: what must hold whatever comes.
//!
//! A model of its own, made only of what a person does and of what the rig shows, says when the drives may be on.

use super::testbench::{Bench, Tamper, steady};
use super::*;
use proptest::prelude::*;
use std::boxed::Box;
use std::vec::Vec;

/// Something that happens between two runs of ticks.
#[derive(Debug, Clone, Copy)]
enum Happening {
    Switch(bool),
    Command(u8),
    /// Inputs are spoiled in this way for so many ticks.
    Spoil(u8, u16),
    /// So many ticks pass.
    Ticks(u16),
}

fn happening() -> impl Strategy<Value = Happening> {
    prop_oneof![
        1 => any::<bool>().prop_map(Happening::Switch),
        6 => (0..11_u8).prop_map(Happening::Command),
        1 => (0..10_u8, 1..200_u16).prop_map(|(how, ticks)| Happening::Spoil(how, ticks)),
        3 => (1..400_u16).prop_map(Happening::Ticks),
    ]
}

fn spoil(how: u8) -> fn(&mut Samples) {
    match how {
        0 => |s| s.emergency_stop = true,
        1 => |s| s.m1_drive_fault = true,
        2 => |s| s.m2_drive_fault = true,
        3 => |s| s.adc_fresh = false,
        4 => |s| s.adc.friction_bridge = u16::MAX,
        5 => |s| s.adc.normal_bridge = 0,
        6 => |s| s.adc.m2_torque = u16::MAX,
        7 => |s| s.adc.supply = 0,
        8 => |s| s.tick_irregular = true,
        _ => |s| s.deadline_missed = true,
    }
}

/// What a person and the rig have done, as far as arming depends on it.
#[derive(Debug, Default)]
struct Permission {
    ticks_off: u32,
    ticks_on: u32,
    /// The switch was off long enough since the start and since the last fault.
    released: bool,
    /// An arm command was accepted since the drives were last off.
    asked: bool,
    faulted: bool,
}

impl Permission {
    fn tick(&mut self, switch: bool) {
        (self.ticks_off, self.ticks_on) =
            if switch { (0, self.ticks_on + 1) } else { (self.ticks_off + 1, 0) };
        self.released |= self.ticks_off >= 50;
    }
}

fn command(bench: &mut Bench, number: u8, permission: &mut Permission) {
    let mut settings = *bench.config.settings();
    let experiment = steady(0.5, M2Mode::Speed, 3.0, 0.5).prepare(&bench.config).unwrap();
    settings.speed_loop.bandwidth_hz = 20.0;
    let config = settings.build().unwrap();
    let command = match number {
        0 | 1 => Command::Arm,
        2 => Command::Disarm,
        3 => Command::Start,
        4 => Command::Stop,
        5 | 6 => Command::ClearFault,
        7 => Command::Tare,
        8 | 9 => Command::LoadExperiment(&experiment),
        _ => Command::SetConfig(&config),
    };
    let before = bench.state.mode();
    let done = bench.apply(command).is_ok();
    match command {
        Command::Arm if done => {
            assert!(permission.released, "armed without the switch released");
            assert!(permission.ticks_on >= 50, "armed with the switch off");
            assert!(!permission.faulted, "armed with a fault latched");
            assert_eq!(before, Mode::Disabled);
            permission.asked = true;
        }
        Command::ClearFault if done => permission.faulted = false,
        Command::SetConfig(_) if done => {
            assert!(!before.is_live(), "the settings changed with the drives on")
        }
        Command::LoadExperiment(_) if done => assert!(!before.has_torque()),
        _ => {}
    }
}

fn check(outputs: &Outputs, permission: &mut Permission, switch: bool) -> Result<(), TestCaseError> {
    let record = &outputs.record;
    let enabled = outputs.drive_enable != [false; 2];
    prop_assert_eq!(enabled, record.mode.is_live());
    if enabled {
        prop_assert!(permission.asked, "enabled and nobody asked");
        prop_assert!(switch, "enabled with the switch off");
        prop_assert!(record.faults.is_empty(), "enabled with {:?}", record.fault);
    } else {
        prop_assert!(outputs.is_safe());
        permission.asked = false;
    }
    prop_assert!(record.mode.has_torque() || outputs.dac == [DAC_ZERO; 2], "torque in {:?}", record.mode);
    if !record.faults.is_empty() {
        if !permission.faulted {
            permission.released = false;
            permission.ticks_off = 0;
        }
        permission.faulted = true;
    }
    prop_assert_eq!(record.mode == Mode::Fault, !record.faults.is_empty());
    Ok(())
}

proptest! {
    // Each case is some seconds of virtual time.
    #![proptest_config(ProptestConfig { cases: 400, ..ProptestConfig::default() })]

    #[test]
    fn no_drive_is_enabled_without_switch_and_command_or_with_a_fault(
        happenings in prop::collection::vec(happening(), 1..80)
    ) {
        let mut bench = Bench::new();
        let mut permission = Permission::default();
        // So that more than refusals is seen, half of the happenings come at the begin.
        let begin = [Happening::Ticks(1100), Happening::Switch(true), Happening::Ticks(60), Happening::Command(8)];
        let course: Vec<Happening> = begin.into_iter().chain(happenings).collect();
        for happening in course {
            let (how, ticks) = match happening {
                Happening::Switch(on) => {
                    bench.arm_switch = on;
                    (None, 0)
                }
                Happening::Command(number) => {
                    command(&mut bench, number, &mut permission);
                    (None, 0)
                }
                Happening::Spoil(how, ticks) => (Some(how), ticks),
                Happening::Ticks(ticks) => (None, ticks),
            };
            bench.tamper = how.map(|how| Box::new(spoil(how)) as Tamper);
            for _ in 0..ticks {
                permission.tick(bench.arm_switch);
                let outputs = bench.tick();
                check(&outputs, &mut permission, bench.arm_switch)?;
            }
            bench.tamper = None;
        }
    }
}
