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
/// Share of windows taken as quiet, with its normal deviate.
const QUIET: (f64, f64) = (0.25, -0.6745);
/// The same where a tip slips and sticks in most of them.
const QUIETEST: (f64, f64) = (0.1, -1.2816);
/// By noise alone the two shares tell of deviations that are a few hundredths apart in records of some seconds.
const ALIKE: f64 = 1.25;

/// Standard deviation of the noise of a channel, not below that of its own resolution (a channel that
/// stands still on one count is not without noise); 0 where it has neither.
pub fn standard_deviation(values: &[f64]) -> f64 {
    quiet_deviation(values, QUIET, |_| true).max(resolution(values))
}

/// As [`standard_deviation`] for a bridge. Where it stands at the largest or the smallest value of its record it may be at an end of
/// its range, which cuts its noise too: a window that it holds for a quarter says nothing. An encoder that rests is quiet.
pub fn bridge_deviation(values: &[f64]) -> f64 {
    of_bridge(values, QUIET)
}

/// The same from this share of the windows.
fn of_bridge(values: &[f64], quiet: (f64, f64)) -> f64 {
    let lowest = values.iter().copied().fold(f64::INFINITY, f64::min);
    let highest = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let at_end = |x: &&f64| **x == lowest || **x == highest;
    let is_free = |window: &[f64]| 4 * window.iter().filter(at_end).count() < WINDOW;
    quiet_deviation(values, quiet, is_free).max(resolution(values))
}

/// Deviation of what a channel's smallest step rounds.
fn resolution(values: &[f64]) -> f64 {
    let steps = values.windows(2).map(|w| (w[1] - w[0]).abs()).filter(|d| *d > 0.0);
    let smallest = steps.fold(f64::MAX, f64::min);
    if smallest < f64::MAX { smallest / 12f64.sqrt() } else { 0.0 }
}

/// As [`bridge_deviation`] for the friction torque, which swings wherever a tip slips and sticks: from the quietest windows where most
/// of them swing, and as its noise is white, from the quietest part of its spectrum where all of them do.
pub fn white_deviation(values: &[f64]) -> f64 {
    let [usual, least] = [QUIET, QUIETEST].map(|quiet| of_bridge(values, quiet));
    let quiet = if usual < ALIKE * least { usual } else { least };
    Spectrum::new(values).map_or(quiet, |spectrum| spectrum.white_deviation().min(quiet))
}

/// As [`white_deviation`] by fourth differences, for a drive's own channels: their noise is not white, and the quietest part of
/// its spectrum says less than what it does from sample to sample. What swings near a quarter of the sampling rate counts.
pub fn difference_deviation(values: &[f64]) -> f64 {
    let mut variances: Vec<f64> = windows_of_differences(values).map(|(variance, _)| variance).collect();
    if variances.is_empty() {
        return standard_deviation(values);
    }
    median(&mut variances).sqrt().min(standard_deviation(values))
}

/// Variance of white noise in the windows of a channel by fourth differences, which leave out what is slow, and its mean change
/// from sample to sample.
fn windows_of_differences(values: &[f64]) -> impl Iterator<Item = (f64, f64)> + '_ {
    // Sum of the squared binomial coefficients 1, 4, 6, 4, 1.
    const SQUARES: f64 = 70.0;
    let difference = |x: &[f64]| x[0] - 4.0 * x[1] + 6.0 * x[2] - 4.0 * x[3] + x[4];
    let windows = (0..values.len().saturating_sub(4)).step_by(WINDOW);
    windows.map(move |from| {
        let window = &values[from..(from + WINDOW + 4).min(values.len())];
        let count = (window.len() - 4) as f64;
        let variance = window.windows(5).map(|x| difference(x).powi(2)).sum::<f64>() / (SQUARES * count);
        (variance, (window[window.len() - 1] - window[0]) / (count + 3.0))
    })
}

/// Middle one of some values.
fn median(values: &mut [f64]) -> f64 {
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}

/// Deviation of the instants at which a position was taken from those of the samples, in samples: by as much its noise grows with
/// speed, in the faster half of the windows over the slower one. 0 where it does not.
pub fn jitter(position: &[f64]) -> f64 {
    let mut windows: Vec<(f64, f64)> = windows_of_differences(position).collect();
    windows.sort_by(|a, b| a.1.abs().total_cmp(&b.1.abs()));
    let (slow, fast) = windows.split_at(windows.len() / 2);
    if slow.is_empty() {
        return 0.0;
    }
    let medians = |half: &[(f64, f64)]| {
        let [mut variances, mut squares]: [Vec<f64>; 2] =
            [half.iter().map(|w| w.0).collect(), half.iter().map(|w| w.1 * w.1).collect()];
        [median(&mut variances), median(&mut squares)]
    };
    let ([still, slow], [moving, fast]) = (medians(slow), medians(fast));
    // A count rounds nothing where it stands.
    let more = moving - still.max(resolution(position).powi(2));
    if fast > slow { (more.max(0.0) / (fast - slow)).sqrt() } else { 0.0 }
}

