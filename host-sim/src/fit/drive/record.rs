//! A drive's record on an even time grid.
//!
//! Uneven samples are interpolated onto the grid of their median step: linearly, which is below the
//! noise where steps differ by little. A record with steps that are even to 1e-3 is taken as it is.

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

impl DriveRecord {
    /// A record from a log's signals. `None` if there are fewer than [`FEWEST_SAMPLES`] or time does not rise.
    pub fn new(time_s: &[f64], effort: &[f64], position: &[f64]) -> Option<Self> {
        let count = time_s.len();
        if count < FEWEST_SAMPLES || effort.len() != count || position.len() != count {
            return None;
        }
        let step_s = median_step(time_s)?;
        let even = time_s.iter().enumerate().all(|(i, t)| {
            (t - time_s[0] - step_s * i as f64).abs() < 1e-3 * step_s * (1.0 + 1e-3 * i as f64)
        });
        if even {
            let step_s = (time_s[count - 1] - time_s[0]) / (count - 1) as f64;
            return Some(Self {
                start_s: time_s[0],
                step_s,
                effort: effort.to_vec(),
                position: position.to_vec(),
            });
        }
        let grid = even_grid(time_s, step_s);
        Some(Self {
            start_s: time_s[0],
            step_s,
            effort: interpolate(time_s, effort, &grid),
            position: interpolate(time_s, position, &grid),
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

/// Median of the steps; `None` if time stands still or goes back.
pub fn median_step(time_s: &[f64]) -> Option<f64> {
    let mut steps: Vec<f64> = time_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
    if steps.is_empty() || steps.iter().any(|step| !step.is_finite() || *step <= 0.0) {
        return None;
    }
    let middle = steps.len() / 2;
    Some(*steps.select_nth_unstable_by(middle, f64::total_cmp).1)
}

/// Times from the first to the last at a constant step.
pub fn even_grid(time_s: &[f64], step_s: f64) -> Vec<f64> {
    let (Some(first), Some(last)) = (time_s.first(), time_s.last()) else { return Vec::new() };
    let count = ((last - first) / step_s + 1e-6).floor() as usize + 1;
    (0..count).map(|i| first + step_s * i as f64).collect()
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
    fn time_that_goes_back_is_no_record() {
        let mut time: Vec<f64> = (0..100).map(f64::from).collect();
        time[50] = 3.0;
        assert!(DriveRecord::new(&time, &time.clone(), &time.clone()).is_none());
    }
}
