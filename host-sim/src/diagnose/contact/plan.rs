//! Motion and load of a record cut into the steps of a model, ready for any number of runs.
//!
//! A bin of several samples is one step: bristles are advanced exactly for a held speed, and a wound-up
//! block hardly moves. After a change of speed or load the block of a series element winds up over a few
//! milliseconds and millimetres; there a sample is cut into pieces of `FINE_S`. Between samples speed and
//! load follow the cubic with the slopes of the neighbours. A step has the mean speed over it and the load
//! at its end, where its result belongs. Pieces are even in number, so that one ends in the bin's middle,
//! where a single sample was taken.

use super::super::record::Record;
use super::anchors;
use super::bins::Bin;

/// Step while the element winds up: a tenth of the 5 ms of an assumed block. The core's step is of second
/// order, so a few thousandths of the transient are wrong.
const FINE_S: f64 = 500e-6;
/// Step while the disc turns back: stiff bristles answer with a jump, and a ring keeps its phase for long.
const TURN_S: f64 = 60e-6;
/// Change of speed over two samples that is a turn and no noise, rad/s.
const TURN_RAD_S: f64 = 0.05;
/// Relative change of speed or load from one sample to the next that starts a fine stretch.
const CHANGE: f64 = 0.01;
/// Speed below which changes are not relative to itself but to this, m/s.
const SLOW_M_S: f64 = 5e-3;
/// Load below which changes are relative to this, N.
const LIGHT_N: f64 = 2.0;
/// A fine stretch ends when so much has been slid (several times a block's deformation) …
const WOUND_UP_M: f64 = 8e-3;
/// … and at least this long after the change.
const SETTLED_S: f64 = 0.02;
/// Speed below which the element does not wind up further, m/s.
const STANDING_M_S: f64 = 1e-4;

/// One step of the model.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Step {
    /// Length, s.
    pub length_s: f64,
    /// Disc speed, mean over the step, rad/s.
    pub speed_rad_s: f64,
    /// Disc angle at its end, rad.
    pub angle_rad: f64,
    /// Normal force at its end, N.
    pub load_n: f64,
}

/// Steps of a record.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Plan {
    /// Middle of each bin, s.
    pub time_s: Vec<f64>,
    /// Steps in each bin.
    pub counts: Vec<u16>,
    /// All steps.
    pub steps: Vec<Step>,
    /// Bins before which the element is taken anew from what the friction channel shows, N·m.
    pub anchors: Vec<(usize, f64)>,
}

impl Plan {
    /// Cuts the bins of a record into steps for inputs of its length.
    pub fn new(record: &Record, bins: &[Bin], radius_m: f64, speed_rad_s: &[f64], load_n: &[f64]) -> Self {
        let time_s = &record.time_s;
        let fine = fine_samples(record, radius_m, speed_rad_s, load_n);
        let (mut speed, mut load) = (Curve::new(time_s, speed_rad_s), Curve::new(time_s, load_n));
        let mut angle = Curve::new(time_s, &record.angle_rad);
        let mut plan = Self::default();
        let last = time_s.len().saturating_sub(1);
        // A sample stands for the time halfway to its neighbours.
        let edge = |i: usize| match i {
            0 => time_s[0],
            i if i > last => time_s[last],
            i => 0.5 * (time_s[i - 1] + time_s[i]),
        };
        for bin in bins {
            let (from_s, to_s) = (edge(bin.from), edge(bin.to));
            let span_s = to_s - from_s;
            let count = if bin.len() == 1 && fine[bin.from] {
                let longest_s = if turns(speed_rad_s, bin.from) { TURN_S } else { FINE_S };
                2 * (0.5 * span_s / longest_s).round().clamp(1.0, 32.0) as u16
            } else {
                1
            };
            let length_s = (span_s / f64::from(count)).max(1e-9);
            let mut covered = speed.area(from_s);
            for part in 0..count {
                let start_s = from_s + length_s * f64::from(part);
                let area = speed.area(start_s + length_s);
                plan.steps.push(Step {
                    length_s,
                    speed_rad_s: (area - covered) / length_s,
                    angle_rad: angle.at(start_s + length_s),
                    load_n: load.at(start_s + length_s),
                });
                covered = area;
            }
            plan.counts.push(count);
            plan.time_s.push(0.5 * (from_s + to_s));
        }
        plan.anchors = anchors::find(record, radius_m, load_n)
            .into_iter()
            .map(|(sample, shown_nm)| (bins.partition_point(|bin| bin.to <= sample), shown_nm))
            .collect();
        plan
    }
}

