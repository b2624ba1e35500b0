//! Linear filters on an even grid that are the same for every term of a balance, so that both sides of an
//! equation see the same one and no noise is differentiated on one side only.

use wide::f64x4;

use super::linear::dot;

/// A Gaussian is cut off after so many standard deviations: what is left out is 6e-5 of its area.
pub(super) const REACH: f64 = 4.0;

/// Values filtered with a Gaussian of standard deviation `width` (samples), or with its derivative of order 0 to 3
/// (per sample). Beyond its ends the signal is mirrored.
pub fn gaussian(values: &[f64], width: f64, order: usize) -> Vec<f64> {
    let n = values.len();
    if n == 0 || width <= 0.0 {
        return values.to_vec();
    }
    // A first derivative stays a Gaussian's: what smooths the other terms smooths it alike.
    convolved(values, &kernel(width, order, order >= 2))
}

/// As [`gaussian`] of a channel with white noise of this deviation, and 0 where there is nothing but that noise: as a column of a
/// balance, noise would be weighed as if it were motion, and where a record mostly rests, rest would outweigh motion.
pub fn derivative_of_motion(values: &[f64], width: f64, order: usize, noise: f64) -> Vec<f64> {
    /// Energy over this many times the noise's is motion: over [`WIDTHS`] it is known to some half of itself.
    const OVER_NOISE: f64 = 3.0;
    /// Energy is taken over so many widths.
    const WIDTHS: f64 = 2.0;
    let of_noise = noise * noise * kernel(width, order, order >= 2).iter().map(|k| k * k).sum::<f64>();
    let derivative = gaussian(values, width, order);
    let square: Vec<f64> = derivative.iter().map(|d| d * d).collect();
    let energy = gaussian(&square, WIDTHS * width, 0);
    let share = |energy: f64| (1.0 - OVER_NOISE * of_noise / energy.max(f64::MIN_POSITIVE)).max(0.0);
    derivative.iter().zip(energy).map(|(d, energy)| d * share(energy)).collect()
}

/// Values smoothed with (3 − x²/w²)/2 times a Gaussian of width w (samples), so that polynomials up to the third degree pass
/// as they are: at ωw = 0.75 it loses 4 % of an amplitude where the Gaussian loses 25 %, for a third more of the noise. For
/// signals that a transient is judged by.
pub fn smoothed_flat(values: &[f64], width: f64) -> Vec<f64> {
    if values.is_empty() || width <= 0.0 {
        return values.to_vec();
    }
    convolved(values, &kernel(width, 0, true))
}

/// The input of a second-order mode (natural frequency in radians per sample, damping ratio) behind its output, smoothed as by
/// [`smoothed_flat`]: (1 + 2ζ s/ω₀ + s²/ω₀²) times that filter, from its frequency response.
///
/// A mode that rings is a zero here, so what rings goes and what made it ring stays.
pub fn before_mode(values: &[f64], omega: f64, damping_ratio: f64, width: f64) -> Vec<f64> {
    /// Points of the integral over the frequency: the response is smooth over a hundredth of the band.
    const POINTS: usize = 128;
    // Its fourth derivative reaches half as far again as the Gaussian.
    let half = (1.5 * REACH * width + 0.5) as isize;
    let step = std::f64::consts::PI / POINTS as f64;
    let weight = |place: isize| -> f64 {
        let sum: f64 = (0..POINTS)
            .map(|k| {
                let w = (k as f64 + 0.5) * step;
                let (x, r) = (0.5 * (width * w).powi(2), w / omega);
                let (sin, cos) = (w * place as f64).sin_cos();
                (1.0 + x) * (-x).exp() * ((1.0 - r * r) * cos + 2.0 * damping_ratio * r * sin)
            })
            .sum();
        sum / POINTS as f64
    };
    convolved(values, &(-half..=half).map(weight).collect::<Vec<_>>())
}

/// A signal, mirrored beyond its ends, behind an even number of weights around each sample and that at it.
fn convolved(values: &[f64], kernel: &[f64]) -> Vec<f64> {
    let n = values.len();
    let half = kernel.len() / 2;
    let mirrored = |i: isize| {
        let period = 2 * n as isize;
        let at = i.rem_euclid(period);
        values[if at < n as isize { at as usize } else { (period - 1 - at) as usize }]
    };
    (0..n)
        .map(|i| {
            if i >= half && i + half < n {
                dot(&values[i - half..=i + half], kernel)
            } else {
                kernel
                    .iter()
                    .enumerate()
                    .map(|(j, k)| k * mirrored(i as isize + j as isize - half as isize))
                    .sum()
            }
        })
        .collect()
}

