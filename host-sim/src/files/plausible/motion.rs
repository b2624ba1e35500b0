//! Angle against the integral of speed, and speeds no such rig has.

use super::{Finding, quantile};
use crate::files::log::{Log, slope};
use crate::files::signal::Signal;

/// Angle and speed are compared over stretches of this length: noise and resolution average out, motion does not.
const STRETCH_S: f64 = 0.05;
/// Less motion than this says nothing, rad.
const LEAST_RAD: f64 = 0.5;
/// How far the ratio may be from one.
const TOLERANCE: f64 = 0.1;
/// Least correlation of two records of one motion.
const LEAST_CORRELATION: f64 = 0.8;
/// The fastest disc: the limits of the firmware allow 60 rad/s.
const FASTEST_RAD_S: f64 = 100.0;

/// change of angle / integral of speed, and what makes it so: the option that mends it, and the words.
const CAUSES: [(f64, &str, &str); 8] = [
    (180.0 / std::f64::consts::PI, "the angle looks like degrees", "--unit m2_angle_rad=deg"),
    (std::f64::consts::TAU / 60.0, "the speed looks like rpm", "--unit m2_speed_rad_s=rpm"),
    (std::f64::consts::PI / 180.0, "the speed looks like degrees per second", "--unit m2_speed_rad_s=deg/s"),
    (
        6.0,
        "the angle looks like degrees and the speed like rpm",
        "--unit m2_angle_rad=deg m2_speed_rad_s=rpm",
    ),
    (1.0 / std::f64::consts::TAU, "the angle looks like revolutions", "--unit m2_angle_rad=rev"),
    (std::f64::consts::TAU, "the speed looks like revolutions per second", "--unit m2_speed_rad_s=rev/s"),
    (1e-3, "the time looks like milliseconds", "--unit time_s=ms"),
    (-1.0, "one of the two has the other sign", "--unit m2_angle_rad=-rad, or m2_speed_rad_s=-rad/s"),
];

pub(super) fn findings(log: &Log) -> Vec<Finding> {
    let both = angle_against_speed(log);
    if both.is_empty() { fastest(log).into_iter().collect() } else { both }
}

fn angle_against_speed(log: &Log) -> Vec<Finding> {
    let (Some(angle), Some(speed)) = (log.signal(Signal::M2Angle), log.signal(Signal::M2Speed)) else {
        return Vec::new();
    };
    let time_s = log.time_s();
    let (mut turned, mut integral) = (Vec::new(), Vec::new());
    let (mut from, mut sum) = (0, 0.0);
    for at in 1..time_s.len() {
        sum += 0.5 * (speed[at] + speed[at - 1]) * (time_s[at] - time_s[at - 1]);
        // Of a log whose time has another unit the stretches are single steps.
        if time_s[at] - time_s[from] >= STRETCH_S {
            turned.push(angle[at] - angle[from]);
            integral.push(sum);
            (from, sum) = (at, 0.0);
        }
    }
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let total = |a: &[f64]| a.iter().map(|a| a.abs()).sum::<f64>();
    if total(&turned) < LEAST_RAD || total(&integral) < LEAST_RAD || turned.len() < 4 {
        return Vec::new();
    }
    let (tt, ti, ii) = (dot(&turned, &turned), dot(&turned, &integral), dot(&integral, &integral));
    let (ratio, correlation) = (ti / ii, ti / (tt * ii).sqrt());
    let column = Signal::M2Angle.column();
    if correlation.abs() < LEAST_CORRELATION {
        return vec![Finding::doubt(
            column,
            format!(
                "does not belong to m2_speed_rad_s: the correlation of its changes with the integral of the speed is {correlation:.2}"
            ),
        )];
    }
    if (ratio - 1.0).abs() <= TOLERANCE {
        return Vec::new();
    }
    let cause = CAUSES.iter().find(|(factor, ..)| (ratio / factor - 1.0).abs() <= TOLERANCE);
    let why = cause.map_or("its scale or that of m2_speed_rad_s is wrong".to_owned(), |(_, what, how)| {
        format!("{what}: {how}")
    });
    vec![Finding::doubt(column, format!("changes by {ratio:.4} times the integral of m2_speed_rad_s; {why}"))]
}

fn fastest(log: &Log) -> Option<Finding> {
    let time_s = log.time_s();
    let (column, speed, unit) = match (log.signal(Signal::M2Speed), log.signal(Signal::M2Angle)) {
        (Some(speed), _) => (Signal::M2Speed.column(), speed.to_vec(), "rpm"),
        (None, Some(angle)) => {
            // Over ten samples: the resolution of an encoder is no speed.
            let (time_s, angle): (Vec<f64>, Vec<f64>) =
                time_s.iter().zip(angle).step_by(10).map(|(t, a)| (*t, *a)).unzip();
            (Signal::M2Angle.column(), slope(&time_s, &angle), "deg")
        }
        (None, None) => return None,
    };
    let high = quantile(speed.iter().map(|speed| speed.abs()), 0.95);
    (high > FASTEST_RAD_S).then(|| {
        let other = if unit == "deg" { high.to_radians() } else { high * std::f64::consts::TAU / 60.0 };
        let sentence = format!(
            "the disc would turn at {high:.0} rad/s ({:.0} rpm); if the column is in {unit}, it is {other:.1} rad/s: --unit {column}={unit}",
            high * 60.0 / std::f64::consts::TAU
        );
        Finding::doubt(column, sentence)
    })
}
