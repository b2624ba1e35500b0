//! Covariance of what was fitted, when residuals are neither white nor normal.
//!
//! cov p = H⁻¹ S H⁻¹ (Huber 1967, White 1980) with H = Σ ψ′(r_t) j_t j_tᵀ, S = Σ_b s_b s_bᵀ and s_b = Σ_{t∈b} j_t ψ(r_t)
//! summed over a block of neighbouring samples, as [`crate::fit::covariance`] does for least squares; ψ is the slope of
//! Student's likelihood. The blocks see whatever noise of the inputs, error between samples or of the model's form is
//! left in the residuals and is correlated over less than a block; S has what noise that is slower adds from block to block
//! besides ([`super::slow_noise`]), as far as it was not taken out of residuals and columns. The prior takes part in H alone, so that a
//! number that the logs do not determine is as uncertain as the prior and no less.

use std::borrow::Cow;

use nalgebra::{DMatrix, DVector};

use super::contact::log::ContactLog;
use super::contact::problem::{FREEDOM, Fit, Problem};
use super::linear::{self, Slope};
use super::slow_noise::Errors;
use crate::fit::covariance::BLOCKS;

/// Blocks of nearly equal length, none across two logs; `lengths` are those of the logs.
fn blocks(lengths: &[usize]) -> Vec<std::ops::Range<usize>> {
    let all: usize = lengths.iter().sum();
    let mut from = 0;
    let mut blocks = Vec::new();
    for &length in lengths {
        let count = ((BLOCKS * length) as f64 / all.max(1) as f64).round().max(1.0) as usize;
        blocks.extend((0..count).map(|b| from + b * length / count..from + (b + 1) * length / count));
        from += length;
    }
    blocks
}

/// What a likelihood says of parameters about where they were fitted.
pub(super) struct Known {
    /// Covariance.
    pub(super) covariance: DMatrix<f64>,
    /// From where they were fitted to the likelihood's own top, the prior left out: H⁻¹ Σ ψ(r_t) j_t, and not cov p times the
    /// prior's slope: a likelihood that is less sure than it pretends to be pulls no less.
    pub(super) to_top: DVector<f64>,
}

/// Residuals and columns −∂r/∂p of a fit, all logs on end, whitened as far as the noise is.
pub(super) struct Linearised<'a> {
    columns: Cow<'a, [Slope]>,
    /// Residuals over their deviations; 0 where a sample takes no part.
    r: Cow<'a, [f64]>,
    /// The deviations, N m.
    deviation_nm: &'a [f64],
    /// Where the tip slides: elsewhere slow noise does not show.
    slides: Vec<bool>,
    /// Samples of each log.
    lengths: Vec<usize>,
}

impl<'a> Linearised<'a> {
    /// About a fit.
    pub(super) fn new(problem: &'a Problem<'_>, fit: &'a Fit, columns: &'a [Slope]) -> Self {
        Self {
            columns: problem.noise.whitened_columns(columns),
            r: problem.noise.whitened(&fit.r),
            deviation_nm: &problem.noise.deviation,
            slides: problem.slides(fit),
            lengths: problem.logs.iter().map(ContactLog::len).collect(),
        }
    }

    /// What it says of parameters whose prior is `prior_sd`, `fitted` of them having been fitted to the residuals.
    pub(super) fn known(&self, prior_sd: &[f64], fitted: usize) -> Known {
        let Self { columns, r, deviation_nm, slides, lengths } = self;
        let n = columns.len();
        let score: Vec<f64> = r.iter().map(|r| score(*r)).collect();
        let slope: Vec<f64> = r
            .iter()
            .map(|r| {
                if *r == 0.0 { 0.0 } else { (FREEDOM + 1.0) * (FREEDOM - r * r) / (FREEDOM + r * r).powi(2) }
            })
            .collect();
        // In units of the prior, so that the inverse is of numbers of one size.
        let scaled = scaled(columns, prior_sd);
        let (mut h, _) = linear::normal_equations(&scaled, &slope, r);
        let blocks = blocks(lengths);
        let residual = r.iter().zip(*deviation_nm).zip(slides);
        let residual: Vec<f64> =
            residual.map(|((r, sd), slides)| if *slides { r * sd } else { 0.0 }).collect();
        let gradient = |c: &Vec<f64>| {
            c.iter().zip(&slope).zip(*deviation_nm).map(|((c, slope), sd)| c * slope / sd).collect()
        };
        let gradients: Vec<Vec<f64>> = scaled.iter().map(gradient).collect();
        let errors = Errors { residual: &residual, deviation: deviation_nm, lengths };
        let mut spread = DMatrix::identity(n, n);
        let freedom = blocks.len() as f64 / (blocks.len().saturating_sub(fitted)).max(1) as f64;
        for block in &blocks {
            let sum =
                DVector::from_fn(n, |i, _| linear::dot(&scaled[i][block.clone()], &score[block.clone()]));
            spread += freedom * &sum * sum.transpose();
        }
        let spread = errors.across_blocks(&gradients, &blocks, spread);
        for i in 0..n {
            h[(i, i)] += 1.0;
        }
        let factor = linear::factor(&h);
        let covariance = factor.solve(&factor.solve(&spread).transpose());
        let to_top = factor.solve(&DVector::from_fn(n, |i, _| linear::dot(&scaled[i], &score)));
        Known {
            covariance: DMatrix::from_fn(n, n, |i, j| covariance[(i, j)] * prior_sd[i] * prior_sd[j]),
            to_top: to_top.component_mul(&DVector::from_column_slice(prior_sd)),
        }
    }
}

