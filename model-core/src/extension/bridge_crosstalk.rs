//! Crosstalk: the friction bridge picks up normal force, whatever the direction of sliding.
//!
//! T_measured = T + k F_N

use crate::error::{ParameterError, require};
use crate::real::Real;

/// Crosstalk, prepared.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BridgeCrosstalk<T> {
    gain: T,
}

impl<T: Real> BridgeCrosstalk<T> {
    /// Name of the parameter: torque shown per normal force, N·m/N.
    pub const NAMES: &'static [&'static str] = &["gain_nm_per_n"];

    /// Prepares the effect from values in the order of [`Self::NAMES`].
    pub fn new(values: &[T; 1]) -> Result<Self, ParameterError> {
        let allowed = values[0].abs() <= T::ONE;
        Ok(Self { gain: require("gain_nm_per_n", values[0], allowed, "-1 to 1 N m/N")? })
    }

    /// What the friction channel shows besides friction, N·m.
    #[inline]
    pub fn torque_nm(&self, normal_force_n: T) -> T {
        self.gain * normal_force_n
    }
}
