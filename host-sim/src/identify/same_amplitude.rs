//! The evidence that a wave has one amplitude in all logs where each has a phase of its own.
//!
//! A ripple or an eccentricity belongs to the machine: its amplitude A is the same in every log, and only where the angle's
//! zero is differs. Cosine and sine of each log are solved for freely, (c_l, s_l) with precision λ_l and amplitude a_l, which
//! grants each log an amplitude of its own. That is put right here: for c, s ~ N(0, σ²) the amplitude is Rayleigh's, and
//!
//! ln ∫ p(A | σ) Π_l ⟨exp(−½ λ_l |A e^{iφ} − a_l|²)⟩_φ dA − Σ_l ln ∫ N(c, s | 0, σ²) exp(−½ λ_l |(c, s) − (c_l, s_l)|²) dc ds
//!
//! is added to the evidence. ⟨·⟩_φ is exp(−½ λ (A − a)²) e^{−λAa} I₀(λAa).

use super::evidence::log_mean_exp;

/// What an amplitude may differ by from log to log: magnets lose 0.1 to 0.2 % per kelvin, and a motor warms by some ten.
const REPEATS_WITHIN: f64 = 0.02;
/// The integral over A reaches so many deviations about its peak, in so many points.
const REACH: f64 = 6.0;
const POINTS: usize = 121;
/// Logs that know it so many times less well than the best one do not say where it is.
const VAGUE: f64 = 30.0;

/// A wave in one log: amplitude as solved for, and the precision of its two coefficients.
#[derive(Debug, Clone, Copy)]
pub(super) struct Seen {
    /// √(c² + s²).
    pub amplitude: f64,
    /// λ, the geometric mean of the two.
    pub precision: f64,
}

/// ln of the evidence for one amplitude over that for one in each log, both with this deviation of the prior.
pub(super) fn log_ratio(logs: &[Seen], sigma: f64) -> f64 {
    let apart: f64 = logs
        .iter()
        .map(|log| {
            let widened = 1.0 + sigma * sigma * log.precision;
            -widened.ln() - 0.5 * log.precision * log.amplitude.powi(2) / widened
        })
        .sum();
    let precision_at = |log: &Seen, at: f64| 1.0 / (1.0 / log.precision + (REPEATS_WITHIN * at).powi(2));
    let log_density = |at: f64| {
        let likelihood: f64 = logs
            .iter()
            .map(|log| {
                let precision = precision_at(log, at);
                // What is spread by the tolerance is spread over more, not more likely.
                let spread = 0.5 * (precision / log.precision).ln();
                spread - 0.5 * precision * (at - log.amplitude).powi(2)
                    + log_bessel(log.precision * at * log.amplitude)
            })
            .sum();
        (at / (sigma * sigma)).ln() - 0.5 * (at / sigma).powi(2) + likelihood
    };
    // The peak lies among the logs' own amplitudes; where they disagree there may be several.
    let finest = logs.iter().map(|log| log.precision).fold(0.0, f64::max).sqrt().recip();
    let peaks = logs
        .iter()
        .map(|log| (log.amplitude, precision_at(log, log.amplitude).sqrt().recip()))
        .filter(|(_, width)| *width < VAGUE * finest);
    let (low, high) = peaks.fold((f64::INFINITY, 0.0f64), |(low, high), (at, width)| {
        (low.min(at - REACH * width), high.max(at + REACH * width))
    });
    let low = low.max(1e-6 * high);
    let points = (((high - low) / finest * 4.0) as usize).clamp(POINTS, 100 * POINTS);
    let step = (high - low) / points as f64;
    let all: Vec<f64> = (0..points).map(|n| log_density(low + (n as f64 + 0.5) * step)).collect();
    let count = points as f64;
    log_mean_exp(all.into_iter()) + (count * step).ln() - apart
}

/// ln (e^{−x} I₀(x)): Abramowitz and Stegun 9.8.1 and 9.8.2, to 2·10⁻⁷.
fn log_bessel(x: f64) -> f64 {
    let polynomial = |t: f64, c: &[f64]| c.iter().rev().fold(0.0, |sum, c| sum * t + c);
    if x < 3.75 {
        let t = (x / 3.75).powi(2);
        let c = [1.0, 3.515_622_9, 3.089_942_4, 1.206_749_2, 0.265_973_2, 0.036_076_8, 0.004_581_3];
        polynomial(t, &c).ln() - x
    } else {
        let c = [
            0.398_942_28,
            0.013_285_92,
            0.002_253_19,
            -0.001_575_65,
            0.009_162_81,
            -0.020_577_06,
            0.026_355_37,
            -0.016_476_33,
            0.003_923_77,
        ];
        polynomial(3.75 / x, &c).ln() - 0.5 * x.ln()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn seen(amplitude: f64, deviation: f64) -> Seen {
        Seen { amplitude, precision: deviation.powi(-2) }
    }

    #[test]
    fn one_log_says_nothing_of_it() {
        for amplitude in [0.0, 0.02, 0.5] {
            let ratio = log_ratio(&[seen(amplitude, 0.01)], 0.3);
            assert!(ratio.abs() < 0.02, "{amplitude}: {ratio}");
        }
    }

    #[test]
    fn equal_amplitudes_speak_for_it_and_different_ones_against() {
        let equal = log_ratio(&[seen(0.1, 0.001), seen(0.1, 0.001)], 0.3);
        assert!(equal > 2.0 && equal < 6.0, "{equal}");
        let different = log_ratio(&[seen(0.1, 0.001), seen(0.02, 0.001)], 0.3);
        assert!(different < -400.0, "{different}");
        // A log that does not know it has no say.
        let vague = log_ratio(&[seen(0.1, 0.001), seen(0.3, 0.3)], 0.3);
        assert!(vague.abs() < 1.0, "{vague}");
    }
}