/// Whether the disc starts, stops or turns next to a sample.
fn turns(speed_rad_s: &[f64], at: usize) -> bool {
    let near = &speed_rad_s[at.saturating_sub(1)..(at + 2).min(speed_rad_s.len())];
    let (low, high) =
        near.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(*v), high.max(*v)));
    low <= 0.0 && high >= 0.0 && high - low > TURN_RAD_S
}

/// Samples at which an elastic element winds up.
fn fine_samples(record: &Record, radius_m: f64, speed_rad_s: &[f64], load_n: &[f64]) -> Vec<bool> {
    let mut fine = vec![true; record.len()];
    let (mut slid_m, mut since_s) = (f64::INFINITY, f64::INFINITY);
    for at in 1..record.len() {
        let span_s = record.time_s[at] - record.time_s[at - 1];
        let (v0, v1) = (radius_m * speed_rad_s[at - 1], radius_m * speed_rad_s[at]);
        let (n0, n1) = (load_n[at - 1], load_n[at]);
        let faster = (v1 - v0).abs() > CHANGE * v0.abs().max(v1.abs()).max(SLOW_M_S);
        let heavier = (n1 - n0).abs() > CHANGE * n0.max(n1).max(LIGHT_N);
        if faster || heavier {
            (slid_m, since_s) = (0.0, 0.0);
        }
        let moves = v0.abs().max(v1.abs()) > STANDING_M_S;
        fine[at] = since_s < SETTLED_S || moves && slid_m < WOUND_UP_M && since_s < 1.0;
        slid_m += 0.5 * (v0 + v1).abs() * span_s;
        since_s += span_s;
    }
    fine
}

/// A cubic through the samples with the slopes of parabolas through neighbours, asked at rising times.
struct Curve<'a> {
    time_s: &'a [f64],
    values: &'a [f64],
    slopes: Vec<f64>,
    /// Piece that was asked last, and the area up to its start.
    at: usize,
    area: f64,
}

impl<'a> Curve<'a> {
    fn new(time_s: &'a [f64], values: &'a [f64]) -> Self {
        Self { time_s, values, slopes: crate::files::log::slope(time_s, values), at: 1, area: 0.0 }
    }

    /// c0 + c1 s + c2 s² + c3 s³ of the piece that ends at sample `at`, and its length.
    fn piece(&self, at: usize) -> ([f64; 4], f64) {
        let span_s = self.time_s[at] - self.time_s[at - 1];
        let (x0, x1) = (self.values[at - 1], self.values[at]);
        let (d0, d1) = (span_s * self.slopes[at - 1], span_s * self.slopes[at]);
        ([x0, d0, 3.0 * (x1 - x0) - 2.0 * d0 - d1, 2.0 * (x0 - x1) + d0 + d1], span_s)
    }

    fn area_of([a, b, c, d]: [f64; 4], s: f64) -> f64 {
        s * (a + s * (b / 2.0 + s * (c / 3.0 + s * d / 4.0)))
    }

    /// Moves on to the piece that holds a time.
    fn seek(&mut self, time_s: f64) {
        while self.at + 1 < self.time_s.len() && self.time_s[self.at] < time_s {
            let (piece, span_s) = self.piece(self.at);
            self.area += span_s * Self::area_of(piece, 1.0);
            self.at += 1;
        }
    }

    /// Integral from the first sample.
    fn area(&mut self, time_s: f64) -> f64 {
        self.seek(time_s);
        let (piece, span_s) = self.piece(self.at);
        self.area + span_s * Self::area_of(piece, (time_s - self.time_s[self.at - 1]) / span_s)
    }

    fn at(&mut self, time_s: f64) -> f64 {
        self.seek(time_s);
        let ([a, b, c, d], span_s) = self.piece(self.at);
        let s = (time_s - self.time_s[self.at - 1]) / span_s;
        a + s * (b + s * (c + s * d))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn areas_and_values_of_a_parabola_are_exact() {
        let time_s: Vec<f64> = (0..50).map(|i| 0.1 * f64::from(i) + 0.003 * f64::from(i % 3)).collect();
        let values: Vec<f64> = time_s.iter().map(|t| 3.0 * t * t - 2.0 * t + 1.0).collect();
        let mut curve = Curve::new(&time_s, &values);
        for k in 0..400 {
            let t = 0.012 * f64::from(k);
            assert!((curve.area(t) - (t * t * t - t * t + t)).abs() < 1e-9);
            assert!((curve.at(t) - (3.0 * t * t - 2.0 * t + 1.0)).abs() < 1e-9);
        }
    }
}
