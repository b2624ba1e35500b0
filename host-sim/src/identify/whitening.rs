//! What white noise and slow noise together leave new in each row: generalised least squares.
//!
//! A row's error is e + Σ s_j with e white and s_j first-order processes of one variance a decade apart, which make 1/f noise
//! (`slow_noise.rs`). The Kalman filter of that (Kalman 1960) turns a series into its innovations, which are white: response and
//! columns alike go through it, so that what changes as slowly as the noise counts as little as it tells. Gains and deviations
//! of the innovations depend on the rows' deviations alone and are the same for all columns.

use nalgebra::{SMatrix, SVector};

/// Time constants of the processes, rows: a decade apart, from what an average over a few rows leaves to a log's length.
const ROWS_LONG: [f64; SLOW] = [30.0, 300.0, 3000.0];
/// Processes.
const SLOW: usize = 3;

/// A row's part of the filter.
#[derive(Debug, Clone)]
struct Row {
    /// Place among all points.
    point: usize,
    /// What is kept of each process since the row before; nothing at the begin of a log.
    kept: SVector<f64, SLOW>,
    /// What each process takes of the innovation.
    gain: SVector<f64, SLOW>,
    /// Of the innovation.
    deviation: f64,
}

/// The filter for the rows of a balance.
#[derive(Debug, Clone, Default)]
pub(super) struct Whitening {
    rows: Vec<Row>,
    /// Whether there is slow noise.
    slow: bool,
}

impl Whitening {
    /// For these rows, log by log, each log's a step of so many points apart or more, with the white noise's deviation at each point
    /// and the variance of each slow process.
    pub(super) fn new(logs: &[Vec<usize>], step: usize, deviation: &[f64], of_each: f64) -> Self {
        let stationary = SMatrix::<f64, SLOW, SLOW>::from_diagonal_element(of_each);
        let mut rows = Vec::new();
        for log in logs {
            let mut variance = stationary;
            let mut before: Option<usize> = None;
            for &point in log {
                let steps = before.map(|before| (point - before) as f64 / step.max(1) as f64);
                let kept = SVector::from_fn(|j, _| steps.map_or(0.0, |steps| (-steps / ROWS_LONG[j]).exp()));
                let moves = SMatrix::from_diagonal(&kept);
                variance = stationary + moves * (variance - stationary) * moves;
                let seen = variance.row_sum().transpose();
                let of_innovation = deviation[point].powi(2) + seen.sum();
                let gain = seen / of_innovation;
                variance -= gain * seen.transpose();
                rows.push(Row { point, kept, gain, deviation: of_innovation.sqrt() });
                before = Some(point);
            }
        }
        Self { rows, slow: of_each > 0.0 }
    }

    /// Points of the rows, each with the deviation of its innovation.
    pub(super) fn rows(&self) -> impl Iterator<Item = (usize, f64)> + '_ {
        self.rows.iter().map(|row| (row.point, row.deviation))
    }

    /// The innovations of a series over all points, over their deviations.
    pub(super) fn of(&self, values: &[f64]) -> Vec<f64> {
        if !self.slow {
            return self.rows.iter().map(|row| values[row.point] / row.deviation).collect();
        }
        let mut state = SVector::<f64, SLOW>::zeros();
        let of_row = |row: &Row| {
            state.component_mul_assign(&row.kept);
            let innovation = values[row.point] - state.sum();
            state += row.gain * innovation;
            innovation / row.deviation
        };
        self.rows.iter().map(of_row).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::identify::noise::White;

    const COUNT: usize = 6000;

    /// White noise of deviation 1 that doubles half way, and the three processes.
    fn noise(of_each: f64, seed: u64) -> Vec<f64> {
        let mut white = White::new(seed);
        let mut state = ROWS_LONG.map(|_| of_each.sqrt() * white.next());
        (0..COUNT)
            .map(|i| {
                for (s, long) in state.iter_mut().zip(ROWS_LONG) {
                    let kept = (-1.0 / long).exp();
                    *s = kept * *s + (of_each * (1.0 - kept * kept)).sqrt() * white.next();
                }
                state.iter().sum::<f64>() + deviation(i) * white.next()
            })
            .collect()
    }

    fn deviation(row: usize) -> f64 {
        if row < COUNT / 2 { 1.0 } else { 2.0 }
    }

    /// Variance of a mean over so many values times their number, relative to that of the values.
    fn of_means(values: &[f64], block: usize) -> f64 {
        let means = values.chunks_exact(block).map(|chunk| chunk.iter().sum::<f64>().powi(2) / block as f64);
        let count = values.len() / block;
        means.sum::<f64>() / count as f64 / (values.iter().map(|x| x * x).sum::<f64>() / values.len() as f64)
    }

    #[test]
    fn innovations_of_slow_and_white_noise_are_white_and_of_deviation_one() {
        let of_each = 0.3;
        let deviations: Vec<f64> = (0..COUNT).map(deviation).collect();
        let rows: Vec<usize> = (0..COUNT).collect();
        let (mut squares, mut before, mut after) = (0.0, 0.0, 0.0);
        const LOGS: u64 = 20;
        for seed in 0..LOGS {
            let values = noise(of_each, seed);
            let white = Whitening::new(std::slice::from_ref(&rows), 1, &deviations, of_each).of(&values);
            squares += white.iter().map(|x| x * x).sum::<f64>() / (COUNT as f64 * LOGS as f64);
            before += of_means(&values, 300) / LOGS as f64;
            after += of_means(&white, 300) / LOGS as f64;
        }
        // 400 means: their variance is known to 7 %.
        assert!(
            (squares - 1.0).abs() < 0.01 && before > 20.0 && (after - 1.0).abs() < 0.2,
            "{squares} {before} {after}"
        );
    }

    #[test]
    fn without_slow_noise_rows_are_over_their_deviation_and_a_new_log_has_forgotten() {
        let logs = [vec![0, 2, 4], vec![6, 8]];
        let values: Vec<f64> = (0..10).map(f64::from).collect();
        let plain = Whitening::new(&logs, 2, &[2.0; 10], 0.0).of(&values);
        assert_eq!(plain, [0.0, 1.0, 2.0, 3.0, 4.0]);
        let whitening = Whitening::new(&logs, 2, &[2.0; 10], 0.5);
        let alone = Whitening::new(&logs[1..], 2, &[2.0; 10], 0.5);
        assert_eq!(whitening.of(&values)[3..], alone.of(&values)[..]);
    }
}
