//! Decimation by a linear-phase filter: Hamming-windowed sinc, 20 q + 1 taps, cut-off at the new
//! Nyquist frequency.
//!
//! Only outputs whose filter lies wholly within the record are given: nothing is invented at the ends,
//! and ten new samples are lost at each.

use std::f64::consts::PI;

/// A decimation filter.
#[derive(Debug, Clone)]
pub struct Decimator {
    factor: usize,
    taps: Vec<f64>,
}

impl Decimator {
    /// A filter that keeps every `factor`-th sample; 0 and 1 keep all unchanged.
    pub fn new(factor: usize) -> Self {
        let factor = factor.max(1);
        let half = if factor == 1 { 0 } else { 10 * factor as i64 };
        let mut taps: Vec<f64> = (-half..=half)
            .map(|i| {
                let x = PI * i as f64 / factor as f64;
                let sinc = if i == 0 { 1.0 } else { x.sin() / x };
                sinc * (0.54 + 0.46 * (PI * i as f64 / half.max(1) as f64).cos())
            })
            .collect();
        let sum: f64 = taps.iter().sum();
        taps.iter_mut().for_each(|tap| *tap /= sum);
        Self { factor, taps }
    }

    /// Input positions of the outputs for a record of `count` samples.
    pub fn positions(&self, count: usize) -> Vec<usize> {
        let half = self.taps.len() / 2;
        (half..count.saturating_sub(half)).step_by(self.factor).collect()
    }

    /// The decimated signal, one value for each of [`Self::positions`].
    pub fn apply(&self, signal: &[f64]) -> Vec<f64> {
        let half = self.taps.len() / 2;
        self.positions(signal.len())
            .into_iter()
            .map(|at| signal[at - half..=at + half].iter().zip(&self.taps).map(|(x, tap)| x * tap).sum())
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slow_tones_pass_and_tones_that_would_fold_do_not() {
        let decimator = Decimator::new(10);
        for (hz, gain) in [(10.0, 1.0), (80.0, 0.0)] {
            let signal: Vec<f64> = (0..3000).map(|i| (2.0 * PI * hz * f64::from(i) / 1000.0).cos()).collect();
            for (at, y) in decimator.positions(3000).into_iter().zip(decimator.apply(&signal)) {
                // Ripple of the Hamming window: 53 dB down.
                assert!((y - gain * signal[at]).abs() < 3e-3, "{hz} Hz at {at}: {y}");
            }
        }
    }

    #[test]
    fn a_record_shorter_than_the_filter_gives_nothing() {
        assert!(Decimator::new(10).apply(&[1.0; 150]).is_empty());
    }
}
