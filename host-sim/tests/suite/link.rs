//! The host's side of the link against a rig made of the control core and the plant: the same requests, answers
//! and rows as the firmware's, in simulated time.

use crate::fake_rig::{Rig, TICK_S, setup};
use host_sim::files::signal::Signal;
use host_sim::input_error::InputError;
use host_sim::link::ask::Ask;
use host_sim::link::client::Client;
use host_sim::link::procedure::Procedure;
use host_sim::link::record::Record;
use host_sim::link::rows::{self, Zero};
use host_sim::link::run_experiment::{RunExperiment, RunOptions, RunRecord};
use host_sim::link::words;
use host_sim::lockstep::{self, Setup};
use model_core::control::Fault;
use rig_link::message::{Command, PROTOCOL_VERSION};

/// Does a procedure with the rig; `each` may meddle, once a millisecond.
fn perform<P: Procedure>(
    rig: &mut Rig,
    procedure: &mut P,
    most_s: f64,
    mut each: impl FnMut(&mut Rig, &mut P, f64),
) -> Result<P::Outcome, InputError> {
    let mut client = Client::new();
    let mut now_s = 0.0;
    while now_s < most_s {
        procedure.step(now_s, &mut client)?;
        if let Some(outcome) = procedure.outcome() {
            return Ok(outcome);
        }
        each(rig, procedure, now_s);
        let bytes = rig.millisecond(&client.take_outgoing());
        client.receive(&bytes);
        now_s += 10.0 * TICK_S;
    }
    panic!("not done after {most_s} s");
}

/// The person at the arm switch: off, then on when asked.
fn turn_switch(rig: &mut Rig, run: &mut RunExperiment, _: f64) {
    rig.arm_switch = run.wants_arm_switch() || rig.arm_switch;
}

fn run(
    experiment: &str,
    each: impl FnMut(&mut Rig, &mut RunExperiment, f64),
) -> (Setup, Result<RunRecord, InputError>) {
    let (_, setup) = setup(experiment);
    let mut rig = Rig::new(&setup);
    let mut procedure = RunExperiment::new(setup.experiment.clone(), RunOptions::default());
    let record = perform(&mut rig, &mut procedure, 40.0, each);
    (setup, record)
}

#[test]
fn a_run_over_the_link_gives_the_log_of_the_run_on_the_pc() {
    let (setup, record) = run("fig22", turn_switch);
    let record = record.unwrap();
    assert_eq!((record.fault, rows::missing(&record.rows)), (None, 0));
    let log = rows::log(&record.rows, &record.scale, Zero::Experiment);
    let on_pc = lockstep::run(&setup, |_, _| {}).unwrap();
    let expected = on_pc.log(10, setup.plant.counts_per_rev);
    assert_eq!(log.time_s(), expected.time_s());
    assert_eq!(log.time_s()[..2], [0.0, 0.001]);
    // The start-up of the two differs by some ticks, so the noise is not the same; what is measured is.
    let friction = |log: &host_sim::files::log::Log| log.signal(Signal::FrictionTorque).unwrap().to_vec();
    let (a, b) = (friction(&log), friction(&expected));
    let difference: f64 = a.iter().zip(&b).map(|(a, b)| (a - b).powi(2)).sum();
    let size: f64 = b.iter().map(|b| b * b).sum();
    assert!((difference / size).sqrt() < 0.02, "{}", (difference / size).sqrt());
}

#[test]
fn without_its_arm_switch_the_rig_is_not_armed_and_the_run_says_so() {
    let (_, setup) = setup("fig20");
    let mut rig = Rig::new(&setup);
    let options = RunOptions { arm_patience_s: 2.0, ..RunOptions::default() };
    let mut procedure = RunExperiment::new(setup.experiment, options);
    let mut notes = Vec::new();
    let error = perform(&mut rig, &mut procedure, 10.0, |_, run, _| notes.extend(run.notes())).unwrap_err();
    assert_eq!(error.to_string(), "the arm switch was not turned on");
    assert!(notes.iter().any(|note| note.contains("turn its arm switch off and on")), "{notes:?}");
}

#[test]
fn a_fault_ends_the_run_and_keeps_what_was_recorded() {
    let (_, record) = run("fig20", |rig, run, now_s| {
        turn_switch(rig, run, now_s);
        rig.emergency_stop = run.progress_ticks() > 5_000;
    });
    let record = record.unwrap();
    assert_eq!(record.known_fault(), Some(Fault::EmergencyStop));
    assert!(record.fault_words().unwrap().contains("emergency stop"));
    let last = record.rows.last().unwrap();
    assert!((5_000..5_100).contains(&last.experiment_tick), "{}", last.experiment_tick);
}

#[test]
fn a_rig_that_falls_silent_ends_the_run_with_an_error() {
    let (_, record) = run("fig20", |rig, run, now_s| {
        turn_switch(rig, run, now_s);
        rig.dead = run.progress_ticks() > 5_000;
    });
    assert_eq!(record.unwrap_err().to_string(), "the rig has gone silent in the middle of the run");
}

#[test]
fn lost_rows_are_counted() {
    let (_, setup) = setup("fig20");
    let mut rig = Rig::new(&setup);
    rig.lose = |sequence| sequence % 100 == 7;
    let recorded = perform(&mut rig, &mut Record::new(10, 1.0, true), 10.0, |_, _, _| {}).unwrap();
    assert_eq!(rows::missing(&recorded.rows), 10);
    assert_eq!(recorded.rows.last().unwrap().sequence, 1000);
}

#[test]
fn another_version_of_the_protocol_is_refused_with_both_numbers() {
    let (_, setup) = setup("fig20");
    let mut rig = Rig::new(&setup);
    rig.hello.protocol = 99;
    let mut procedure = RunExperiment::new(setup.experiment, RunOptions::default());
    let error = perform(&mut rig, &mut procedure, 10.0, |_, _, _| {}).unwrap_err();
    assert_eq!(
        error.to_string(),
        format!(
            "protocol = 99: the firmware speaks another version of the protocol; allowed: {PROTOCOL_VERSION}"
        )
    );
}

#[test]
fn a_supply_of_the_converters_that_is_off_is_told_with_its_volts() {
    let (_, setup) = setup("fig20");
    let mut rig = Rig::new(&setup);
    assert!(!words::hello(&rig.hello).contains("3.3 V"));
    rig.hello.reference_mv = 3_400;
    assert!(
        words::hello(&rig.hello).ends_with("; its 3.3 V are 3.400 V: analogue readings are off by as much")
    );
}

#[test]
fn a_port_with_nobody_behind_it_is_named_as_such() {
    let (_, setup) = setup("fig20");
    let mut rig = Rig::new(&setup);
    rig.dead = true;
    let error = perform(&mut rig, &mut Ask::new([Command::Hello]), 10.0, |_, _, _| {}).unwrap_err();
    assert!(error.to_string().starts_with("no answer to the greeting"), "{error}");
}

#[test]
fn an_experiment_beyond_the_rigs_limits_is_refused_in_words() {
    let (_, mut setup) = setup("fig20");
    let segment = setup.experiment.m1.last_mut().unwrap();
    segment.shape = model_core::control::Shape::Constant { value: 80.0 };
    let mut rig = Rig::new(&setup);
    let mut procedure = RunExperiment::new(setup.experiment, RunOptions::default());
    let error = perform(&mut rig, &mut procedure, 10.0, |_, _, _| {}).unwrap_err().to_string();
    assert!(error.starts_with("the rig cannot run this experiment: ") && error.contains("80"), "{error}");
}
