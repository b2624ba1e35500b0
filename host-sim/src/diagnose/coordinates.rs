//! What a residual is looked at over: quantities of a log's motion and load at any time.
//!
//! From the log alone, without a model: speed is the smoothed column, or the slope of the smoothed position; sliding distance,
//! dissipated energy (of the measured friction or effort) and heat (the same, forgotten with a time constant of
//! `COOLING_S`) start at zero in each log; dwell is the rest before the last breakaway and counts for
//! `FRESH_S` of motion. Quantities of which a log knows nothing are left out.

use super::smooth;
use crate::files::log::{Log, LogKind};
use crate::files::signal::Signal;

/// Time constant of the heat.
const COOLING_S: f64 = 5.0;
/// How long a breakaway is fresh.
const FRESH_S: f64 = 0.15;
/// A shorter rest is noise around zero speed.
const LEAST_REST_S: f64 = 0.05;
/// Samples a second are enough for what a residual is sorted by.
const RATE_HZ: f64 = 500.0;
/// Share of the typical speed below which a drive rests.
const REST_SHARE: f64 = 0.01;
/// Share of samples at which an even signal bends.
const EVEN_SHARE: f64 = 0.05;
/// Bend that counts as rounding, of the largest step.
const ROUNDING: f64 = 1e-6;

/// A quantity over time.
#[derive(Debug, Clone, PartialEq)]
pub struct Coordinate {
    /// Name with unit, for sentences: "speed, rad/s".
    pub name: &'static str,
    /// Unit.
    pub unit: &'static str,
    /// Value at each time; NaN where it does not apply.
    pub values: Vec<f64>,
    /// Each log has an origin of its own: bins are not shared between logs.
    pub own_origin: bool,
}

/// All quantities of a log.
#[derive(Debug, Clone, PartialEq)]
pub struct Coordinates {
    start_s: f64,
    /// Time from the log's start, s.
    pub time_s: Vec<f64>,
    /// −1, 0, 1.
    pub direction: Vec<f64>,
    /// Load that friction is proportional to: normal force, or 1.
    pub load: Vec<f64>,
    /// The quantities.
    pub list: Vec<Coordinate>,
}

impl Coordinates {
    /// From a log that was checked.
    pub fn new(log: &Log) -> Self {
        let kind = log.kind().unwrap_or(LogKind::RotaryDrive);
        let time = log.time_s();
        let start_s = time.first().copied().unwrap_or(0.0);
        let span_s = time.last().copied().unwrap_or(0.0) - start_s;
        let every = ((time.len() as f64 / span_s.max(1e-9)) / RATE_HZ).ceil().max(1.0) as usize;
        let thin = |values: &[f64]| -> Vec<f64> {
            values.chunks(every).map(|c| c.iter().sum::<f64>() / c.len() as f64).collect()
        };
        let time_s: Vec<f64> = thin(time).iter().map(|t| t - start_s).collect();
        let linear = kind == LogKind::LinearDrive;
        let signal = |signal: Signal| log.signal(signal).map(thin);
        let position = signal(if linear { Signal::Position } else { Signal::M2Angle });
        let speed = match (&position, signal(Signal::M2Speed)) {
            // Noise of a speed column would end every rest.
            (_, Some(speed)) => smooth::signal(&speed, noise_of(&speed)).values,
            (Some(position), None) => smooth::slope(&time_s, position, noise_of(position)).values,
            (None, None) => vec![0.0; time_s.len()],
        };
        let typical = quantile(&speed.iter().map(|v| v.abs()).collect::<Vec<_>>(), 0.9);
        let rest = REST_SHARE * typical;
        let direction: Vec<f64> =
            speed.iter().map(|v| if v.abs() > rest { v.signum() } else { 0.0 }).collect();
        let normal = signal(Signal::NormalForce);
        let effort = signal(if linear { Signal::Force } else { Signal::M2Torque });
        let dissipating = signal(Signal::FrictionTorque).or_else(|| effort.clone());
        let load = normal.clone().unwrap_or_else(|| vec![1.0; time_s.len()]);
        let mut made = Self { start_s, time_s, direction, load, list: Vec::new() };
        made.push("time", "s", made.time_s.clone(), true);
        made.push("speed", if linear { "m/s" } else { "rad/s" }, speed.clone(), false);
        if let Some(normal) = normal {
            made.push("normal force", "N", normal, false);
        }
        if let Some(position) = &position {
            let turn = if linear { f64::INFINITY } else { std::f64::consts::TAU };
            let wrapped =
                position.iter().map(|q| if turn.is_finite() { q.rem_euclid(turn) } else { *q }).collect();
            let (name, unit) = if linear { ("position", "m") } else { ("disc angle", "rad") };
            made.push(name, unit, wrapped, true);
        }
        made.push("direction", "", made.direction.clone(), false);
        let slid = made.integral(&speed.iter().map(|v| v.abs()).collect::<Vec<_>>(), f64::INFINITY);
        made.push("sliding distance", if linear { "m" } else { "rad" }, slid, false);
        if let Some(force) = &dissipating {
            let power: Vec<f64> = force.iter().zip(&speed).map(|(f, v)| (f * v).abs()).collect();
            let energy = made.integral(&power, f64::INFINITY);
            made.push("dissipated energy", "J", energy, false);
            let heat = made.integral(&power, COOLING_S);
            made.push("heat", "J", heat, false);
        }
        let (dwell, since) = made.rests(&speed);
        made.push("dwell", "s", dwell, false);
        made.push("travel since reversal", if linear { "m" } else { "rad" }, since, false);
        let acceleration =
            smooth::slope(&made.time_s, &speed, super::noise::standard_deviation(&speed)).values;
        made.push("acceleration", if linear { "m/s²" } else { "rad/s²" }, acceleration, false);
        if let Some(effort) = effort {
            made.push(
                if linear { "force" } else { "M2 torque" },
                if linear { "N" } else { "N m" },
                effort,
                false,
            );
        }
        if let Some(torque) = signal(Signal::M1Torque) {
            made.push("M1 torque", "N m", torque, false);
        }
        made
    }

