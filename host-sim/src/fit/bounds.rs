//! Parameters with bounds and scales, and the unbounded coordinates in which they are searched.
//!
//! x = low + (high − low)(1 + sin y)/2, the transform of MINUIT (James and Roos, 1975): the optimiser
//! sees no bound, and the slope dx/dy is zero only on the bound itself. Parameters that span decades
//! (stiffnesses, characteristic speeds) are transformed in ln x, so that a step means a ratio.
//! Unbounded parameters are only scaled.

/// What a step of a parameter means.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scale {
    /// Differences.
    Linear,
    /// Ratios; bounds must be positive.
    Logarithmic,
}

/// A parameter to identify.
#[derive(Debug, Clone, PartialEq)]
pub struct Parameter {
    /// Name with unit, as in the model file.
    pub name: String,
    /// Where the search starts.
    pub start: f64,
    /// Lower bound, or −∞.
    pub low: f64,
    /// Upper bound, or ∞.
    pub high: f64,
    /// What a step means.
    pub scale: Scale,
}

impl Parameter {
    /// A parameter whose steps are differences.
    pub fn linear(name: &str, start: f64, low: f64, high: f64) -> Self {
        Self { name: name.into(), start, low, high, scale: Scale::Linear }
    }

    /// A positive parameter whose steps are ratios.
    pub fn logarithmic(name: &str, start: f64, low: f64, high: f64) -> Self {
        Self { name: name.into(), start, low, high, scale: Scale::Logarithmic }
    }

    /// The size that a change of this parameter is compared to: its value for a ratio, else its range
    /// or its start.
    pub fn typical(&self, value: f64) -> f64 {
        match self.scale {
            Scale::Logarithmic => value,
            Scale::Linear if self.bounded() => 0.1 * (self.high - self.low),
            Scale::Linear => self.start.abs().max(value.abs()).max(1e-12),
        }
    }

    fn bounded(&self) -> bool {
        self.low.is_finite() && self.high.is_finite()
    }

    fn straight(&self, x: f64) -> f64 {
        match self.scale {
            Scale::Linear => x,
            Scale::Logarithmic => x.ln(),
        }
    }

    /// The search coordinate of a value; values on a bound are first moved inside by 1e-6 of the range,
    /// where the transform still has a slope.
    pub fn to_search(&self, value: f64) -> f64 {
        if !self.bounded() {
            return self.straight(value) / self.unbounded_scale();
        }
        let (low, high) = (self.straight(self.low), self.straight(self.high));
        let share = ((self.straight(value) - low) / (high - low)).clamp(1e-6, 1.0 - 1e-6);
        (2.0 * share - 1.0).asin()
    }

    /// The value of a search coordinate; always within the bounds.
    pub fn from_search(&self, y: f64) -> f64 {
        let straight = if self.bounded() {
            let (low, high) = (self.straight(self.low), self.straight(self.high));
            low + (high - low) * 0.5 * (1.0 + y.sin())
        } else {
            y * self.unbounded_scale()
        };
        match self.scale {
            Scale::Linear => straight,
            Scale::Logarithmic => straight.exp(),
        }
    }

    fn unbounded_scale(&self) -> f64 {
        match self.scale {
            Scale::Linear if self.start != 0.0 => self.start.abs(),
            _ => 1.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_survive_the_way_to_search_coordinates_and_back() {
        let parameters = [
            (Parameter::linear("a", 0.5, -1.0, 2.0), 1.3),
            (Parameter::logarithmic("k", 1e4, 1.0, 1e9), 3.4e6),
            (Parameter::linear("m", 95.0, f64::NEG_INFINITY, f64::INFINITY), 17.0),
        ];
        for (parameter, value) in parameters {
            let back = parameter.from_search(parameter.to_search(value));
            // Rounding of sin and asin, magnified by at most exp.
            assert!((back / value - 1.0).abs() < 1e-9, "{} {back}", parameter.name);
        }
    }

    #[test]
    fn no_search_coordinate_leaves_the_bounds() {
        let parameter = Parameter::logarithmic("k", 10.0, 1.0, 100.0);
        for step in -100..100 {
            let value = parameter.from_search(0.1 * f64::from(step));
            assert!((1.0 - 1e-12..=100.0 * (1.0 + 1e-12)).contains(&value));
        }
    }
}
