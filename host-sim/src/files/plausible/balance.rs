//! Friction against load, load against the motor that presses, torque against acceleration.

use super::{Finding, quantile};
use crate::files::log::{Log, slope};
use crate::files::rig_file::RigFile;
use crate::files::signal::Signal;
use crate::input_error::InputError;

/// Friction torque over normal force is coefficient times radius: metres that a laboratory rig can have.
const RATIO_M: std::ops::RangeInclusive<f64> = 2e-4..=2.0;
/// Shares of the largest value above which a sample counts.
const LOADED: f64 = 0.3;
/// A disc that never turns faster is at rest.
const LEAST_RAD_S: f64 = 0.05;
/// A friction torque that never rises higher is a sensor's zero.
const LEAST_NM: f64 = 0.1;
/// So is a force.
const LEAST_N: f64 = 2.0;
/// How near an inertia must come to the rig's in another unit of the angle to be taken for it.
const INERTIA_TOLERANCE: f64 = 0.2;

pub(super) fn findings(log: &Log) -> Vec<Finding> {
    [contact(log), inertia(log).into_iter().collect()].concat()
}

fn contact(log: &Log) -> Vec<Finding> {
    let (Some(normal), Some(friction)) =
        (log.signal(Signal::NormalForce), log.signal(Signal::FrictionTorque))
    else {
        return Vec::new();
    };
    let Some(speed) = speed(log) else { return Vec::new() };
    let largest = |values: &[f64]| quantile(values.iter().map(|value| value.abs()), 0.99);
    let (most_n, most_nm, most_rad_s) = (largest(normal), largest(friction), largest(&speed));
    // At rest there is no friction to compare with, and elements that are lifted show their sensors' zeros alone.
    if most_n <= 0.0 || most_nm < LEAST_NM || most_rad_s < LEAST_RAD_S {
        return Vec::new();
    }
    let sliding: Vec<Sliding> = (0..normal.len())
        .map(|k| Sliding { normal_n: normal[k], friction_nm: friction[k], speed_rad_s: speed[k] })
        .filter(|s| s.normal_n.abs() > LOADED * most_n && s.friction_nm.abs() > LOADED * most_nm)
        .filter(|s| s.speed_rad_s.abs() > LOADED * most_rad_s)
        .collect();
    if sliding.len() < 20 {
        return Vec::new();
    }
    let force_n = quantile(sliding.iter().map(|s| s.normal_n), 0.5);
    if quantile(sliding.iter().map(|s| s.normal_n), 0.9) < 0.0 && force_n < -LEAST_N {
        return vec![Finding::Impossible(
            InputError::new(format!(
                "is negative while the elements rub (median {force_n:.4} N where friction acts); > 0 presses"
            ))
            .key(Signal::NormalForce.column())
            .allowed("--unit normal_force_n=-N where the sensor counts the other way"),
        )];
    }
    [scale(log, &sliding, force_n), direction(&sliding)].into_iter().flatten().collect()
}

/// A sample in which the disc turns under load.
struct Sliding {
    normal_n: f64,
    friction_nm: f64,
    speed_rad_s: f64,
}

fn speed(log: &Log) -> Option<Vec<f64>> {
    match (log.signal(Signal::M2Speed), log.signal(Signal::M2Angle)) {
        (Some(speed), _) => Some(speed.to_vec()),
        (None, Some(angle)) => Some(slope(log.time_s(), angle)),
        (None, None) => None,
    }
}

