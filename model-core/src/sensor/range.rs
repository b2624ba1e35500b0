//! What a sensor's numbers may be: once for effects, rig and plant.

use crate::error::{ParameterError, require};
use crate::real::Real;

/// Least gain that is undone: one that has drifted further is a broken bridge, and dividing by it would be noise.
pub const LEAST_GAIN: f64 = 0.1;
/// Natural frequency of a mode.
pub const MODE_HZ: Range = Range { least: 1.0, most: 1e5, allowed: "1 to 1e5 Hz" };
/// Its damping ratio.
pub const DAMPING_RATIO: Range = Range { least: 0.0, most: 10.0, allowed: "0 to 10" };
/// A pure delay.
pub const DELAY_S: Range = Range { least: 0.0, most: 1.0, allowed: "0 to 1 s" };

/// The values that a number may have.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Range {
    /// The least.
    pub least: f64,
    /// The most.
    pub most: f64,
    /// The same in words, with the unit.
    pub allowed: &'static str,
}

impl Range {
    /// The value where it is allowed.
    ///
    /// # Errors
    /// The name, the value and what is allowed, where it is not.
    pub fn check<T: Real>(&self, name: &'static str, value: T) -> Result<T, ParameterError> {
        let ok = value >= T::from_f64(self.least) && value <= T::from_f64(self.most);
        require(name, value, ok, self.allowed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ends_are_allowed_and_what_is_beyond_them_or_no_number_is_not() {
        for value in [0.0f32, 10.0] {
            assert_eq!(DAMPING_RATIO.check("damping_ratio", value), Ok(value));
        }
        for value in [-1e-6f32, 10.1, f32::NAN] {
            let error = DAMPING_RATIO.check("damping_ratio", value).unwrap_err();
            assert_eq!((error.name, error.allowed), ("damping_ratio", "0 to 10"));
        }
    }
}
