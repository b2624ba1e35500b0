//! A second-order low-pass, ẍ + 2ζω ẋ + ω² x = ω² u, stepped exactly for an input that is a straight
//! line between samples.
//!
//! With u = u0 + s t the straight line x = u − 2ζ s/ω solves the equation; what deviates from it dies
//! out by the matrix exponential of the homogeneous equation. Any step size, any ζ ≥ 0.

use std::f64::consts::TAU;

/// Steps that differ by less than this part share one matrix exponential: time stamps of a few digits
/// make equal steps differ in their last places.
const SAME_STEP: f64 = 1e-7;

/// The low-pass with its state.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SecondOrder {
    omega_rad_s: f64,
    damping_ratio: f64,
    value: f64,
    rate: f64,
    input: f64,
    step_s: f64,
    exponential: [f64; 4],
}

impl SecondOrder {
    /// At rest at the value `start` of input and output.
    pub fn new(natural_hz: f64, damping_ratio: f64, start: f64) -> Self {
        Self {
            omega_rad_s: TAU * natural_hz,
            damping_ratio,
            value: start,
            rate: 0.0,
            input: start,
            step_s: 0.0,
            exponential: [1.0, 0.0, 0.0, 1.0],
        }
    }

    /// What value and rate become within a time where the input is 0, row by row.
    pub fn transition(natural_hz: f64, damping_ratio: f64, time_s: f64) -> [f64; 4] {
        exponential(TAU * natural_hz, damping_ratio, time_s)
    }

    /// The output now.
    pub fn value(&self) -> f64 {
        self.value
    }

    /// Delay of slow signals: 2ζ/ω.
    pub fn delay_s(natural_hz: f64, damping_ratio: f64) -> f64 {
        2.0 * damping_ratio / (TAU * natural_hz)
    }

    /// Moves on by `step_s`, over which the input went in a straight line to `input`.
    #[inline]
    pub fn step(&mut self, step_s: f64, input: f64) -> f64 {
        if (step_s - self.step_s).abs() > SAME_STEP * self.step_s {
            self.step_s = step_s;
            self.exponential = exponential(self.omega_rad_s, self.damping_ratio, step_s);
        }
        let slope = (input - self.input) / step_s;
        let lag = 2.0 * self.damping_ratio * slope / self.omega_rad_s;
        let (off, off_rate) = (self.value - (self.input - lag), self.rate - slope);
        let [a, b, c, d] = self.exponential;
        self.value = input - lag + a * off + b * off_rate;
        self.rate = slope + c * off + d * off_rate;
        self.input = input;
        self.value
    }
}

/// exp([[0, 1], [−ω², −2ζω]] t), row by row.
fn exponential(omega: f64, zeta: f64, t: f64) -> [f64; 4] {
    // e^{−ζωt}·{cos, sin/ω_d} for ζ < 1 and their hyperbolic kin for ζ > 1, taken as exponentials so
    // that neither factor overflows. Near ζ = 1 both turn into {1, t}.
    let (even, odd) = {
        let square = (1.0 - zeta * zeta) * (omega * t) * (omega * t);
        let decay = (-zeta * omega * t).exp();
        if square.abs() < 1e-6 {
            // Two terms of the series: relative error below square²/24.
            (decay * (1.0 - square / 2.0), decay * t * (1.0 - square / 6.0))
        } else if square > 0.0 {
            let phase = square.sqrt();
            (decay * phase.cos(), decay * phase.sin() * t / phase)
        } else {
            let x = (-square).sqrt();
            let (slow, fast) = ((x - zeta * omega * t).exp(), (-x - zeta * omega * t).exp());
            (0.5 * (slow + fast), 0.5 * (slow - fast) * t / x)
        }
    };
    let damped = zeta * omega * odd;
    [even + damped, odd, -omega * omega * odd, even - damped]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_step_response_is_that_of_the_textbook_for_every_damping() {
        // The input jumps within the first, very short step: as a jump in its middle, but for (ω·jump)².
        for zeta in [0.0, 0.02, 0.7, 1.0, 1.000_000_1, 3.0_f64] {
            let (omega, jump_s) = (TAU * 100.0, 1e-8);
            let mut filter = SecondOrder::new(100.0, zeta, 0.0);
            filter.step(jump_s, 1.0);
            for i in 1..200 {
                let x = filter.step(1e-4, 1.0);
                let t = f64::from(i) * 1e-4 + 0.5 * jump_s;
                let expected = if zeta < 1.0 {
                    let wd = omega * (1.0 - zeta * zeta).sqrt();
                    1.0 - (-zeta * omega * t).exp() * ((wd * t).cos() + zeta * omega / wd * (wd * t).sin())
                } else if zeta < 1.1 {
                    1.0 - (-omega * t).exp() * (1.0 + omega * t)
                } else {
                    let r = omega * (zeta * zeta - 1.0).sqrt();
                    1.0 - (-zeta * omega * t).exp() * ((r * t).cosh() + zeta * omega / r * (r * t).sinh())
                };
                // 1e-7: ζ = 1.000 000 1 is compared with the critical case. 200 steps of rounding else.
                assert!((x - expected).abs() < 1e-7, "{zeta} {t}: {x} {expected}");
            }
        }
    }

    #[test]
    fn a_ramp_is_followed_at_its_delay_whatever_the_steps() {
        let mut filter = SecondOrder::new(50.0, 0.7, 0.0);
        let mut t = 0.0;
        for i in 0..400 {
            let step_s = if i % 3 == 0 { 1e-4 } else { 7e-4 };
            t += step_s;
            filter.step(step_s, 3.0 * t);
        }
        // The transient has died to e^{-44}.
        let expected = 3.0 * (t - SecondOrder::delay_s(50.0, 0.7));
        assert!((filter.value() - expected).abs() < 1e-12);
    }
}
