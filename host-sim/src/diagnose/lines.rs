//! Lines in the spectrum of a channel that stand at one frequency all the time: hum, a supply's ripple, a fan.
//!
//! What the rig does itself changes with its motion and load. A frequency at which a channel has power in every stretch of every log is none
//! of its effects. The spectrum of stretches of `STRETCH_S` (Hann window, straight line taken off) is compared
//! with that of its neighbours: the lower quartile over all stretches must stand out by `FACTOR`.
//! Lines that the motion has too are a controller that hunts, and those at a known mode are its ringing.
//! Left out: lines below `LOWEST_HZ`, where motion has power all the time, and those that come and go.

use std::f64::consts::TAU;

use super::analysis::Role;
use super::coordinates::quantile;
use super::verdict::Judged;
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

/// What tells the motion, the first that is there.
const MOTION: [Signal; 3] = [Signal::M2Speed, Signal::M2Angle, Signal::Position];
/// A mode's neighbourhood, relative.
const NEAR: f64 = 0.1;

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

/// The strongest line of each channel in the training logs, where there is one. `modes_hz` are resonances that
/// are known: what rings there is no line.
pub fn find(logs: &[(Log, Role)], modes_hz: &[f64]) -> Vec<SpectralLine> {
    // What the motion shares is the rig's own swinging, a controller that hunts.
    let motion = MOTION.iter().find_map(|signal| standing_out(logs, *signal));
    CHANNELS.iter().filter_map(|channel| line_of(logs, *channel, modes_hz, motion.as_deref())).collect()
}

/// Resonances that are among the causes named.
pub fn modes_hz(judged: &[Judged]) -> Vec<f64> {
    let of_part = |part: &Judged| -> Vec<f64> {
        let Some(fit) = part.result() else { return Vec::new() };
        let modes = [("ring_resonance", "mode_hz"), ("shaft_torsion", "natural_frequency_hz")];
        let values = modes.into_iter().filter_map(|(id, name)| fit.get(Some(id), name));
        values.map(|mode| mode.value).collect()
    };
    judged.iter().flat_map(of_part).collect()
}

fn line_of(
    logs: &[(Log, Role)],
    channel: Signal,
    modes_hz: &[f64],
    motion: Option<&[(f64, f64)]>,
) -> Option<SpectralLine> {
    let own = |k: usize| {
        let near = |f: f64| (k as f64 / STRETCH_S - f).abs() < NEAR * f;
        let moves = motion.is_some_and(|motion| {
            motion[k.saturating_sub(1)..(k + 2).min(motion.len())].iter().any(|(over, _)| *over > FACTOR)
        });
        moves || modes_hz.iter().any(|f| near(*f))
    };
    let spectrum = standing_out(logs, channel)?;
    let lines = spectrum.iter().enumerate().filter(|(k, (over, _))| *over > FACTOR && !own(*k));
    let (k, (_, amplitude)) = lines.max_by(|a, b| a.1.0.total_cmp(&b.1.0))?;
    Some(SpectralLine {
        channel: channel.column(),
        frequency_hz: k as f64 / STRETCH_S,
        amplitude: *amplitude,
    })
}

/// At each whole number of periods in a stretch: by how much the power there stands out, and its amplitude.
fn standing_out(logs: &[(Log, Role)], channel: Signal) -> Option<Vec<(f64, f64)>> {
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
    let looked_at = (LOWEST_HZ * STRETCH_S) as usize..bins.saturating_sub(NEIGHBOURS + 2);
    let of = |k: usize| {
        if !looked_at.contains(&k) {
            return (0.0, 0.0);
        }
        let around: Vec<f64> = (3..3 + NEIGHBOURS)
            .flat_map(|far| [k.checked_sub(far), Some(k + far)])
            .flatten()
            .filter_map(|i| low.get(i).copied())
            .collect();
        (low[k] / quantile(&around, 0.75).max(f64::MIN_POSITIVE), low[k].sqrt())
    };
    Some((0..bins).map(of).collect())
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
        let lines = find(&log(0.03), &[]);
        assert_eq!(lines.len(), 1);
        assert_eq!(lines[0].frequency_hz, 50.0);
        // Noise of 0.02 adds 0.001 to an amplitude over 1000 samples; reversals raise it in some stretches.
        assert!((lines[0].amplitude - 0.03).abs() < 0.006, "{:?}", lines[0]);
    }

    #[test]
    fn a_known_mode_and_what_the_motion_shares_are_no_line() {
        assert!(find(&log(0.03), &[51.0]).is_empty());
        let mut hunting = log(0.03);
        let swing = hunting[0].0.time_s().iter().map(|t| (TAU * 50.0 * t).sin()).collect();
        hunting[0].0.set_signal(Signal::M2Speed, swing);
        assert!(find(&hunting, &[]).is_empty());
    }

    #[test]
    fn reversals_and_noise_are_no_line() {
        assert!(find(&log(0.0), &[]).is_empty());
    }
}
