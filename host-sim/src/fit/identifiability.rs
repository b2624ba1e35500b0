//! What the data cannot tell: singular values of the Jacobian in scaled parameters.
//!
//! Columns of J are multiplied by the typical size of their parameter. A column that is zero beside
//! the others is a parameter without influence. With columns then brought to length one, a small
//! singular value σ_min/σ_max means a direction in which changes of several parameters cancel; the
//! parameters with a large share in that right singular vector are those that cannot be told apart
//! (Belsley, Kuh and Welsch, 1980). Sees only the neighbourhood of one point.

use nalgebra::DMatrix;

/// Below this length relative to the longest, a scaled column has no influence: that is rounding of
/// differences of a simulation.
const NO_INFLUENCE: f64 = 1e-9;
/// Below this ratio of singular values a direction is lost: changes of 1 % cancel to 1e-7 of the signal.
const LOST_DIRECTION: f64 = 1e-5;
/// A parameter belongs to a lost direction if it has at least this share of the largest component.
const SHARE: f64 = 0.05;

/// What a Jacobian says about identifiability.
#[derive(Debug, Clone, PartialEq)]
pub enum Identifiability {
    /// Every direction in parameter space changes the residual.
    Full {
        /// Smallest over largest singular value, columns at unit length.
        singular_ratio: f64,
    },
    /// These parameters, by position, change nothing.
    NoInfluence(Vec<usize>),
    /// Changes of these parameters, by position, cancel.
    Inseparable {
        /// The parameters.
        parameters: Vec<usize>,
        /// Smallest over largest singular value.
        singular_ratio: f64,
    },
}

/// Examines a Jacobian whose columns are scaled to typical sizes of the parameters.
pub fn examine(scaled: &DMatrix<f64>) -> Identifiability {
    let norms: Vec<f64> = scaled.column_iter().map(|column| column.norm()).collect();
    let longest = norms.iter().copied().fold(0.0, f64::max);
    let without: Vec<usize> =
        (0..norms.len()).filter(|&column| norms[column] <= longest * NO_INFLUENCE).collect();
    if !without.is_empty() {
        return Identifiability::NoInfluence(without);
    }
    let unit = DMatrix::from_fn(scaled.ncols(), scaled.ncols(), |i, j| {
        scaled.column(i).dot(&scaled.column(j)) / (norms[i] * norms[j])
    });
    // Eigenvalues of the p × p matrix of cosines are the squared singular values; ratios down to
    // 1e-7 survive the squaring, which is below the limit used here.
    let eigen = unit.symmetric_eigen();
    let largest = eigen.eigenvalues.iter().copied().fold(0.0, f64::max);
    let (at, least) = eigen
        .eigenvalues
        .iter()
        .copied()
        .enumerate()
        .fold((0, f64::INFINITY), |best, (at, value)| if value < best.1 { (at, value) } else { best });
    let singular_ratio = (least.max(0.0) / largest).sqrt();
    if singular_ratio >= LOST_DIRECTION {
        return Identifiability::Full { singular_ratio };
    }
    let direction = eigen.eigenvectors.column(at);
    let most = direction.amax();
    let parameters = (0..norms.len()).filter(|&i| direction[i].abs() >= SHARE * most).collect();
    Identifiability::Inseparable { parameters, singular_ratio }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn column(f: impl Fn(f64) -> f64) -> impl Fn(usize) -> f64 {
        move |row| f(row as f64 / 100.0)
    }

    #[test]
    fn independent_columns_are_identified() {
        let (a, b) = (column(|t| t.sin()), column(|t| t * t));
        let jacobian = DMatrix::from_fn(500, 2, |row, c| if c == 0 { a(row) } else { b(row) });
        assert!(matches!(examine(&jacobian), Identifiability::Full { .. }));
    }

    #[test]
    fn a_product_of_two_parameters_names_both_and_not_the_third() {
        let (a, b) = (column(|t| t.sin()), column(|t| t * t));
        let jacobian = DMatrix::from_fn(500, 3, |row, c| match c {
            0 => 2.0 * a(row),
            1 => b(row),
            _ => -5.0 * a(row),
        });
        let Identifiability::Inseparable { parameters, .. } = examine(&jacobian) else { panic!() };
        assert_eq!(parameters, [0, 2]);
    }

    #[test]
    fn a_column_of_zeros_has_no_influence() {
        let a = column(|t| t.cos());
        let jacobian = DMatrix::from_fn(500, 2, |row, c| if c == 0 { a(row) } else { 0.0 });
        assert_eq!(examine(&jacobian), Identifiability::NoInfluence(vec![1]));
    }
}
