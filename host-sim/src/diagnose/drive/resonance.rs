//! Whitening of a residual whose noise has passed a resonance.
//!
//! In a contact log the measured friction T drives the disc, and the shaft hands the disc's motion on as
//! H T, H = ω²/D, D = s² + 2ζω s + ω². The residual then has the density S_u + S_T |H|²: noise of the
//! torque, and of the friction behind a resonance that may be sharp. The filter g D/D′ with
//! |D′|² S_u = S_u |D|² + S_T ω⁴ makes it white again: the innovations of the stationary Kalman filter
//! of a disc that the measured friction drives (Anderson and Moore, Optimal Filtering, 1979). With
//! r = S_T/S_u: ω′² = ω² √(1 + r) and 2ζ′²ω′² = ω′² − ω² + 2ζ²ω². The gain g makes the mean of ln |g D/D′| zero
//! over the judged band: then sums of squares with and without the filter compare as likelihoods, and
//! a filter cannot gain by turning a part of the band down.
//! Discrete by the bilinear transform, exact at ω. It runs at the rate of the whitened samples.

use super::conditioned::DriveLog;

/// A mode between the friction and the motor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Resonance {
    /// Undamped angular frequency, rad/s.
    pub omega_rad_s: f64,
    /// Damping ratio.
    pub damping_ratio: f64,
}

/// A second-order section.
#[derive(Debug, Clone, Copy)]
struct Section {
    b: [f64; 3],
    a: [f64; 2],
}

/// How well the noise's densities are known over the band: a filter must gain more than this.
const DENSITY_ERROR: f64 = 0.15;
/// Damping below this is not resolved.
const LEAST_DAMPING: f64 = 1e-3;

impl Section {
    /// (n0 s² + n1 s + n2)/(s² + d1 s + d2), at samples of `step_s`, exact at `omega`.
    fn new(numerator: [f64; 3], denominator: [f64; 2], omega: f64, step_s: f64) -> Self {
        let bend = 0.5 * omega * step_s;
        // Above the Nyquist frequency nothing can be exact; the plain transform is taken.
        let k = if bend < 1.4 { omega / bend.tan() } else { 2.0 / step_s };
        let scale = 1.0 / (k * k + denominator[0] * k + denominator[1]);
        let [n0, n1, n2] = numerator;
        Self {
            b: [
                scale * (n0 * k * k + n1 * k + n2),
                scale * 2.0 * (n2 - n0 * k * k),
                scale * (n0 * k * k - n1 * k + n2),
            ],
            a: [
                scale * 2.0 * (denominator[1] - k * k),
                scale * (k * k - denominator[0] * k + denominator[1]),
            ],
        }
    }

    fn apply(&self, signal: &[f64]) -> Vec<f64> {
        let (mut s1, mut s2) = (0.0, 0.0);
        let pass = |x: &f64| {
            let y = self.b[0] * x + s1;
            s1 = self.b[1] * x - self.a[0] * y + s2;
            s2 = self.b[2] * x - self.a[1] * y;
            y
        };
        signal.iter().map(pass).collect()
    }
}

/// The filters of one resonance in one log.
#[derive(Debug, Clone, Copy)]
pub struct ResonanceFilters {
    whitening: Section,
    disc: Section,
}

impl Resonance {
    /// The filters at samples of `step_s`, for a density of the friction's noise over the torque's and a
    /// judged band.
    pub fn filters(self, noise_ratio: f64, step_s: f64, band_hz: f64) -> ResonanceFilters {
        let (w, zeta) = (self.omega_rad_s, self.damping_ratio.max(LEAST_DAMPING));
        let square = w * w;
        let wide = square * (1.0 + noise_ratio).sqrt();
        let damped = (wide - square + 2.0 * zeta * zeta * square) / 2.0;
        let own = [2.0 * zeta * w, square];
        let wider = [2.0 * damped.max(0.0).sqrt(), wide];
        let steps = 256;
        let mean_log = (0..steps)
            .map(|i| {
                let s = 2.0 * std::f64::consts::PI * band_hz * (f64::from(i) + 0.5) / f64::from(steps);
                let size = |d: [f64; 2]| (d[1] - s * s).hypot(d[0] * s).ln();
                size(own) - size(wider)
            })
            .sum::<f64>()
            / f64::from(steps);
        let gain = (-mean_log).exp() * (1.0 + DENSITY_ERROR).sqrt();
        let whitening = Section::new([gain, gain * own[0], gain * own[1]], wider, w, step_s);
        ResonanceFilters { whitening, disc: Section::new([0.0, 0.0, square], own, w, step_s) }
    }

    /// |H|² at a frequency.
    pub fn gain_squared(self, hz: f64) -> f64 {
        let x = (2.0 * std::f64::consts::PI * hz / self.omega_rad_s).powi(2);
        let zeta = self.damping_ratio.max(LEAST_DAMPING);
        1.0 / ((1.0 - x).powi(2) + 4.0 * zeta * zeta * x)
    }
}

impl ResonanceFilters {
    /// Whitens a signal.
    pub fn whiten(&self, signal: &[f64]) -> Vec<f64> {
        self.whitening.apply(signal)
    }

    /// What the disc hands on to the motor of a torque on it.
    pub fn through_disc(&self, signal: &[f64]) -> Vec<f64> {
        self.disc.apply(signal)
    }
}

/// Density of the friction's noise over that of M2's torque; `None` where there is no contact.
pub fn noise_ratio(log: &DriveLog) -> Option<f64> {
    let friction = log.contact.as_ref()?.friction_std.powi(2);
    let torque = (log.force_std.powi(2) - friction).max(0.05 * log.force_std.powi(2));
    Some((friction / torque).clamp(0.05, 20.0))
}

#[cfg(test)]
mod tests {
    use super::super::noise::tests::normal;
    use super::*;

    #[test]
    fn noise_behind_a_sharp_resonance_comes_out_white() {
        let (step_s, count) = (2.5e-3, 40_000);
        let resonance = Resonance { omega_rad_s: 80.0, damping_ratio: 0.02 };
        for ratio in [0.3, 1.0, 4.0] {
            let filters = resonance.filters(ratio, step_s, 0.5 / step_s);
            let (torque, friction) = (normal(count, 4), normal(count, 5));
            let passed = filters.through_disc(&friction);
            let size = f64::sqrt(1.0 / (1.0 + ratio));
            let residual: Vec<f64> =
                torque.iter().zip(&passed).map(|(u, t)| size * (u - ratio.sqrt() * t)).collect();
            let white = filters.whiten(&residual);
            let white = &white[4000..];
            let variance = white.iter().map(|x| x * x).sum::<f64>() / white.len() as f64;
            // The gain that the logarithmic mean asks for grows with the width of D′: up to 1.6 here.
            let kept = variance * (1.0 + ratio) / (1.0 + DENSITY_ERROR);
            assert!((0.9..1.8).contains(&kept), "{ratio} {kept}");
            // White noise, which a disc that is not there has not coloured, must not shrink.
            let wrong = filters.whiten(&torque);
            assert!(wrong.iter().map(|x| x * x).sum::<f64>() > (1.0 + 0.5 * DENSITY_ERROR) * count as f64);
            for lag in [1, 8, 16, 31] {
                let products: f64 = white.windows(lag + 1).map(|w| w[0] * w[lag]).sum();
                let correlation = products / white.len() as f64;
                assert!(correlation.abs() < 0.04, "{ratio} {lag} {correlation}");
            }
        }
    }
}
