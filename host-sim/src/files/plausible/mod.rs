//! Whether the values of a log can be what its columns say.
//!
//! A log in the wrong unit fits some model with confident numbers. Each check compares quantities that do not
//! know of each other: angle with the integral of speed, friction with load, torque with acceleration, time with
//! the rates at which rigs are sampled. What cannot be is refused; what is odd becomes a notice that says why.
//! Limits are wide: no rig that rubs something on a disc comes near them, and a wrong unit is beyond them by far.
//! Left out: small errors of calibration, which no check can tell from another rig.

mod balance;
mod motion;
mod values;

use super::log::Log;
use crate::input_error::InputError;
use crate::notices;

/// What was found.
#[derive(Debug, Clone, PartialEq)]
pub enum Finding {
    /// Odd, but it could be.
    Doubt {
        /// The column it is about.
        column: &'static str,
        /// Why, with the numbers, and what to do.
        sentence: String,
    },
    /// Nothing sensible can follow.
    Impossible(InputError),
}

impl Finding {
    fn doubt(column: &'static str, sentence: String) -> Self {
        Self::Doubt { column, sentence }
    }
}

/// Looks at a log whose form is right.
#[must_use]
pub fn findings(log: &Log) -> Vec<Finding> {
    let values = values::findings(log);
    if values.iter().any(|finding| matches!(finding, Finding::Impossible(_))) {
        // One absurd value makes nonsense of every sum.
        return values;
    }
    [values, motion::findings(log), balance::findings(log)].concat()
}

/// Refuses what is impossible, and says what is doubtful.
///
/// # Errors
/// The first finding of the first kind.
pub(super) fn check(log: &Log) -> Result<(), InputError> {
    for finding in findings(log) {
        match finding {
            Finding::Impossible(error) => return Err(error.file(log.source.as_str())),
            Finding::Doubt { column, sentence } => {
                notices::warn(&format!("{}: {column}: {sentence}", log.source));
            }
        }
    }
    Ok(())
}

/// The value below which this share of the values lies; 0 for none.
#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, clippy::cast_precision_loss)]
fn quantile(values: impl Iterator<Item = f64>, share: f64) -> f64 {
    let mut values: Vec<f64> = values.collect();
    if values.is_empty() {
        return 0.0;
    }
    let rank = ((values.len() - 1) as f64 * share).round() as usize;
    *values.select_nth_unstable_by(rank, f64::total_cmp).1
}

#[cfg(test)]
mod tests;