/// Deviation about the parabola in the middle one of windows of so many samples.
pub fn usual_deviation(values: &[f64], window: usize) -> f64 {
    let mut variances: Vec<f64> = values.chunks_exact(window).map(detrended_variance).collect();
    if variances.is_empty() { detrended_variance(values).sqrt() } else { median(&mut variances).sqrt() }
}

/// Deviation in the quiet ones of these windows, or of all where there is none.
fn quiet_deviation(values: &[f64], (quantile, deviate): (f64, f64), counts: impl Fn(&[f64]) -> bool) -> f64 {
    let windows = || values.chunks_exact(WINDOW);
    let mut variances: Vec<f64> = windows().filter(|window| counts(window)).map(detrended_variance).collect();
    if variances.is_empty() {
        variances = windows().map(detrended_variance).collect();
    }
    if variances.is_empty() {
        return detrended_variance(values).sqrt();
    }
    let rank = ((variances.len() - 1) as f64 * quantile).round() as usize;
    let (_, quiet, _) = variances.select_nth_unstable_by(rank, f64::total_cmp);
    (*quiet / chi_square_ratio(deviate, (WINDOW - 3) as f64)).sqrt()
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
    fn an_end_of_the_range_hides_no_noise() {
        // Two fifths of the time at the end, and the noise in front of the converter.
        let values: Vec<f64> = white(20_000, 2)
            .iter()
            .enumerate()
            .map(|(i, e)| (2.0 * (1e-3 * i as f64).sin() + 0.02 * e).clamp(-1.2, 1.2))
            .collect();
        let found = bridge_deviation(&values);
        assert!((found / 0.02 - 1.0).abs() < 0.06, "{found}");
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
    fn instants_that_jitter_show_in_how_a_positions_noise_grows_with_speed() {
        const COUNT_RAD: f64 = 5e-5;
        let position = |jitter: f64| -> Vec<f64> {
            let (at, read) = (white(20_000, 3), white(20_000, 4));
            let taken = at.iter().enumerate().map(|(i, e)| i as f64 + jitter * e);
            // To and fro at up to 5 rad/s, in counts of a noisy encoder.
            let angle = taken.map(|t| 10.0 * (5e-4 * t).sin());
            angle.zip(&read).map(|(x, e)| (x / COUNT_RAD + 0.3 * e).round() * COUNT_RAD).collect()
        };
        let found = jitter(&position(0.03));
        assert!((found / 0.03 - 1.0).abs() < 0.1, "{found}");
        assert!(jitter(&position(0.0)) < 0.002, "{}", jitter(&position(0.0)));
        // Standing still, it has nothing to show.
        assert_eq!(jitter(&[1.0; 500]), 0.0);
        assert_eq!(jitter(&[1.0; 3]), 0.0);
    }

    #[test]
    fn a_torque_is_as_noisy_as_where_it_rests_if_it_swings_elsewhere() {
        let [noise, chatter] = [9, 10].map(|seed| white(20_000, seed));
        // Of cycles faster than samples nothing in the spectrum is quiet.
        let swing = |i: usize| if i % 5000 < 4200 { 0.5 * chatter[i] } else { 0.0 };
        let values: Vec<f64> = noise.iter().enumerate().map(|(i, e)| swing(i) + 0.01 * e).collect();
        // Six tenths of the windows that are quiet are quieter than the one that tells.
        let found = white_deviation(&values);
        assert!((1.0..1.25).contains(&(found / 0.01)), "{found}");
        assert!(bridge_deviation(&values) > 0.1);
        // Where it is as noisy everywhere, the usual windows tell.
        assert!(white_deviation(&noise) <= standard_deviation(&noise));
    }

    #[test]
    fn a_channel_without_noise_has_none() {
        let values: Vec<f64> = (0..5000).map(|i| 1e-3 * f64::from(i)).collect();
        assert!(quiet_deviation(&values, QUIET, |_| true) < 1e-12);
        // Counts of an encoder that hardly moves: that of a count.
        let counts: Vec<f64> = (0..5000).map(|i| if i < 2500 { 1.0 } else { 1.5 }).collect();
        assert_eq!(standard_deviation(&counts), 0.5 / 12f64.sqrt());
    }
}
