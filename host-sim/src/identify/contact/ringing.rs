//! What swings faster than a model can follow from sample to sample, as noise of the friction channel.
//!
//! A tip that breaks away between two samples strikes the torque ring, and one that sticks and slips within a few samples
//! drives it: the channel then shows a line that is seen anywhere in the band, mirrored. When it was struck is not known, so
//! that no phase can be predicted. But each sample tells more of it:
//!
//! e_i = x_i + n_i,  z_{i+1} = d R(θ_i) z_i + s_i,  x = first of z
//!
//! with the angle θ a step and the energy E of what the channel shows above the modes that are simulated, taken over a few
//! milliseconds, and s of variance (1 − d²) E/2. Kalman's filter turns residuals into innovations, which are independent with the
//! variances it gives. It is the same linear map for all hypotheses, with determinant 1, so that their likelihoods compare.

use std::f64::consts::TAU;

use crate::identify::filters::gaussian;
use crate::identify::spectrum::Spectrum;

/// Width of the filter that passes what is fast, samples: of what is seen at 0.4 cycles per sample 75 % pass, of what stands 0.1 %.
const FAST: f64 = 1.2;
/// Cosine of the angle in a step from which on it is fast: 0.28 cycles per sample, beyond the modes that are simulated (0.25).
const FASTER: f64 = -0.19;
/// Width over which angle and energy are taken, samples: ten periods of the slowest.
const WIDTH: f64 = 5.0;
/// It swings where there is so many times the energy of white noise.
const OVER_NOISE: f64 = 2.0;
/// Share of the energy that is new in each sample, 1 − d²: what 600 Hz with 1.4 % damping lose in a millisecond.
const RENEWED: f64 = 0.1;

/// What swings in one log's channel.
#[derive(Debug, Clone)]
pub struct Ringing {
    /// d (cos θ, sin θ), by sample.
    rotations: Vec<[f64; 2]>,
    /// Variance of what is new, by sample.
    strikes: Vec<f64>,
}

/// Cycles per sample at which most of what a channel swings with is that is too fast to be followed, and the RMS of all that.
pub fn fast_line(channel: &[f64]) -> Option<(f64, f64)> {
    let (cycles, variance) = Spectrum::new(channel)?.beyond(FASTER.acos() / TAU);
    Some((cycles, variance.sqrt()))
}

/// A filter in which the noise of each sample is known.
#[derive(Debug, Clone)]
pub(super) struct Filter {
    rotations: Vec<[f64; 2]>,
    gains: Vec<[f64; 2]>,
    /// Variance of the state before each sample.
    pub(super) rung: Vec<f64>,
}

/// Every other sample with its sign changed.
fn alternated(values: &[f64]) -> Vec<f64> {
    values.iter().enumerate().map(|(i, x)| if i % 2 == 0 { *x } else { -x }).collect()
}

impl Ringing {
    /// In a channel with white noise of this deviation; `None` where nothing swings.
    pub(super) fn new(channel: &[f64], noise: f64) -> Option<Self> {
        // Turned by half a cycle a sample, what is fast is slow.
        let fast = gaussian(&alternated(channel), FAST, 0);
        let own = |lag: usize| -> Vec<f64> {
            let product = |i: usize| fast[i] * fast[i.saturating_sub(lag)];
            gaussian(&(0..fast.len()).map(product).collect::<Vec<_>>(), WIDTH, 0)
        };
        let (power, next) = (own(0), own(1));
        // Means of the products of white noise: a Gaussian's with itself, and with itself a sample on.
        let of_noise = noise * noise * 0.5 / (std::f64::consts::PI.sqrt() * FAST);
        let of_noise_next = of_noise * (-0.25 / (FAST * FAST)).exp();
        let each = power.iter().zip(&next).map(|(power, next)| {
            let (over, over_next) = (power - of_noise, next - of_noise_next);
            let cosine = -(over_next / over.max(f64::MIN_POSITIVE)).clamp(-1.0, 1.0);
            if over < OVER_NOISE * of_noise || cosine > FASTER {
                return ([0.0; 2], 0.0);
            }
            let angle = cosine.acos();
            // What the filter took of it.
            let passed = (-(FAST * (std::f64::consts::PI - angle)).powi(2)).exp();
            let energy = 2.0 * over / passed;
            ([cosine, angle.sin()].map(|x| x * (1.0 - RENEWED).sqrt()), 0.5 * RENEWED * energy)
        });
        let (rotations, strikes): (_, Vec<f64>) = each.unzip();
        strikes.iter().any(|strike| *strike > 0.0).then_some(Self { rotations, strikes })
    }

    /// Kalman's gains where each sample's own noise has this variance; what is not used tells nothing.
    pub(super) fn filter(&self, variance: &[f64], used: &[bool]) -> Filter {
        let (mut p11, mut p12, mut p22) = (0.0f64, 0.0f64, 0.0f64);
        let (mut gains, mut rung) = (Vec::with_capacity(variance.len()), Vec::with_capacity(variance.len()));
        let steps = self.rotations.iter().zip(&self.strikes);
        for (([c, s], strike), (variance, used)) in steps.zip(variance.iter().zip(used)) {
            (p11, p12, p22) = (
                c * c * p11 + 2.0 * c * s * p12 + s * s * p22 + strike,
                -c * s * p11 + (c * c - s * s) * p12 + c * s * p22,
                s * s * p11 - 2.0 * c * s * p12 + c * c * p22 + strike,
            );
            rung.push(p11);
            let gain = if *used {
                [p11, p12].map(|p| p / (p11 + variance).max(f64::MIN_POSITIVE))
            } else {
                [0.0; 2]
            };
            p22 -= gain[1] * p12;
            p12 -= gain[0] * p12;
            p11 -= gain[0] * p11;
            gains.push(gain);
        }
        Filter { rotations: self.rotations.clone(), gains, rung }
    }
}

