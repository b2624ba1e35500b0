//! A friction channel that lags the motion by a pure delay: a filter in the amplifier, a slow converter.
//!
//! T_measured(t) = T(t − d)
//!
//! The past is kept at the rate of the steps, so the longest delay is [`LONGEST_STEPS`] of them; between
//! two steps the past is interpolated.

use crate::error::ParameterError;
use crate::real::Real;
use crate::sensor::DELAY_S;

/// Longest delay in steps: 51 ms at 10 kHz.
pub const LONGEST_STEPS: usize = 511;

/// Delay, prepared for a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrictionDelay<T> {
    delay_s: T,
    whole_steps: usize,
    part: T,
}

/// The last torques, newest at `at`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Past<T> {
    torque_nm: [T; LONGEST_STEPS + 1],
    at: usize,
}

impl<T: Real> Default for Past<T> {
    fn default() -> Self {
        Self { torque_nm: [T::ZERO; LONGEST_STEPS + 1], at: 0 }
    }
}

impl<T: Real> Past<T> {
    /// A past in which the torque never changed.
    pub fn holding(torque_nm: T) -> Self {
        Self { torque_nm: [torque_nm; LONGEST_STEPS + 1], at: 0 }
    }
}

impl<T: Real> FrictionDelay<T> {
    /// Name of the parameter: delay, s.
    pub const NAMES: &'static [&'static str] = &["delay_s"];

    /// Prepares the effect from values in the order of [`Self::NAMES`].
    pub fn new(values: &[T; 1], step_s: T) -> Result<Self, ParameterError> {
        let delay_s = DELAY_S.check("delay_s", values[0])?;
        let mut delay = Self { delay_s, whole_steps: 0, part: T::ZERO };
        delay.set_step_s(step_s);
        Ok(delay)
    }

    /// Changes the step size, s; what is remembered keeps its step. The caller keeps it positive. A delay
    /// beyond the memory is cut to it.
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    pub fn set_step_s(&mut self, step_s: T) {
        let steps = (self.delay_s / step_s).to_f64();
        self.whole_steps = (steps as usize).min(LONGEST_STEPS - 1);
        self.part = T::from_f64(steps - self.whole_steps as f64).at_most(T::ONE);
    }

    /// Takes in the present torque and gives the delayed one.
    #[inline]
    pub fn advance(&self, past: &mut Past<T>, torque_nm: T) -> T {
        past.at = (past.at + 1) & LONGEST_STEPS;
        past.torque_nm[past.at] = torque_nm;
        let newer = past.torque_nm[past.at.wrapping_sub(self.whole_steps) & LONGEST_STEPS];
        let older = past.torque_nm[past.at.wrapping_sub(self.whole_steps + 1) & LONGEST_STEPS];
        newer + self.part * (older - newer)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ramp_comes_out_late_by_the_delay() {
        for delay in [0.0f64, 1e-4, 2.55e-3, 7e-3, 51e-3] {
            let effect = FrictionDelay::new(&[delay], 1e-4).unwrap();
            let mut past = Past::default();
            let mut shown = 0.0;
            for k in 0..2000 {
                shown = effect.advance(&mut past, f64::from(k) * 1e-4);
            }
            assert!((shown - (0.1999 - delay)).abs() < 1e-12, "{delay}: {shown}");
        }
    }
}
