//! Why an identification was refused.

use std::fmt;

/// Why no parameters are returned.
#[derive(Debug, Clone, PartialEq)]
pub enum FitError {
    /// Too few samples for the parameters asked for.
    TooFewSamples {
        /// Samples that could be used.
        samples: usize,
        /// Samples that are needed.
        needed: usize,
    },
    /// A start value outside its bounds.
    StartOutOfBounds {
        /// The parameter.
        name: String,
        /// Its start value.
        value: f64,
        /// Lower bound.
        low: f64,
        /// Upper bound.
        high: f64,
    },
    /// The residual does not change with this parameter at the start: an optimiser would return the
    /// start value and call it a result.
    NoInfluence {
        /// The parameters without influence.
        names: Vec<String>,
    },
    /// Several parameters whose changes compensate each other in this data.
    Inseparable {
        /// The parameters that cannot be told apart.
        names: Vec<String>,
        /// Smallest over largest singular value of the scaled Jacobian.
        singular_ratio: f64,
    },
    /// Parameters whose standard deviation is larger than allowed.
    Undetermined {
        /// The parameters with their standard deviation relative to their value.
        names: Vec<(String, f64)>,
    },
    /// The model gave NaN or infinity for every start.
    NotFinite,
    /// No start converged; the text is the optimiser's last reason.
    NotConverged(String),
}

impl fmt::Display for FitError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::TooFewSamples { samples, needed } => {
                write!(f, "{samples} usable samples; allowed: at least {needed}")
            }
            Self::StartOutOfBounds { name, value, low, high } => {
                write!(f, "{name} = {value:e}: start value out of bounds; allowed: {low:e} to {high:e}")
            }
            Self::NoInfluence { names } => write!(
                f,
                "{} cannot be identified: the simulated signal does not depend on it in these logs; \
                 fix it, or use a log that excites it",
                names.join(", ")
            ),
            Self::Inseparable { names, singular_ratio } => write!(
                f,
                "{} cannot be told apart in these logs (singular values of the scaled Jacobian: ratio \
                 {singular_ratio:.1e}); fix all but one of them",
                names.join(", ")
            ),
            Self::Undetermined { names } => {
                let list: Vec<String> =
                    names.iter().map(|(name, std)| format!("{name} (± {:.0} %)", 100.0 * std)).collect();
                write!(
                    f,
                    "these logs do not determine {}; fix it, or use a log that excites it",
                    list.join(", ")
                )
            }
            Self::NotFinite => write!(f, "the model gives no finite signal at any start"),
            Self::NotConverged(why) => write!(f, "no start converged: {why}"),
        }
    }
}

impl std::error::Error for FitError {}
