//! How much better one fit is than another, and what its parameters cost.
//!
//! A channel's level of residual is not taken as known: no model of a real rig is perfect. Its log-likelihood
//! with the level estimated is −(n/2) ln(mean loss), the loss nearly the square, n the number of independent values
//! ([`super::pooled`]) that the best fit at hand leaves. A parameter costs (1/2) ln n (Schwarz 1978), an effect costs
//! [`EFFECT_PRICE`] more, because it was picked among many and its shapes were searched over a range.

use super::analysis::{Fit, Role};
use super::pooled::{channels, common_losses};
use super::structure::TOLERATED_LEVEL;

/// Price of an effect beside its parameters, in units of log-likelihood: a level of e⁻⁶ for each.
pub const EFFECT_PRICE: f64 = 6.0;

/// Independent values in each channel of the training logs.
#[derive(Debug, Clone, PartialEq)]
pub struct Independent {
    counts: Vec<(&'static str, f64)>,
}

impl Independent {
    /// As a fit's residuals tell.
    pub fn of(fit: &Fit, role: Role) -> Self {
        let counts = channels(fit, role)
            .iter()
            .map(|channel| (channel.name, channel.count() as f64 / channel.correlation_length()))
            .collect();
        Self { counts }
    }

    /// As if nothing were left but noise: what could be seen at best.
    pub fn at_most(fit: &Fit, role: Role) -> Self {
        let counts = channels(fit, role)
            .iter()
            .map(|channel| (channel.name, channel.count() as f64 / channel.samples_per_noise()))
            .collect();
        Self { counts }
    }

    fn of_channel(&self, name: &str) -> f64 {
        self.counts.iter().find(|(known, _)| *known == name).map_or(0.0, |(_, count)| *count)
    }

    /// In all channels.
    pub fn total(&self) -> f64 {
        self.counts.iter().map(|(_, count)| count).sum()
    }
}

/// A fit against the baseline.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Score {
    /// Log-likelihood ratio to the baseline.
    pub likelihood: f64,
    /// The same less the price of parameters and effects.
    pub penalised: f64,
    /// Relative fall of the mean square of the subsystem's own signal, its first channel: 1 − after/before.
    pub share: f64,
}

/// Log-likelihood ratio of `fit` to `base` on the logs of a role, and the relative fall of the first channel.
pub fn likelihood_ratio(base: &Fit, fit: &Fit, role: Role, independent: &Independent) -> (f64, f64) {
    let (mut likelihood, mut share) = (0.0, 0.0);
    for (index, before) in channels(base, role).iter().enumerate() {
        let after = channels(fit, role).into_iter().find(|c| c.name == before.name);
        let Some(after) = after else { continue };
        let (from, to, count) = common_losses(before, &after);
        if count == 0 || from <= 0.0 {
            continue;
        }
        // A witness that noise nearly explains has nothing more to say: it would outvote, by its many independent
        // values, a signal that is far from explained.
        let (from, to) =
            if index == 0 { (from, to) } else { (from.max(TOLERATED_LEVEL), to.max(TOLERATED_LEVEL)) };
        // Residuals below a millionth of their start are not told apart: rounding.
        let ratio = (to / from).max(1e-6);
        likelihood -= 0.5 * independent.of_channel(before.name) * ratio.ln();
        if index == 0 {
            share = 1.0 - ratio;
        }
    }
    (likelihood, share)
}

/// Parameters that a fit has more than the baseline.
pub fn added_parameters(fit: &Fit) -> usize {
    let trained = |log: usize| fit.logs.get(log).is_some_and(|log| log.role == Role::Train);
    fit.parameters.iter().filter(|p| p.effect.is_some() && p.std != 0.0 && p.log.is_none_or(trained)).count()
}

/// Scores a fit against the baseline on the training logs.
pub fn score(base: &Fit, fit: &Fit, independent: &Independent) -> Score {
    let (likelihood, share) = likelihood_ratio(base, fit, Role::Train, independent);
    let per_parameter = 0.5 * independent.total().max(2.0).ln();
    let price = added_parameters(fit) as f64 * per_parameter + fit.effects.len() as f64 * EFFECT_PRICE;
    Score { likelihood, penalised: likelihood - price, share }
}

#[cfg(test)]
mod tests {
    use super::super::noise::tests::white;
    use super::super::pooled::tests::fit_of;
    use super::*;

    #[test]
    fn halving_white_residuals_is_worth_half_of_n_times_the_log_of_four() {
        let noise = white(4000, 7);
        let base = fit_of(noise.clone());
        let fit = fit_of(noise.iter().map(|x| 0.5 * x).collect());
        let independent = Independent::of(&base, Role::Train);
        let score = score(&base, &fit, &independent);
        let expected = 0.5 * independent.total() * 4f64.ln();
        // The loss is the square only nearly.
        assert!((score.likelihood - expected).abs() < 0.06 * expected);
        assert!((score.share - 0.75).abs() < 0.03);
    }

    #[test]
    fn a_witness_within_noise_has_no_vote_and_one_far_above_has() {
        let with_witness = |level: f64| {
            let mut fit = fit_of(white(4000, 7));
            let mut witness = fit.logs[0].channels[0].clone();
            witness.name = "witness";
            witness.residual.iter_mut().for_each(|r| *r *= level);
            fit.logs[0].channels.push(witness);
            fit
        };
        let gain = |from: f64, to: f64| {
            let (base, fit) = (with_witness(from), with_witness(to));
            likelihood_ratio(&base, &fit, Role::Train, &Independent::of(&fit, Role::Train)).0
        };
        assert_eq!(gain(1.3, 0.5), 0.0);
        assert!(gain(5.0, 1.0) > 1000.0);
    }

    #[test]
    fn a_correlated_rest_is_worth_less_than_a_white_one() {
        let noise = white(4000, 8);
        let slow: Vec<f64> = (0..4000).map(|i| (0.02 * i as f64).sin()).collect();
        let (white, slow) = (fit_of(noise), fit_of(slow));
        let count = |fit| Independent::of(fit, Role::Train).total();
        assert!(count(&slow) < 0.1 * count(&white), "{} {}", count(&slow), count(&white));
    }
}
