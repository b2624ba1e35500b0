//! What an effect's file says of itself to the engine: parameters with priors, and what they change.

/// A parameter that is fitted.
#[derive(Debug, Clone)]
pub struct Parameter {
    /// Name with unit, as files have it.
    pub name: String,
    /// Mean of its normal prior, in the scale that is fitted.
    pub mean: f64,
    /// Standard deviation of the prior.
    pub sd: f64,
    /// Whether it is an amplitude: then the prior's width is averaged over a range of scales, since how strong an effect is
    /// is not known beforehand.
    pub amplitude: bool,
    /// Lower bound.
    pub lower: f64,
    /// Step of finite differences.
    pub step: f64,
    /// Longest move in one iteration.
    pub reach: f64,
}

impl Parameter {
    /// An amplitude around 0.
    pub fn amplitude(name: impl Into<String>, sd: f64) -> Self {
        Self {
            name: name.into(),
            mean: 0.0,
            sd,
            amplitude: true,
            lower: f64::NEG_INFINITY,
            step: 0.02 * sd.min(1.0),
            reach: sd.max(1.0),
        }
    }

    /// An amplitude that is not negative.
    pub fn positive(name: impl Into<String>, sd: f64) -> Self {
        Self { lower: 0.0, ..Self::amplitude(name, sd) }
    }

    /// A number whose logarithm has this mean and deviation.
    pub fn logarithm(name: impl Into<String>, typical: f64, sd: f64) -> Self {
        Self {
            name: name.into(),
            mean: typical.ln(),
            sd,
            amplitude: false,
            lower: f64::NEG_INFINITY,
            step: 0.02,
            reach: 0.7,
        }
    }
}

/// Where a search over a term's parameters starts.
#[derive(Debug, Clone)]
pub enum Starts {
    /// At these points.
    At(Vec<Vec<f64>>),
    /// At the points of a grid that leave the smallest residual.
    BestOf(Vec<Vec<f64>>, usize),
}

/// Columns: one value for each point of each log.
pub type Column = Vec<Vec<f64>>;
