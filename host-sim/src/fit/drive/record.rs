//! A drive's record on an even time grid.
//!
//! Uneven samples are interpolated onto the grid of their median step: linearly, which is below the
//! noise where steps differ by little. A record whose times are even to 1 % of a step is taken as it is.

use crate::files::log::median_step;

/// Effort in, position out, evenly sampled. Newtons and metres, or newton metres and radians.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct DriveRecord {
    /// Time of the first sample, s.
    pub start_s: f64,
    /// Time between samples, s.
    pub step_s: f64,
    /// Force or torque that drives.
    pub effort: Vec<f64>,
    /// Position or angle.
    pub position: Vec<f64>,
}

/// Fewest samples that a derivative of a filtered position makes sense on.
pub const FEWEST_SAMPLES: usize = 50;

/// An even grid of times over a log's.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Grid {
    /// First time, s.
    pub start_s: f64,
    /// Step, s.
    pub step_s: f64,
    /// Number of times.
    pub count: usize,
    even: bool,
}

impl Grid {
    /// The grid of a log's times; `None` if time does not rise.
    pub fn over(time_s: &[f64]) -> Option<Self> {
        let median_s = median_step(time_s)?;
        let (start_s, last) = (time_s[0], time_s.len() - 1);
        let step_s = (time_s[last] - start_s) / last as f64;
        let even =
            time_s.iter().enumerate().all(|(i, t)| (t - start_s - step_s * i as f64).abs() < 0.01 * step_s);
        if even {
            return Some(Self { start_s, step_s, count: time_s.len(), even });
        }
        let count = ((time_s[last] - start_s) / median_s + 1e-6).floor() as usize + 1;
        Some(Self { start_s, step_s: median_s, count, even })
    }

    /// Values at the grid's times.
    pub fn resample(&self, time_s: &[f64], values: &[f64]) -> Vec<f64> {
        if self.even {
            return values.to_vec();
        }
        let times: Vec<f64> = (0..self.count).map(|i| self.start_s + self.step_s * i as f64).collect();
        interpolate(time_s, values, &times)
    }
}

impl DriveRecord {
    /// A record from a log's signals. `None` if there are fewer than [`FEWEST_SAMPLES`] or time does not rise.
    pub fn new(time_s: &[f64], effort: &[f64], position: &[f64]) -> Option<Self> {
        let count = time_s.len();
        if count < FEWEST_SAMPLES || effort.len() != count || position.len() != count {
            return None;
        }
        let grid = Grid::over(time_s)?;
        Some(Self {
            start_s: grid.start_s,
            step_s: grid.step_s,
            effort: grid.resample(time_s, effort),
            position: grid.resample(time_s, position),
        })
    }

    /// Number of samples.
    pub fn len(&self) -> usize {
        self.effort.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.effort.is_empty()
    }

    /// Time of a sample, s.
    pub fn time_s(&self, sample: usize) -> f64 {
        self.start_s + self.step_s * sample as f64
    }

    /// Samples per second.
    pub fn rate_hz(&self) -> f64 {
        1.0 / self.step_s
    }
}

/// Linear interpolation at rising times; beyond the ends the end value.
pub fn interpolate(time_s: &[f64], values: &[f64], at: &[f64]) -> Vec<f64> {
    let mut right = 1;
    at.iter()
        .map(|t| {
            while right + 1 < time_s.len() && time_s[right] < *t {
                right += 1;
            }
            let (t0, t1) = (time_s[right - 1], time_s[right]);
            let share = ((t - t0) / (t1 - t0)).clamp(0.0, 1.0);
            values[right - 1] + share * (values[right] - values[right - 1])
        })
        .collect()
}

/// Central differences, one-sided at the ends.
pub fn central_difference(signal: &[f64], step_s: f64) -> Vec<f64> {
    let last = signal.len().saturating_sub(1);
    (0..signal.len())
        .map(|i| {
            let (left, right) = (i.saturating_sub(1), (i + 1).min(last));
            if left == right {
                0.0
            } else {
                (signal[right] - signal[left]) / (step_s * (right - left) as f64)
            }
        })
        .collect()
}

/// First and second derivative by the seven-point formulas, whose gain at a tenth of the rate is short
/// by 1e-3 and 3e-4 (central differences: 6 % and 12 %); ends repeat the nearest value.
pub fn derivatives(signal: &[f64], step_s: f64) -> (Vec<f64>, Vec<f64>) {
    let count = signal.len();
    if count < 7 {
        return (vec![0.0; count], vec![0.0; count]);
    }
    let at = |i: usize| i.clamp(3, count - 4);
    let first = |i: usize| {
        let odd = |k: usize| signal[at(i) + k] - signal[at(i) - k];
        (45.0 * odd(1) - 9.0 * odd(2) + odd(3)) / (60.0 * step_s)
    };
    let second = |i: usize| {
        let even = |k: usize| signal[at(i) + k] + signal[at(i) - k];
        (270.0 * even(1) - 27.0 * even(2) + 2.0 * even(3) - 490.0 * signal[at(i)]) / (180.0 * step_s * step_s)
    };
    ((0..count).map(first).collect(), (0..count).map(second).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn even_samples_are_taken_as_they_are() {
        let time: Vec<f64> = (0..100).map(|i| f64::from(i) / 1000.0).collect();
        let record = DriveRecord::new(&time, &time, &time).unwrap();
        assert_eq!(record.effort, time);
        assert!((record.step_s - 1e-3).abs() < 1e-12);
    }

    #[test]
    fn uneven_samples_land_on_an_even_grid() {
        let time: Vec<f64> = (0..200).map(|i| 0.01 * f64::from(i) + 0.003 * f64::from(i % 3)).collect();
        let line: Vec<f64> = time.iter().map(|t| 2.0 * t + 1.0).collect();
        let record = DriveRecord::new(&time, &line, &line).unwrap();
        for i in 0..record.len() {
            assert!((record.position[i] - 2.0 * record.time_s(i) - 1.0).abs() < 1e-9);
        }
    }

    #[test]
    fn derivatives_of_a_wave_keep_their_gain_up_to_a_tenth_of_the_rate() {
        let omega = 2.0 * std::f64::consts::PI * 0.1;
        let wave: Vec<f64> = (0..100).map(|i| (omega * f64::from(i)).sin()).collect();
        let (first, second) = derivatives(&wave, 1.0);
        for i in 10..90 {
            let phase = omega * i as f64;
            assert!((first[i] - omega * phase.cos()).abs() < 2e-3 * omega);
            assert!((second[i] + omega * omega * phase.sin()).abs() < 1e-3 * omega * omega);
        }
    }

    #[test]
    fn time_that_goes_back_is_no_record() {
        let mut time: Vec<f64> = (0..100).map(f64::from).collect();
        time[50] = 3.0;
        assert!(DriveRecord::new(&time, &time.clone(), &time.clone()).is_none());
    }
}
