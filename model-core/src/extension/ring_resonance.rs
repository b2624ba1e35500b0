//! The torque ring's own mode, lower or less damped than the rig file says.
//!
//! ẍ + 2ζω ẋ + ω² x = ω² T,   T_measured = x
//!
//! Advanced exactly for a torque that runs straight over the step, so that neither phase nor damping is
//! made by the integrator.

use crate::error::{ParameterError, require};
use crate::real::Real;

/// Mode, prepared for a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RingResonance<T> {
    omega: T,
    damping: T,
    /// Homogeneous solution over a step: rows are position and speed.
    hold: [[T; 2]; 2],
    step_s: T,
}

/// What the ring shows.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct RingState<T> {
    /// Torque shown, N·m.
    pub torque_nm: T,
    /// Its rate, N·m/s.
    pub rate_nm_s: T,
    input_nm: T,
}

impl<T: Real> RingResonance<T> {
    /// Names of the parameters: undamped frequency, Hz; damping ratio.
    pub const NAMES: &'static [&'static str] = &["mode_hz", "damping_ratio"];

    /// Prepares the effect from values in the order of [`Self::NAMES`].
    pub fn new(values: &[T; 2], step_s: T) -> Result<Self, ParameterError> {
        let [mode_hz, damping] = *values;
        let mode_allowed = mode_hz >= T::ONE && mode_hz <= T::from_f64(1e5);
        let damping_allowed = damping >= T::from_f64(1e-4) && damping <= T::from_f64(0.99);
        let mode_hz = require("mode_hz", mode_hz, mode_allowed, "1 to 1e5 Hz")?;
        let damping = require("damping_ratio", damping, damping_allowed, "1e-4 to 0.99")?;
        let omega = mode_hz * T::from_f64(core::f64::consts::TAU);
        let mut mode = Self { omega, damping, hold: [[T::ZERO; 2]; 2], step_s };
        mode.set_step_s(step_s);
        Ok(mode)
    }

    /// Changes the step size, s. The caller keeps it positive.
    pub fn set_step_s(&mut self, step_s: T) {
        let decay = self.damping * self.omega;
        let swing = self.omega * (T::ONE - self.damping * self.damping).sqrt();
        let shrink = (-decay * step_s).exp();
        let (cosine, sine) = ((swing * step_s).cos(), (swing * step_s).sin());
        let ratio = decay / swing;
        self.hold = [
            [shrink * (cosine + ratio * sine), shrink * sine / swing],
            [-shrink * sine * self.omega * self.omega / swing, shrink * (cosine - ratio * sine)],
        ];
        self.step_s = step_s;
    }

    /// Advances by one step with the torque at its end and gives what the ring shows then.
    #[inline]
    pub fn advance(&self, state: &mut RingState<T>, torque_nm: T) -> T {
        // A straight input is followed by itself, late by 2ζ/ω; the rest is the homogeneous solution.
        let slope = (torque_nm - state.input_nm) / self.step_s;
        let late = slope * (self.damping + self.damping) / self.omega;
        let x = state.torque_nm - (state.input_nm - late);
        let rate = state.rate_nm_s - slope;
        state.torque_nm = torque_nm - late + self.hold[0][0] * x + self.hold[0][1] * rate;
        state.rate_nm_s = slope + self.hold[1][0] * x + self.hold[1][1] * rate;
        state.input_nm = torque_nm;
        state.torque_nm
    }

    /// A ring at rest under a torque.
    pub fn holding(torque_nm: T) -> RingState<T> {
        RingState { torque_nm, rate_nm_s: T::ZERO, input_nm: torque_nm }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_rings_with_its_frequency_and_damping() {
        let (hz, damping, step) = (200.0f64, 0.05, 1e-4);
        let mode = RingResonance::new(&[hz, damping], step).unwrap();
        let mut state = RingResonance::holding(0.0);
        state.input_nm = 1.0;
        let omega = core::f64::consts::TAU * hz;
        let swing = omega * (1.0 - damping * damping).sqrt();
        for k in 1..500 {
            let t = f64::from(k) * step;
            let shown = mode.advance(&mut state, 1.0);
            let expected = 1.0
                - (-damping * omega * t).exp()
                    * ((swing * t).cos() + damping * omega / swing * (swing * t).sin());
            assert!((shown - expected).abs() < 1e-10, "{t}");
        }
    }

    #[test]
    fn a_ramp_is_followed_late_by_twice_the_damping_over_the_frequency() {
        let mode = RingResonance::new(&[100.0f64, 0.3], 1e-4).unwrap();
        let mut state = RingResonance::holding(0.0);
        let mut shown = 0.0;
        for k in 1..20_000 {
            shown = mode.advance(&mut state, f64::from(k) * 1e-3);
        }
        let late = 10.0 * 0.6 / (core::f64::consts::TAU * 100.0);
        assert!((shown - (19.999 - late)).abs() < 1e-9);
    }
}
