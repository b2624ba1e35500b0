//! Experiments: what is refused, with which words, and what a run asks for tick by tick.

use super::sequencer::{Demand, MAX_DURATION_TICKS, MAX_SEGMENTS, Sequencer};
use super::*;
use std::string::{String, ToString as _};
use std::vec::Vec;

fn constant<M>(start_tick: u32, mode: M, value: f32) -> Segment<M> {
    Segment { start_tick, mode, shape: Shape::Constant { value } }
}

/// M1 at 1 N·m, M2 at 1 rad/s, for 100 ticks.
fn plain() -> Experiment {
    let mut e = Experiment { duration_ticks: 100, ..Experiment::default() };
    e.m1.push(constant(0, M1Mode::Torque, 1.0)).unwrap();
    e.m2.push(constant(0, M2Mode::Speed, 1.0)).unwrap();
    e
}

fn refusal(change: impl Fn(&mut Experiment)) -> String {
    let mut e = plain();
    change(&mut e);
    let config = ControlSettings::default().build().unwrap();
    e.prepare(&config).expect_err("must be refused").to_string()
}

fn with_m1(shape: Shape) -> String {
    refusal(|e| e.m1[0].shape = shape)
}

fn with_m2(mode: M2Mode, shape: Shape) -> String {
    refusal(|e| e.m2[0] = Segment { start_tick: 0, mode, shape })
}

#[test]
fn times_that_make_no_sense_are_refused_in_words() {
    let allowed = std::format!("allowed: 1 … {MAX_DURATION_TICKS}");
    assert_eq!(
        refusal(|e| e.duration_ticks = 0),
        std::format!("duration_ticks = 0 is not allowed; {allowed}")
    );
    assert_eq!(
        refusal(|e| e.duration_ticks = MAX_DURATION_TICKS + 1),
        std::format!("duration_ticks = 36000001 is not allowed; {allowed}")
    );
    assert_eq!(refusal(|e| e.m1.clear()), "m1 has no segment; allowed: at least one");
    assert_eq!(refusal(|e| e.m2.clear()), "m2 has no segment; allowed: at least one");
    assert_eq!(
        refusal(|e| e.m2[0].start_tick = 5),
        "m2 segment 0: start_tick = 5 is not allowed; allowed: 0"
    );
    assert_eq!(
        refusal(|e| e.m1.extend([constant(50, M1Mode::Torque, 1.0), constant(50, M1Mode::Torque, 2.0)])),
        "m1 segment 2: start_tick = 50 is not allowed; allowed: later than the segment before"
    );
    assert_eq!(
        refusal(|e| e.m2.extend([constant(100, M2Mode::Torque, 1.0)])),
        "m2 segment 1: start_tick = 100 is not allowed; allowed: below duration_ticks = 100"
    );
}

#[test]
fn values_beyond_the_limits_are_refused_in_words() {
    let constant = |value| Shape::Constant { value };
    // (160 + 8)/30 N·m keep the normal force at 160 N.
    assert_eq!(with_m1(constant(5.7)), "m1 segment 0: torque_nm = 5.7 is not allowed; allowed: 0 … 5.6");
    assert_eq!(with_m1(constant(-0.1)), "m1 segment 0: torque_nm = -0.1 is not allowed; allowed: 0 … 5.6");
    assert_eq!(with_m1(constant(f32::NAN)), "m1 segment 0: torque_nm = NaN is not allowed; allowed: 0 … 5.6");
    assert_eq!(
        with_m2(M2Mode::Speed, constant(-32.0)),
        "m2 segment 0: speed_rad_s = -32 is not allowed; allowed: -31.5 … 31.5"
    );
    assert_eq!(
        with_m2(M2Mode::Torque, constant(8.5)),
        "m2 segment 0: torque_nm = 8.5 is not allowed; allowed: -8 … 8"
    );
    let ramp = |from, to| Shape::Ramp { from, to, ticks: 10 };
    assert!(with_m2(M2Mode::Torque, ramp(9.0, 0.0)).contains("torque_nm = 9 "));
    assert!(with_m2(M2Mode::Torque, ramp(0.0, f32::INFINITY)).contains("torque_nm = inf "));
    let sine = |offset, amplitude, angular_frequency_rad_s, phase_rad| {
        with_m2(M2Mode::Torque, Shape::Sine { offset, amplitude, angular_frequency_rad_s, phase_rad })
    };
    assert!(sine(6.0, 3.0, 1.0, 0.0).contains("torque_nm = 9 "), "offset and amplitude together");
    assert!(sine(-6.0, 3.0, 1.0, 0.0).contains("torque_nm = -9 "));
    assert!(sine(0.0, -1.0, 1.0, 0.0).contains("amplitude = -1 is not allowed; allowed: 0 … 16"));
    assert!(
        sine(0.0, 1.0, 2001.0, 0.0)
            .contains("angular_frequency_rad_s = 2001 is not allowed; allowed: 0 … 2000")
    );
    assert!(sine(0.0, 1.0, 1.0, 1e6).contains("phase_rad = 1000000 is not allowed; allowed: -1000 … 1000"));
}

