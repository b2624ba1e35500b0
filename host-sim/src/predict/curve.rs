//! What a sampled signal did between its samples: a cubic for each interval.
//!
//! Its slope at a sample is that of the parabola through the sample and its neighbours, for even and
//! uneven sampling alike; error of third order in the step. No limiter: it is linear in the samples.

use crate::files::log::slope;

/// Cubics through samples.
#[derive(Debug, Clone)]
pub struct Curve<'a> {
    time_s: &'a [f64],
    values: &'a [f64],
    slopes: Vec<f64>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
/// One interval: c0 + c1 s + c2 s² + c3 s³, s from 0 to 1.
pub struct Piece([f64; 4]);

impl<'a> Curve<'a> {
    /// Through these samples; two or more.
    pub fn new(time_s: &'a [f64], values: &'a [f64]) -> Self {
        Self { time_s, values, slopes: slope(time_s, values) }
    }

    /// The piece from sample `i` to the next.
    pub fn piece(&self, i: usize) -> Piece {
        let span_s = self.time_s[i + 1] - self.time_s[i];
        let (x0, x1) = (self.values[i], self.values[i + 1]);
        let (d0, d1) = (span_s * self.slopes[i], span_s * self.slopes[i + 1]);
        Piece([x0, d0, 3.0 * (x1 - x0) - 2.0 * d0 - d1, 2.0 * (x0 - x1) + d0 + d1])
    }
}

impl Piece {
    /// Value at `s`.
    pub fn at(&self, s: f64) -> f64 {
        let [a, b, c, d] = self.0;
        a + s * (b + s * (c + s * d))
    }

    /// Integral over s from 0 to `s`.
    pub fn area(&self, s: f64) -> f64 {
        let [a, b, c, d] = self.0;
        s * (a + s * (b / 2.0 + s * (c / 3.0 + s * d / 4.0)))
    }
}

/// The signal at t + `ahead_s` for each t; its first and last value outside the log.
pub fn shifted(time_s: &[f64], values: &[f64], ahead_s: f64) -> Vec<f64> {
    if ahead_s == 0.0 {
        return values.to_vec();
    }
    resampled(time_s, values, time_s.iter().map(|t| t + ahead_s))
}

/// The signal at other times, which rise; its first and last value outside the log.
pub fn resampled(time_s: &[f64], values: &[f64], at_s: impl Iterator<Item = f64>) -> Vec<f64> {
    let Some(last) = time_s.len().checked_sub(1) else { return Vec::new() };
    let curve = Curve::new(time_s, values);
    let mut i = 0;
    let at = |t: f64| {
        while i < last && time_s[i + 1] <= t {
            i += 1;
        }
        if i == last || t <= time_s[0] {
            return values[i];
        }
        curve.piece(i).at((t - time_s[i]) / (time_s[i + 1] - time_s[i]))
    };
    at_s.map(at).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_parabola_is_moved_in_time_exactly_and_held_at_its_ends() {
        let time_s = [0.0, 0.1, 0.3, 0.35, 0.5];
        let parabola = |t: f64| 3.0 * t * t - t;
        let values = time_s.map(parabola);
        for (ahead_s, times_s) in [(0.04, [0.04, 0.14, 0.34, 0.39, 0.5]), (-0.2, [0.0, 0.0, 0.1, 0.15, 0.3])]
        {
            for (value, t) in shifted(&time_s, &values, ahead_s).iter().zip(times_s) {
                // A dozen roundings of numbers below 1.
                assert!((value - parabola(t)).abs() < 1e-14, "{value} {t}");
            }
        }
        assert_eq!(shifted(&time_s, &values, 0.0), values);
    }

    #[test]
    fn the_area_of_a_piece_is_the_integral_of_its_values() {
        let (time_s, values) = ([0.0, 1.0, 2.5, 3.0], [1.0, -2.0, 0.5, 4.0]);
        let piece = Curve::new(&time_s, &values).piece(1);
        let parts = 10_000;
        let sum: f64 = (0..parts).map(|i| piece.at(0.7 * (f64::from(i) + 0.5) / f64::from(parts))).sum();
        // Midpoint rule: error of order (0.7/1e4)².
        assert!((piece.area(0.7) - 0.7 * sum / f64::from(parts)).abs() < 1e-7);
    }
}
