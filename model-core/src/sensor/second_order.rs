//! A second-order system of unit gain: the mode of the part that carries the gauges, or a low-pass.
//!
//! ÿ + 2ζω ẏ + ω² y = ω² u
//!
//! u and y have one unit, which is the caller's. Advanced exactly for an input that runs straight over the step, so that neither
//! phase nor damping is made by the integrator: the straight line is followed by itself, late by 2ζ/ω; what deviates from it dies
//! out by the matrix exponential of the homogeneous equation. Any step, any ω > 0, any ζ ≥ 0.

use crate::real::Real;

/// Steps that differ by less than this part share one matrix exponential: time stamps of a few digits make equal steps differ in
/// their last places.
const SAME_STEP: f64 = 1e-7;

/// A second-order system, prepared for a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SecondOrder<T> {
    omega: T,
    damping: T,
    /// Homogeneous solution over a step: rows are value and rate.
    hold: [[T; 2]; 2],
    step_s: T,
}

/// Where it is.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SecondOrderState<T> {
    /// Output, in units of the input.
    pub value: T,
    /// Its rate, per second.
    pub rate: T,
    /// Input at the end of the last step.
    pub input: T,
}

impl<T: Real> SecondOrderState<T> {
    /// At rest under an input that never changed.
    pub fn holding(value: T) -> Self {
        Self { value, rate: T::ZERO, input: value }
    }
}

impl<T: Real> SecondOrder<T> {
    /// With an undamped frequency (Hz, above 0) and a damping ratio (0 or more), for a step of `step_s` seconds (above 0); the
    /// caller keeps them there.
    pub fn new(natural_hz: T, damping_ratio: T, step_s: T) -> Self {
        let omega = natural_hz * T::from_f64(core::f64::consts::TAU);
        let mut system = Self { omega, damping: damping_ratio, hold: [[T::ZERO; 2]; 2], step_s: T::ZERO };
        system.set_step_s(step_s);
        system
    }

    /// A Butterworth low-pass with this corner, Hz: ζ = 1/√2.
    pub fn butterworth(corner_hz: T, step_s: T) -> Self {
        Self::new(corner_hz, T::from_f64(core::f64::consts::FRAC_1_SQRT_2), step_s)
    }

    /// Changes the step size, s. The caller keeps it positive.
    #[inline]
    pub fn set_step_s(&mut self, step_s: T) {
        if (step_s - self.step_s).abs() > T::from_f64(SAME_STEP) * self.step_s {
            self.hold = homogeneous(self.omega, self.damping, step_s);
            self.step_s = step_s;
        }
    }

    /// What value and rate become within a step where the input is 0, row by row.
    pub fn transition(&self) -> [[T; 2]; 2] {
        self.hold
    }

    /// Delay of slow signals, s: 2ζ/ω.
    pub fn delay_s(&self) -> T {
        (self.damping + self.damping) / self.omega
    }

    /// Advances by one step, over which the input went in a straight line to `input`; gives the output then.
    #[inline]
    pub fn step(&self, state: &mut SecondOrderState<T>, input: T) -> T {
        let slope = (input - state.input) / self.step_s;
        let late = slope * (self.damping + self.damping) / self.omega;
        let x = state.value - (state.input - late);
        let rate = state.rate - slope;
        state.value = input - late + self.hold[0][0] * x + self.hold[0][1] * rate;
        state.rate = slope + self.hold[1][0] * x + self.hold[1][1] * rate;
        state.input = input;
        state.value
    }
}

