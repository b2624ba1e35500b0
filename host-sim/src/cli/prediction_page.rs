//! `report.html` of `rig predict` and `rig fit`: measured against predicted, and what is left by what it may follow.

use std::f64::consts::TAU;

use crate::files::log::ContactSignals;
use crate::report::prediction::Prediction;

/// The quantities of a contact log that a residual may follow.
pub(super) fn of_contact(signals: &ContactSignals<'_>) -> Vec<(&'static str, Vec<f64>)> {
    let mut over = vec![
        ("speed of the disc, rad/s", signals.m2_speed_rad_s.to_vec()),
        ("normal force, N", signals.normal_force_n.to_vec()),
    ];
    if let Some(angle) = signals.m2_angle_rad {
        over.push(("place on the disc, turns", angle.iter().map(|a| (a / TAU).rem_euclid(1.0)).collect()));
    }
    over.push(("time, s", signals.time_s.to_vec()));
    over
}

/// The friction torque of a contact log.
pub(super) fn friction<'a>(
    name: &str,
    signals: &'a ContactSignals<'_>,
    measured: &'a [f64],
    predicted: &'a [f64],
) -> Prediction<'a> {
    Prediction {
        name: name.to_owned(),
        quantity: "friction torque, N m",
        time_s: signals.time_s,
        measured,
        predicted,
        over: of_contact(signals),
    }
}