    fn push(&mut self, name: &'static str, unit: &'static str, values: Vec<f64>, own_origin: bool) {
        self.list.push(Coordinate { name, unit, values, own_origin });
    }

    fn integral(&self, rate: &[f64], forget_s: f64) -> Vec<f64> {
        let mut sum = 0.0;
        (0..rate.len())
            .map(|i| {
                if i > 0 {
                    let step_s = self.time_s[i] - self.time_s[i - 1];
                    sum = sum * (-step_s / forget_s).exp() + 0.5 * (rate[i] + rate[i - 1]) * step_s;
                }
                sum
            })
            .collect()
    }

    /// Rest before the last breakaway while that is fresh, and travel since the last reversal.
    fn rests(&self, speed: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let (mut rest_from, mut dwell, mut moving_from) = (Some(0.0), f64::NAN, 0.0);
        let (mut last, mut travel) = (0.0, 0.0);
        let mut dwells = Vec::with_capacity(speed.len());
        let mut travels = Vec::with_capacity(speed.len());
        for (i, direction) in self.direction.iter().enumerate() {
            let now = self.time_s[i];
            if *direction == 0.0 {
                rest_from = rest_from.or(Some(now));
                dwells.push(f64::NAN);
            } else {
                if let Some(from) = rest_from.take().filter(|from| now - from > LEAST_REST_S) {
                    (dwell, moving_from) = (now - from, now);
                }
                dwells.push(if now - moving_from < FRESH_S { dwell } else { f64::NAN });
                if *direction != last {
                    (last, travel) = (*direction, 0.0);
                }
            }
            if i > 0 {
                travel += speed[i].abs() * (now - self.time_s[i - 1]);
            }
            travels.push(travel);
        }
        (dwells, travels)
    }

    /// Index of the sample nearest to each time. Channels may count time from the log's start or as the log does.
    pub fn at(&self, times: &[f64]) -> Vec<usize> {
        let last = self.time_s.len().saturating_sub(1);
        let end = self.time_s.last().copied().unwrap_or(0.0);
        let absolute =
            times.last().is_some_and(|t| *t > end + 1e-6) || times.first().is_some_and(|t| *t < 0.0);
        let shift = if absolute { self.start_s } else { 0.0 };
        let mut at = 0;
        times
            .iter()
            .map(|t| {
                while at < last && self.time_s[at] < t - shift {
                    at += 1;
                }
                at
            })
            .collect()
    }
}

/// Standard deviation of a signal's noise. One that goes on evenly but for a few samples has none: what it changes by
/// from sample to sample is its course and not its resolution.
fn noise_of(values: &[f64]) -> f64 {
    let largest = values.windows(2).map(|w| (w[1] - w[0]).abs()).fold(0.0, f64::max);
    let bent = |w: &&[f64]| (w[2] - 2.0 * w[1] + w[0]).abs() > ROUNDING * largest;
    let bends = values.windows(3).filter(bent).count();
    if (bends as f64) < EVEN_SHARE * values.len() as f64 {
        return 0.0;
    }
    super::noise::standard_deviation(values)
}

/// A quantile of values; NaN are left out.
pub fn quantile(values: &[f64], share: f64) -> f64 {
    let mut known: Vec<f64> = values.iter().copied().filter(|x| x.is_finite()).collect();
    if known.is_empty() {
        return 0.0;
    }
    let rank = (share * (known.len() - 1) as f64).round() as usize;
    *known.select_nth_unstable_by(rank, f64::total_cmp).1
}

