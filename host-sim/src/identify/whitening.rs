//! What white noise and slow noise leave new in each row: generalised least squares.
//!
//! A row's error is e + Σ s_j with e white and s_j first-order processes of one variance a decade apart, which make 1/f noise
//! (`slow_noise.rs`). The Kalman filter of that (Kalman 1960) turns a series into its innovations, which are white: response and columns alike go through it, so that what changes as
//! the noise does counts as little as it tells. Gains and deviations of the innovations depend on the rows' deviations alone and
//! are the same for all columns.

use std::ops::{Add, Mul, Sub};

use nalgebra::{SMatrix, SVector};
use rayon::prelude::*;
use wide::f64x4;

use super::linear::Slope;

/// Time constants of the processes, s: a decade apart, from what the effective sample size counts to a log's length.
const LONG_S: [f64; SLOW] = [0.05, 0.5, 5.0, 50.0];
/// Processes.
pub(super) const SLOW: usize = 4;

type State = SVector<f64, SLOW>;

/// Columns that go through the filter together.
const LANES: usize = 4;

/// A value of a column, or of some beside each other.
trait Lane: Copy + Add<Output = Self> + Sub<Output = Self> + Mul<f64, Output = Self> {}
impl Lane for f64 {}
impl Lane for f64x4 {}

/// A row's part of the filter.
#[derive(Debug, Clone)]
struct Row {
    /// Place among all points.
    point: usize,
    /// What is kept of each process since the row before; nothing at the begin of a log.
    kept: [f64; SLOW],
    /// What each state takes of the innovation.
    gain: [f64; SLOW],
    /// Whether the processes show in it.
    shows: f64,
    /// Of the white noise.
    white: f64,
    /// Of the innovation.
    deviation: f64,
}

impl Row {
    /// The states a row on.
    fn moves<T: Lane>(&self, state: &mut [T; SLOW]) {
        for (state, kept) in state.iter_mut().zip(self.kept) {
            *state = *state * kept;
        }
    }

    /// What the row shows of the states.
    fn shown<T: Lane>(&self, state: &[T; SLOW]) -> T {
        ((state[0] + state[1]) + (state[2] + state[3])) * self.shows
    }

