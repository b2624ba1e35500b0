//! What effects live over, from the measured channels: heat, distance slid, load, direction.

use crate::identify::contact::log::ContactLog;
use crate::identify::filters::rms;

/// Times over which heat is held, s: from within a slide to longer than a log.
pub const HEAT_TIMES_S: [f64; 3] = [1.5, 15.0, 50.0];

/// Name of the time within a log, with its unit, among what may be followed.
pub const TIME: &str = "time, s";

/// Coordinates of a log.
#[derive(Debug, Clone)]
pub struct Coordinates {
    /// Dissipated power, W.
    pub power_w: Vec<f64>,
    /// Heat held for each of [`HEAT_TIMES_S`], J.
    pub heat_j: [Vec<f64>; 3],
    /// Distance slid, m.
    pub distance_m: Vec<f64>,
    /// Direction of sliding, −1 to 1.
    pub direction: Vec<f64>,
    /// ln of speed over its usual value, within ±3.
    pub log_speed: Vec<f64>,
    /// ln of load over its usual value.
    pub log_load: Vec<f64>,
    /// Time over the longest log's length.
    pub time: Vec<f64>,
}

/// Largest values in the training logs.
#[derive(Debug, Clone)]
pub struct Scales {
    /// Heat, J.
    pub heat_j: [f64; 3],
    /// Distance, m.
    pub distance_m: f64,
    /// Distance slid in all of them, m.
    pub slid_m: f64,
    /// Length, s.
    pub time_s: f64,
    /// Usual load, N: the root of the mean square.
    pub load_n: f64,
    /// Usual speed, m/s.
    pub speed_m_s: f64,
    /// Usual friction torque, N m.
    pub torque_nm: f64,
    /// Range of the disc's angle, rad.
    pub turned_rad: f64,
}

/// First-order response that falls to 1/e in `time_s`, of an input held over each step.
pub fn held(input: &[f64], step_s: f64, time_s: f64) -> Vec<f64> {
    let kept = (-step_s / time_s).exp();
    let mut level = 0.0;
    input
        .iter()
        .map(|x| {
            level = kept * level + (1.0 - kept) * time_s * x;
            level
        })
        .collect()
}

fn power(log: &ContactLog) -> Vec<f64> {
    log.smooth_nm.iter().zip(&log.root_speed_m_s).map(|(t, v)| (t / log.radius_m * v).abs()).collect()
}

impl Scales {
    /// Of the training logs.
    pub fn new(logs: &[ContactLog]) -> Self {
        let largest = |of: &dyn Fn(&ContactLog) -> f64| logs.iter().map(of).fold(1e-12, f64::max);
        let usual =
            |of: &dyn Fn(&ContactLog) -> f64| rms(&logs.iter().map(of).collect::<Vec<_>>()).max(1e-12);
        let end = |values: Vec<f64>| values.into_iter().fold(0.0, f64::max);
        let slid =
            |log: &ContactLog| log.root_speed_m_s.iter().map(|v| v.abs() * log.grid.step_s).sum::<f64>();
        Self {
            heat_j: HEAT_TIMES_S
                .map(|time_s| largest(&|log| end(held(&power(log), log.grid.step_s, time_s)))),
            distance_m: largest(&slid),
            slid_m: logs.iter().map(slid).sum(),
            time_s: largest(&|log| log.grid.time_s.last().copied().unwrap_or(0.0)),
            load_n: usual(&|log| rms(&log.load_n)),
            speed_m_s: usual(&|log| rms(&log.root_speed_m_s)),
            torque_nm: usual(&|log| rms(&log.friction_nm)),
            turned_rad: largest(&|log| {
                let (least, most) = (f64::INFINITY, f64::NEG_INFINITY);
                let ends = log.angle_rad.iter().fold((least, most), |(a, b), x| (a.min(*x), b.max(*x)));
                ends.1 - ends.0
            }),
        }
    }
}

impl Coordinates {
    /// Of a log.
    pub fn new(log: &ContactLog, scales: &Scales) -> Self {
        let power_w = power(log);
        let speed = &log.root_speed_m_s;
        let mut distance = 0.0;
        Self {
            heat_j: HEAT_TIMES_S.map(|time_s| held(&power_w, log.grid.step_s, time_s)),
            distance_m: speed
                .iter()
                .map(|v| {
                    distance += v.abs() * log.grid.step_s;
                    distance
                })
                .collect(),
            // Below a hundredth of the usual speed the direction is not known.
            direction: speed.iter().map(|v| (v / (0.01 * scales.speed_m_s)).tanh()).collect(),
            log_speed: speed
                .iter()
                .map(|v| (v.abs() / (0.3 * scales.speed_m_s) + 1e-9).ln().clamp(-3.0, 3.0) / 3.0)
                .collect(),
            log_load: log.load_n.iter().map(|n| (n.max(0.03 * scales.load_n) / scales.load_n).ln()).collect(),
            time: log.grid.time_s.iter().map(|t| t / scales.time_s).collect(),
            power_w,
        }
    }
}

/// Rises from 0 to 1 over the coordinate's largest value, the faster the smaller `bend`: straight for a large one.
pub fn saturating(coordinate: &[f64], largest: f64, bend: f64) -> Vec<f64> {
    let end = 1.0 - (-1.0 / bend).exp();
    coordinate.iter().map(|x| (1.0 - (-x / (bend * largest)).exp()) / end).collect()
}