/// Weights on the samples before, at and after. A sampled and cut derivative of a Gaussian has wrong moments, and a
/// position is large against its second difference; so `exact` weights are (b + c x²)·Gaussian, for odd orders times x, with
/// b and c such that polynomials up to the third degree give their derivatives exactly. Others are the Gaussian alone.
fn kernel(width: f64, order: usize, exact: bool) -> Vec<f64> {
    let half = (REACH * width + 0.5) as isize;
    let places = || (-half..=half).map(|j| j as f64);
    let weight = |x: f64| (-0.5 * (x / width).powi(2)).exp();
    // Of the sampled and cut Gaussian, so that the moments hold at any width.
    let moment = |n: i32| places().map(|x| x.powi(n) * weight(x)).sum::<f64>();
    let odd = (order % 2) as i32;
    // Σ (b + c x²) x^(2 odd) w = lower, Σ (b + c x²) x^(2 + 2 odd) w = upper.
    let (lower, upper) = match order {
        0 | 1 => (1.0, 0.0),
        2 => (0.0, 2.0),
        _ => (0.0, 6.0),
    };
    let (m0, m2, m4) = (moment(2 * odd), moment(2 + 2 * odd), moment(4 + 2 * odd));
    let d = m0 * m4 - m2 * m2;
    let (b, c) = if exact && d > 0.0 {
        ((lower * m4 - upper * m2) / d, (upper * m0 - lower * m2) / d)
    } else {
        (1.0 / m0, 0.0)
    };
    places().map(|x| (b + c * x * x) * x.powi(odd) * weight(x)).collect()
}

/// Largest magnitude of the derivative behind a Gaussian of this width within two samples, per sample.
pub fn largest_change(values: &[f64], width: f64) -> Vec<f64> {
    local_maximum(&gaussian(values, width, 1).iter().map(|d| d.abs()).collect::<Vec<_>>(), 2)
}

/// RMS of the steps from sample to sample, over a Gaussian window of this width.
pub fn steps(values: &[f64], width: f64) -> Vec<f64> {
    let squares: Vec<f64> =
        (0..values.len()).map(|i| (values[i] - values[i.saturating_sub(1)]).powi(2)).collect();
    gaussian(&squares, width, 0).iter().map(|square| square.max(0.0).sqrt()).collect()
}

/// Share of white noise that a Gaussian of this width leaves.
pub fn white_share(width: f64) -> f64 {
    (0.5 / (std::f64::consts::PI.sqrt() * width)).sqrt()
}

/// Share of white noise that [`smoothed_flat`] of this width leaves: ∫((3 − x²)/2)² of a Gaussian's square is 27/16 of its area.
pub fn white_share_flat(width: f64) -> f64 {
    (27.0_f64 / 16.0).sqrt() * white_share(width)
}

/// Widths that are tried in turn, samples, and half width of the interval in which the truth lies, in deviations of what is left of
/// the noise: so wide that noise seldom passes for a peak.
const WIDER: [f64; 6] = [1.0, 2.0, 4.0, 8.0, 16.0, WIDEST_MEAN];
const WITHIN: f64 = 3.0;
/// The widest of them.
pub const WIDEST_MEAN: f64 = 32.0;

/// A signal without its white noise of this deviation, smoothed at each point as widely as the narrower estimates allow: the
/// rule of intersecting confidence intervals (A. Goldenshluger, A. Nemirovski, Math. Methods Statist. 6, 1997). Steps and peaks
/// stay what they are.
pub fn adaptively_smoothed(signal: &[f64], noise: f64) -> Vec<f64> {
    smoothed_together([(signal, noise)])
}

/// The same of the first of two signals that follow each other: as widely as the estimates of both allow, since what is steady
/// in the one with less noise is so in the other.
pub fn smoothed_together<const N: usize>(signals: [(&[f64], f64); N]) -> Vec<f64> {
    let mut out = signals[0].0.to_vec();
    widest_agreeing(signals, &WIDER, |i, _, smoothed| out[i] = smoothed);
    out
}

