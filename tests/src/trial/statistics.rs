//! Shares with exact intervals, and calibration of probabilities.

use statrs::distribution::{Beta, ContinuousCDF};

/// A count out of a number of cases.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Share {
    /// Cases that count.
    pub hits: usize,
    /// All cases.
    pub of: usize,
}

impl Share {
    /// Counts those that are true.
    pub fn of(cases: impl IntoIterator<Item = bool>) -> Self {
        cases.into_iter().fold(Self::default(), |share, hit| Self {
            hits: share.hits + usize::from(hit),
            of: share.of + 1,
        })
    }

    /// The share; NaN of no cases.
    #[must_use]
    pub fn value(self) -> f64 {
        self.hits as f64 / self.of as f64
    }

    /// Exact 95 % interval (C. J. Clopper, E. S. Pearson, Biometrika 26, 1934): quantiles of beta distributions;
    /// the whole range where there are no cases.
    #[must_use]
    pub fn interval_95(self) -> (f64, f64) {
        let (hits, misses) = (self.hits as f64, (self.of - self.hits) as f64);
        let quantile = |a: f64, b: f64, p: f64| Beta::new(a, b).map(|beta| beta.inverse_cdf(p));
        let low = if self.hits == 0 { 0.0 } else { quantile(hits, misses + 1.0, 0.025).unwrap_or(0.0) };
        let high = if misses == 0.0 { 1.0 } else { quantile(hits + 1.0, misses, 0.975).unwrap_or(1.0) };
        (low, high)
    }

    /// As `51 of 54, 94 % [85, 99]`.
    #[must_use]
    pub fn words(self) -> String {
        if self.of == 0 {
            return "–".to_string();
        }
        let (low, high) = self.interval_95();
        let percent = 100.0 * self.value();
        format!("{} of {}, {percent:.0} % [{:.0}, {:.0}]", self.hits, self.of, 100.0 * low, 100.0 * high)
    }
}

/// Probabilities stated against what was true, in ten bins of equal width.
#[derive(Debug, Clone, PartialEq)]
pub struct Calibration {
    /// (statements, their mean probability, share that was true) of each bin.
    pub bins: [(usize, f64, Share); 10],
    /// Mean over the statements of |mean probability − share true| of their bin.
    pub expected_error: f64,
}

impl Calibration {
    /// Of (probability, whether it was true).
    #[must_use]
    pub fn of(statements: &[(f64, bool)]) -> Self {
        let mut bins = [(0, 0.0, Share::default()); 10];
        for (probability, truth) in statements {
            let bin = &mut bins[((probability * 10.0) as usize).min(9)];
            bin.0 += 1;
            bin.1 += probability;
            bin.2.of += 1;
            bin.2.hits += usize::from(*truth);
        }
        let mut expected_error = 0.0;
        for bin in bins.iter_mut().filter(|bin| bin.0 > 0) {
            bin.1 /= bin.0 as f64;
            expected_error += (bin.1 - bin.2.value()).abs() * bin.0 as f64 / statements.len() as f64;
        }
        Self { bins, expected_error }
    }
}

/// Middle of the values (mean of the two middle ones); NaN of none.
#[must_use]
pub fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    let half = values.len() / 2;
    match values.len() {
        0 => f64::NAN,
        count if count % 2 == 1 => values[half],
        _ => 0.5 * (values[half - 1] + values[half]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn intervals_are_those_of_the_tables() {
        // Published tables: 0 of 10 → [0, 0.3085]; 5 of 10 → [0.1871, 0.8129]; 10 of 10 → [0.6915, 1].
        for (hits, low, high) in [(0, 0.0, 0.3085), (5, 0.1871, 0.8129), (10, 0.6915, 1.0)] {
            let found = Share { hits, of: 10 }.interval_95();
            assert!((found.0 - low).abs() < 1e-4 && (found.1 - high).abs() < 1e-4, "{hits}: {found:?}");
        }
    }

    #[test]
    fn an_interval_holds_the_truth_in_95_of_100_experiments_or_more() {
        // Exactly: sum of the binomial probabilities of the counts whose interval holds 0.9 of 54.
        let (n, p) = (54_usize, 0.9_f64);
        let mut mass = p.mul_add(-1.0, 1.0).powi(54);
        let mut held = 0.0;
        for hits in 0..=n {
            let (low, high) = Share { hits, of: n }.interval_95();
            held += if low <= p && p <= high { mass } else { 0.0 };
            mass *= (n - hits) as f64 / (hits + 1) as f64 * p / (1.0 - p);
        }
        assert!((0.95..1.0).contains(&held), "{held}");
    }

    #[test]
    fn calibration_is_perfect_where_shares_are_as_stated_and_counts_the_miss_otherwise() {
        let of = |share: usize| (0..10).map(|i| (0.75, i < share)).collect::<Vec<_>>();
        let miss = |share: usize| Calibration::of(&of(share)).expected_error;
        assert!((miss(3) - 0.45).abs() < 1e-12 && (miss(7) - 0.05).abs() < 1e-12);
        let mixed: Vec<(f64, bool)> = of(7).into_iter().chain([(1.0, true); 30]).collect();
        assert!((Calibration::of(&mixed).expected_error - 0.25 * 0.05).abs() < 1e-12);
    }

    #[test]
    fn the_median_is_in_the_middle() {
        assert!((median(vec![3.0, 1.0, 2.0]) - 2.0).abs() < 1e-12);
        assert!((median(vec![4.0, 1.0, 2.0, 3.0]) - 2.5).abs() < 1e-12);
        assert!(median(Vec::new()).is_nan());
    }
}
