//! The torque ring's own mode, lower or less damped than the rig file says.
//!
//! ẍ + 2ζω ẋ + ω² x = ω² T,   T_measured = x
//!
//! A [`SecondOrder`] system: exact for a torque that runs straight over the step.

use crate::error::ParameterError;
use crate::real::Real;
use crate::sensor::{DAMPING_RATIO, MODE_HZ, SecondOrder, SecondOrderState};

/// Mode, prepared for a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RingResonance<T>(SecondOrder<T>);

impl<T: Real> RingResonance<T> {
    /// Names of the parameters: undamped frequency, Hz; damping ratio.
    pub const NAMES: &'static [&'static str] = &["mode_hz", "damping_ratio"];

    /// Prepares the effect from values in the order of [`Self::NAMES`].
    pub fn new(values: &[T; 2], step_s: T) -> Result<Self, ParameterError> {
        let mode_hz = MODE_HZ.check("mode_hz", values[0])?;
        let damping_ratio = DAMPING_RATIO.check("damping_ratio", values[1])?;
        Ok(Self(SecondOrder::new(mode_hz, damping_ratio, step_s)))
    }

    /// Changes the step size, s. The caller keeps it positive.
    pub fn set_step_s(&mut self, step_s: T) {
        self.0.set_step_s(step_s);
    }

    /// Advances by one step with the torque at its end and gives what the ring shows then, N·m.
    #[inline]
    pub fn advance(&self, state: &mut SecondOrderState<T>, torque_nm: T) -> T {
        self.0.step(state, torque_nm)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn modes_and_damping_ratios_of_rig_files_are_allowed_and_others_are_not() {
        for values in [[600.0f64, 0.02], [1.0, 0.0], [1e5, 10.0], [90.0, 1.0]] {
            assert!(RingResonance::new(&values, 1e-4).is_ok(), "{values:?}");
        }
        assert_eq!(RingResonance::new(&[0.5f64, 0.02], 1e-4).unwrap_err().name, "mode_hz");
        assert_eq!(RingResonance::new(&[600.0f64, -0.1], 1e-4).unwrap_err().name, "damping_ratio");
    }
}
