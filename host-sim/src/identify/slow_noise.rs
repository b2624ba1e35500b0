//! What noise slower than a block of [`super::fit_interval`] does to what is fitted: 1/f noise, which strain gauges'
//! amplifiers have and which a record of some ten seconds takes for friction of another speed.
//!
//! Its level is the flat part of the residuals' Allan variance (IEEE Std 952, bias instability), of which white noise makes
//! a part that falls with the length m of the means: σ²(m) = A/m + B. First-order processes of equal variance a decade apart
//! have a power B/(2 ln 2)/f (van der Ziel 1950): those as long as a block and ten times as long are what its sums do not
//! show. What is longer is a zero of the bridge, which has a prior.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};

use super::filters::{deviation_by_median, median_magnitude};
use super::linear;

/// Variance of a variance from so many differences, times their number, over its square: 2 of normal ones, of which their
/// median takes 37 % as much notice.
const VARIANCE_OF_VARIANCE: f64 = 2.0 / 0.37;
/// Shortest means, samples: shorter ones show the filters of sensors and what swings.
const SHORTEST: usize = 16;
/// Means of less than this part of their samples are none. A tip that sticks most of the time slides in each of them, and what
/// is slow is in a part of a mean as in all of it.
const LEAST_PART: usize = 8;
/// Longest ones, as a part of the shortest log: means of more than it are few, and what is fitted has taken of them.
const LONGEST: usize = 4;
/// Passes of the fit of the Allan variance: each has the weights of the last one's expectation.
const PASSES: usize = 8;
/// Variance of the process of a decade over the flat part.
const OF_DECADE: f64 = std::f64::consts::LN_10 / (2.0 * std::f64::consts::LN_2);
/// Time constants over the length of a block.
const BLOCKS_LONG: [f64; 2] = [1.0, 10.0];

/// What the errors of a fit are, all logs on end.
pub(super) struct Errors<'a> {
    /// Residuals; 0 where a sample takes no part, or does not show what is slow: where a tip sticks, its slip is observed from
    /// the force, slow noise and all.
    pub(super) residual: &'a [f64],
    /// Deviation of each.
    pub(super) deviation: &'a [f64],
    /// Samples of each log.
    pub(super) lengths: &'a [usize],
}

