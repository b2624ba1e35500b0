//! A film between rubber and road: a force in proportion to sliding speed, whatever the load.
//!
//! F_film = c v

use crate::error::{ParameterError, require};
use crate::real::Real;

/// Viscous film, prepared.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ViscousFilm<T> {
    coefficient: T,
}

impl<T: Real> ViscousFilm<T> {
    /// Name of the parameter: force per sliding speed, N·s/m.
    pub const NAMES: &'static [&'static str] = &["coefficient_n_s_per_m"];

    /// Prepares the effect from values in the order of [`Self::NAMES`].
    pub fn new(values: &[T; 1]) -> Result<Self, ParameterError> {
        let allowed = values[0] >= T::ZERO && values[0] <= T::from_f64(1e6);
        Ok(Self { coefficient: require("coefficient_n_s_per_m", values[0], allowed, "0 to 1e6 N s/m")? })
    }

    /// Force of the film, N.
    #[inline]
    pub fn force_n(&self, sliding_speed_m_s: T) -> T {
        self.coefficient * sliding_speed_m_s
    }
}