/// exp([[0, 1], [−ω², −2ζω]] t), row by row.
fn homogeneous<T: Real>(omega: T, damping: T, step_s: T) -> [[T; 2]; 2] {
    let decay = damping * omega;
    let below_critical = T::ONE - damping * damping;
    if below_critical > T::ZERO {
        let swing = omega * below_critical.sqrt();
        let shrink = (-decay * step_s).exp();
        let (cosine, sine) = ((swing * step_s).cos(), (swing * step_s).sin());
        let ratio = decay / swing;
        return [
            [shrink * (cosine + ratio * sine), shrink * sine / swing],
            [-shrink * sine * omega * omega / swing, shrink * (cosine - ratio * sine)],
        ];
    }
    // The same with e^{−ζωt}·{cosh, sinh/r}, r = ω √(ζ² − 1), of which neither factor overflows.
    let (even, odd) = if below_critical < T::ZERO {
        let root = (-below_critical).sqrt();
        let spread = (omega + omega) * root * step_s;
        // ω (ζ − √(ζ² − 1)), the slow one's rate, without the difference.
        let slow = (-omega * step_s / (damping + root)).exp();
        let fast = slow * (-spread).exp();
        (T::HALF * (slow + fast), -slow * (-spread).exp_m1() / spread * step_s)
    } else {
        let shrink = (-decay * step_s).exp();
        (shrink, shrink * step_s)
    };
    let damped = decay * odd;
    [[even + damped, odd], [-omega * omega * odd, even - damped]]
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::f64::consts::TAU;

    /// Response to a unit step at a time after it.
    fn textbook(omega: f64, zeta: f64, t: f64) -> f64 {
        if zeta < 1.0 {
            let wd = omega * (1.0 - zeta * zeta).sqrt();
            1.0 - (-zeta * omega * t).exp() * ((wd * t).cos() + zeta * omega / wd * (wd * t).sin())
        } else if zeta < 1.1 {
            1.0 - (-omega * t).exp() * (1.0 + omega * t)
        } else {
            let r = omega * (zeta * zeta - 1.0).sqrt();
            1.0 - (-zeta * omega * t).exp() * ((r * t).cosh() + zeta * omega / r * (r * t).sinh())
        }
    }

    #[test]
    fn the_step_response_is_that_of_the_textbook_for_every_damping() {
        for zeta in [0.0, 0.02, 0.7, 0.999_999_9, 1.0, 1.000_000_1, 3.0_f64] {
            let (hz, step_s) = (100.0, 1e-4);
            let system = SecondOrder::new(hz, zeta, step_s);
            let mut state = SecondOrderState { input: 1.0, ..SecondOrderState::holding(0.0) };
            for k in 1..200 {
                let t = f64::from(k) * step_s;
                let (x, expected) = (system.step(&mut state, 1.0), textbook(TAU * hz, zeta, t));
                // 1e-7: what is next to the critical case is compared with it. 200 steps of rounding else.
                let near = if (zeta - 1.0).abs() < 1e-3 { 1e-7 } else { 1e-12 };
                assert!((x - expected).abs() < near, "{zeta} {t}: {x} {expected}");
            }
        }
    }

    #[test]
    fn single_precision_keeps_every_damping_to_its_rounding() {
        for zeta in [0.0f32, 0.02, 0.99, 1.0, 1.000_001, 1.5, 10.0] {
            let system = SecondOrder::new(600.0f32, zeta, 1e-4);
            let reference = SecondOrder::new(600.0f64, f64::from(zeta), 1e-4);
            for (row, expected) in system.transition().iter().zip(reference.transition()) {
                for (x, e) in row.iter().zip(expected) {
                    // In units of the largest entry of its row; ζ = 10 takes a difference of numbers a hundred times as large.
                    let size = expected.iter().fold(0.0f64, |m, e| m.max(e.abs()));
                    assert!((f64::from(*x) - e).abs() < 4e-6 * size.max(1e-30), "{zeta}: {x} {e}");
                }
            }
        }
    }

    #[test]
    fn a_ramp_is_followed_late_by_twice_the_damping_over_the_frequency() {
        for zeta in [0.3, 1.0, 2.0] {
            let system = SecondOrder::new(100.0f64, zeta, 1e-4);
            let mut state = SecondOrderState::holding(0.0);
            let mut shown = 0.0;
            for k in 1..20_000 {
                shown = system.step(&mut state, f64::from(k) * 1e-3);
            }
            let late = 10.0 * 2.0 * zeta / (TAU * 100.0);
            assert!((10.0 * system.delay_s() - late).abs() < 1e-15);
            assert!((shown - (19.999 - late)).abs() < 1e-9);
        }
    }

    #[test]
    fn steps_may_change_on_the_way() {
        let mut system = SecondOrder::new(50.0, 0.7, 1e-4);
        let mut state = SecondOrderState::holding(0.0);
        let mut t = 0.0;
        for i in 0..400 {
            let step_s = if i % 3 == 0 { 1e-4 } else { 7e-4 };
            t += step_s;
            system.set_step_s(step_s);
            system.step(&mut state, 3.0 * t);
        }
        // The transient has died to e^{-44}.
        assert!((state.value - 3.0 * (t - system.delay_s())).abs() < 1e-12);
    }
}
