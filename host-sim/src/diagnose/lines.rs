//! Lines in the spectrum of a channel that stand at one frequency all the time: hum, a supply's ripple, a fan.
//!
//! What the rig does itself changes with its motion and load. A frequency at which a channel has power in every stretch of every log is none
//! of its effects. The spectrum of stretches of `STRETCH_S` (Hann window, straight line taken off) is compared
//! with that of its neighbours: the lower quartile over all stretches must stand out by `FACTOR`.
//! Left out: lines below `LOWEST_HZ`, where motion has power all the time, and those that come and go.

use std::f64::consts::TAU;

use super::analysis::Role;
use super::coordinates::quantile;
use crate::files::log::Log;
use crate::files::signal::Signal;

/// Length of a stretch, s.
const STRETCH_S: f64 = 1.0;
/// Lowest and highest frequency looked at.
const LOWEST_HZ: f64 = 15.0;
const HIGHEST_HZ: f64 = 500.0;
/// Neighbours on each side that give the level, beyond the line's own width of two.
const NEIGHBOURS: usize = 10;
/// Power over that of the neighbours. For noise the lower quartile over n stretches stays below its median; 8 is far out.
const FACTOR: f64 = 8.0;
/// Fewest stretches.
const FEWEST: usize = 8;
/// Channels that are looked at.
const CHANNELS: [Signal; 5] =
    [Signal::FrictionTorque, Signal::NormalForce, Signal::M2Torque, Signal::Force, Signal::M1Torque];

/// A line.
#[derive(Debug, Clone, PartialEq)]
pub struct SpectralLine {
    /// Column.
    pub channel: &'static str,
    /// Frequency, Hz.
    pub frequency_hz: f64,
    /// Amplitude in the channel's unit.
    pub amplitude: f64,
}

impl SpectralLine {
    /// In words.
    pub fn sentence(&self) -> String {
        format!(
            "{} has a line at {:.0} Hz with an amplitude of {:.3}, whatever the rig does",
            self.channel, self.frequency_hz, self.amplitude
        )
    }
}

/// The strongest line of each channel in the training logs, where there is one.
pub fn find(logs: &[(Log, Role)]) -> Vec<SpectralLine> {
    CHANNELS.iter().filter_map(|channel| line_of(logs, *channel)).collect()
}

fn line_of(logs: &[(Log, Role)], channel: Signal) -> Option<SpectralLine> {
    let mut powers: Vec<Vec<f64>> = Vec::new();
    for (log, _) in logs.iter().filter(|(_, role)| *role == Role::Train) {
        let (values, time) = (log.signal(channel)?, log.time_s());
        let span_s = time.last()? - time.first()?;
        let rate_hz = (time.len() - 1) as f64 / span_s;
        let length = (STRETCH_S * rate_hz).round() as usize;
        if length < 64 {
            return None;
        }
        let bins = ((HIGHEST_HZ.min(0.45 * rate_hz)) * STRETCH_S) as usize;
        powers.extend(values.chunks_exact(length).map(|stretch| spectrum(stretch, bins)));
    }
    let bins = powers.iter().map(Vec::len).min()?;
    if powers.len() < FEWEST {
        return None;
    }
    let low: Vec<f64> =
        (0..bins).map(|k| quantile(&powers.iter().map(|p| p[k]).collect::<Vec<_>>(), 0.25)).collect();
    let first = (LOWEST_HZ * STRETCH_S) as usize;
    let mut best: Option<(f64, usize)> = None;
    for k in first..bins.saturating_sub(NEIGHBOURS + 2) {
        let around: Vec<f64> = (3..3 + NEIGHBOURS)
            .flat_map(|far| [k.checked_sub(far), Some(k + far)])
            .flatten()
            .filter_map(|i| low.get(i).copied())
            .collect();
        let over = low[k] / quantile(&around, 0.75).max(f64::MIN_POSITIVE);
        if over > FACTOR && best.is_none_or(|(known, _)| over > known) {
            best = Some((over, k));
        }
    }
    let (_, k) = best?;
    Some(SpectralLine {
        channel: channel.column(),
        frequency_hz: k as f64 / STRETCH_S,
        amplitude: low[k].sqrt(),
    })
}

/// Squared amplitude of a sine at each whole number of periods in a stretch.
fn spectrum(stretch: &[f64], bins: usize) -> Vec<f64> {
    let count = stretch.len();
    let centre = 0.5 * (count - 1) as f64;
    let mean = stretch.iter().sum::<f64>() / count as f64;
    let (mut product, mut norm) = (0.0, 0.0);
    for (i, x) in stretch.iter().enumerate() {
        product += (i as f64 - centre) * (x - mean);
        norm += (i as f64 - centre).powi(2);
    }
    let slope = product / norm;
    let windowed: Vec<f64> = stretch
        .iter()
        .enumerate()
        .map(|(i, x)| {
            let window = 1.0 - (TAU * (i as f64 + 0.5) / count as f64).cos();
            window * (x - mean - slope * (i as f64 - centre))
        })
        .collect();
    let turns: Vec<(f64, f64)> = (0..count).map(|i| (TAU * i as f64 / count as f64).sin_cos()).collect();
    (0..bins)
        .map(|k| {
            let (mut re, mut im, mut at) = (0.0, 0.0, 0);
            for x in &windowed {
                let (sin, cos) = turns[at];
                re += x * cos;
                im += x * sin;
                at += k;
                if at >= count {
                    at -= count;
                }
            }
            (re * re + im * im) * (2.0 / count as f64).powi(2)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::super::noise::tests::white;
    use super::*;

    fn log(hum: f64) -> Vec<(Log, Role)> {
        let mut log = Log::default();
        let time: Vec<f64> = (0..20_000).map(|i| f64::from(i) * 1e-3).collect();
        let noise = white(20_000, 11);
        let torque = time
            .iter()
            .zip(&noise)
            .map(|(t, e)| 3.0 * (2.0 * t).sin().signum() + 0.02 * e + hum * (TAU * 50.0 * t).sin());
        log.set_signal(Signal::FrictionTorque, torque.collect());
        log.set_signal(Signal::Time, time);
        vec![(log, Role::Train)]
    }

    #[test]
    fn hum_is_found_with_its_frequency_and_size_among_reversals_and_noise() {
        let lines = find(&log(0.03));
        assert_eq!(lines.len(), 1);
        assert_eq!(lines[0].frequency_hz, 50.0);
        // Noise of 0.02 adds 0.001 to an amplitude over 1000 samples; reversals raise it in some stretches.
        assert!((lines[0].amplitude - 0.03).abs() < 0.006, "{:?}", lines[0]);
    }

    #[test]
    fn reversals_and_noise_are_no_line() {
        assert!(find(&log(0.0)).is_empty());
    }
}