/// Tells of each sample, and of each of these widths in turn as long as the estimates of all signals agree with all narrower
/// ones: the sample, the width's place, the first signal smoothed.
pub fn widest_agreeing<const N: usize>(
    signals: [(&[f64], f64); N],
    widths: &[f64],
    mut tell: impl FnMut(usize, usize, f64),
) {
    let interval = |value: f64, left: f64| (value - WITHIN * left, value + WITHIN * left);
    let first = |(signal, noise): (&[f64], f64)| -> Vec<(f64, f64)> {
        signal.iter().map(|x| interval(*x, noise)).collect()
    };
    let mut within = signals.map(first);
    let mut open = vec![true; within[0].len()];
    for (at, width) in widths.iter().enumerate() {
        let smoothed = signals.map(|(signal, _)| gaussian(signal, *width, 0));
        for i in 0..open.len() {
            for ((within, smoothed), (_, noise)) in within.iter_mut().zip(&smoothed).zip(&signals) {
                let own = interval(smoothed[i], noise * white_share(*width));
                within[i] = (within[i].0.max(own.0), within[i].1.min(own.1));
                open[i] &= within[i].0 <= within[i].1;
            }
            if open[i] {
                tell(i, at, smoothed[0][i]);
            }
        }
    }
}

/// Largest value within `half` samples on either side.
pub fn local_maximum(values: &[f64], half: usize) -> Vec<f64> {
    let n = values.len();
    let mut waiting: std::collections::VecDeque<usize> = std::collections::VecDeque::new();
    let mut out = Vec::with_capacity(n);
    for i in 0..n + half {
        if i < n {
            while waiting.back().is_some_and(|&j| values[j] <= values[i]) {
                waiting.pop_back();
            }
            waiting.push_back(i);
        }
        if i >= half {
            while waiting.front().is_some_and(|&j| j + 2 * half < i) {
                waiting.pop_front();
            }
            out.push(waiting.front().map_or(0.0, |&j| values[j]));
        }
    }
    out
}

/// The signal at t + `ahead` samples (any fraction), by cubics through four samples; held at its ends.
pub fn shifted(values: &[f64], ahead: f64) -> Vec<f64> {
    let n = values.len() as isize;
    if n == 0 || ahead == 0.0 {
        return values.to_vec();
    }
    let whole = ahead.floor();
    let s = ahead - whole;
    let whole = whole as isize;
    // Cubic Hermite with the slopes of the central differences.
    let w = [
        -0.5 * s + s * s - 0.5 * s * s * s,
        1.0 - 2.5 * s * s + 1.5 * s * s * s,
        0.5 * s + 2.0 * s * s - 1.5 * s * s * s,
        -0.5 * s * s + 0.5 * s * s * s,
    ];
    let at = |i: isize| values[i.clamp(0, n - 1) as usize];
    (0..n)
        .map(|i| {
            let j = i + whole;
            if j >= 1 && j + 2 < n {
                let x = &values[(j - 1) as usize..=(j + 2) as usize];
                w[0] * x[0] + w[1] * x[1] + w[2] * x[2] + w[3] * x[3]
            } else {
                w[0] * at(j - 1) + w[1] * at(j) + w[2] * at(j + 1) + w[3] * at(j + 2)
            }
        })
        .collect()
}

/// e^x of each.
pub fn exponentials(values: &[f64]) -> Vec<f64> {
    let mut out = values.to_vec();
    let mut four = out.chunks_exact_mut(4);
    for x in &mut four {
        x.copy_from_slice(f64x4::from([x[0], x[1], x[2], x[3]]).exp().as_array_ref());
    }
    four.into_remainder().iter_mut().for_each(|x| *x = x.exp());
    out
}

/// Central differences per sample.
pub fn gradient(values: &[f64]) -> Vec<f64> {
    let n = values.len();
    if n < 2 {
        return vec![0.0; n];
    }
    (0..n)
        .map(|i| match i {
            0 => values[1] - values[0],
            i if i == n - 1 => values[i] - values[i - 1],
            i => 0.5 * (values[i + 1] - values[i - 1]),
        })
        .collect()
}

/// Root of the mean square.
pub fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|x| x * x).sum::<f64>() / values.len().max(1) as f64).sqrt()
}

/// Median of the magnitudes; 0 of nothing.
pub fn median_magnitude(values: impl Iterator<Item = f64>) -> f64 {
    let mut sorted: Vec<f64> = values.map(f64::abs).collect();
    if sorted.is_empty() {
        return 0.0;
    }
    let middle = sorted.len() / 2;
    *sorted.select_nth_unstable_by(middle, f64::total_cmp).1
}