    /// The innovation of a value, which the states take up.
    fn innovation<T: Lane>(&self, value: T, state: &mut [T; SLOW]) -> T {
        self.moves(state);
        let innovation = value - self.shown(state);
        for (state, gain) in state.iter_mut().zip(self.gain) {
            *state = *state + innovation * gain;
        }
        innovation * self.deviation.recip()
    }
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
    /// Whether there is anything but white noise.
    coloured: bool,
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
        let mut rows = Vec::new();
        for log in logs {
            let mut variance = SMatrix::<f64, SLOW, SLOW>::from_diagonal_element(of_each);
            let mut before: Option<usize> = None;
            for &point in &log.points {
                let since_s = before.map(|before| (point - before) as f64 * log.step_s);
                let kept_for = |long_s: f64| since_s.map_or(0.0, |since| (-since / long_s).exp());
                let mut row = Row {
                    point,
                    kept: LONG_S.map(kept_for),
                    gain: [0.0; SLOW],
                    shows: f64::from(u8::from(shows(point))),
                    white: deviation[point],
                    deviation: 0.0,
                };
                // F P Fᵀ, columns and then rows, and what is new in each state so that its variance stays.
                for _ in 0..2 {
                    for j in 0..SLOW {
                        let mut column: [f64; SLOW] = variance.column(j).into_owned().into();
                        row.moves(&mut column);
                        variance.set_column(j, &column.into());
                    }
                    variance = variance.transpose();
                }
                for j in 0..SLOW {
                    variance[(j, j)] += of_each * (1.0 - row.kept[j].powi(2));
                }
                let seen = State::from_fn(|j, _| row.shown(&variance.column(j).into_owned().into()));
                let of_innovation = row.white.powi(2) + row.shown(&seen.into());
                let gain = seen / of_innovation;
                row.gain = gain.into();
                row.deviation = of_innovation.sqrt();
                variance -= gain * seen.transpose();
                rows.push(row);
                before = Some(point);
            }
        }
        Self { rows, coloured: of_each > 0.0 }
    }

    /// Whether there is anything but white noise.
    pub(super) fn is_coloured(&self) -> bool {
        self.coloured
    }

    /// Points of the rows, each with the deviation of its innovation.
    pub(super) fn rows(&self) -> impl Iterator<Item = (usize, f64)> + '_ {
        self.rows.iter().map(|row| (row.point, row.deviation))
    }

    /// The innovations of a series over all points, over their deviations.
    pub(super) fn of(&self, values: &[f64]) -> Vec<f64> {
        if !self.coloured {
            return self.rows.iter().map(|row| values[row.point] / row.deviation).collect();
        }
        let mut state = [0.0; SLOW];
        self.rows.iter().map(|row| row.innovation(values[row.point], &mut state)).collect()
    }

    /// The same of columns.
    pub(super) fn of_columns(&self, columns: &[&Vec<f64>]) -> Vec<Vec<f64>> {
        if !self.coloured {
            return columns.iter().map(|column| self.of(column)).collect();
        }
        let of_lanes = |lanes: &[&Vec<f64>]| {
            let mut out = vec![Vec::with_capacity(self.rows.len()); lanes.len()];
            let value = |lane: usize, row: &Row| lanes[lane][row.point];
            self.innovations(lanes.len(), value, |lane, _, innovation| out[lane].push(innovation));
            out
        };
        columns.par_chunks(LANES).flat_map_iter(of_lanes).collect()
    }

    /// The innovations of a series over the white noise's deviation, by point: 0 where there is no row.
    pub(super) fn of_relative(&self, values: &[f64]) -> Vec<f64> {
        let mut out = vec![0.0; values.len()];
        let mut state = [0.0; SLOW];
        for row in &self.rows {
            out[row.point] = row.innovation(values[row.point] * row.white, &mut state);
        }
        out
    }

    /// The same of columns.
    pub(super) fn of_relative_columns(&self, columns: &[Slope]) -> Vec<Slope> {
        let of_lanes = |lanes: &[Slope]| {
            let mut out: Vec<Vec<f64>> = lanes.iter().map(|column| vec![0.0; column.len()]).collect();
            let value = |lane: usize, row: &Row| lanes[lane][row.point] * row.white;
            self.innovations(lanes.len(), value, |lane, row, innovation| out[lane][row.point] = innovation);
            out.into_iter().map(Slope::from)
        };
        columns.par_chunks(LANES).flat_map_iter(of_lanes).collect()
    }

    /// Innovations of up to [`LANES`] columns, row by row.
    fn innovations(
        &self,
        columns: usize,
        value: impl Fn(usize, &Row) -> f64,
        mut put: impl FnMut(usize, &Row, f64),
    ) {
        let mut state = [f64x4::ZERO; SLOW];
        for row in &self.rows {
            let values: [f64; LANES] =
                std::array::from_fn(|lane| if lane < columns { value(lane, row) } else { 0.0 });
            let new = row.innovation(f64x4::from(values), &mut state).to_array();
            (0..columns).for_each(|lane| put(lane, row, new[lane]));
        }
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
    fn columns_go_through_beside_each_other_as_each_does_alone() {
        let logs =
            [(0..100).collect(), (110..200).collect()].map(|points| LogPoints { points, step_s: STEP_S });
        let whitening = Whitening::new(&logs, &[0.5; 200], |i| i % 7 != 0, 0.3);
        let column = |seed: u64| (0..200).scan(White::new(seed), |white, _| Some(white.next())).collect();
        let columns: Vec<Vec<f64>> = (0..6).map(column).collect();
        let each: Vec<Vec<f64>> = columns.iter().map(|column| whitening.of(column)).collect();
        assert_eq!(whitening.of_columns(&columns.iter().collect::<Vec<_>>()), each);
        let each: Vec<Slope> = columns.iter().map(|column| whitening.of_relative(column).into()).collect();
        let columns: Vec<Slope> = columns.into_iter().map(Slope::from).collect();
        assert_eq!(whitening.of_relative_columns(&columns), each);
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
