//! What a channel picks up from the mains: a line at 50 or 60 Hz that no motion makes.

use std::f64::consts::TAU;

use rustfft::num_complex::Complex;

/// Frequencies of the grids there are, Hz.
const GRIDS_HZ: [f64; 2] = [50.0, 60.0];
/// It is looked for so many places of the spectrum on either side: a Hann window's line is as wide, and a grid within 20 mHz.
const WIDE: i32 = 2;
/// The level beside it is taken over so many places on either side.
const BESIDE: i32 = 20;
/// A line has so many times the power beside it: noise has it once in three million places.
const OVER_NOISE: f64 = 15.0;

/// A line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Line {
    /// Its frequency, Hz.
    pub hz: f64,
    /// Its variance, half the square of its amplitude.
    pub variance: f64,
}

impl Line {
    /// Takes off an even series what swings with it; a value that is 0 takes no part.
    pub(super) fn take_off(&self, values: &mut [f64], step_s: f64) {
        let turn = TAU * self.hz * step_s;
        let (mut re, mut im, mut count) = (0.0, 0.0, 0.0);
        for (i, x) in values.iter().enumerate().filter(|(_, x)| **x != 0.0) {
            let (sin, cos) = (turn * i as f64).sin_cos();
            (re, im, count) = (re + x * cos, im + x * sin, count + 0.5);
        }
        for (i, x) in values.iter_mut().enumerate().filter(|(_, x)| **x != 0.0) {
            let (sin, cos) = (turn * i as f64).sin_cos();
            *x -= (re * cos + im * sin) / count;
        }
    }
}

/// The stronger line of the two grids in an even series, behind a Hann window; `None` where neither stands out.
pub(super) fn line(values: &[f64], step_s: f64) -> Option<Line> {
    let of_grid = |hz: f64| (hz * step_s < 0.5).then(|| at(values, step_s, hz)).flatten();
    GRIDS_HZ.into_iter().filter_map(of_grid).max_by(|a, b| a.variance.total_cmp(&b.variance))
}

fn at(values: &[f64], step_s: f64, hz: f64) -> Option<Line> {
    let length_s = values.len() as f64 * step_s;
    let sums: Vec<Complex<f64>> = (-BESIDE - 1..=BESIDE + 1)
        .map(|place| turned_sum(values, TAU * step_s * (hz + f64::from(place) / length_s)))
        .collect();
    // 1 − cos takes half of either neighbour off; its own sum is that of the places.
    let behind_window = |x: &[Complex<f64>]| x[1] - 0.5 * (x[0] + x[2]);
    let of_amplitude = 2.0 / (values.len().max(1) as f64).powi(2);
    let power: Vec<f64> = sums.windows(3).map(|x| of_amplitude * behind_window(x).norm_sqr()).collect();
    let near = |at: &usize| at.abs_diff(BESIDE as usize) <= WIDE as usize;
    let strongest = (0..power.len()).filter(near).map(|at| power[at]).fold(0.0, f64::max);
    let mut beside: Vec<f64> = (0..power.len()).filter(|at| !near(at)).map(|at| power[at]).collect();
    let middle = beside.len() / 2;
    // Of noise's powers the median is ln 2 of the mean.
    let level = *beside.select_nth_unstable_by(middle, f64::total_cmp).1 / std::f64::consts::LN_2;
    (strongest > OVER_NOISE * level).then_some(Line { hz, variance: strongest - level })
}

/// Sum of a series that is turned back by so many radians a sample.
fn turned_sum(values: &[f64], turn: f64) -> Complex<f64> {
    let step = Complex::from_polar(1.0, -turn);
    let turned = values.iter().scan(Complex::ONE, |turned, x| {
        let now = *turned;
        *turned *= step;
        Some(now * x)
    });
    turned.sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::identify::noise::tests::white;

    const COUNT: usize = 20_000;
    const STEP_S: f64 = 1e-3;

    #[test]
    fn a_line_is_found_beside_noise_and_steps_and_none_where_there_is_none() {
        for (grid_hz, off_hz) in [(50.0, 0.0), (60.0, 0.03), (50.0, -0.05)] {
            for amplitude in [0.0, 0.03] {
                let of = |(i, e): (usize, f64)| {
                    let t = STEP_S * i as f64;
                    let steps = if ((t / 1.7) as usize).is_multiple_of(2) { 2.0 } else { -1.5 };
                    steps + 0.02 * e + amplitude * (TAU * (grid_hz + off_hz) * t + 0.4).sin()
                };
                let values: Vec<f64> = white(COUNT, 5).into_iter().enumerate().map(of).collect();
                let found = line(&values, STEP_S);
                if amplitude == 0.0 {
                    assert_eq!(found, None);
                } else {
                    let Line { hz, variance } = found.expect("a line");
                    let ratio = variance / (0.5 * amplitude * amplitude);
                    // Between two places of the spectrum a Hann window shows 72 % of the power.
                    assert!(hz == grid_hz && (0.65..1.2).contains(&ratio), "{grid_hz} {off_hz}: {ratio}");
                    let (mut left, line) = (values.clone(), Line { hz: hz + off_hz, variance });
                    line.take_off(&mut left, STEP_S);
                    assert_eq!(self::line(&left, STEP_S), None);
                }
            }
        }
    }

    #[test]
    fn what_the_disc_makes_at_that_frequency_for_a_while_is_no_line() {
        // A sweep through it.
        let sweep: Vec<f64> =
            (0..COUNT).map(|i| (TAU * (20.0 + 2.0 * STEP_S * i as f64) * STEP_S * i as f64).sin()).collect();
        assert_eq!(line(&sweep, STEP_S), None);
    }
}