/// Deviation of normal values about zero, by the median of their sizes: what is far out does not count.
pub fn deviation_by_median(values: impl Iterator<Item = f64>) -> f64 {
    /// Median size of a normal deviate.
    const MEDIAN: f64 = 0.6745;
    median_magnitude(values) / MEDIAN
}

#[cfg(test)]
mod tests {
    use super::*;
    use model_core::sensor::{SecondOrder, SecondOrderState};

    #[test]
    fn steps_see_what_swings_from_sample_to_sample_and_not_a_slope() {
        let swings: Vec<f64> = (0..200).map(|i| if i % 2 == 0 { 1.0 } else { -1.0 }).collect();
        assert!((steps(&swings, 6.0)[100] - 2.0).abs() < 1e-6);
        let slope: Vec<f64> = (0..200).map(|i| 0.01 * f64::from(i)).collect();
        assert!((steps(&slope, 6.0)[100] - 0.01).abs() < 1e-6);
    }

    #[test]
    fn flat_smoothing_passes_cubics_and_keeps_a_mode_that_the_gaussian_loses() {
        for width in [0.6, 0.8, 1.0, 2.5] {
            let cubic: Vec<f64> = (0..60).map(|i| (f64::from(i) * 0.1 - 3.0).powi(3)).collect();
            let smooth = smoothed_flat(&cubic, width);
            for i in 15..45 {
                assert!((smooth[i] - cubic[i]).abs() < 1e-9, "{width} {i}");
            }
        }
        let mode: Vec<f64> = (0..200).map(|i| (0.75 * f64::from(i)).sin()).collect();
        let kept = |smooth: Vec<f64>| rms(&smooth[50..150]) / rms(&mode[50..150]);
        assert!((0.95..0.99).contains(&kept(smoothed_flat(&mode, 1.0))));
        assert!(kept(gaussian(&mode, 1.0, 0)) < 0.78);
    }

    #[test]
    fn a_derivative_is_there_where_something_moves_and_not_where_noise_is_alone() {
        let noise = crate::identify::noise::tests::white(4000, 7);
        let step = |i: usize| if i < 2000 { 0.0 } else { 1.0 };
        let shown: Vec<f64> = noise.iter().enumerate().map(|(i, e)| step(i) + 0.01 * e).collect();
        let clean: Vec<f64> = (0..4000).map(step).collect();
        for order in 1..=2 {
            let found = derivative_of_motion(&shown, 4.0, order, 0.01);
            let (all, true_one) = (gaussian(&shown, 4.0, order), gaussian(&clean, 4.0, order));
            assert!(rms(&found[..1900]) < 0.15 * rms(&all[..1900]), "{order}");
            let error: Vec<f64> = (1980..2020).map(|i| found[i] - true_one[i]).collect();
            assert!(rms(&error) < 0.12 * rms(&true_one[1980..2020]), "{order}: {}", rms(&error));
        }
    }

    #[test]
    fn what_a_mode_was_struck_by_is_found_behind_its_ringing() {
        // Struck every 500 samples; the mode moves in steps of a tenth of a sample.
        let struck = |t: f64| (0.02 * t).sin() + if (t / 500.0).floor() % 2.0 > 0.0 { 1.0 } else { 0.0 };
        for (omega, width) in [(0.14, 3.5), (0.4, 1.6), (1.53, 1.2)] {
            let mode = SecondOrder::new(omega / std::f64::consts::TAU, 0.005, 0.1);
            let mut state = SecondOrderState::holding(struck(0.0));
            let shown: Vec<f64> = (0..3000)
                .map(|i| {
                    let fine = (1..=10)
                        .map(|j| mode.step(&mut state, struck(f64::from(i) + 0.1 * f64::from(j) - 1.0)));
                    fine.last().unwrap_or_default()
                })
                .collect();
            let input: Vec<f64> = (0..3000).map(|i| struck(f64::from(i))).collect();
            let off = |found: &[f64]| {
                let away = (20..2980).filter(|i| (i + 20) % 500 > 40);
                rms(&away.map(|i| found[i] - input[i]).collect::<Vec<_>>())
            };
            let found = before_mode(&shown, omega, 0.005, width);
            assert!(off(&shown) > 0.2 && off(&found) < 0.004, "{omega}: {} {}", off(&shown), off(&found));
        }
    }

