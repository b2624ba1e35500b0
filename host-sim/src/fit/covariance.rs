//! Covariance of least-squares parameters when the residual is not white.
//!
//! cov θ = (JᵀJ)⁻¹ S (JᵀJ)⁻¹ with S = Σ_b s_b s_bᵀ and s_b = Σ_{t∈b} J_t r_t, the sum of the scores over
//! a block of neighbouring samples (batch means of the sandwich estimator; White 1980, Newey and West
//! 1987 weigh lags instead of cutting blocks). White noise gives σ²(JᵀJ)⁻¹; residuals that are
//! correlated over less than a block give the larger variance that they deserve. Left out: correlation
//! longer than a block, so 40 blocks are taken, each 1/40 of the record.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};

/// Number of blocks.
pub const BLOCKS: usize = 40;

/// Blocks of so many samples.
pub fn blocks_of(samples: usize) -> Vec<Range<usize>> {
    let blocks = BLOCKS.min(samples / 2).max(1);
    (0..blocks).map(|block| block * samples / blocks..(block + 1) * samples / blocks).collect()
}

/// Makes the covariance of Jᵀr of these blocks' and the one that they show, where noise is slower than a block.
pub type Slow<'a> = &'a dyn Fn(&[Range<usize>], DMatrix<f64>) -> DMatrix<f64>;

/// Covariance of the parameters; `None` where JᵀJ cannot be inverted.
pub fn sandwich(
    jacobian: &DMatrix<f64>,
    residual: &DVector<f64>,
    slow: Option<Slow<'_>>,
) -> Option<DMatrix<f64>> {
    let (samples, parameters) = jacobian.shape();
    let blocks = blocks_of(samples);
    if samples <= parameters || blocks.len() <= parameters {
        return None;
    }
    // Columns are scaled to length one for the inverse, and scaled back after it.
    let norms: Vec<f64> = jacobian.column_iter().map(|column| column.norm().max(f64::MIN_POSITIVE)).collect();
    let scaled = DMatrix::from_fn(samples, parameters, |sample, parameter| {
        jacobian[(sample, parameter)] / norms[parameter]
    });
    let inverse = (scaled.transpose() * &scaled).try_inverse()?;
    let mut spread = DMatrix::zeros(parameters, parameters);
    for block in &blocks {
        let score = scaled.rows_range(block.clone()).transpose() * residual.rows_range(block.clone());
        spread += &score * score.transpose();
    }
    // Fitting p parameters removes p of the blocks' degrees of freedom.
    spread *= blocks.len() as f64 / (blocks.len() - parameters) as f64;
    let of_jacobian = |of_scaled: &DMatrix<f64>, back: i32| {
        DMatrix::from_fn(parameters, parameters, |i, j| of_scaled[(i, j)] * (norms[i] * norms[j]).powi(back))
    };
    if let Some(slow) = slow {
        spread = of_jacobian(&slow(&blocks, of_jacobian(&spread, 1)), -1);
    }
    let covariance = &inverse * spread * &inverse;
    Some(of_jacobian(&covariance, -1))
}

/// Correlations from a covariance.
pub fn correlations(covariance: &DMatrix<f64>) -> DMatrix<f64> {
    let std: Vec<f64> = covariance.diagonal().iter().map(|variance| variance.max(0.0).sqrt()).collect();
    DMatrix::from_fn(std.len(), std.len(), |i, j| {
        if i == j { 1.0 } else { covariance[(i, j)] / (std[i] * std[j]).max(f64::MIN_POSITIVE) }
    })
}

/// Half width of the 95 % interval in standard deviations: Student's t for `BLOCKS` − 10 degrees of
/// freedom, the least that a fit of up to ten parameters leaves.
pub const INTERVAL_95: f64 = 2.042;

#[cfg(test)]
mod tests {
    use super::*;

    /// Reproducible noise, uniform with variance 1.
    fn noise(count: usize, mut seed: u64) -> Vec<f64> {
        (0..count)
            .map(|_| {
                seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                ((seed >> 11) as f64 / (1u64 << 53) as f64 - 0.5) * 12f64.sqrt()
            })
            .collect()
    }

    #[test]
    fn white_noise_gives_the_classical_standard_deviation() {
        let samples = 4000;
        let jacobian = DMatrix::from_element(samples, 1, 1.0);
        let covariance = sandwich(&jacobian, &DVector::from_vec(noise(samples, 3)), None).unwrap();
        // A variance from 40 blocks has a relative standard deviation of √(2/40) = 22 %; three of them.
        let ratio = covariance[(0, 0)] * samples as f64;
        assert!((ratio - 1.0).abs() < 0.66, "{ratio}");
    }

    #[test]
    fn correlated_noise_widens_the_interval() {
        let samples = 8000;
        let white = noise(samples, 5);
        let mut state = 0.0;
        let red: Vec<f64> = white
            .iter()
            .map(|w| {
                state = 0.9 * state + w;
                state
            })
            .collect();
        let jacobian = DMatrix::from_element(samples, 1, 1.0);
        let covariance = sandwich(&jacobian, &DVector::from_vec(red), None).unwrap();
        // Variance of the mean of an AR(1) process: σ²/(1 − 0.9)²/n = 100/n.
        let ratio = covariance[(0, 0)] * samples as f64 / 100.0;
        assert!((0.4..1.7).contains(&ratio), "{ratio}");
    }
}