impl Errors<'_> {
    /// Allan variance of means over so many samples, half the squared difference of neighbours: that of white noise with the
    /// deviations, that of the residuals, and the number of differences.
    fn allan(&self, samples: usize) -> (f64, f64, usize) {
        let (mut white, mut differences, mut from) = (Vec::new(), Vec::new(), 0);
        for &length in self.lengths {
            let mean = |at: usize| {
                let (mut weight, mut sum, mut used) = (0.0, 0.0, 0);
                for i in at..at + samples {
                    if self.residual[i] != 0.0 {
                        let w = self.deviation[i].powi(-2);
                        (weight, sum, used) = (weight + w, sum + w * self.residual[i], used + 1);
                    }
                }
                (LEAST_PART * used > samples).then(|| (weight.recip(), sum / weight))
            };
            let means: Vec<_> = (0..length / samples).map(|k| mean(from + k * samples)).collect();
            from += length;
            for pair in means.windows(2) {
                if let [Some(a), Some(b)] = pair {
                    white.push(0.5 * (a.0 + b.0));
                    differences.push(a.1 - b.1);
                }
            }
        }
        let count = differences.len();
        let size = deviation_by_median(differences.into_iter());
        // The square of a number that is known so well is larger by its variance.
        let larger = 1.0 + 0.25 * VARIANCE_OF_VARIANCE / count as f64;
        (median_magnitude(white.into_iter()), 0.5 * size * size / larger, count)
    }

    /// Variance of the first-order process of a decade, as far as it is seen: what is less than its own deviation is not, since
    /// white noise in few long means looks like it in every other record.
    pub(super) fn of_decade(&self) -> f64 {
        let (level, variance) = self.level();
        (level - variance.sqrt()).max(0.0) * OF_DECADE
    }

    /// The same at its likeliest: what is not seen for sure counts against what is as slow.
    pub(super) fn likeliest_of_decade(&self) -> f64 {
        self.level().0 * OF_DECADE
    }

    /// Flat part of the Allan variance, and the variance of that: the likeliest, a variance being known to a share of what is
    /// expected of it, the better the more differences it is taken from. A share of what was found would weigh a mean that happens
    /// to be steady most.
    fn level(&self) -> (f64, f64) {
        let longest = self.lengths.iter().copied().min().unwrap_or(0) / LONGEST;
        let octaves = std::iter::successors(Some(SHORTEST), |m| Some(2 * m)).take_while(|m| *m <= longest);
        let seen: Vec<_> = octaves.map(|m| self.allan(m)).filter(|(_, found, _)| *found > 0.0).collect();
        let mut expected: Vec<f64> = seen.iter().map(|(_, found, _)| *found).collect();
        let (mut h, mut level) = (DMatrix::zeros(2, 2), 0.0);
        for _ in 0..PASSES {
            h.fill(0.0);
            let mut g = DVector::zeros(2);
            for ((white, found, count), expected) in seen.iter().zip(&expected) {
                let row = DVector::from_vec(vec![*white, 1.0]) / *expected;
                h += *count as f64 * &row * row.transpose();
                g += *count as f64 * found / expected * row;
            }
            let parts = linear::non_negative(&h, &g);
            level = parts[1];
            for (expected, (white, _, _)) in expected.iter_mut().zip(&seen) {
                *expected = (parts[0] * white + level).max(f64::MIN_POSITIVE);
            }
        }
        (level, linear::factor(&h).inverse()[(1, 1)] * VARIANCE_OF_VARIANCE)
    }

    /// Covariance of the score Σ g_t e_t with what slow noise e adds to it across blocks, whose own sums have made `within`; g are
    /// the gradients of each parameter. What cancels from block to block is not taken off.
    pub(super) fn across_blocks(
        &self,
        gradients: &[Vec<f64>],
        blocks: &[Range<usize>],
        within: DMatrix<f64>,
    ) -> DMatrix<f64> {
        let n = gradients.len();
        let mut across = DMatrix::zeros(n, n);
        let long = self.residual.len() as f64 / blocks.len().max(1) as f64;
        let ends: Vec<usize> = self
            .lengths
            .iter()
            .scan(0, |end, length| {
                *end += length;
                Some(*end)
            })
            .collect();
        for kept in BLOCKS_LONG.map(|blocks| (-1.0 / (blocks * long)).exp()) {
            // Twice Σ_s Σ_t g_s g_tᵀ kept^(t−s) over s in an earlier block of the same log than t.
            let mut past = DVector::zeros(n);
            for block in blocks {
                let mut own = DVector::zeros(n);
                for i in block.clone() {
                    if ends.contains(&i) {
                        (past, own) = (DVector::zeros(n), DVector::zeros(n));
                    }
                    past *= kept;
                    own *= kept;
                    if self.residual[i] != 0.0 {
                        let now = DVector::from_fn(n, |k, _| gradients[k][i]);
                        across.ger(2.0, &now, &past, 1.0);
                        own += now;
                    }
                }
                past += own;
            }
        }
        let across = across.symmetric_part() * self.of_decade();
        let of_blocks = linear::factor(&within).l();
        let whiten =
            |m: &DMatrix<f64>| of_blocks.solve_lower_triangular(m).unwrap_or_else(|| DMatrix::zeros(n, n));
        let mut relative = whiten(&whiten(&across).transpose()).symmetric_eigen();
        relative.eigenvalues.apply(|share| *share = share.max(0.0));
        within + &of_blocks * relative.recompose() * of_blocks.transpose()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::covariance::blocks_of;
    use crate::identify::noise::White;

    const LENGTHS: [usize; 2] = [8000, 12_000];
    const BLOCK: f64 = 500.0;

    /// White noise of deviation 1, and first-order processes of this deviation a decade apart, shorter than a sample to
    /// longer than a log.
    fn residual(of_each: f64, white: &mut White) -> Vec<f64> {
        of_lengths(LENGTHS, of_each, white)
    }

    fn of_lengths(lengths: [usize; 2], of_each: f64, white: &mut White) -> Vec<f64> {
        let mut all = Vec::new();
        for length in lengths {
            let constants = [5.0, 50.0, 500.0, 5000.0];
            let mut states = constants.map(|_| white.next());
            for _ in 0..length {
                for (state, constant) in states.iter_mut().zip(constants) {
                    let kept = f64::exp(-1.0 / constant);
                    *state = kept * *state + (1.0 - kept * kept).sqrt() * white.next();
                }
                all.push(white.next() + of_each * states.iter().sum::<f64>());
            }
        }
        all
    }

    fn errors<'a>(residual: &'a [f64], deviation: &'a [f64]) -> Errors<'a> {
        Errors { residual, deviation, lengths: &LENGTHS }
    }

    #[test]
    fn the_level_is_that_of_the_noise() {
        let ones = vec![1.0; 20_000];
        let mut white = White::new(3);
        for of_each in [0.1, 0.3] {
            let mean =
                (0..8).map(|_| errors(&residual(of_each, &mut white), &ones).of_decade()).sum::<f64>() / 8.0;
            let ratio = mean / (of_each * of_each);
            assert!((0.5..1.5).contains(&ratio), "{of_each}: {ratio}");
        }
        // White noise alone mostly shows none: less than what a block leaves of it.
        let mean = (0..64).map(|_| errors(&residual(0.0, &mut white), &ones).of_decade()).sum::<f64>() / 64.0;
        assert!(mean < 0.1 / BLOCK, "{mean}");
    }

    #[test]
    fn short_records_show_it_as_long_ones_do() {
        // Four or eight differences of the longest means, which by chance may be small.
        const SHORT: [usize; 2] = [1500, 1400];
        const RECORDS: u32 = 100;
        let ones = vec![1.0; 2900];
        let mut white = White::new(11);
        let (mut mean, mut unseen) = (0.0, 0);
        for _ in 0..RECORDS {
            let residual = of_lengths(SHORT, 0.5, &mut white);
            let errors = Errors { residual: &residual, deviation: &ones, lengths: &SHORT };
            let found = errors.likeliest_of_decade();
            mean += found / f64::from(RECORDS);
            unseen += u32::from(found == 0.0);
        }
        assert!((0.8..1.2).contains(&(mean / 0.25)) && unseen < 5, "{mean}, {unseen}");
    }

    #[test]
    fn the_level_is_seen_though_the_tip_slides_a_third_of_the_time() {
        let ones = vec![1.0; 20_000];
        let mut white = White::new(7);
        let mean = (0..8).map(|_| {
            let mut r = residual(0.3, &mut white);
            r.iter_mut().enumerate().filter(|(i, _)| i % 150 >= 50).for_each(|(_, r)| *r = 0.0);
            errors(&r, &ones).of_decade()
        });
        let ratio = mean.sum::<f64>() / 8.0 / 0.09;
        assert!((0.5..1.5).contains(&ratio), "{ratio}");
    }

    #[test]
    fn a_number_that_slow_noise_moves_is_as_uncertain_as_that() {
        // A number that shows in turn, two and a half blocks long: the slow processes do not cancel in it.
        let gradient: Vec<f64> = (0..20_000).map(|i| if i / 1250 % 2 == 0 { 1.0 } else { -0.5 }).collect();
        let norm: f64 = gradient.iter().map(|g| g * g).sum();
        let ones = vec![1.0; 20_000];
        let mut white = White::new(5);
        let (mut found, mut stated) = (0.0, 0.0);
        const TRIALS: u32 = 300;
        let blocks = blocks_of(gradient.len());
        for _ in 0..TRIALS {
            let r = residual(0.3, &mut white);
            let estimate = gradient.iter().zip(&r).map(|(g, r)| g * r).sum::<f64>() / norm;
            let sum = |block: &Range<usize>| linear::dot(&gradient[block.clone()], &r[block.clone()]);
            let within = DMatrix::from_element(1, 1, blocks.iter().map(|block| sum(block).powi(2)).sum());
            let spread = errors(&r, &ones).across_blocks(std::slice::from_ref(&gradient), &blocks, within);
            found += estimate * estimate / f64::from(TRIALS);
            stated += spread[(0, 0)] / norm / norm / f64::from(TRIALS);
        }
        // A variance of 300 is known to 8 %.
        assert!((0.75..1.3).contains(&(stated / found)), "{stated} for {found}");
    }
}