    #[test]
    fn a_gaussian_filter_keeps_a_line_and_gives_the_derivatives_of_a_cubic() {
        let cubic: Vec<f64> = (0..200).map(|i| (0.01 * f64::from(i)).powi(3)).collect();
        let line: Vec<f64> = (0..200).map(|i| 3.0 - 0.5 * f64::from(i)).collect();
        let (smooth, slope, second) =
            (gaussian(&line, 4.0, 0), gaussian(&line, 4.0, 1), gaussian(&cubic, 4.0, 2));
        let third = gaussian(&cubic, 4.0, 3);
        for i in 40..160 {
            assert!((smooth[i] - line[i]).abs() < 1e-10);
            assert!((slope[i] + 0.5).abs() < 1e-12);
            assert!((second[i] - 6e-6 * i as f64).abs() < 1e-10);
            assert!((third[i] - 6e-6).abs() < 1e-12, "{}", third[i]);
        }
    }

    #[test]
    fn a_parabola_is_shifted_exactly() {
        let parabola = |t: f64| 0.3 * t * t - t;
        let values: Vec<f64> = (0..50).map(|i| parabola(f64::from(i))).collect();
        for ahead in [0.37, -2.6, 3.0] {
            for (i, x) in shifted(&values, ahead).iter().enumerate().take(40).skip(5) {
                assert!((x - parabola(i as f64 + ahead)).abs() < 1e-9, "{ahead} {i}");
            }
        }
    }

    #[test]
    fn the_local_maximum_is_that_of_the_window() {
        let values: Vec<f64> = (0..60).map(|i| (f64::from(i * i % 17)).sin()).collect();
        for (i, found) in local_maximum(&values, 3).iter().enumerate() {
            let expected =
                values[i.saturating_sub(3)..(i + 4).min(60)].iter().copied().fold(f64::MIN, f64::max);
            assert!((found - expected).abs() < 1e-15);
        }
    }

    #[test]
    fn what_is_smoothed_adaptively_keeps_its_peaks_and_loses_its_noise() {
        let truth: Vec<f64> = (0..4000)
            .map(|i| match i {
                0..1000 => 0.0,
                1000..1020 => 0.05 * f64::from(i - 999),
                1020..2500 => 0.4,
                _ => 0.4 + 0.3 * (0.02 * f64::from(i - 2500)).sin(),
            })
            .collect();
        let noise = crate::identify::noise::tests::white(truth.len(), 9);
        let signal: Vec<f64> = truth.iter().zip(&noise).map(|(x, n)| x + 0.01 * n).collect();
        let smoothed = adaptively_smoothed(&signal, 0.01);
        let off =
            |range: std::ops::Range<usize>| rms(&range.map(|i| smoothed[i] - truth[i]).collect::<Vec<_>>());
        assert!((smoothed[1019] - 1.0).abs() < 0.03, "{}", smoothed[1019]);
        let off = [off(200..900), off(1100..2400), off(2600..3900)];
        // A bend is followed to within less than the noise.
        assert!(off[0] < 0.002 && off[1] < 0.002 && off[2] < 0.01, "{off:?}");
        // One width for all cuts the peak.
        assert!(gaussian(&signal, 4.0, 0)[1019] < 0.8);
    }

    #[test]
    fn what_a_quieter_signal_shows_to_be_a_swing_is_not_smoothed_away() {
        let swing = |i: usize| if (i / 500).is_multiple_of(2) { 0.0 } else { (0.12 * i as f64).sin() };
        let signal = |noise: f64, seed: u64| -> Vec<f64> {
            let noises = crate::identify::noise::tests::white(4000, seed);
            noises.iter().enumerate().map(|(i, n)| swing(i) + noise * n).collect()
        };
        let (noisy, quiet) = (signal(0.5, 4), signal(0.02, 5));
        // Share of the swing that is left.
        let left = |smoothed: &[f64]| {
            let own = |i: &usize| (i / 500) % 2 == 1;
            let sum = |of: &dyn Fn(usize) -> f64| (0..4000).filter(own).map(of).sum::<f64>();
            sum(&|i| smoothed[i] * swing(i)) / sum(&|i| swing(i).powi(2))
        };
        let (alone, together) =
            (adaptively_smoothed(&noisy, 0.5), smoothed_together([(&noisy, 0.5), (&quiet, 0.02)]));
        assert!(left(&alone) < 0.9 && left(&together) > 0.97, "{} {}", left(&alone), left(&together));
        // Where neither swings, all of the noise goes that would go.
        let noise = |smoothed: &[f64]| rms(&smoothed[1100..1400]);
        assert!(noise(&together) < 1.2 * noise(&alone), "{} {}", noise(&together), noise(&alone));
    }
}
