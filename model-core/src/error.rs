//! Why a set of parameters was refused.

use core::fmt;

/// A parameter outside its allowed range: which one, what it was, what is allowed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ParameterError {
    /// Name of the parameter, with its unit, as in the model file.
    pub name: &'static str,
    /// The value that was refused.
    pub value: f64,
    /// What is allowed, in words with numbers and unit.
    pub allowed: &'static str,
}

impl fmt::Display for ParameterError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        // A value that came as f32 is shown with the digits it was given, not with those of its widening.
        #[allow(clippy::cast_possible_truncation)]
        let narrow = self.value as f32;
        if f64::from(narrow) == self.value {
            write!(f, "{} = {} is not allowed; allowed: {}", self.name, narrow, self.allowed)
        } else {
            write!(f, "{} = {} is not allowed; allowed: {}", self.name, self.value, self.allowed)
        }
    }
}

impl core::error::Error for ParameterError {}

/// Returns `value` where `ok` holds, else the error that names it.
pub(crate) fn require<T: crate::real::Real>(
    name: &'static str,
    value: T,
    ok: bool,
    allowed: &'static str,
) -> Result<T, ParameterError> {
    if ok && value.is_finite() {
        Ok(value)
    } else {
        Err(ParameterError { name, value: value.to_f64(), allowed })
    }
}
