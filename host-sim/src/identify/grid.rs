//! A log brought to an even time grid of 1 ms or more.
//!
//! The filters of a balance and the observer of the slip want even steps. Logs that are faster than 1 kHz are averaged over whole
//! groups of samples (nothing that is identified here is faster than the groups); slower ones are taken as they are, since what
//! an interpolation puts between samples is wrong wherever slip begins or a load steps. Unevenly sampled ones are
//! interpolated by cubics through the samples, at their usual rate. Points of the grid that lie in a gap are marked and not used.

use super::noise;
use crate::files::log::{median_step, slope};

/// Samples that are closer are averaged up to this, s: the fastest of the effects, a ringing bridge, needs a few points a period.
pub const STEP_S: f64 = 1e-3;
/// A distance between samples of more than so many median steps is a gap.
const GAP_STEPS: f64 = 4.0;

/// How samples are brought to the grid.
#[derive(Debug, Clone)]
pub struct Grid {
    /// Step, s.
    pub step_s: f64,
    /// Time since the log's first sample, s.
    pub time_s: Vec<f64>,
    /// Whether a point lies between samples and not in a gap.
    pub covered: Vec<bool>,
    /// Time of the log's first sample, s.
    pub start_s: f64,
    way: Way,
}

#[derive(Debug, Clone)]
enum Way {
    Copy,
    Mean(usize),
    /// Interval and the place in it, from 0 to 1.
    Between(Vec<(usize, f64)>),
}

impl Grid {
    /// The grid for these time stamps, which rise.
    pub fn new(time_s: &[f64]) -> Self {
        let start_s = time_s.first().copied().unwrap_or(0.0);
        let median = median_step(time_s).unwrap_or(STEP_S);
        let group = (STEP_S / median + 0.25).floor().max(1.0) as usize;
        let step_s = median * group as f64;
        // Rounded time stamps (three to six decimals) are even.
        let even = time_s.windows(2).all(|t| ((t[1] - t[0]) - median).abs() < 0.02 * median);
        if even {
            let n = time_s.len() / group;
            let centre = 0.5 * (group - 1) as f64 * median;
            let time_s = (0..n).map(|i| i as f64 * step_s + centre).collect();
            let way = if group == 1 { Way::Copy } else { Way::Mean(group) };
            return Self { step_s, time_s, covered: vec![true; n], start_s, way };
        }
        let last_s = time_s.last().copied().unwrap_or(0.0) - start_s;
        let n = if time_s.len() < 2 { 0 } else { (last_s / step_s + 1e-6).floor() as usize + 1 };
        let mut at = 0;
        let (mut places, mut covered, mut grid) = (Vec::new(), Vec::new(), Vec::new());
        for i in 0..n {
            let t = start_s + i as f64 * step_s;
            while at + 2 < time_s.len() && time_s[at + 1] <= t {
                at += 1;
            }
            let span = time_s[at + 1] - time_s[at];
            places.push((at, ((t - time_s[at]) / span).clamp(0.0, 1.0)));
            covered.push(span <= GAP_STEPS * median.max(step_s));
            grid.push(i as f64 * step_s);
        }
        Self { step_s, time_s: grid, covered, start_s, way: Way::Between(places) }
    }

    /// Points of the grid.
    pub fn len(&self) -> usize {
        self.time_s.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.time_s.is_empty()
    }

    /// A channel on the grid; `time_s` are the log's time stamps.
    pub fn channel(&self, time_s: &[f64], values: &[f64]) -> Vec<f64> {
        match &self.way {
            Way::Copy => values[..self.len()].to_vec(),
            Way::Mean(group) => {
                values.chunks_exact(*group).map(|chunk| chunk.iter().sum::<f64>() / *group as f64).collect()
            }
            Way::Between(places) => {
                let slopes = slope(time_s, values);
                places
                    .iter()
                    .map(|&(i, s)| {
                        let span = time_s[i + 1] - time_s[i];
                        let (a, b) = (values[i], values[i + 1]);
                        let (da, db) = (span * slopes[i], span * slopes[i + 1]);
                        let (c2, c3) = (3.0 * (b - a) - 2.0 * da - db, 2.0 * (a - b) + da + db);
                        a + s * (da + s * (c2 + s * c3))
                    })
                    .collect()
            }
        }
    }

    /// Standard deviation of a bridge's noise on the grid.
    pub fn noise(&self, values_on_grid: &[f64], values: &[f64]) -> f64 {
        match &self.way {
            Way::Between(_) => noise::bridge_deviation(values),
            _ => noise::bridge_deviation(values_on_grid),
        }
    }

    /// Points of the grid that touch a marked sample of the log.
    pub fn touched(&self, marked: &[bool]) -> Vec<bool> {
        match &self.way {
            Way::Copy => marked[..self.len()].to_vec(),
            Way::Mean(group) => marked.chunks_exact(*group).map(|chunk| chunk.iter().any(|m| *m)).collect(),
            Way::Between(places) => places.iter().map(|&(i, _)| marked[i] || marked[i + 1]).collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fast_logs_are_averaged_slow_ones_taken_as_they_are_uneven_ones_interpolated_and_gaps_marked() {
        let at = |rate: f64, n: usize| (0..n).map(|i| i as f64 / rate).collect::<Vec<f64>>();
        let fast = Grid::new(&at(10_000.0, 1000));
        assert_eq!(fast.len(), 100);
        assert!((fast.step_s - 1e-3).abs() < 1e-12);
        let slow_time = at(200.0, 100);
        let slow = Grid::new(&slow_time);
        assert!((slow.step_s - 5e-3).abs() < 1e-12);
        assert_eq!(slow.channel(&slow_time, &slow_time), slow_time);
        let uneven_time: Vec<f64> =
            (0..100).map(|i| 2e-3 * (f64::from(i) + 0.3 * f64::from(i % 2))).collect();
        let uneven = Grid::new(&uneven_time);
        let line: Vec<f64> = uneven_time.iter().map(|t| 3.0 * t - 1.0).collect();
        for (t, x) in uneven.time_s.iter().zip(uneven.channel(&uneven_time, &line)) {
            assert!((x - (3.0 * t - 1.0)).abs() < 1e-12);
        }
        let mut gap = at(1000.0, 500);
        gap.drain(100..150);
        let grid = Grid::new(&gap);
        assert_eq!(grid.len(), 500);
        assert_eq!(grid.covered.iter().filter(|c| !**c).count(), 51);
    }
}
