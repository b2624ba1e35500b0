//! The residuals of one channel over several logs, and how much independent information they hold.
//!
//! If the model is true, a channel's residuals are noise of variance one in which `samples_per_noise`
//! neighbours share one value. If it is not, what is left is correlated over longer times, and the number
//! of independent values is smaller: count / τ with τ = 1 + 2 Σ ρ_k, summed until the correlation is
//! lost in noise (initial positive sequence; Geyer 1992). All tests and scores count with that number, so that a
//! structured rest makes them careful instead of sure.

use super::analysis::{Channel, Fit, Role};

/// Longest lag of the autocorrelation, s.
const LONGEST_LAG_S: f64 = 2.0;
/// Degrees of freedom of the loss: Gaussian up to about three standard deviations.
const FREEDOM: f64 = 20.0;

/// A channel over all logs of a role.
#[derive(Debug, Clone)]
pub struct Pooled<'a> {
    /// Name of the channel.
    pub name: &'static str,
    /// Index of the log in the fit, and the channel there.
    pub pieces: Vec<(usize, &'a Channel)>,
}

/// All channels of a fit over the logs of a role.
pub fn channels(fit: &Fit, role: Role) -> Vec<Pooled<'_>> {
    let mut pooled: Vec<Pooled<'_>> = Vec::new();
    for (index, log) in fit.logs.iter().enumerate().filter(|(_, log)| log.role == role) {
        for channel in &log.channels {
            match pooled.iter_mut().find(|p| p.name == channel.name) {
                Some(known) => known.pieces.push((index, channel)),
                None => pooled.push(Pooled { name: channel.name, pieces: vec![(index, channel)] }),
            }
        }
    }
    pooled
}

impl Pooled<'_> {
    /// Residuals that count.
    pub fn values(&self) -> impl Iterator<Item = f64> + '_ {
        self.pieces.iter().flat_map(|(_, c)| c.residual.iter().copied()).filter(|r| r.is_finite())
    }

    /// Number of residuals that count.
    pub fn count(&self) -> usize {
        self.values().count()
    }

    /// Mean square of the residuals; 1 is noise.
    pub fn mean_square(&self) -> f64 {
        let count = self.count();
        if count == 0 { 0.0 } else { self.values().map(|r| r * r).sum::<f64>() / count as f64 }
    }

    /// Neighbours that share one noise value.
    pub fn samples_per_noise(&self) -> f64 {
        self.pieces.iter().map(|(_, c)| c.samples_per_noise).fold(1.0, f64::max)
    }

    /// Mean product of residuals `lag` samples apart, and the number of pairs.
    pub fn autocovariance(&self, lag: usize) -> (f64, usize) {
        let (mut sum, mut pairs) = (0.0, 0);
        for (_, channel) in &self.pieces {
            let residual = &channel.residual;
            for (a, b) in residual.iter().zip(residual.iter().skip(lag)) {
                let product = a * b;
                if product.is_finite() {
                    sum += product;
                    pairs += 1;
                }
            }
        }
        if pairs == 0 { (0.0, 0) } else { (sum / pairs as f64, pairs) }
    }

    /// Samples that share one independent value, from the residuals themselves: τ.
    pub fn correlation_length(&self) -> f64 {
        let (variance, _) = self.autocovariance(0);
        if variance <= 0.0 {
            return self.samples_per_noise();
        }
        let step_s = self.step_s();
        let longest = if step_s > 0.0 { (LONGEST_LAG_S / step_s) as usize } else { 0 };
        let mut tau = 1.0;
        let mut lag = 1;
        // Lags are walked through in growing steps: a correlation that lasts is smooth.
        while lag <= longest {
            let stride = 1 + lag / 16;
            let (covariance, pairs) = self.autocovariance(lag);
            let rho = covariance / variance;
            if pairs == 0 || rho < 2.0 / (pairs as f64).sqrt() {
                break;
            }
            tau += 2.0 * rho * stride as f64;
            lag += stride;
        }
        tau.max(self.samples_per_noise())
    }

    /// Time between residuals, s.
    pub fn step_s(&self) -> f64 {
        self.pieces
            .iter()
            .find_map(|(_, c)| {
                let (first, last) = (c.time_s.first()?, c.time_s.last()?);
                (c.time_s.len() > 1).then(|| (last - first) / (c.time_s.len() - 1) as f64)
            })
            .unwrap_or(0.0)
    }
}

