//! Butterworth low-pass of fourth order, run forward and backward: no phase, attenuation squared.
//!
//! Two second-order sections with the pole pairs of angle π/8 and 3π/8, by the bilinear transform with
//! pre-warped cut-off. The record is extended at both ends by its point reflection, long enough for
//! the start-up transient to fade, so ends are smooth in value and slope.
//! Source: Oppenheim and Schafer, Discrete-Time Signal Processing. Left out: other orders.

use std::f64::consts::PI;

/// Extension at each end in periods of the cut-off: the slowest pole pair decays by e⁻²π·0.38 in one.
const EXTENSION_PERIODS: f64 = 6.0;

#[derive(Debug, Clone, Copy)]
struct Section {
    b: [f64; 3],
    a: [f64; 2],
}

/// A prepared filter.
#[derive(Debug, Clone, Copy)]
pub struct LowPass {
    sections: [Section; 2],
    extension: usize,
}

impl LowPass {
    /// A low-pass with −3 dB per pass at `cutoff_hz`, which must be below half of `rate_hz`; higher
    /// cut-offs are lowered to 0.45 of the rate.
    pub fn new(cutoff_hz: f64, rate_hz: f64) -> Self {
        let relative = (cutoff_hz / rate_hz).clamp(1e-6, 0.45);
        let k = (PI * relative).tan();
        let section = |angle: f64| {
            // 1/(s² + 2 cos(angle) s + 1) with s = (z − 1)/(k (z + 1))
            let damping = 2.0 * angle.cos();
            let scale = 1.0 / (1.0 + damping * k + k * k);
            let gain = k * k * scale;
            Section {
                b: [gain, 2.0 * gain, gain],
                a: [2.0 * (k * k - 1.0) * scale, (1.0 - damping * k + k * k) * scale],
            }
        };
        Self {
            sections: [section(PI / 8.0), section(3.0 * PI / 8.0)],
            extension: (EXTENSION_PERIODS / relative).ceil() as usize,
        }
    }

    /// The signal filtered forward and backward, of the same length.
    pub fn zero_phase(&self, signal: &[f64]) -> Vec<f64> {
        let count = signal.len();
        if count < 2 {
            return signal.to_vec();
        }
        let extension = self.extension.min(count - 1);
        let (first, last) = (signal[0], signal[count - 1]);
        let before = (1..=extension).rev().map(|i| 2.0 * first - signal[i]);
        let after = (1..=extension).map(|i| 2.0 * last - signal[count - 1 - i]);
        let mut extended: Vec<f64> = before.chain(signal.iter().copied()).chain(after).collect();
        self.pass(&mut extended);
        extended.reverse();
        self.pass(&mut extended);
        extended.reverse();
        extended[extension..extension + count].to_vec()
    }

    fn pass(&self, signal: &mut [f64]) {
        let Some(&start) = signal.first() else { return };
        for Section { b, a } in &self.sections {
            let (mut s1, mut s2) = (0.0, 0.0);
            for x in signal.iter_mut() {
                let input = *x - start;
                let output = b[0] * input + s1;
                s1 = b[1] * input - a[0] * output + s2;
                s2 = b[2] * input - a[1] * output;
                *x = output + start;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tone(hz: f64, rate: f64) -> Vec<f64> {
        (0..4000).map(|i| (2.0 * PI * hz * f64::from(i) / rate).sin()).collect()
    }

    #[test]
    fn a_tone_keeps_its_phase_and_is_halved_at_the_cut_off() {
        let filter = LowPass::new(50.0, 1000.0);
        for (hz, gain) in [(5.0, 1.0 / (1.0 + 0.1f64.powi(8))), (50.0, 0.5)] {
            let signal = tone(hz, 1000.0);
            let filtered = filter.zero_phase(&signal);
            for i in 500..3500 {
                // Away from the ends, the transient has decayed below 1e-6.
                assert!((filtered[i] - gain * signal[i]).abs() < 1e-4, "{hz} {i}");
            }
        }
    }

    #[test]
    fn a_straight_line_passes_unchanged_up_to_its_ends() {
        let line: Vec<f64> = (0..1000).map(|i| 3.0 + 0.5 * f64::from(i)).collect();
        for (x, y) in line.iter().zip(LowPass::new(20.0, 1000.0).zero_phase(&line)) {
            // 1e-6 of a line that rises by 500: the transient left after the extension.
            assert!((x - y).abs() < 5e-4, "{x} {y}");
        }
    }
}
