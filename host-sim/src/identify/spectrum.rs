//! Power spectral density of a channel by Welch's method (1967): means over segments that overlap by half, each behind a
//! Hann window.

use std::f64::consts::TAU;

use rustfft::FftPlanner;
use rustfft::num_complex::Complex;

/// Samples of a segment: a line is found to a thousandth of the sampling rate, and 20 s at a kilohertz give 38 segments.
const SEGMENT: usize = 1024;
/// Shortest segment that is called a spectrum.
const SHORTEST: usize = 64;
/// A peak is looked for within so many places on either side: a window's line is four wide.
const BESIDE: usize = 4;
/// Places over which the level around a peak is taken.
const AROUND: usize = 32;
/// Frequency below which causes live, Hz; above it residuals only tell how white they are.
pub const SLOW_HZ: f64 = 30.0;

/// Power spectral density at even frequencies from 0 to half the sampling rate.
pub struct Spectrum {
    /// Cycles per sample from one place to the next.
    step: f64,
    /// (Unit of the channel)² per cycle per sample, two-sided: white noise of variance σ² has σ² everywhere.
    density: Vec<f64>,
}

impl Spectrum {
    /// Of a channel's samples; `None` where there are fewer than a short segment.
    pub fn new(values: &[f64]) -> Option<Self> {
        let segment = SEGMENT.min(1 << (values.len() / 4).max(1).ilog2());
        if segment < SHORTEST {
            return None;
        }
        let window: Vec<f64> =
            (0..segment).map(|i| 0.5 - 0.5 * (TAU * i as f64 / segment as f64).cos()).collect();
        let power: f64 = window.iter().map(|w| w * w).sum();
        let transform = FftPlanner::new().plan_fft_forward(segment);
        let mut density = vec![0.0; segment / 2 + 1];
        let mut count = 0.0;
        for from in (0..=values.len() - segment).step_by(segment / 2) {
            let part = &values[from..from + segment];
            let mean = part.iter().sum::<f64>() / segment as f64;
            let mut line: Vec<Complex<f64>> =
                part.iter().zip(&window).map(|(x, w)| Complex::new((x - mean) * w, 0.0)).collect();
            transform.process(&mut line);
            density.iter_mut().zip(&line).for_each(|(d, x)| *d += x.norm_sqr() / power);
            count += 1.0;
        }
        density.iter_mut().for_each(|d| *d /= count);
        Some(Self { step: 1.0 / segment as f64, density })
    }

    /// Standard deviation of the white noise in it: from the median density in that eighth of the frequencies which has least,
    /// since a line stands in one of them and what is slow in the lowest.
    pub fn white_deviation(&self) -> f64 {
        const BANDS: usize = 8;
        let used = &self.density[1..];
        let median = |part: &[f64]| {
            let mut sorted = part.to_vec();
            *sorted.select_nth_unstable_by(part.len() / 2, f64::total_cmp).1
        };
        used.chunks_exact(used.len() / BANDS).map(median).fold(f64::INFINITY, f64::min).sqrt()
    }

    /// Where the density is largest beyond so many cycles per sample, and the variance there beside white noise.
    pub fn beyond(&self, cycles: f64) -> (f64, f64) {
        let white = self.white_deviation().powi(2);
        let from = ((cycles / self.step).ceil() as usize).min(self.density.len() - 1);
        let beyond = || self.density.iter().enumerate().skip(from);
        let largest = beyond().max_by(|a, b| a.1.total_cmp(b.1)).map_or(from, |(at, _)| at);
        let variance = 2.0 * self.step * beyond().map(|(_, density)| (density - white).max(0.0)).sum::<f64>();
        (largest as f64 * self.step, variance)
    }