#[test]
fn the_limits_of_the_configuration_count_and_not_the_defaults() {
    let mut settings = ControlSettings::default();
    settings.limits.speed_rad_s = 0.5;
    let error = plain().prepare(&settings.build().unwrap()).unwrap_err();
    let value = ExperimentError::Value {
        motor: Motor::M2,
        index: 0,
        name: "speed_rad_s",
        value: 1.0,
        low: -0.5,
        high: 0.5,
    };
    assert_eq!(error, value);
}

#[test]
fn a_run_asks_for_each_segment_from_its_tick_on() {
    let config = ControlSettings::default().build().unwrap();
    let mut e = plain();
    e.m1.extend([constant(10, M1Mode::Torque, 2.0), constant(11, M1Mode::Torque, 3.0)]);
    let ramp = Shape::Ramp { from: 0.0, to: 1.0, ticks: 4 };
    e.m2.extend([Segment { start_tick: 20, mode: M2Mode::Torque, shape: ramp }]);
    e.duration_ticks = 30;
    let mut sequencer = Sequencer::default();
    assert_eq!(sequencer.state(), SequencerState::Empty);
    assert!(!sequencer.start() && sequencer.step().is_none());
    sequencer.load(&e.prepare(&config).unwrap());
    assert_eq!(sequencer.state(), SequencerState::Loaded);
    for _ in 0..2 {
        assert!(sequencer.start());
        let demands: Vec<Demand> = std::iter::from_fn(|| sequencer.step()).collect();
        assert_eq!(demands.len(), 30);
        let m1: Vec<f32> = demands.iter().map(|d| d.m1_torque_nm).collect();
        assert_eq!(m1[8..13], [1.0, 1.0, 2.0, 3.0, 3.0]);
        let m2: Vec<(M2Mode, f32)> = demands.iter().map(|d| (d.m2_mode, d.m2)).collect();
        assert_eq!(m2[19], (M2Mode::Speed, 1.0));
        let torque: Vec<f32> = m2[20..26].iter().map(|d| d.1).collect();
        assert_eq!(torque, [0.0, 0.25, 0.5, 0.75, 1.0, 1.0]);
        assert!(m2[20..].iter().all(|d| d.0 == M2Mode::Torque));
        assert_eq!((sequencer.state(), sequencer.elapsed()), (SequencerState::Finished, 30));
    }
}

#[test]
fn a_full_list_of_segments_runs_to_its_last() {
    let config = ControlSettings::default().build().unwrap();
    let mut e = plain();
    e.m1.clear();
    e.m1.extend((0..MAX_SEGMENTS as u32).map(|k| constant(k, M1Mode::Torque, k as f32 / 64.0)));
    let mut sequencer = Sequencer::default();
    sequencer.load(&e.prepare(&config).unwrap());
    sequencer.start();
    for k in 0..100 {
        let expected = (k.min(63)) as f32 / 64.0;
        assert_eq!(sequencer.step().map(|d| d.m1_torque_nm), Some(expected));
    }
}

#[test]
fn a_stopped_run_asks_for_nothing() {
    let config = ControlSettings::default().build().unwrap();
    let mut sequencer = Sequencer::default();
    sequencer.load(&plain().prepare(&config).unwrap());
    sequencer.start();
    sequencer.step();
    sequencer.stop();
    assert!(sequencer.step().is_none());
    assert_eq!(sequencer.state(), SequencerState::Finished);
}
