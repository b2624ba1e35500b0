//! The noise of the two channels of a drive, from the records themselves.
//!
//! Force noise is white, so it lies below the force's spectrum at every frequency; where neither
//! motion nor controller puts power, it is the spectrum. The same holds for the position's noise
//! (rounding of the counts, sensor). Each density is therefore the least of the smoothed spectrum
//! (Welch: medians over overlapping Hann-windowed segments, so that reversals in some of them do not
//! count) over all frequencies. No model is needed for it, so an unmodelled effect does not raise it,
//! unless the effect is white.
//! Left out: noise that is not white; it shows as structure.

use std::f64::consts::PI;

/// Samples in a segment.
const SEGMENT: usize = 256;
/// Neighbouring frequencies that are averaged: the least of many scattered values would lie too low.
const SMOOTHING: usize = 12;
/// Median of a χ² variable with two degrees of freedom over its mean.
const MEDIAN_OVER_MEAN: f64 = std::f64::consts::LN_2;

/// Spectrum of a signal: power per frequency bin, such that white noise of variance 1 gives 1.
/// Medians over segments; a straight line is removed from each.
pub fn spectrum(signal: &[f64]) -> Vec<f64> {
    let segment = SEGMENT.min(signal.len());
    if segment < 16 {
        return Vec::new();
    }
    let window: Vec<f64> =
        (0..segment).map(|i| 0.5 - 0.5 * (2.0 * PI * (i as f64 + 0.5) / segment as f64).cos()).collect();
    let power: f64 = window.iter().map(|w| w * w).sum();
    let turn: Vec<(f64, f64)> =
        (0..segment).map(|i| (2.0 * PI * i as f64 / segment as f64).sin_cos()).collect();
    let starts: Vec<usize> = (0..=signal.len() - segment).step_by(segment / 2).collect();
    // Beyond 64 segments the median hardly moves; the record is then sampled evenly.
    let starts: Vec<usize> = starts.iter().copied().step_by(starts.len().div_ceil(64)).collect();
    let mut powers = vec![Vec::with_capacity(starts.len()); segment / 2];
    for start in starts {
        let piece = without_line(&signal[start..start + segment]);
        let windowed: Vec<f64> = piece.iter().zip(&window).map(|(x, w)| x * w).collect();
        for (bin, powers) in powers.iter_mut().enumerate() {
            let (mut re, mut im) = (0.0, 0.0);
            let mut at = 0;
            for x in &windowed {
                let (sin, cos) = turn[at];
                re += x * cos;
                im += x * sin;
                at += bin;
                if at >= segment {
                    at -= segment;
                }
            }
            powers.push((re * re + im * im) / power);
        }
    }
    powers.iter_mut().map(|values| median(values) / MEDIAN_OVER_MEAN).collect()
}

/// Standard deviation of the white part of a signal.
pub fn white_std(signal: &[f64]) -> f64 {
    let spectrum = spectrum(signal);
    // The lowest bins hold the motion and what the removal of a line did to them.
    let usable = spectrum.get(4..).unwrap_or_default();
    let least = usable
        .windows(SMOOTHING.min(usable.len().max(1)))
        .map(|near| near.iter().sum::<f64>() / near.len() as f64)
        .fold(f64::INFINITY, f64::min);
    if least.is_finite() { least.sqrt() } else { 0.0 }
}

fn without_line(piece: &[f64]) -> Vec<f64> {
    let count = piece.len() as f64;
    let centre = 0.5 * (count - 1.0);
    let mean = piece.iter().sum::<f64>() / count;
    let (mut cross, mut square) = (0.0, 0.0);
    for (i, x) in piece.iter().enumerate() {
        let t = i as f64 - centre;
        cross += t * (x - mean);
        square += t * t;
    }
    piece.iter().enumerate().map(|(i, x)| x - mean - cross / square * (i as f64 - centre)).collect()
}

/// Median; the slice is reordered. 0 for none.
pub fn median(values: &mut [f64]) -> f64 {
    if values.is_empty() {
        return 0.0;
    }
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// Reproducible normal noise of variance 1: sums of twelve uniform values.
    pub(in super::super) fn normal(count: usize, mut seed: u64) -> Vec<f64> {
        let mut uniform = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 11) as f64 / (1u64 << 53) as f64 - 0.5
        };
        (0..count).map(|_| (0..12).map(|_| uniform()).sum()).collect()
    }

    #[test]
    fn white_noise_under_a_large_slow_signal_is_found() {
        let noise = normal(20_000, 3);
        let signal: Vec<f64> =
            noise.iter().enumerate().map(|(i, n)| 0.02 * n + 5.0 * (0.003 * i as f64).sin()).collect();
        let std = white_std(&signal);
        // The least of about ten independent averages of 12 bins, each good to 8 %.
        assert!((std / 0.02 - 1.0).abs() < 0.15, "{std}");
    }

    #[test]
    fn rounding_to_counts_is_noise_of_a_twelfth() {
        let signal: Vec<f64> = (0..20_000).map(|i| (5000.0 * (0.002 * f64::from(i)).sin()).round()).collect();
        let std = white_std(&signal);
        assert!((std * 12f64.sqrt() - 1.0).abs() < 0.25, "{std}");
    }
}
