//! Is it worth fitting an effect beside others? An estimate from fits at hand.
//!
//! The fit of the effect alone tells how its parameters move the residuals. The residual of the combination so far is regressed on
//! these columns (a score test; Rao 1948): R² of it is what the effect could explain to first order, and −(n/2) ln(1 − R²) the gain in
//! log-likelihood. It decides only what is not even tried: the effect's own fit may have other shapes than
//! it has beside the others.

use nalgebra::{DMatrix, DVector};

use super::analysis::{Fit, Role};
use super::pooled::channels;
use super::score::Independent;

/// Smallest singular value of the columns that counts, relative to the largest.
const SINGULAR: f64 = 1e-8;

/// Estimated gain in log-likelihood of adding `effect` to a fit; `alone` is the effect's own fit. `None` where that does not tell.
pub fn estimated_gain(fit: &Fit, alone: &Fit, effect: &str, independent: &Independent) -> Option<f64> {
    let own: Vec<usize> =
        (0..alone.parameters.len()).filter(|&p| alone.parameters[p].effect == Some(effect)).collect();
    let baseline: Vec<usize> =
        (0..alone.parameters.len()).filter(|&p| alone.parameters[p].effect.is_none()).collect();
    let (mut residual, mut rows) = (Vec::new(), Vec::new());
    let mut known = false;
    for channel in channels(fit, Role::Train) {
        let level = channel.mean_square().sqrt().max(1e-12);
        let other = channels(alone, Role::Train).into_iter().find(|c| c.name == channel.name)?;
        for ((_, now), (_, alone)) in channel.pieces.iter().zip(&other.pieces) {
            let columns: Vec<Option<&Vec<f64>>> = own
                .iter()
                .chain(&baseline)
                .map(|&p| alone.sensitivity.get(p).filter(|column| column.len() == now.residual.len()))
                .collect();
            // A size that lies on its bound alone moves nothing there, and may do so beside others.
            let moves = |column: &Option<&Vec<f64>>| {
                column.is_some_and(|c| c.iter().any(|x| x.is_finite() && *x != 0.0))
            };
            known |= columns[..own.len()].iter().any(moves);
            for (i, r) in now.residual.iter().enumerate().filter(|(_, r)| r.is_finite()) {
                residual.push(r / level);
                let value = |column: &Option<&Vec<f64>>| column.map_or(0.0, |c| c[i] / level);
                rows.extend(columns.iter().map(value).map(|x| if x.is_finite() { x } else { 0.0 }));
            }
        }
    }
    let width = own.len() + baseline.len();
    if !known || residual.len() <= 2 * width {
        return None;
    }
    let matrix = DMatrix::from_row_slice(residual.len(), width, &rows);
    let residual = DVector::from_vec(residual);
    let explained =
        |columns: std::ops::Range<usize>| projected(&matrix.columns_range(columns).into_owned(), &residual);
    let total = residual.norm_squared();
    // What the baseline's parameters alone would still gain is not the effect's.
    let share = (explained(0..width) - explained(own.len()..width)) / total;
    Some(-0.5 * independent.total() * (1.0 - share.clamp(0.0, 0.999)).ln())
}

/// Sum of squares of a vector that columns explain.
fn projected(columns: &DMatrix<f64>, vector: &DVector<f64>) -> f64 {
    if columns.is_empty() {
        return 0.0;
    }
    let mut scaled = columns.clone();
    for mut column in scaled.column_iter_mut() {
        let norm = column.norm();
        if norm > 0.0 {
            column /= norm;
        }
    }
    let eigen = (scaled.transpose() * &scaled).symmetric_eigen();
    let products = scaled.transpose() * vector;
    let largest = eigen.eigenvalues.max();
    (0..eigen.eigenvalues.len())
        .filter(|&k| eigen.eigenvalues[k] > SINGULAR * largest)
        .map(|k| eigen.eigenvectors.column(k).dot(&products).powi(2) / eigen.eigenvalues[k])
        .sum()
}

#[cfg(test)]
mod tests {
    use super::super::analysis::Estimate;
    use super::super::noise::tests::white;
    use super::super::pooled::tests::fit_of;
    use super::*;

    #[test]
    fn an_effect_whose_column_is_in_the_residual_is_worth_a_fit_and_another_is_not() {
        let column: Vec<f64> = (0..3000).map(|i| (0.07 * i as f64).sin()).collect();
        let noise = white(3000, 2);
        let fit = fit_of(noise.iter().zip(&column).map(|(e, x)| e + 0.3 * x).collect());
        let alone = |column: Vec<f64>| {
            let mut alone = fit_of(white(3000, 3));
            alone.parameters =
                vec![Estimate { effect: Some("x"), name: "size".into(), value: 1.0, std: 0.1, log: None }];
            alone.logs[0].channels[0].sensitivity = vec![column];
            alone
        };
        let independent = Independent::of(&fit_of(noise), Role::Train);
        let gain = |column| estimated_gain(&fit, &alone(column), "x", &independent).unwrap();
        // 0.3²/2 of a variance of 1.045 over 3000 values: 66; by chance about one half.
        assert!((gain(column) - 66.0).abs() < 20.0);
        assert!(gain(white(3000, 9)) < 5.0);
    }
}