#[cfg(test)]
mod tests {
    use super::super::noise::tests::white;
    use super::*;

    /// Rests of a drive between its movements, s: (start, length).
    const RESTS: [(f64, f64); 3] = [(1.0, 0.1), (2.1, 0.5), (3.6, 2.0)];
    const END_S: f64 = 7.0;

    /// Speed of a drive that moves with 1 rad/s one way, then the other, and rests between.
    fn resting(t: f64) -> f64 {
        let rests = RESTS.iter().any(|(from, length)| (*from..from + length).contains(&t));
        let done = RESTS.iter().filter(|(from, _)| *from <= t).count();
        match (rests, done % 2) {
            (true, _) => 0.0,
            (false, 0) => 1.0,
            (false, _) => -1.0,
        }
    }

    /// Its log: noise of angle and speed as standard deviations, where there are such columns.
    fn log_of(rate_hz: f64, angle_noise: Option<f64>, speed_noise: Option<f64>) -> Log {
        let count = (END_S * rate_hz) as usize;
        let time: Vec<f64> = (0..count).map(|i| i as f64 / rate_hz).collect();
        let speed: Vec<f64> = time.iter().map(|t| resting(*t)).collect();
        let mut angle = 0.0;
        let angles: Vec<f64> = speed
            .iter()
            .map(|v| {
                angle += v / rate_hz;
                angle
            })
            .collect();
        let noisy = |values: &[f64], std: f64, seed: u64| -> Vec<f64> {
            values.iter().zip(white(count, seed)).map(|(x, e)| x + std * e).collect()
        };
        let mut log = Log::default();
        log.set_signal(Signal::M2Torque, speed.iter().map(|v| 0.3 * v).collect());
        if let Some(std) = angle_noise {
            log.set_signal(Signal::M2Angle, noisy(&angles, std, 5));
        }
        if let Some(std) = speed_noise {
            log.set_signal(Signal::M2Speed, noisy(&speed, std, 6));
        }
        log.set_signal(Signal::Time, time);
        log
    }

    /// The view holds each rest's length for as long as the breakaway after it is fresh, and nothing elsewhere.
    #[track_caller]
    fn dwells_are_seen(log: &Log) {
        let coordinates = Coordinates::new(log);
        let dwell = &coordinates.list.iter().find(|c| c.name == "dwell").unwrap().values;
        // Smoothing and the threshold of speed shift both ends of a rest by some samples.
        const NEAR_S: f64 = 0.02;
        for (t, value) in coordinates.time_s.iter().zip(dwell) {
            let after = RESTS.iter().find(|(from, length)| {
                let since = t - from - length;
                since > NEAR_S && since < FRESH_S - NEAR_S
            });
            let around = RESTS.iter().any(|(from, length)| {
                let since = t - from - length;
                (-NEAR_S..FRESH_S + NEAR_S).contains(&since)
            });
            match after {
                Some((_, length)) => assert!((value - length).abs() < NEAR_S, "{t}: {value} of {length}"),
                None => assert!(around || value.is_nan(), "{t}: {value}"),
            }
        }
    }

    #[test]
    fn the_rest_before_a_breakaway_is_seen_from_an_encoders_angle() {
        // Two counts of 480 000 a turn.
        dwells_are_seen(&log_of(1000.0, Some(2.6e-5), None));
        dwells_are_seen(&log_of(5000.0, Some(2.6e-5), None));
    }

    #[test]
    fn the_rest_before_a_breakaway_is_seen_from_an_angle_without_noise() {
        dwells_are_seen(&log_of(1000.0, Some(0.0), None));
        dwells_are_seen(&log_of(500.0, Some(0.0), None));
    }

    #[test]
    fn the_rest_before_a_breakaway_is_seen_from_a_speed_with_and_without_noise() {
        // The noise is at times above the threshold of rest.
        dwells_are_seen(&log_of(1000.0, None, Some(0.01)));
        dwells_are_seen(&log_of(1000.0, Some(2.6e-5), Some(0.01)));
        dwells_are_seen(&log_of(1000.0, None, Some(0.0)));
    }

    #[test]
    fn a_drive_that_never_rests_has_no_dwell() {
        let mut log = log_of(1000.0, None, None);
        let angle: Vec<f64> = log.time_s().iter().map(|t| (2.0 * t).sin()).collect();
        log.set_signal(Signal::M2Angle, angle);
        let coordinates = Coordinates::new(&log);
        let dwell = coordinates.list.iter().find(|c| c.name == "dwell").unwrap();
        assert!(dwell.values.iter().all(|value| value.is_nan()));
    }

    #[test]
    fn a_quantile_leaves_out_what_is_not_known() {
        assert_eq!(quantile(&[3.0, f64::NAN, 1.0, 2.0], 0.5), 2.0);
        assert_eq!(quantile(&[f64::NAN], 0.5), 0.0);
    }
}
