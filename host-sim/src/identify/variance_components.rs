//! How large named sources of noise are: variance components from squared residuals.
//!
//! v = Σ a_s n_s² + what is known besides, with n_s from each source and a_s ≥ 0 by iterated weighted least squares on the squares,
//! Student-t cut and with a weak prior at 1 (Rao 1970, minimum norm quadratic estimation).

use nalgebra::{DMatrix, DVector};

use super::linear;

/// The prior weighs as much as this share of the samples.
const PRIOR_SHARE: f64 = 2e-5;
/// Beyond so many deviations a residual is the tail's; the cut costs this factor of a Gaussian's variance.
const CUT: (f64, f64) = (3.0, 1.15);
/// Passes: each has the weights of the last one's variances.
const PASSES: usize = 6;
/// A source is not taken for less than this share of its variance.
pub(super) const LEAST: f64 = 1e-3;

/// A sample: squares of its sources, square of its residual, variance that is known besides.
pub(super) struct Sample<'s> {
    pub(super) sources: &'s [f64],
    pub(super) square: f64,
    pub(super) besides: f64,
}

/// The factors, `least` of each at least; `typical` is the samples' usual variance before. 1 where there is no sample.
pub(super) fn fitted(samples: &[Sample<'_>], least: &[f64], typical: f64) -> Vec<f64> {
    let count = least.len();
    let mut factors = vec![1.0; count];
    if samples.is_empty() {
        return factors;
    }
    let strength = PRIOR_SHARE * samples.len() as f64;
    let mean = |s: usize| samples.iter().map(|own| own.sources[s]).sum::<f64>() / samples.len() as f64;
    let prior: Vec<f64> = (0..count).map(|s| strength * (mean(s) / typical).powi(2) + 1e-30).collect();
    for _ in 0..PASSES {
        let (mut h, mut g) = (DMatrix::<f64>::zeros(count, count), DVector::<f64>::zeros(count));
        for Sample { sources, square, besides } in samples {
            let v = sources.iter().zip(&factors).map(|(n, a)| n * a).sum::<f64>().max(1e-24) + besides;
            let y = square.min(CUT.0 * CUT.0 * v) * CUT.1 - besides;
            for a in 0..count {
                g[a] += sources[a] * y / (v * v);
                for b in 0..=a {
                    h[(a, b)] += sources[a] * sources[b] / (v * v);
                }
            }
        }
        h.fill_upper_triangle_with_lower_triangle();
        for (s, prior) in prior.iter().enumerate() {
            h[(s, s)] += prior;
            g[s] += prior;
        }
        factors = linear::solve_bounded(&h, &g, least).iter().copied().collect();
    }
    factors
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::identify::noise::tests::white;

    #[test]
    fn sources_are_found_as_large_as_they_are() {
        const COUNT: usize = 20_000;
        // The second source acts in a quarter of the samples, and is a tenth of what it is thought to be; the first twice.
        let sources: Vec<[f64; 2]> =
            (0..COUNT).map(|i| [1.0, if i % 4 == 0 { 100.0 } else { 0.0 }]).collect();
        let noise = white(COUNT, 3);
        let samples: Vec<Sample<'_>> = sources
            .iter()
            .zip(&noise)
            .map(|(own, n)| Sample {
                sources: own,
                square: (4.0 * own[0] + 0.01 * own[1]) * n * n,
                besides: 0.0,
            })
            .collect();
        let found = fitted(&samples, &[LEAST, LEAST], 26.0);
        // This noise has no tails, for the cut of which a seventh is added.
        assert!((found[0] / 4.0 - 1.0).abs() < 0.2 && (found[1] - 0.01).abs() < 0.005, "{found:?}");
        // What one source is known to make the others do not make as well.
        assert_eq!(fitted(&samples, &[9.0, LEAST], 26.0), [9.0, LEAST]);
    }
}
