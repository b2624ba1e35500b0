//! Figs. 18–21: the PC rig against an independent solution of the same rig, both in closed loop with the core.
//!
//! The commands of one run cannot simply be replayed on the other: under held torques steady sliding is unstable where
//! friction falls with speed (F_N |g′| r²/J = 22 1/s at 10 rpm), so after a few seconds any two solutions part.
//! So each rig is in its own loop with the core; the core's quantised commands and readings are a part of both.

use host_sim::files::experiment_file::ExperimentFile;
use host_sim::files::model_file::ModelFile;
use host_sim::files::rig_file::RigFile;
use host_sim::lockstep::{self, Setup};
use host_sim::plant::parameters::NoiseParameters;
use model_core::control::tick::{ControlState, apply, step};
use model_core::control::{AdcScan, Command, Mode, Samples};
use rig_tests::reference_rig::{ReferenceRig, ReferenceState, Solver};

/// What the wiring plan says about levels, written down here once more.
fn sample(s: &ReferenceState, arm_switch: bool) -> Samples {
    let code = |value: f64, low: f64, high: f64| {
        ((value - low) / (high - low)).clamp(0.01, 0.99).mul_add(65536.0, 0.5).floor() as u16
    };
    let count = |angle: f64| (angle / std::f64::consts::TAU * 480_000.0).floor() as i64 as u32;
    Samples {
        m1_count: count((s.pressure_n + 8.0) / 3000.0),
        m2_count: count(s.angle_rad),
        adc: AdcScan {
            friction_bridge: code(s.amplifier_nm[0], -12.0, 12.0),
            normal_bridge: code(s.normal_n(), -20.0, 220.0),
            m1_torque: code(s.m1_torque_nm, -10.0, 10.0),
            m2_torque: code(s.m2_torque_nm, -10.0, 10.0),
            supply: code(24.0 / 11.0, 0.0, 3.3),
        },
        adc_fresh: true,
        arm_switch,
        link_heard: true,
        ..Samples::default()
    }
}

/// True friction torque at each tick of the experiment, with the core on the reference rig.
fn reference(setup: &Setup) -> Vec<f64> {
    let rig = ReferenceRig::default();
    let mut config = setup.config;
    let mut core = ControlState::new(&config);
    let prepared = setup.experiment.prepare(&config).unwrap();
    let mut state = rig.at_rest();
    let mut commands = [0.0; 2];
    let (mut arm_switch, mut armed, mut started) = (false, false, false);
    let mut friction = Vec::new();
    while friction.len() < setup.experiment.duration_ticks as usize {
        let outputs = step(&config, &mut core, &sample(&state, arm_switch));
        if outputs.record.mode == Mode::Running {
            friction.push(state.friction_torque_nm);
        }
        assert!(outputs.record.fault.is_none(), "{:?}", outputs.record.fault);
        // The outputs of this tick act from the next instant on.
        let states = rig.run(&state, &commands[..1], &commands[1..], 1e-9, Solver::Automatic).unwrap();
        state = states[1];
        commands = [0, 1].map(|k| {
            let enabled = outputs.drive_enable[k];
            if enabled { (f64::from(outputs.dac[k]) - 2048.0) / 2048.0 * 8.0 } else { 0.0 }
        });
        match core.mode() {
            // The inputs permit only once they have been steady for a while: ask until the core arms.
            Mode::Disabled if arm_switch && !armed => {
                armed = apply(&mut config, &mut core, Command::Arm).is_ok();
            }
            Mode::Disabled => arm_switch = true,
            Mode::Armed if !started => {
                apply(&mut config, &mut core, Command::LoadExperiment(&prepared)).unwrap();
                apply(&mut config, &mut core, Command::Start).unwrap();
                started = true;
            }
            _ => {}
        }
    }
    friction
}

fn compare(name: &str) {
    let experiment = ExperimentFile::named_or_read(name, &[]).unwrap();
    let rig = RigFile::assumed_rig(&[]).unwrap();
    let model = ModelFile::assumed(&[]).unwrap();
    let mut setup = Setup::from_files(&experiment, &rig, &model, &model).unwrap();
    setup.plant.noise = NoiseParameters::none();
    let recording = lockstep::run(&setup, |_, _| {}).unwrap();
    let product = recording.column(|f| f.truth.friction_torque_nm);
    let exact = reference(&setup);
    assert_eq!(product.len(), exact.len());
    let error: f64 = product.iter().zip(&exact).map(|(a, b)| (a - b) * (a - b)).sum();
    let power: f64 = exact.iter().map(|b| b * b).sum();
    let nrmse = (error / power).sqrt();
    let overshoot = |torque: &[f64]| {
        let peak = torque[40_000..].iter().copied().fold(0.0, f64::max);
        let settled = torque[90_000..].iter().sum::<f64>() / 10_000.0;
        peak / settled - 1.0
    };
    let (ours, theirs) = (overshoot(&product), overshoot(&exact));
    println!("{name}: NRMSE {nrmse:.2e}, overshoot {ours:.5} against {theirs:.5}");
    assert!(nrmse <= 1e-3, "{name}: {nrmse}");
    assert!((ours - theirs).abs() <= 5e-3, "{name}: {ours} against {theirs}");
}

#[test]
fn fig18_is_the_solution_of_its_equations() {
    compare("fig18");
}

#[test]
fn fig19_is_the_solution_of_its_equations() {
    compare("fig19");
}

#[test]
fn fig20_is_the_solution_of_its_equations() {
    compare("fig20");
}

#[test]
fn fig21_is_the_solution_of_its_equations() {
    compare("fig21");
}
