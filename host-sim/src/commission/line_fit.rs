//! A straight line through points, y = a + b x, by least squares, with what it leaves.

use serde::Serialize;

/// The line and its points.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LineFit {
    /// Abscissae.
    pub x: Vec<f64>,
    /// Ordinates.
    pub y: Vec<f64>,
    /// y at x = 0.
    pub offset: f64,
    /// Its standard deviation, none with fewer than three points.
    pub offset_std: Option<f64>,
    /// Change of y per x.
    pub slope: f64,
    /// Its standard deviation.
    pub slope_std: Option<f64>,
    /// Largest deviation of a point from the line, in the unit of y.
    pub largest_residual: f64,
}

impl LineFit {
    /// The line through these points; none where they do not determine one.
    #[must_use]
    #[allow(clippy::cast_precision_loss)]
    pub fn through(points: &[(f64, f64)]) -> Option<Self> {
        let n = points.len() as f64;
        let (x, y): (Vec<f64>, Vec<f64>) = points.iter().copied().unzip();
        let mean = |values: &[f64]| values.iter().sum::<f64>() / n;
        let (x_mean, y_mean) = (mean(&x), mean(&y));
        let spread: f64 = x.iter().map(|x| (x - x_mean).powi(2)).sum();
        if points.len() < 2 || spread.is_nan() || spread <= 0.0 {
            return None;
        }
        let slope = points.iter().map(|(x, y)| (x - x_mean) * (y - y_mean)).sum::<f64>() / spread;
        let offset = y_mean - slope * x_mean;
        let residuals: Vec<f64> = points.iter().map(|(x, y)| y - offset - slope * x).collect();
        let variance = residuals.iter().map(|r| r * r).sum::<f64>() / (n - 2.0);
        let known = points.len() > 2;
        let largest_residual = residuals.iter().fold(0.0, |most: f64, r| most.max(r.abs()));
        Some(Self {
            offset,
            offset_std: known.then(|| (variance * (1.0 / n + x_mean * x_mean / spread)).sqrt()),
            slope,
            slope_std: known.then(|| (variance / spread).sqrt()),
            largest_residual,
            x,
            y,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_found_and_what_it_leaves_is_told() {
        let fit = LineFit::through(&[(0.0, 1.0), (1.0, 3.1), (2.0, 5.0), (3.0, 6.9)]).unwrap();
        // By hand: slope 1.96, offset 1.06; residuals -0.06, 0.08, 0.02, -0.04.
        assert!((fit.slope - 1.96).abs() < 1e-12 && (fit.offset - 1.06).abs() < 1e-12, "{fit:?}");
        assert!((fit.largest_residual - 0.08).abs() < 1e-12);
        // s² = 0.012/2, Var(b) = s²/5.
        assert!((fit.slope_std.unwrap() - (0.006f64 / 5.0).sqrt()).abs() < 1e-12);
    }

    #[test]
    fn points_above_each_other_give_no_line() {
        assert_eq!(LineFit::through(&[(1.0, 1.0), (1.0, 2.0)]), None);
        assert_eq!(LineFit::through(&[(1.0, 1.0)]), None);
    }
}
