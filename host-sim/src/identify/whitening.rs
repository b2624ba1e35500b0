//! What white noise and slow noise together leave new in each row: generalised least squares.
//!
//! A row's error is e + Σ s_j with e white and s_j first-order processes of one variance a decade apart, which make 1/f noise
//! (`slow_noise.rs`). The Kalman filter of that (Kalman 1960) turns a series into its innovations, which are white: response and
//! columns alike go through it, so that what changes as slowly as the noise counts as little as it tells. Gains and deviations
//! of the innovations depend on the rows' deviations alone and are the same for all columns.

use nalgebra::{SMatrix, SVector};

/// Time constants of the processes, s: a decade apart, from what the effective sample size counts to a log's length.
const LONG_S: [f64; SLOW] = [0.05, 0.5, 5.0, 50.0];
/// Processes.
pub(super) const SLOW: usize = 4;

/// A row's part of the filter.
#[derive(Debug, Clone)]
struct Row {
    /// Place among all points.
    point: usize,
    /// What is kept of each process since the row before; nothing at the begin of a log.
    kept: SVector<f64, SLOW>,
    /// What each process takes of the innovation.
    gain: SVector<f64, SLOW>,
    /// Whether the processes show in it.
    shows: f64,
    /// Of the white noise.
    white: f64,
    /// Of the innovation.
    deviation: f64,
}

/// Rows of a log.
pub(super) struct LogPoints {
    /// Their points.
    pub(super) points: Vec<usize>,
    /// Distance of two points, s.
    pub(super) step_s: f64,
}

/// The filter for the rows of a balance.
#[derive(Debug, Clone, Default)]
pub(super) struct Whitening {
    rows: Vec<Row>,
    /// Whether there is slow noise.
    slow: bool,
}

impl Whitening {
    /// For these rows, log by log, with the white noise's deviation at each point, whether slow noise shows there, and the variance
    /// of each slow process.
    pub(super) fn new(
        logs: &[LogPoints],
        deviation: &[f64],
        shows: impl Fn(usize) -> bool,
        of_each: f64,
    ) -> Self {
        let stationary = SMatrix::<f64, SLOW, SLOW>::from_diagonal_element(of_each);
        let mut rows = Vec::new();
        for log in logs {
            let mut variance = stationary;
            let mut before: Option<usize> = None;
            for &point in &log.points {
                let since_s = before.map(|before| (point - before) as f64 * log.step_s);
                let kept = SVector::from_fn(|j, _| since_s.map_or(0.0, |since| (-since / LONG_S[j]).exp()));
                let moves = SMatrix::from_diagonal(&kept);
                variance = stationary + moves * (variance - stationary) * moves;
                let white = deviation[point];
                let shows = f64::from(u8::from(shows(point)));
                let seen = shows * variance.row_sum().transpose();
                let of_innovation = white.powi(2) + seen.sum();
                let gain = seen / of_innovation;
                variance -= gain * seen.transpose();
                rows.push(Row { point, kept, gain, shows, white, deviation: of_innovation.sqrt() });
                before = Some(point);
            }
        }
        Self { rows, slow: of_each > 0.0 }
    }

    /// Whether there is slow noise.
    pub(super) fn is_slow(&self) -> bool {
        self.slow
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
        self.innovations(|row| values[row.point]).collect()
    }

    /// The same of a series over the white noise's deviation, by point: 0 where there is no row.
    pub(super) fn of_relative(&self, values: &[f64]) -> Vec<f64> {
        let mut out = vec![0.0; values.len()];
        let innovations = self.innovations(|row| values[row.point] * row.white);
        self.rows.iter().zip(innovations).for_each(|(row, innovation)| out[row.point] = innovation);
        out
    }

    fn innovations(&self, value: impl Fn(&Row) -> f64) -> impl Iterator<Item = f64> {
        let mut state = SVector::<f64, SLOW>::zeros();
        self.rows.iter().map(move |row| {
            state.component_mul_assign(&row.kept);
            let innovation = value(row) - row.shows * state.sum();
            state += row.gain * innovation;
            innovation / row.deviation
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::identify::noise::White;

    const COUNT: usize = 6000;
    const STEP_S: f64 = 2e-3;

    /// White noise of deviation 1 that doubles half way, and the processes.
    fn noise(of_each: f64, seed: u64) -> Vec<f64> {
        let mut white = White::new(seed);
        let mut state = LONG_S.map(|_| of_each.sqrt() * white.next());
        (0..COUNT)
            .map(|i| {
                for (s, long_s) in state.iter_mut().zip(LONG_S) {
                    let kept = (-STEP_S / long_s).exp();
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
        let rows = [LogPoints { points: (0..COUNT).collect(), step_s: STEP_S }];
        let (mut squares, mut before, mut after) = (0.0, 0.0, 0.0);
        const LOGS: u64 = 20;
        for seed in 0..LOGS {
            let values = noise(of_each, seed);
            let white = Whitening::new(&rows, &deviations, |_| true, of_each).of(&values);
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
        let logs = [vec![0, 2, 4], vec![6, 8]].map(|points| LogPoints { points, step_s: STEP_S });
        let values: Vec<f64> = (0..10).map(f64::from).collect();
        let plain = Whitening::new(&logs, &[2.0; 10], |_| true, 0.0).of(&values);
        assert_eq!(plain, [0.0, 1.0, 2.0, 3.0, 4.0]);
        let whitening = Whitening::new(&logs, &[2.0; 10], |_| true, 0.5);
        let alone = Whitening::new(&logs[1..], &[2.0; 10], |_| true, 0.5);
        assert_eq!(whitening.of(&values)[3..], alone.of(&values)[..]);
        // By point, of what is over the white noise's deviation.
        let relative: Vec<f64> = values.iter().map(|x| x / 2.0).collect();
        let by_point = whitening.of_relative(&relative);
        assert_eq!(by_point.iter().step_by(2).copied().collect::<Vec<f64>>(), whitening.of(&values));
        assert!(by_point.iter().skip(1).step_by(2).all(|x| *x == 0.0));
    }

    #[test]
    fn a_row_in_which_slow_noise_does_not_show_tells_nothing_of_it() {
        let points = LogPoints { points: (0..300).collect(), step_s: STEP_S };
        let logs = std::slice::from_ref(&points);
        let sticks = |i: usize| (100..200).contains(&i);
        let values: Vec<f64> = (0..300).map(|i| if sticks(i) { 0.5 } else { 3.0 }).collect();
        let white = Whitening::new(logs, &[1.0; 300], |i| !sticks(i), 10.0).of(&values);
        assert!(white[100..200].iter().all(|x| *x == 0.5), "{:?}", &white[100..110]);
        // What was seen before is remembered, as far as processes last.
        assert!(
            white[0] > 0.4 && white[99].abs() < 0.1 && white[200].abs() < 0.2,
            "{} {}",
            white[99],
            white[200]
        );
    }
}