/// Mean losses of a channel in two fits, over the samples that count in both, and their number.
///
/// The loss is Student's with `FREEDOM` degrees of freedom, in units of the lower of the two levels (not below noise):
/// nearly the square, but a few outliers, a breakaway a moment too late, do not decide.
pub fn common_losses(a: &Pooled<'_>, b: &Pooled<'_>) -> (f64, f64, usize) {
    let pairs = || {
        let pieces = a.pieces.iter().zip(&b.pieces);
        let pairs = pieces.flat_map(|((_, a), (_, b))| a.residual.iter().zip(&b.residual));
        pairs.filter(|(x, y)| x.is_finite() && y.is_finite())
    };
    let (sum_a, sum_b, count) =
        pairs().fold((0.0, 0.0, 0usize), |(a, b, n), (x, y)| (a + x * x, b + y * y, n + 1));
    if count == 0 {
        return (0.0, 0.0, 0);
    }
    let unit = (sum_a.min(sum_b) / count as f64).max(1.0);
    let loss = |r: f64| unit * FREEDOM * (r * r / unit / FREEDOM).ln_1p();
    let (loss_a, loss_b) = pairs().fold((0.0, 0.0), |(a, b), (x, y)| (a + loss(*x), b + loss(*y)));
    (loss_a / count as f64, loss_b / count as f64, count)
}

#[cfg(test)]
pub(super) mod tests {
    use super::super::analysis::LogFit;
    use super::super::noise::tests::white;
    use super::*;

    /// A fit with one training log of one channel.
    pub(in super::super) fn fit_of(residual: Vec<f64>) -> Fit {
        let time_s: Vec<f64> = (0..residual.len()).map(|i| i as f64 * 0.01).collect();
        let count = residual.len();
        let channel = Channel {
            name: "force",
            time_s: time_s.clone(),
            residual: residual.clone(),
            sensitivity: vec![],
            samples_per_noise: 1.0,
        };
        let log = LogFit {
            role: Role::Train,
            time_s,
            measured: residual,
            predicted: vec![0.0; count],
            noise_std: vec![1.0; count],
            used: vec![true; count],
            channels: vec![channel],
        };
        Fit { effects: vec![], parameters: vec![], logs: vec![log] }
    }

    #[test]
    fn white_noise_has_one_sample_a_value_and_a_moving_mean_of_five_has_five() {
        let noise = white(20_000, 3);
        let fit = fit_of(noise.clone());
        assert!(channels(&fit, Role::Train)[0].correlation_length() < 1.1);
        let mean: Vec<f64> = noise.windows(5).map(|w| w.iter().sum()).collect();
        let fit = fit_of(mean);
        let tau = channels(&fit, Role::Train)[0].correlation_length();
        // A triangle of correlation: 1 + 2·(0.8 + 0.6 + 0.4 + 0.2) = 5.
        assert!((tau - 5.0).abs() < 0.4, "{tau}");
    }

    #[test]
    fn masked_samples_count_in_neither_fit() {
        let (a, b) = (fit_of(vec![1.0, f64::NAN, 3.0]), fit_of(vec![2.0, 5.0, f64::NAN]));
        let (a, b) = (channels(&a, Role::Train), channels(&b, Role::Train));
        let (one, two, count) = common_losses(&a[0], &b[0]);
        // 20 ln(1 + 1/20) and 20 ln(1 + 4/20).
        assert!((one - 0.976).abs() < 1e-3 && (two - 3.646).abs() < 1e-3 && count == 1, "{one} {two}");
    }
}
