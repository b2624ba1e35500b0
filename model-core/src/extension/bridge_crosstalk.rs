//! Crosstalk: the friction bridge picks up normal force, whatever the direction of sliding.
//!
//! T_measured = T + k F_N + q F_N²
//!
//! k is the tilt of the gauges, q the bending of the ring under load.

use crate::error::{ParameterError, require};
use crate::real::Real;

/// Crosstalk, prepared.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BridgeCrosstalk<T> {
    gain: T,
    bend: T,
}

impl<T: Real> BridgeCrosstalk<T> {
    /// Names of the parameters: torque shown per normal force, N·m/N, and per its square, N·m/N².
    pub const NAMES: &'static [&'static str] = &["gain_nm_per_n", "bend_nm_per_n2"];

    /// Prepares the effect from values in the order of [`Self::NAMES`].
    pub fn new(values: &[T; 2]) -> Result<Self, ParameterError> {
        let [gain, bend] = *values;
        let (gain_allowed, bend_allowed) = (gain.abs() <= T::ONE, bend.abs() <= T::ONE);
        Ok(Self {
            gain: require("gain_nm_per_n", gain, gain_allowed, "-1 to 1 N m/N")?,
            bend: require("bend_nm_per_n2", bend, bend_allowed, "-1 to 1 N m/N^2")?,
        })
    }

    /// What the friction channel shows besides friction, N·m.
    #[inline]
    pub fn torque_nm(&self, normal_force_n: T) -> T {
        (self.gain + self.bend * normal_force_n) * normal_force_n
    }
}