/// Slope of −ln of Student's likelihood over the residual.
fn score(r: f64) -> f64 {
    (FREEDOM + 1.0) * r / (FREEDOM + r * r)
}

fn scaled(columns: &[Slope], by: &[f64]) -> Vec<Vec<f64>> {
    columns.iter().zip(by).map(|(c, by)| c.iter().map(|x| x * by).collect()).collect()
}

/// Samples that count as one to what is fitted: tr(V₀⁻¹V) over its expectation, V the variance of the score from blocks and V₀ that
/// of samples that are independent (Pauli, Racugno and Ventura 2011 scale a composite likelihood so). An error that repeats
/// itself, as that of a swing between two samples does, has no slow part and yet says the same again and again.
///
/// The score of all blocks together is nothing where the parameters were fitted, so that of n parameters and independent samples
/// n − Σ_b tr((V₀⁻¹V_b)²) is expected, V_b what a block has of V₀: of nearly all of them where each is seen in many blocks, and of
/// those that are seen in one nothing.
pub(super) fn repeated(columns: &[Slope], r: &[f64], lengths: &[usize], prior_sd: &[f64]) -> f64 {
    let n = columns.len();
    let score: Vec<f64> = r.iter().map(|r| score(*r)).collect();
    let scaled = scaled(columns, prior_sd);
    let squares: Vec<f64> = score.iter().map(|s| s * s).collect();
    let of_block = |block: std::ops::Range<usize>| {
        let sum = DVector::from_fn(n, |i, _| linear::dot(&scaled[i][block.clone()], &score[block.clone()]));
        let columns: Vec<&[f64]> = scaled.iter().map(|column| &column[block.clone()]).collect();
        let (independent, _) = linear::normal_equations(&columns, &squares[block.clone()], &r[block]);
        (sum, independent)
    };
    let blocks: Vec<(DVector<f64>, DMatrix<f64>)> = blocks(lengths).into_iter().map(of_block).collect();
    let independent = blocks.iter().fold(DMatrix::zeros(n, n), |sum, (_, own)| sum + own);
    let factor = linear::factor(&independent);
    let seen: f64 = blocks.iter().map(|(sum, _)| sum.dot(&factor.solve(sum))).sum();
    let taken: f64 = blocks
        .iter()
        .map(|(_, own)| {
            let share = factor.solve(own);
            share.component_mul(&share.transpose()).sum()
        })
        .sum();
    seen / (n as f64 - taken).max(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::identify::spectrum::{SLOW_HZ, share_below};

    fn noise(count: usize, mut seed: u64) -> Vec<f64> {
        let mut uniform = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 11) as f64 / (1u64 << 53) as f64 - 0.5
        };
        (0..count).map(|_| (0..12).map(|_| uniform()).sum()).collect()
    }

    #[test]
    fn blocks_cover_every_sample_once_and_stay_within_a_log() {
        let blocks = blocks(&[3000, 1000]);
        assert_eq!(blocks.len(), BLOCKS);
        assert!(blocks.windows(2).all(|b| b[0].end == b[1].start) && blocks[BLOCKS - 1].end == 4000);
        assert!(blocks.iter().any(|b| b.end == 3000));
    }

    #[test]
    fn an_error_that_repeats_itself_counts_as_few_samples() {
        let n = 8000;
        let lengths = [n];
        let swing: Slope = (0..n).map(|i| (2.2 * i as f64).sin()).collect();
        let of = |r: &[f64]| repeated(std::slice::from_ref(&swing), r, &lengths, &[1.0]);
        let white = noise(n, 5);
        // Forty blocks know a variance within 22 %, one deviation.
        let independent = of(&white);
        assert!((0.4..1.8).contains(&independent), "{independent}");
        // The form of the swing is wrong by as much as the noise, over a half of the log one way and the other way after it.
        let wrong: Vec<f64> =
            (0..n).map(|i| white[i] + if i < n / 2 { swing[i] } else { -swing[i] }).collect();
        let slow = share_below(SLOW_HZ, &wrong, 1e-3);
        let counts = of(&wrong);
        assert!(slow < 2.0 && counts > 20.0, "{slow} {counts}");
    }

    #[test]
    fn independent_samples_count_as_one_each_to_however_many_parameters() {
        let n = 8000;
        let white = noise(n, 5);
        let counts = |parameters: usize| {
            let wave = |k: usize| (0..n).map(move |i| (0.05 * (k + 1) as f64 * i as f64).sin()).collect();
            let columns: Vec<Slope> = (0..parameters).map(wave).collect();
            let (h, g) = linear::normal_equations(&columns, &vec![1.0; n], &white);
            let fitted = linear::factor(&h).solve(&g);
            let left: Vec<f64> = (0..n)
                .map(|i| white[i] - columns.iter().zip(fitted.iter()).map(|(c, p)| c[i] * p).sum::<f64>())
                .collect();
            repeated(&columns, &left, &[n], &vec![1.0; parameters])
        };
        // More than there are blocks, too.
        for parameters in [8, 30, BLOCKS + 15] {
            let counts = counts(parameters);
            assert!((0.8..1.25).contains(&counts), "{parameters}: {counts}");
        }
    }

    /// Of residuals of deviation 1 in one log that slides throughout.
    fn of(columns: &[Slope], r: &[f64], prior_sd: &[f64]) -> Known {
        let deviation_nm = &vec![1.0; r.len()];
        let (slides, lengths) = (vec![true; r.len()], vec![r.len()]);
        Linearised { columns: columns.into(), r: r.into(), deviation_nm, slides, lengths }
            .known(prior_sd, columns.len())
    }

    #[test]
    fn the_mean_of_white_noise_has_its_own_deviation() {
        const RECORDS: u64 = 32;
        let n = 8000;
        let ratio = |seed: u64| {
            of(&[vec![1.0; n].into()], &noise(n, 100 + seed), &[1.0]).covariance[(0, 0)] * n as f64
        };
        let mut ratios: Vec<f64> = (0..RECORDS).map(ratio).collect();
        ratios.sort_by(f64::total_cmp);
        // Forty blocks know a variance within 22 %, one deviation; Student's weights cost 1/0.93 on normal noise.
        let usual = ratios[ratios.len() / 2];
        assert!((0.8..1.4).contains(&usual), "{usual}");
        // White noise by chance looks slow in one record of six, by half of its variance on the mean of all.
        let mean = ratios.iter().sum::<f64>() / RECORDS as f64;
        assert!(mean < 2.0, "{mean}");
    }

    #[test]
    fn the_top_is_where_the_slope_says_however_uncertain_it_is() {
        let n = 8000;
        // A mean of 0.1 that the prior kept out of the fit; beside it a swing of the whole log's length in the residuals.
        let of = |swing: f64| {
            let wave = |i: usize| (std::f64::consts::TAU * i as f64 / n as f64).sin();
            let r: Vec<f64> =
                noise(n, 3).iter().enumerate().map(|(i, x)| 0.1 + x + swing * wave(i)).collect();
            of(&[vec![1.0; n].into()], &r, &[1.0])
        };
        let (quiet, swings) = (of(0.0), of(0.5));
        let grows = swings.covariance[(0, 0)] / quiet.covariance[(0, 0)];
        assert!(grows > 5.0, "{grows}");
        for known in [quiet, swings] {
            assert!((known.to_top[0] - 0.1).abs() < 0.03, "{}", known.to_top);
        }
    }

    #[test]
    fn what_changes_nothing_is_as_uncertain_as_its_prior() {
        let n = 2000;
        let c = of(&[1.0, 0.0].map(|x| vec![x; n].into()), &noise(n, 5), &[1.0, 0.7]).covariance;
        assert!((c[(1, 1)].sqrt() - 0.7).abs() < 1e-9, "{c}");
    }
}
