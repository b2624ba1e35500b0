//! What a channel picks up from the mains: a line at 50 or 60 Hz that no motion makes. It is taken off before anything else is
//! looked at; but a range ends for the channel as it was logged.

use std::f64::consts::TAU;

use rustfft::num_complex::Complex;

/// Frequencies of the grids there are, Hz.
const GRIDS_HZ: [f64; 2] = [50.0, 60.0];
/// It is looked for so many places of the spectrum on either side: a Hann window's line is as wide, and a grid within 20 mHz.
const WIDE: i32 = 2;
/// The level beside it is taken over so many places on either side.
const BESIDE: i32 = 20;
/// For so long a line keeps its phase, s: that of a grid whose frequency wanders by 20 mHz, one deviation.
const PHASE_KEPT_S: f64 = 8.0;
/// A line has so many times the power beside it: noise has it once in three million places.
const OVER_NOISE: f64 = 15.0;

/// An even channel without what it picks up from the mains.
pub(super) fn without(channel: &[f64], step_s: f64) -> Vec<f64> {
    line_hz(channel, step_s).map_or_else(|| channel.to_vec(), |hz| without_line(channel, step_s, hz))
}

/// Frequency of the stronger line of the two grids in an even series; `None` where neither stands out.
fn line_hz(values: &[f64], step_s: f64) -> Option<f64> {
    let of_grid = |hz: f64| (hz * step_s < 0.5).then(|| near(values, step_s, hz)).flatten();
    let lines = GRIDS_HZ.into_iter().filter_map(of_grid);
    lines.max_by(|a, b| a.1.total_cmp(&b.1)).map(|(hz, _)| hz)
}

/// Frequency and power of the line near a grid's frequency, behind a Hann window.
fn near(values: &[f64], step_s: f64, grid_hz: f64) -> Option<(f64, f64)> {
    let length_s = values.len() as f64 * step_s;
    let sums: Vec<Complex<f64>> = (-BESIDE - 1..=BESIDE + 1)
        .map(|place| turned_sum(values, TAU * step_s * (grid_hz + f64::from(place) / length_s)))
        .collect();
    // 1 − cos takes half of either neighbour off; its own sum is that of the places.
    let behind_window = |x: &[Complex<f64>]| (x[1] - 0.5 * (x[0] + x[2])).norm_sqr();
    let power: Vec<f64> = sums.windows(3).map(behind_window).collect();
    let near = |at: &usize| at.abs_diff(BESIDE as usize) <= WIDE as usize;
    let strongest = (0..power.len()).filter(near).max_by(|a, b| power[*a].total_cmp(&power[*b]))?;
    let mut beside: Vec<f64> = (0..power.len()).filter(|at| !near(at)).map(|at| power[at]).collect();
    let middle = beside.len() / 2;
    // Of noise's powers the median is ln 2 of the mean.
    let level = *beside.select_nth_unstable_by(middle, f64::total_cmp).1 / std::f64::consts::LN_2;
    if power[strongest] <= OVER_NOISE * level {
        return None;
    }
    // A line δ places beyond the stronger of two has amplitudes there that are as 2 − δ to 1 + δ.
    let (before, after) = (power[strongest - 1], power[strongest + 1]);
    let ratio = (before.max(after) / power[strongest]).sqrt();
    let off = (2.0 * ratio - 1.0).max(0.0) / (ratio + 1.0) * if after > before { 1.0 } else { -1.0 };
    let place = strongest as f64 - f64::from(BESIDE) + off;
    Some((grid_hz + place / length_s, power[strongest]))
}

/// Sum of a series that is turned back by so many radians a sample.
fn turned_sum(values: &[f64], turn: f64) -> Complex<f64> {
    let step = Complex::from_polar(1.0, -turn);
    let turned = values.iter().scan(Complex::ONE, |turned, x| {
        let now = *turned;
        *turned *= step;
        Some(now * x)
    });
    turned.sum()
}

