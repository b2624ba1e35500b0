//! Is a residual only noise? And if not, where does it live?
//!
//! Two kinds of tests, both free of a model of the noise's size. **Lags**: white noise has no
//! correlation beyond its own bandwidth; the mean correlation over the lags just beyond it is the
//! structured part of the variance. **Views**: the residual sorted into bins of time, speed, load, angle and the other quantities of
//! [`super::coordinates`]; in each bin its mean, and its part along the direction of friction (times load) are taken off.
//! What that explains beyond what chance would, with so many bins and values so little independent, is the view's share.
//!
//! A test is significant beyond `LEVEL` standard deviations: there are some tens of tests for each log, and a false alarm is
//! worse than a miss. No real model is perfect; what is significant and yet below `TOLERATED_VARIANCE` of the noise's variance, or
//! below `TOLERATED_NRMSE` of the signal, counts as noise.

use super::analysis::{Fit, Role};
use super::coordinates::{Coordinates, quantile};
use super::pooled::{Pooled, channels};

/// Bins of a view.
const BINS: usize = 20;
/// Standard deviations.
const LEVEL: f64 = 5.0;
/// Structured variance that is tolerated, in units of the noise's variance.
pub const TOLERATED_VARIANCE: f64 = 0.8;
/// Mean square that a noise level estimated too low may give.
pub const TOLERATED_LEVEL: f64 = 2.0;
/// Structured error that is tolerated, relative to the signal's RMS.
pub const TOLERATED_NRMSE: f64 = 2e-3;

/// How a channel's residual looks over one quantity.
#[derive(Debug, Clone, PartialEq)]
pub struct View {
    /// Quantity.
    pub name: &'static str,
    /// Its unit.
    pub unit: &'static str,
    /// Share of the residual's variance that it explains beyond chance.
    pub share: f64,
    /// Standard deviations beyond chance.
    pub deviations: f64,
    /// Centre of each bin.
    pub at: Vec<f64>,
    /// Mean residual in each bin, over the noise's standard deviation.
    pub mean: Vec<f64>,
}

/// What is structured in a channel's residual.
#[derive(Debug, Clone, PartialEq)]
pub struct Structure {
    /// The channel.
    pub channel: &'static str,
    /// Mean square: 1 is noise.
    pub mean_square: f64,
    /// Structured part of it.
    pub structured: f64,
    /// Relative to the signal: RMS of the structured part over RMS of the signal.
    pub nrmse: f64,
    /// Standard deviations of the lag test beyond chance.
    pub deviations: f64,
    /// Views, the most telling first.
    pub views: Vec<View>,
}

impl Structure {
    /// Whether it is more than noise and imperfection.
    pub fn is_material(&self) -> bool {
        let significant = self.mean_square > 2.0 * TOLERATED_LEVEL
            || self.deviations > LEVEL
            || self.views.iter().any(|view| view.deviations > LEVEL && view.share > 0.02);
        significant && self.structured > TOLERATED_VARIANCE && self.nrmse > TOLERATED_NRMSE
    }
}

/// Tests all channels of a fit on the logs of a role.
pub fn structures(fit: &Fit, role: Role, coordinates: &[Coordinates]) -> Vec<Structure> {
    channels(fit, role).iter().map(|channel| structure(fit, channel, coordinates)).collect()
}

fn structure(fit: &Fit, channel: &Pooled<'_>, coordinates: &[Coordinates]) -> Structure {
    let mean_square = channel.mean_square();
    let (lagged, deviations) = beyond_noise(channel);
    let tau = channel.correlation_length();
    let mut views: Vec<View> = coordinates.first().map_or(Vec::new(), |first| {
        (0..first.list.len()).filter_map(|which| view(channel, coordinates, which, tau)).collect()
    });
    views.sort_by(|a, b| b.share.total_cmp(&a.share));
    let seen =
        views.iter().filter(|v| v.deviations > LEVEL).map(|v| v.share * mean_square).fold(0.0, f64::max);
    // A residual that swings from sample to sample has no mean correlation; its size gives it away.
    let structured = lagged.max(seen).max(mean_square - TOLERATED_LEVEL);
    Structure {
        channel: channel.name,
        mean_square,
        structured,
        nrmse: structured.sqrt() * noise_to_signal(fit, channel),
        deviations,
        views,
    }
}

