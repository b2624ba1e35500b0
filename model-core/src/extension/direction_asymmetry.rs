//! Friction that differs between the two directions of sliding: cut or worn rubber, a combed road.
//!
//! µ = µ0 (1 + d sgn v)

use crate::error::{ParameterError, require};
use crate::real::Real;

/// Asymmetry, prepared.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DirectionAsymmetry<T> {
    asymmetry: T,
}

impl<T: Real> DirectionAsymmetry<T> {
    /// Name of the parameter: half the relative difference, d.
    pub const NAMES: &'static [&'static str] = &["asymmetry"];

    /// Prepares the effect from values in the order of [`Self::NAMES`].
    pub fn new(values: &[T; 1]) -> Result<Self, ParameterError> {
        let allowed = values[0].abs() <= T::from_f64(0.95);
        Ok(Self { asymmetry: require("asymmetry", values[0], allowed, "-0.95 to 0.95")? })
    }

    /// What friction is multiplied with at a sliding speed.
    #[inline]
    pub fn factor(&self, sliding_speed_m_s: T) -> T {
        T::ONE + self.asymmetry * sliding_speed_m_s.sign()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_directions_differ_by_twice_the_asymmetry() {
        let effect = DirectionAsymmetry::new(&[0.1f64]).unwrap();
        assert_eq!((effect.factor(0.2), effect.factor(-0.2), effect.factor(0.0)), (1.1, 0.9, 1.0));
    }
}