impl Filter {
    /// What residuals are beyond what the mode was seen to ring with.
    pub(super) fn innovations(&self, residual: &mut [f64]) {
        let (mut x, mut y) = (0.0, 0.0);
        for (r, ([c, s], gain)) in residual.iter_mut().zip(self.rotations.iter().zip(&self.gains)) {
            (x, y) = (c * x + s * y, c * y - s * x);
            *r -= x;
            x += gain[0] * *r;
            y += gain[1] * *r;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::identify::filters::rms;
    use crate::identify::noise::tests::white;
    use model_core::sensor::{SecondOrder, SecondOrderState};

    const STEP_S: f64 = 1e-3;
    const NOISE: f64 = 0.01;

    /// What a mode and noise show of a torque that jumps every 300 samples, at another instant between two of them
    /// each time; and the torque.
    fn struck(hz: f64, jump: f64) -> (Vec<f64>, Vec<f64>) {
        let at = |t: f64| {
            let count = (t.max(0.0) / 300.0).floor();
            let late = (t.max(0.0) + count * 0.37 % 1.0) / 300.0;
            if late.floor() as i64 % 2 == 0 { jump } else { 0.0 }
        };
        let mode = SecondOrder::new(hz, 0.02, 0.05 * STEP_S);
        let mut state = SecondOrderState::holding(jump);
        let noise = white(6000, 5);
        let mut shown = Vec::new();
        for i in 0..6000u32 {
            let t = f64::from(i);
            for j in 1..=20 {
                mode.step(&mut state, at(t - 1.0 + 0.05 * f64::from(j)));
            }
            shown.push(state.value + NOISE * noise[i as usize]);
        }
        (shown, (0..6000).map(|i| at(f64::from(i))).collect())
    }

    /// Innovations, and those over their deviations.
    fn filtered(shown: &[f64], torque: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let variance = vec![NOISE * NOISE; shown.len()];
        let filter =
            Ringing::new(shown, NOISE).expect("it swings").filter(&variance, &vec![true; shown.len()]);
        let mut innovations: Vec<f64> = shown.iter().zip(torque).map(|(y, x)| y - x).collect();
        filter.innovations(&mut innovations);
        let over =
            innovations.iter().zip(&filter.rung).map(|(e, p)| e / (p + NOISE * NOISE).sqrt()).collect();
        (innovations, over)
    }

    #[test]
    fn what_a_ring_shows_after_a_jump_is_told_by_its_last_samples() {
        for hz in [620.0, 550.0, 680.0, 1430.0] {
            let (shown, torque) = struck(hz, 1.0);
            let residual: Vec<f64> = shown.iter().zip(&torque).map(|(y, x)| y - x).collect();
            // The jump itself and the samples that tell the ring's state are left out.
            let later = |x: &[f64]| {
                let later = (0..x.len()).filter(|i| (4..30).contains(&(i % 300)));
                rms(&later.map(|i| x[i]).collect::<Vec<_>>())
            };
            let (innovations, over) = filtered(&shown, &torque);
            let (before, after) = (later(&residual), later(&innovations));
            assert!(before > 5.0 * NOISE && after < 0.4 * before, "{hz}: {before} {after}");
            let mut sizes: Vec<f64> = over.iter().map(|x| x.abs()).collect();
            sizes.sort_by(f64::total_cmp);
            // Of independent normal numbers half are within 0.67 and nineteen of twenty within 1.96; energy is spread over some
            // milliseconds, so that what is before a jump is thought less known than it is. One of 300 is the jump.
            let at = |share: f64| sizes[(share * sizes.len() as f64) as usize];
            assert!((0.5..0.74).contains(&at(0.5)), "{hz}: {}", at(0.5));
            assert!((1.5..2.2).contains(&at(0.95)) && at(0.995) < 4.0, "{hz}: {} {}", at(0.95), at(0.999));
        }
    }

    #[test]
    fn a_ring_is_seen_where_sampling_mirrors_it() {
        for hz in [620.0, 550.0, 680.0, 1430.0] {
            let (cycles, rms_nm) = fast_line(&struck(hz, 1.0).0).expect("long enough");
            let mirrored = (STEP_S * hz - (STEP_S * hz).round()).abs();
            // Within the half width of a mode with so much damping.
            assert!((cycles - mirrored).abs() < 0.02 * STEP_S * hz, "{hz}: {cycles} for {mirrored}");
            assert!(rms_nm > NOISE, "{hz}: {rms_nm}");
        }
    }

    #[test]
    fn a_channel_that_does_not_swing_and_a_mode_that_is_simulated_stay_as_they_are() {
        for omega in [0.05, 0.6, 1.5] {
            let slow: Vec<f64> = (0..3000).map(|i| (omega * f64::from(i)).sin()).collect();
            let shown: Vec<f64> = slow.iter().zip(white(3000, 9)).map(|(x, e)| x + NOISE * e).collect();
            let (innovations, _) = filtered(&shown, &slow);
            let change: Vec<f64> =
                innovations.iter().zip(shown.iter().zip(&slow)).map(|(e, (y, x))| e - (y - x)).collect();
            assert!(rms(&change) < 0.2 * NOISE, "{omega}: {}", rms(&change));
        }
    }
}