/// A thousand in between is a prefix of a unit.
fn scale(log: &Log, sliding: &[Sliding], force_n: f64) -> Option<Finding> {
    let ratio_m = quantile(sliding.iter().map(|s| (s.friction_nm / s.normal_n).abs()), 0.5);
    if RATIO_M.contains(&ratio_m) {
        return None;
    }
    let coefficient = format!(
        "friction torque over normal force is {ratio_m:.3e} m, which is coefficient times radius: at 0.06 m a coefficient of {:.3}",
        ratio_m / 0.06
    );
    // The motor that presses tells which of the two is wrong: a lever gives some 10 N per N·m, not 0.01.
    let per_torque = log
        .signal(Signal::M1Torque)
        .map(|m1| force_n / quantile(m1.iter().map(|torque| torque.abs()), 0.9).max(1e-9));
    let (column, hint) = match (ratio_m > *RATIO_M.end(), per_torque) {
        (true, Some(gain)) if gain > 0.5 => {
            (Signal::FrictionTorque, "the torque looks like mN·m: --unit friction_torque_nm=mNm".to_owned())
        }
        (true, _) => {
            let gain = per_torque.map_or(String::new(), |gain| format!(" ({gain:.3} N per N·m of M1)"));
            (Signal::NormalForce, format!("the force looks like kN{gain}: --unit normal_force_n=kN"))
        }
        (false, _) => (
            Signal::NormalForce,
            "the force looks like mN or the torque like kN·m: --unit normal_force_n=mN".to_owned(),
        ),
    };
    Some(Finding::doubt(column.column(), format!("{coefficient}; {hint}")))
}

/// Friction that drives.
fn direction(sliding: &[Sliding]) -> Option<Finding> {
    let power = sliding.iter().map(|s| s.speed_rad_s * s.friction_nm);
    (quantile(power, 0.9) < 0.0).then(|| {
        let sentence =
            "drives the disc in nine samples of ten; friction that resists m2_speed_rad_s > 0 is > 0: \
            --unit friction_torque_nm=-Nm, or the speed's sign"
                .to_owned();
        Finding::doubt(Signal::FrictionTorque.column(), sentence)
    })
}

/// The inertia that torque and acceleration show, where it is the assumed rig's in another unit of the angle.
fn inertia(log: &Log) -> Option<Finding> {
    let torque = log.signal(Signal::M2Torque)?;
    let time_s = log.time_s();
    let (column, speed) = match (log.signal(Signal::M2Speed), log.signal(Signal::M2Angle)) {
        (Some(speed), _) => (Signal::M2Speed.column(), speed.to_vec()),
        (None, Some(angle)) => (Signal::M2Angle.column(), slope(time_s, angle)),
        (None, None) => return None,
    };
    let friction = log.signal(Signal::FrictionTorque);
    // Momentum over stretches: net torque times time against change of speed.
    let (mut changes, mut impulses) = (Vec::new(), Vec::new());
    let (mut from, mut impulse) = (0, 0.0);
    for at in 1..time_s.len() {
        let net = torque[at] - friction.map_or(0.0, |friction| friction[at]);
        impulse += net * (time_s[at] - time_s[at - 1]);
        if time_s[at] - time_s[from] >= 0.05 {
            changes.push(speed[at] - speed[from]);
            impulses.push(impulse);
            (from, impulse) = (at, 0.0);
        }
    }
    // The bearing's friction is in every stretch alike: only what changes with the speed's change counts.
    let centred = |values: Vec<f64>| {
        let mean = values.iter().sum::<f64>() / values.len().max(1) as f64;
        values.into_iter().map(|value| value - mean).collect::<Vec<f64>>()
    };
    let (changes, impulses) = (centred(changes), centred(impulses));
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let (cc, ci, ii) = (dot(&changes, &changes), dot(&changes, &impulses), dot(&impulses, &impulses));
    if cc <= 0.0 || ii <= 0.0 || ci / (cc * ii).sqrt() < 0.9 {
        return None;
    }
    let (shown, assumed) = (ci / cc, RigFile::assumed_rig(&[]).ok()?.m2_inertia_kg_m2);
    let (unit, factor) = [("rpm", 60.0 / std::f64::consts::TAU), ("deg", 180.0 / std::f64::consts::PI)]
        .into_iter()
        .find(|(_, factor)| (shown * factor / assumed - 1.0).abs() < INERTIA_TOLERANCE)?;
    let unit = match (column == Signal::M2Speed.column(), unit) {
        (true, "deg") => "deg/s",
        (false, "rpm") => return None,
        (_, unit) => unit,
    };
    let sentence = format!(
        "torque over acceleration is {shown:.2e} kg m², {factor:.1} times less than the assumed rig's {assumed:.2e}: \
         the column looks like {unit}: --unit {column}={unit}"
    );
    Some(Finding::doubt(column, sentence))
}
