//! Frequencies at which a friction channel may ring: peaks in the spectrum of what the baseline leaves.
//!
//! Mean periodogram of Hann windows of `WINDOW_S`, on a logarithmic grid of frequencies, times the square of
//! the frequency (what jumps leave falls with it). Only where a search starts; nothing is concluded.

use std::f64::consts::TAU;

/// Length of a window, s: a few periods of the slowest mode.
const WINDOW_S: f64 = 0.25;
/// Lowest frequency, Hz.
const LOWEST_HZ: f64 = 12.0;
/// Step of the grid.
const RATIO: f64 = 1.02;
/// Peaks that are given back.
const PEAKS: usize = 4;

/// The most striking peaks over all logs, Hz; `residuals` with the median step of each.
pub fn peaks(residuals: &[(&[f64], f64)]) -> Vec<f64> {
    let fastest_s = residuals.iter().map(|r| r.1).fold(0.0, f64::max);
    let highest_hz = (0.45 / fastest_s.max(1e-6)).min(800.0);
    let mut grid_hz = vec![LOWEST_HZ];
    while let Some(last) = grid_hz.last().map(|hz| hz * RATIO).filter(|hz| *hz < highest_hz) {
        grid_hz.push(last);
    }
    let power: Vec<f64> = grid_hz.iter().map(|hz| hz * hz * power_at(residuals, *hz)).collect();
    let mut found: Vec<(f64, f64)> = (1..power.len().saturating_sub(1))
        .filter(|i| power[*i] > power[i - 1] && power[*i] >= power[i + 1])
        .map(|i| (power[i], grid_hz[i]))
        .collect();
    found.sort_by(|a, b| b.0.total_cmp(&a.0));
    found.into_iter().take(PEAKS).map(|(_, hz)| hz).collect()
}

fn power_at(residuals: &[(&[f64], f64)], hz: f64) -> f64 {
    let mut sum = 0.0;
    for (values, step_s) in residuals {
        let count = ((WINDOW_S / step_s) as usize).max(8);
        let (cosine, sine) = ((TAU * hz * step_s).cos(), (TAU * hz * step_s).sin());
        for window in values.chunks_exact(count) {
            let (mut c, mut s, mut re, mut im) = (1.0, 0.0, 0.0, 0.0);
            for (i, x) in window.iter().enumerate() {
                let hann = 0.5 - 0.5 * (TAU * i as f64 / count as f64).cos();
                re += hann * x * c;
                im += hann * x * s;
                (c, s) = (c * cosine - s * sine, s * cosine + c * sine);
            }
            sum += (re * re + im * im) / (count * count) as f64;
        }
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::super::super::noise::tests::white;
    use super::*;

    #[test]
    fn a_ring_after_jumps_is_found_in_noise() {
        let noise = white(20_000, 8);
        let values: Vec<f64> = noise
            .iter()
            .enumerate()
            .map(|(i, e)| {
                let t = 1e-3 * (i % 3000) as f64;
                (-12.0 * t).exp() * (TAU * 131.0 * t).cos() + 0.02 * e
            })
            .collect();
        let found = peaks(&[(&values, 1e-3)]);
        // Half a step of the grid.
        assert!((found[0] / 131.0 - 1.0).abs() < 0.02, "{found:?}");
    }
}
