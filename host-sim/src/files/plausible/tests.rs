//! Each unit that people mix up, on a log of the PC rig; and nothing on the log as it is.

use super::*;
use crate::files::experiment_file::ExperimentFile;
use crate::files::model_file::ModelFile;
use crate::files::rig_file::RigFile;
use crate::files::signal::Signal;
use crate::lockstep::{self, Setup};
use std::sync::OnceLock;

/// fig. 20, shortened: rest, acceleration, a step of the load.
fn clean() -> &'static Log {
    static LOG: OnceLock<Log> = OnceLock::new();
    LOG.get_or_init(|| {
        let change = |key: &str, value: &str| (key.to_owned(), value.to_owned());
        let changes =
            [change("m1.1.start_s", "1.0"), change("m2.1.start_s", "0.5"), change("duration_s", "2.5")];
        let file = ExperimentFile::named_or_read("fig20", &changes).unwrap();
        let (rig, model) = (RigFile::assumed_rig(&[]).unwrap(), ModelFile::assumed(&[]).unwrap());
        let setup = Setup::from_files(&file, &rig, &model, &model).unwrap();
        let recording = lockstep::run(&setup, |_, _| {}).unwrap();
        recording.log(10, setup.plant.counts_per_rev)
    })
}

/// The log with some columns multiplied and others left out.
fn log(factors: &[(Signal, f64)], without: &[Signal]) -> Log {
    let mut log = clean().clone();
    log.source = "l.csv".into();
    for (signal, factor) in factors {
        let values = log.signal(*signal).unwrap().iter().map(|value| value * factor).collect();
        log.set_signal(*signal, values);
    }
    log.columns.retain(|column| !without.iter().any(|signal| signal.column() == column.name));
    log
}

#[track_caller]
fn doubted(log: &Log, column: &str, words: &str) {
    let found = findings(log);
    assert!(
        found.iter().any(|finding| matches!(finding, Finding::Doubt { column: about, sentence }
            if *about == column && sentence.contains(words))),
        "{found:?}"
    );
}

#[track_caller]
fn refused(log: &Log, words: &str) {
    let found = findings(log);
    assert!(
        found.iter().any(
            |finding| matches!(finding, Finding::Impossible(error) if error.to_string().contains(words))
        ),
        "{found:?}"
    );
}

#[test]
fn the_log_as_it_is_raises_no_doubt_with_or_without_its_speed() {
    assert_eq!(findings(clean()), []);
    assert_eq!(findings(&log(&[], &[Signal::M2Speed])), []);
    assert_eq!(findings(&log(&[], &[Signal::M2Angle])), []);
}

#[test]
fn rpm_and_degrees_are_found_from_each_other_and_from_the_inertia() {
    let rpm = 60.0 / std::f64::consts::TAU;
    let degrees = 180.0 / std::f64::consts::PI;
    doubted(&log(&[(Signal::M2Speed, rpm)], &[]), "m2_angle_rad", "the speed looks like rpm");
    doubted(&log(&[(Signal::M2Angle, degrees)], &[]), "m2_angle_rad", "the angle looks like degrees");
    let both = log(&[(Signal::M2Angle, degrees), (Signal::M2Speed, rpm)], &[]);
    doubted(&both, "m2_angle_rad", "degrees and the speed like rpm");
    doubted(&log(&[(Signal::M2Speed, rpm)], &[Signal::M2Angle]), "m2_speed_rad_s", "looks like rpm");
    doubted(&log(&[(Signal::M2Angle, degrees)], &[Signal::M2Speed]), "m2_angle_rad", "deg");
    doubted(&log(&[(Signal::M2Angle, -1.0)], &[]), "m2_angle_rad", "the other sign");
}

#[test]
fn kilonewtons_millinewton_metres_and_signs_are_found() {
    doubted(&log(&[(Signal::NormalForce, 1e-3)], &[]), "normal_force_n", "looks like kN (");
    doubted(&log(&[(Signal::FrictionTorque, 1e3)], &[]), "friction_torque_nm", "mN·m");
    doubted(&log(&[(Signal::NormalForce, 1e3)], &[]), "normal_force_n", "like mN");
    doubted(&log(&[(Signal::FrictionTorque, -1.0)], &[]), "friction_torque_nm", "drives the disc");
    refused(&log(&[(Signal::NormalForce, -1.0)], &[]), "is negative while the elements rub");
}

#[test]
fn a_disc_at_rest_and_lifted_elements_raise_no_doubt() {
    // Loaded at rest: the friction channel shows its noise alone.
    let mut rest = log(&[(Signal::M2Speed, 0.0), (Signal::FrictionTorque, 1e-3)], &[Signal::M2Angle]);
    assert_eq!(findings(&rest), []);
    // Lifted: a zero of -0.4 N, noise in the friction channel, the disc turns.
    rest = log(&[(Signal::FrictionTorque, 1e-3)], &[]);
    rest.set_signal(Signal::NormalForce, vec![-0.4; rest.len()]);
    assert_eq!(findings(&rest), []);
}

#[test]
fn milliseconds_and_odd_rates_are_found() {
    refused(&log(&[(Signal::Time, 1e3)], &[]), "if time is in ms, that is 1000 Hz: --unit time_s=ms");
    doubted(&log(&[(Signal::Time, 10.0)], &[]), "time_s", "a rate of 100 Hz");
    doubted(&log(&[(Signal::Time, 0.02)], &[]), "time_s", "a rate of 50000");
    refused(&log(&[(Signal::Time, 1e-3)], &[]), "a rate of 1000000 Hz");
}

#[test]
fn one_absurd_value_is_named_with_its_line() {
    for (value, at) in [(1e308, 700), (-5e4, 3)] {
        let mut log = log(&[], &[]);
        let mut torque = log.signal(Signal::FrictionTorque).unwrap().to_vec();
        torque[at] = value;
        log.set_signal(Signal::FrictionTorque, torque);
        refused(&log, "no value of this quantity");
        refused(&log, &format!("line {}: friction_torque_nm = ", at + 1));
    }
}
