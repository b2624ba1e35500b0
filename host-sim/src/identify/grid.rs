//! A log brought to an even time grid of about 1 ms.
//!
//! The filters of a balance and the observer of the slip want even steps. Faster logs are averaged over whole groups of
//! samples (nothing that is identified here is faster than the groups); slower or unevenly sampled ones are
//! interpolated by cubics through the samples, and what the grid then shows too often is taken back in the effective
//! sample size. Points of the grid that lie in a gap are marked and not used.

use super::noise;
use crate::files::log::slope;

/// The step that is aimed at, s: the fastest of the effects, a ringing bridge, needs a few samples a period.
pub const STEP_S: f64 = 1e-3;
/// A distance between samples of more than so many median steps is a gap.
const GAP_STEPS: f64 = 4.0;

/// Samples for each point of the grid from which on they are about as close as its points.
const LEAST_DENSITY: f64 = 0.8;

/// How samples are brought to the grid.
#[derive(Debug, Clone)]
pub struct Grid {
    /// Step, s.
    pub step_s: f64,
    /// Time since the log's first sample, s.
    pub time_s: Vec<f64>,
    /// Whether a point lies between samples and not in a gap.
    pub covered: Vec<bool>,
    /// Samples of the log for each point of the grid, at most 1.
    pub density: f64,
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
        let mut steps: Vec<f64> = time_s.windows(2).map(|t| t[1] - t[0]).collect();
        let median = if steps.is_empty() {
            STEP_S
        } else {
            let m = steps.len() / 2;
            *steps.select_nth_unstable_by(m, f64::total_cmp).1
        };
        let group = (STEP_S / median + 0.25).floor().max(1.0) as usize;
        let parts = (median / STEP_S - 0.25).ceil().max(1.0);
        let step_s = median * group as f64 / parts;
        // Rounded time stamps (three to six decimals) are even.
        let even = time_s.windows(2).all(|t| ((t[1] - t[0]) - median).abs() < 0.02 * median);
        if even && parts == 1.0 {
            let n = time_s.len() / group;
            let centre = 0.5 * (group - 1) as f64 * median;
            let time_s = (0..n).map(|i| i as f64 * step_s + centre).collect();
            let way = if group == 1 { Way::Copy } else { Way::Mean(group) };
            return Self { step_s, time_s, covered: vec![true; n], density: 1.0, start_s, way };
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
        let density = (time_s.len() as f64 / n.max(1) as f64).min(1.0);
        Self { step_s, time_s: grid, covered, density, start_s, way: Way::Between(places) }
    }

    /// Time between samples of the log, or the step where that is longer, s.
    pub fn interval_s(&self) -> f64 {
        self.step_s / self.density
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

    /// Standard deviation of a channel's noise on the grid.
    pub fn noise(&self, values_on_grid: &[f64], values: &[f64]) -> f64 {
        match &self.way {
            Way::Between(_) => noise::standard_deviation(values),
            _ => noise::standard_deviation(values_on_grid),
        }
    }

    /// Whether samples are about as close as the grid's points, so that a log shows what swings from sample to sample.
    pub fn is_dense(&self) -> bool {
        self.density > LEAST_DENSITY
    }

    /// As [`Self::noise`] of a channel that may swing all the time. Where samples are further apart a signal fills its band, and
    /// no part of the spectrum is noise alone.
    pub fn white_noise(&self, values_on_grid: &[f64], values: &[f64]) -> f64 {
        if self.is_dense() {
            noise::white_deviation(values_on_grid)
        } else {
            self.noise(values_on_grid, values)
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
    fn fast_logs_are_averaged_slow_ones_interpolated_and_gaps_marked() {
        let at = |rate: f64, n: usize| (0..n).map(|i| i as f64 / rate).collect::<Vec<f64>>();
        let fast = Grid::new(&at(10_000.0, 1000));
        assert_eq!((fast.len(), fast.density), (100, 1.0));
        assert!((fast.step_s - 1e-3).abs() < 1e-12);
        let slow_time = at(200.0, 100);
        let slow = Grid::new(&slow_time);
        assert!((slow.step_s - 1e-3).abs() < 1e-12 && (slow.density - 0.2).abs() < 0.01);
        let line: Vec<f64> = slow_time.iter().map(|t| 3.0 * t - 1.0).collect();
        for (t, x) in slow.time_s.iter().zip(slow.channel(&slow_time, &line)) {
            assert!((x - (3.0 * t - 1.0)).abs() < 1e-12);
        }
        let mut gap = at(1000.0, 500);
        gap.drain(100..150);
        let grid = Grid::new(&gap);
        assert_eq!(grid.len(), 500);
        assert_eq!(grid.covered.iter().filter(|c| !**c).count(), 51);
    }
}