/// Mean correlation over the lags just beyond the noise's bandwidth, and its significance.
fn beyond_noise(channel: &Pooled<'_>) -> (f64, f64) {
    let unit = channel.samples_per_noise().ceil() as usize;
    let lags: Vec<usize> = (2 * unit + 1..=4 * unit + 2).collect();
    let (mut sum, mut least) = (0.0, usize::MAX);
    for lag in &lags {
        let (covariance, pairs) = channel.autocovariance(*lag);
        sum += covariance;
        least = least.min(pairs);
    }
    let mean = sum / lags.len() as f64;
    let independent = least as f64 / channel.samples_per_noise();
    let variance = channel.mean_square();
    if independent < 10.0 || variance <= 0.0 {
        (0.0, 0.0)
    } else {
        (mean.max(0.0), mean / variance * independent.sqrt())
    }
}

/// Noise of the channel over the signal of its logs, both RMS.
fn noise_to_signal(fit: &Fit, channel: &Pooled<'_>) -> f64 {
    let (mut noise, mut signal) = (0.0, 0.0);
    for (index, _) in &channel.pieces {
        let log = &fit.logs[*index];
        for i in (0..log.measured.len()).filter(|i| log.used[*i]) {
            noise += log.noise_std[i].powi(2);
            signal += log.measured[i].powi(2);
        }
    }
    if signal > 0.0 { (noise / signal).sqrt() } else { 0.0 }
}

struct Sample {
    at: f64,
    residual: f64,
    along: f64,
}

fn view(channel: &Pooled<'_>, coordinates: &[Coordinates], which: usize, tau: f64) -> Option<View> {
    let mut logs: Vec<Vec<Sample>> = Vec::new();
    let (mut name, mut unit, mut own_origin) = ("", "", false);
    for (index, piece) in &channel.pieces {
        let known = coordinates.get(*index)?;
        let coordinate = known.list.get(which)?;
        (name, unit, own_origin) = (coordinate.name, coordinate.unit, coordinate.own_origin);
        let at = known.at(&piece.time_s);
        let samples = piece.residual.iter().zip(at).filter_map(|(residual, i)| {
            let value = *coordinate.values.get(i)?;
            let along = known.direction[i] * known.load[i];
            (residual.is_finite() && value.is_finite()).then_some(Sample {
                at: value,
                residual: *residual,
                along,
            })
        });
        logs.push(samples.collect());
    }
    let total = channel.values().map(|r| r * r).sum::<f64>();
    let count = channel.count();
    if total <= 0.0 || count < 10 * BINS {
        return None;
    }
    if !own_origin {
        logs = vec![logs.into_iter().flatten().collect()];
    }
    let (mut explained, mut freedom) = (0.0, 0.0);
    let (mut at, mut mean) = (Vec::new(), Vec::new());
    for samples in &mut logs {
        for bin in bins(samples) {
            let (own, degrees) = explained_by(bin);
            explained += own;
            freedom += degrees;
            if bin.len() > 2 {
                at.push(bin.iter().map(|s| s.at).sum::<f64>() / bin.len() as f64);
                mean.push(bin.iter().map(|s| s.residual).sum::<f64>() / bin.len() as f64);
            }
        }
        at.push(f64::NAN);
        mean.push(f64::NAN);
    }
    // By chance each degree of freedom explains τ values' variance; what is explained adds to it, so τ is that of
    // the residual itself: the careful side.
    let variance = total / count as f64;
    let chance = freedom * tau * variance;
    let spread = (2.0 * freedom).sqrt() * tau * variance;
    let share = ((explained - chance) / total).clamp(0.0, 1.0);
    Some(View { name, unit, share, deviations: (explained - chance) / spread, at, mean })
}

