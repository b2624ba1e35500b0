//! A filter that makes the force residual white with variance one, so that it can be judged.
//!
//! With force noise of density S_F and position noise of density S_q the residual of the inverse model
//! has the density S(f) = S_F + (2πf)⁴ M² S_q. The filter has the gain 1/√S up to the band limit and
//! falls to zero over the next third; linear phase, by frequency sampling with a Hann window
//! (Oppenheim and Schafer). It is applied to both sides of the equation alike and evaluated only every
//! few samples. Samples that tell nothing have weight zero on both sides before it.

use std::f64::consts::PI;

use super::model::dot;

/// Half length in periods of the band limit.
const HALF_LENGTH_PERIODS: f64 = 4.0;

/// A prepared whitening filter.
#[derive(Debug, Clone)]
pub struct Whitener {
    taps: Vec<f64>,
    factor: usize,
    /// Output samples that share one independent noise value.
    pub samples_per_noise: f64,
}

impl Whitener {
    /// A filter for records at `rate_hz`, passing up to `band_hz`, for white force noise of
    /// `force_std`, white position noise of `position_std` and an inertia.
    pub fn new(rate_hz: f64, band_hz: f64, force_std: f64, position_std: f64, inertia: f64) -> Self {
        let half = (HALF_LENGTH_PERIODS * rate_hz / band_hz).ceil() as i64;
        let density =
            |hz: f64| force_std.powi(2) + ((2.0 * PI * hz).powi(2) * inertia * position_std).powi(2);
        let pass = |hz: f64| {
            let beyond = ((hz - band_hz) / (band_hz / 3.0)).clamp(0.0, 1.0);
            0.5 + 0.5 * (PI * beyond).cos()
        };
        let bins = 4 * half;
        let gains: Vec<f64> = (0..=bins)
            .map(|bin| {
                let hz = 0.5 * rate_hz * bin as f64 / bins as f64;
                pass(hz) / density(hz).max(f64::MIN_POSITIVE).sqrt()
            })
            .collect();
        let taps = (-half..=half)
            .map(|i| {
                let sum: f64 = gains
                    .iter()
                    .enumerate()
                    .map(|(bin, gain)| {
                        let weight = if bin == 0 || bin as i64 == bins { 0.5 } else { 1.0 };
                        weight * gain * (PI * (bin as i64 * i) as f64 / bins as f64).cos()
                    })
                    .sum();
                let window = 0.5 + 0.5 * (PI * i as f64 / (half + 1) as f64).cos();
                window * sum / bins as f64
            })
            .collect::<Vec<f64>>();
        // Outputs at 8/3 of the band limit: the transition band's end is their Nyquist frequency.
        let factor = ((rate_hz / (band_hz * 8.0 / 3.0)).floor() as usize).max(1);
        let mut whitener = Self { taps, factor, samples_per_noise: 1.0 };
        whitener.normalise(force_std, position_std, inertia, rate_hz);
        whitener.samples_per_noise = (rate_hz / factor as f64 / (2.0 * band_hz * 7.0 / 6.0)).max(1.0);
        whitener
    }

    /// Brings the variance of the output for the assumed noise to one.
    fn normalise(&mut self, force_std: f64, position_std: f64, inertia: f64, rate_hz: f64) {
        let force: f64 = self.taps.iter().map(|tap| tap * tap).sum::<f64>() * force_std.powi(2);
        let tap = |i: i64| if i < 0 { 0.0 } else { self.taps.get(i as usize).copied().unwrap_or(0.0) };
        let curved: f64 = (-1..=self.taps.len() as i64)
            .map(|i| (tap(i - 1) - 2.0 * tap(i) + tap(i + 1)).powi(2))
            .sum::<f64>()
            * (rate_hz.powi(2) * inertia * position_std).powi(2);
        let scale = 1.0 / (force + curved).sqrt().max(f64::MIN_POSITIVE);
        self.taps.iter_mut().for_each(|tap| *tap *= scale);
    }

    /// Input positions of the outputs for a record of `count` samples.
    pub fn positions(&self, count: usize) -> Vec<usize> {
        let half = self.taps.len() / 2;
        (half..count.saturating_sub(half)).step_by(self.factor).collect()
    }

    /// The filtered signal at [`Self::positions`]; `weight` multiplies the samples first.
    pub fn apply(&self, signal: &[f64], weight: &[f64]) -> Vec<f64> {
        let half = self.taps.len() / 2;
        let weighted: Vec<f64> = signal.iter().zip(weight).map(|(x, w)| x * w).collect();
        self.positions(signal.len())
            .into_iter()
            .map(|at| dot(&weighted[at - half..=at + half], &self.taps))
            .collect()
    }

    /// Input samples per output.
    pub fn factor(&self) -> usize {
        self.factor
    }

    /// Half the filter's length in input samples.
    pub fn half_length(&self) -> usize {
        self.taps.len() / 2
    }
}

#[cfg(test)]
mod tests {
    use super::super::noise::tests::normal;
    use super::*;
    use crate::fit::drive::record::central_difference;

    #[test]
    fn force_and_encoder_noise_come_out_white_with_variance_one() {
        let (rate, inertia) = (1000.0, 0.02);
        let (force, position) = (normal(20_000, 1), normal(20_000, 2));
        let acceleration = central_difference(&central_difference(&position, 1e-3), 1e-3);
        let noise: Vec<f64> =
            force.iter().zip(&acceleration).map(|(f, a)| 0.01 * f - inertia * 5e-6 * a).collect();
        let whitener = Whitener::new(rate, 90.0, 0.01, 5e-6, inertia);
        let white = whitener.apply(&noise, &vec![1.0; noise.len()]);
        let variance = white.iter().map(|x| x * x).sum::<f64>() / white.len() as f64;
        // 6500 outputs give the variance to 2 %; central differences at 90 Hz are 3 % short.
        assert!((variance - 1.0).abs() < 0.1, "{variance}");
        let far: f64 = white.windows(12).map(|w| w[0] * w[11]).sum::<f64>() / white.len() as f64;
        assert!(far.abs() < 0.05, "{far}");
    }
}
