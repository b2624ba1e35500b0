//! Standard deviation of a channel's noise, from the channel alone.
//!
//! In windows of [`WINDOW`] samples a parabola is taken off; what is left is noise wherever the signal
//! is slow. Most windows of a record are quiet, so a low quantile of the windows' variances is taken, and
//! corrected for being low: for white noise the variance over its expectation follows χ²/f. A signal that
//! swings in every window counts as noise here; that is the honest side for a threshold.
//! Left out: noise that changes along the record.

use super::spectrum::Spectrum;

/// Samples of a window.
pub const WINDOW: usize = 48;
/// Share of windows taken as quiet.
const QUANTILE: f64 = 0.25;
/// Normal deviate of [`QUANTILE`].
const DEVIATE: f64 = -0.6745;

/// Standard deviation of the noise of a channel, not below that of its own resolution (a channel that
/// stands still on one count is not without noise); 0 where it has neither.
pub fn standard_deviation(values: &[f64]) -> f64 {
    let smallest =
        values.windows(2).map(|w| (w[1] - w[0]).abs()).filter(|d| *d > 0.0).fold(f64::MAX, f64::min);
    let resolution = if smallest < f64::MAX { smallest / 12f64.sqrt() } else { 0.0 };
    quiet_deviation(values).max(resolution)
}

/// As [`standard_deviation`] for a channel whose noise is white, so that a signal that swings in every window does not count
/// as noise: from the quietest part of its spectrum.
pub fn white_deviation(values: &[f64]) -> f64 {
    let usual = standard_deviation(values);
    Spectrum::new(values).map_or(usual, |spectrum| spectrum.white_deviation().min(usual))
}

/// As [`white_deviation`] by fourth differences, for a drive's own channels: their noise is not white, and the quietest part of
/// its spectrum says less than what it does from sample to sample. What swings near a quarter of the sampling rate counts.
pub fn difference_deviation(values: &[f64]) -> f64 {
    // Sum of the squared binomial coefficients 1, 4, 6, 4, 1.
    const SQUARES: f64 = 70.0;
    let differences: Vec<f64> =
        values.windows(5).map(|x| x[0] - 4.0 * x[1] + 6.0 * x[2] - 4.0 * x[3] + x[4]).collect();
    let mut variances: Vec<f64> = differences
        .chunks(WINDOW)
        .map(|chunk| chunk.iter().map(|d| d * d).sum::<f64>() / (SQUARES * chunk.len() as f64))
        .collect();
    if variances.is_empty() {
        return standard_deviation(values);
    }
    let middle = variances.len() / 2;
    variances.select_nth_unstable_by(middle, f64::total_cmp).1.sqrt().min(standard_deviation(values))
}

/// Deviation in the quiet windows.
fn quiet_deviation(values: &[f64]) -> f64 {
    let mut variances: Vec<f64> = values.chunks_exact(WINDOW).map(detrended_variance).collect();
    if variances.is_empty() {
        return detrended_variance(values).sqrt();
    }
    let rank = ((variances.len() - 1) as f64 * QUANTILE).round() as usize;
    let (_, quiet, _) = variances.select_nth_unstable_by(rank, f64::total_cmp);
    (*quiet / chi_square_ratio(DEVIATE, (WINDOW - 3) as f64)).sqrt()
}

/// Quantile of χ²/f at a normal deviate, by Wilson and Hilferty's cube.
fn chi_square_ratio(deviate: f64, freedom: f64) -> f64 {
    let spread = 2.0 / (9.0 * freedom);
    (1.0 - spread + deviate * spread.sqrt()).powi(3)
}

/// Variance around the parabola of least squares.
fn detrended_variance(window: &[f64]) -> f64 {
    let count = window.len();
    if count < 5 {
        return 0.0;
    }
    let centre = 0.5 * (count - 1) as f64;
    // Orthogonal polynomials on the samples: 1, x, x² − mean(x²).
    let abscissa = |i: usize| i as f64 - centre;
    let square = (0..count).map(|i| abscissa(i).powi(2)).sum::<f64>() / count as f64;
    let mut left: Vec<f64> = window.to_vec();
    for degree in 0..3 {
        let basis = |i: usize| match degree {
            0 => 1.0,
            1 => abscissa(i),
            _ => abscissa(i).powi(2) - square,
        };
        let (mut product, mut norm) = (0.0, 0.0);
        for (i, value) in left.iter().enumerate() {
            product += basis(i) * value;
            norm += basis(i).powi(2);
        }
        let share = product / norm;
        left.iter_mut().enumerate().for_each(|(i, value)| *value -= share * basis(i));
    }
    left.iter().map(|x| x * x).sum::<f64>() / (count - 3) as f64
}

/// Reproducible white noise of variance 1, near Gaussian: the sum of twelve uniform numbers of a linear
/// congruential generator (Knuth's MMIX constants).
#[derive(Debug, Clone)]
pub struct White(u64);

impl White {
    /// A sequence of its own for each seed.
    pub fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ 0x5851_F42D_4C95_7F2D)
    }

    /// The next value.
    #[allow(clippy::should_implement_trait, reason = "it never ends")]
    pub fn next(&mut self) -> f64 {
        let mut uniform = || {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (self.0 >> 11) as f64 / (1u64 << 53) as f64
        };
        (0..12).map(|_| uniform()).sum::<f64>() - 6.0
    }
}

#[cfg(test)]
pub(in crate::identify) mod tests {
    use super::*;

    pub(in crate::identify) fn white(count: usize, seed: u64) -> Vec<f64> {
        let mut noise = White::new(seed);
        (0..count).map(|_| noise.next()).collect()
    }

    #[test]
    fn noise_is_measured_where_the_signal_is_quiet() {
        for seed in 1..6 {
            let noise = white(20_000, seed);
            let values: Vec<f64> = noise
                .iter()
                .enumerate()
                .map(|(i, e)| {
                    let t = i as f64 * 1e-3;
                    let ringing = if t % 4.0 < 0.3 { (600.0 * t).sin() } else { 0.0 };
                    5.0 * (0.7 * t).sin() + if t > 7.0 { 3.0 } else { 0.0 } + ringing + 0.02 * e
                })
                .collect();
            // 400 windows of 45 degrees of freedom: the quantile is good to 2 %, ringing shifts it by 2 %.
            let found = standard_deviation(&values);
            assert!((found / 0.02 - 1.0).abs() < 0.06, "{found}");
        }
    }

    #[test]
    fn a_swing_in_every_window_is_no_white_noise() {
        for omega in [0.2, 1.5, 2.6] {
            let values: Vec<f64> = white(20_000, 3)
                .iter()
                .enumerate()
                .map(|(i, e)| (omega * i as f64).sin() + 0.01 * e)
                .collect();
            let found = white_deviation(&values);
            assert!((found / 0.01 - 1.0).abs() < 0.1, "{omega}: {found}");
            if omega < 0.3 {
                let found = difference_deviation(&values);
                assert!((found / 0.01 - 1.0).abs() < 0.1, "{omega}: {found}");
            }
            assert!(standard_deviation(&values) > 0.1);
        }
    }

    #[test]
    fn a_channel_without_noise_has_none() {
        let values: Vec<f64> = (0..5000).map(|i| 1e-3 * f64::from(i)).collect();
        assert!(quiet_deviation(&values) < 1e-12);
        // Counts of an encoder that hardly moves: that of a count.
        let counts: Vec<f64> = (0..5000).map(|i| if i < 2500 { 1.0 } else { 1.5 }).collect();
        assert_eq!(standard_deviation(&counts), 0.5 / 12f64.sqrt());
    }
}