    /// Frequencies of the highest peaks over what is around them, in cycles per sample, the highest first.
    pub fn peaks(&self, most: usize) -> Vec<f64> {
        let n = self.density.len();
        let around = |at: usize, reach: usize| at.saturating_sub(reach)..(at + reach + 1).min(n);
        let mut found: Vec<(f64, usize)> = (1..n)
            .filter(|&at| around(at, BESIDE).all(|other| self.density[other] <= self.density[at]))
            .map(|at| {
                let mut level = self.density[around(at, AROUND)].to_vec();
                let middle = level.len() / 2;
                let level = *level.select_nth_unstable_by(middle, f64::total_cmp).1;
                (self.density[at] / level.max(f64::MIN_POSITIVE), at)
            })
            .collect();
        found.sort_by(|a, b| b.0.total_cmp(&a.0));
        found.into_iter().take(most).map(|(_, at)| at as f64 * self.step).collect()
    }
}

/// Mean spectral density below a frequency over that of all: from the variance of means over blocks of half a period of it,
/// which is its spectral window.
pub fn share_below(hz: f64, values: &[f64], step_s: f64) -> f64 {
    let block = (0.5 / (hz * step_s)).round().max(1.0) as usize;
    let all = values.iter().map(|x| x * x).sum::<f64>() / values.len().max(1) as f64;
    let (mut sum, mut count) = (0.0, 0);
    for chunk in values.chunks_exact(block) {
        sum += chunk.iter().sum::<f64>().powi(2) / block as f64;
        count += 1;
    }
    if all > 0.0 && count > 0 { sum / f64::from(count) / all } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::identify::noise::tests::white;

    /// Samples from one strike to the next, and decay of what rings in a sample.
    const EVERY: usize = 500;
    const DECAY: f64 = 0.01;

    /// A slow signal, a mode that rings at `ring` cycles per sample, and white noise.
    fn ringing(ring: f64, noise: f64) -> Vec<f64> {
        let struck = |i: usize| {
            let t = (i % EVERY) as f64;
            (-DECAY * t).exp() * (TAU * ring * t).sin()
        };
        white(20_000, 3)
            .iter()
            .enumerate()
            .map(|(i, e)| (TAU * 0.002 * i as f64).sin() + struck(i) + noise * e)
            .collect()
    }

    /// Density of noise and ringing at `f` cycles per sample: that of white noise, and of a damped sine, struck so often.
    fn density(f: f64, ring: f64, noise: f64) -> f64 {
        let z = Complex::from_polar((-DECAY).exp(), -TAU * f);
        let one = Complex::new(1.0, 0.0);
        let sine = z * (TAU * ring).sin() / (one - z * 2.0 * (TAU * ring).cos() + z * z);
        noise * noise + sine.norm_sqr() / EVERY as f64
    }

    #[test]
    fn white_noise_is_measured_in_the_quietest_part_of_the_band() {
        for ring in [0.03, 0.12, 0.243, 0.31, 0.45] {
            for noise in [0.001, 0.01, 0.1] {
                let found = Spectrum::new(&ringing(ring, noise)).expect("long enough").white_deviation();
                // The slow signal stands in the lowest eighth.
                let least = (4..32).map(|n| density(f64::from(n) / 64.0, ring, noise));
                let expected = least.fold(f64::INFINITY, f64::min).sqrt();
                assert!((found / expected - 1.0).abs() < 0.1, "{ring} {noise}: {found} {expected}");
            }
        }
    }

    #[test]
    fn the_highest_peak_is_the_ring() {
        for ring in [0.03, 0.12, 0.243, 0.31, 0.45] {
            let found = Spectrum::new(&ringing(ring, 0.01)).expect("long enough").peaks(3);
            assert!(found.iter().any(|f| (f - ring).abs() < 0.0015), "{ring}: {found:?}");
        }
    }

    #[test]
    fn a_few_samples_have_no_spectrum() {
        assert!(Spectrum::new(&[0.0; 200]).is_none() && Spectrum::new(&[]).is_none());
        assert!(Spectrum::new(&[0.0; 256]).is_some());
    }
}