/// An even channel less what swings at a frequency. Amplitude and phase are those behind Hann windows that overlap by half, and
/// between their middles go over into each other as the windows do.
fn without_line(channel: &[f64], step_s: f64, hz: f64) -> Vec<f64> {
    let windows = (channel.len() as f64 * step_s / PHASE_KEPT_S).round().max(1.0) as usize;
    let apart = channel.len() as f64 / (windows + 1) as f64;
    let hann = |off: f64| 0.5 + 0.5 * (0.5 * TAU * off.min(1.0)).cos();
    let turned = |i: usize| Complex::from_polar(1.0, TAU * hz * step_s * i as f64);
    let amplitude = |at: usize| {
        let begin = (at as f64 * apart) as usize;
        let end = ((at + 2) as f64 * apart).ceil() as usize;
        let weight = |i: usize| hann((i as f64 / apart - (at + 1) as f64).abs());
        let own = begin..end.min(channel.len());
        2.0 / apart * own.map(|i| weight(i) * channel[i] * turned(i).conj()).sum::<Complex<f64>>()
    };
    let amplitudes: Vec<Complex<f64>> = (0..windows).map(amplitude).collect();
    let swing = |i: usize| {
        // Before the first middle, and beyond the last one, it is as it is there.
        let place = (i as f64 / apart - 1.0).clamp(0.0, (windows - 1) as f64);
        let (at, share) = (place as usize, hann(place.fract()));
        let next = amplitudes.get(at + 1).unwrap_or(&amplitudes[at]);
        ((amplitudes[at] * share + next * (1.0 - share)) * turned(i)).re
    };
    channel.iter().enumerate().map(|(i, x)| x - swing(i)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::identify::filters::rms;
    use crate::identify::noise::tests::white;

    const COUNT: usize = 20_000;
    const STEP_S: f64 = 1e-3;

    /// Steps of a torque with noise.
    fn steps() -> Vec<f64> {
        let of = |(i, e): (usize, f64)| {
            let steps = if ((STEP_S * i as f64 / 1.7) as usize).is_multiple_of(2) { 2.0 } else { -1.5 };
            steps + 0.02 * e
        };
        white(COUNT, 5).into_iter().enumerate().map(of).collect()
    }

    /// What is left of a swing of this phase, in turns, beside the steps, over the swing.
    fn left(amplitude: f64, turns: impl Fn(f64) -> f64) -> f64 {
        let hum: Vec<f64> =
            (0..COUNT).map(|i| amplitude * (TAU * turns(STEP_S * i as f64) + 0.4).sin()).collect();
        let steps = steps();
        let channel: Vec<f64> = steps.iter().zip(&hum).map(|(x, hum)| x + hum).collect();
        let off: Vec<f64> =
            without(&channel, STEP_S).iter().zip(&steps).map(|(x, true_)| x - true_).collect();
        rms(&off) / rms(&hum)
    }

    #[test]
    fn a_line_is_taken_off_beside_noise_and_steps_and_nothing_where_there_is_none() {
        for hz in [50.0, 60.03, 49.95] {
            let left = left(0.03, |t| hz * t);
            assert!(left < 0.06, "{hz}: {left}");
        }
        assert_eq!(without(&steps(), STEP_S), steps());
    }

    #[test]
    fn a_grid_that_wanders_is_followed() {
        // By 20 mHz, half a minute a swing: a phase that is not followed would leave a tenth of its power.
        let left = left(0.03, |t| 50.0 * t + 0.02 * (TAU * t / 30.0).sin() * 30.0 / TAU);
        assert!(left.powi(2) < 0.06, "{left}");
    }

    #[test]
    fn what_the_disc_makes_at_that_frequency_for_a_while_is_no_line() {
        // A sweep through it.
        let sweep: Vec<f64> =
            (0..COUNT).map(|i| (TAU * (20.0 + 2.0 * STEP_S * i as f64) * STEP_S * i as f64).sin()).collect();
        assert_eq!(line_hz(&sweep, STEP_S), None);
    }
}