/// Bins of about equal numbers; equal values stay together.
fn bins(samples: &mut [Sample]) -> Vec<&[Sample]> {
    samples.sort_by(|a, b| a.at.total_cmp(&b.at));
    let values: Vec<f64> = samples.iter().map(|s| s.at).collect();
    let mut edges: Vec<f64> = (1..BINS).map(|i| quantile(&values, i as f64 / BINS as f64)).collect();
    edges.dedup();
    let mut cuts: Vec<usize> = vec![0];
    for edge in edges {
        let cut = samples.partition_point(|s| s.at < edge);
        let after = samples.partition_point(|s| s.at <= edge);
        // A value that many samples share is a bin of its own.
        cuts.push(cut);
        if after - cut > samples.len() / BINS {
            cuts.push(after);
        }
    }
    cuts.push(samples.len());
    cuts.sort_unstable();
    cuts.dedup();
    cuts.windows(2).map(|w| &samples[w[0]..w[1]]).collect()
}

/// Sum of squares that a mean and a part along the direction explain in a bin, and the degrees of freedom.
fn explained_by(bin: &[Sample]) -> (f64, f64) {
    if bin.len() < 3 {
        return (0.0, 0.0);
    }
    let count = bin.len() as f64;
    let mean = bin.iter().map(|s| s.residual).sum::<f64>() / count;
    let along = bin.iter().map(|s| s.along).sum::<f64>() / count;
    let (mut product, mut norm) = (0.0, 0.0);
    for sample in bin {
        product += (sample.along - along) * (sample.residual - mean);
        norm += (sample.along - along).powi(2);
    }
    let own = count * mean * mean;
    let size = bin.iter().map(|s| s.along * s.along).sum::<f64>();
    if norm > 1e-6 * size { (own + product * product / norm, 2.0) } else { (own, 1.0) }
}

#[cfg(test)]
mod tests {
    use super::super::noise::tests::white;
    use super::super::pooled::tests::fit_of;
    use super::*;
    use crate::files::log::Log;
    use crate::files::signal::Signal;

    /// A stage that swings for 60 s.
    fn swinging() -> Coordinates {
        let time: Vec<f64> = (0..6000).map(|i| f64::from(i) * 0.01).collect();
        let mut log = Log::default();
        log.set_signal(
            Signal::Position,
            time.iter().map(|t| (1.3 * t).sin() + 0.3 * (3.1 * t).sin()).collect(),
        );
        log.set_signal(Signal::Force, time.iter().map(|t| (1.3 * t).cos()).collect());
        log.set_signal(Signal::Time, time);
        Coordinates::new(&log)
    }

    fn structure_of(residual: Vec<f64>) -> Structure {
        structures(&fit_of(residual), Role::Train, &[swinging()]).remove(0)
    }

    #[test]
    fn white_noise_is_noise() {
        for seed in 1..20 {
            let found = structure_of(white(6000, seed));
            assert!(!found.is_material(), "{seed} {found:?}");
        }
    }

    #[test]
    fn a_residual_that_follows_position_is_seen_over_position() {
        let coordinates = swinging();
        let position = &coordinates.list.iter().find(|c| c.name == "position").unwrap().values;
        let residual = white(6000, 4).iter().zip(position).map(|(e, q)| e + 2.0 * (9.0 * q).sin()).collect();
        let found = structure_of(residual);
        assert!(found.is_material());
        assert_eq!(found.views[0].name, "position");
        // Two of noise and signal's three, less what 20 bins blur.
        assert!((0.4..0.75).contains(&found.views[0].share), "{}", found.views[0].share);
    }

    #[test]
    fn a_residual_with_the_sign_of_motion_is_seen_over_direction() {
        let coordinates = swinging();
        let residual = white(6000, 5).iter().zip(&coordinates.direction).map(|(e, d)| e + 1.2 * d).collect();
        let found = structure_of(residual);
        let view = found.views.iter().find(|v| v.name == "direction").unwrap();
        assert!(found.is_material() && view.share > 0.15, "{view:?}");
    }
}
