//! Smoothing that keeps jumps: the widest mean that the data cannot tell from the narrow ones.
//!
//! For each sample the means over windows of growing width are compared; as long as their confidence
//! intervals (κσ/√n) still intersect, the wider one is taken (Lepski's rule; intersection of confidence
//! intervals, Goldenshluger and Nemirovski 1997). Quiet stretches are averaged over many samples, a
//! start or a load step over few. What is smoothed away is below the noise by construction.
//! Used for the measured inputs of a model, whose noise would otherwise pass into the prediction.

/// Half widths of the windows, samples.
const HALF_WIDTHS: [usize; 10] = [1, 2, 3, 5, 8, 12, 18, 27, 40, 60];
/// Half width of the confidence interval in standard deviations.
const KAPPA: f64 = 3.0;

/// A smoothed signal.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Smoothed {
    /// Values at the samples.
    pub values: Vec<f64>,
    /// Standard deviation of what noise is left in each.
    pub std: Vec<f64>,
}

/// Smooths a signal whose samples carry white noise of standard deviation `noise_std`.
pub fn signal(values: &[f64], noise_std: f64) -> Smoothed {
    let mut sums = Vec::with_capacity(values.len() + 1);
    // Sums of differences to the first value, so that rounding stays that of the variation.
    let origin = values.first().copied().unwrap_or(0.0);
    let mut sum = 0.0;
    sums.push(0.0);
    for value in values {
        sum += value - origin;
        sums.push(sum);
    }
    widest(values.len(), |at, half| {
        if half == 0 {
            return (values[at], noise_std);
        }
        let count = (2 * half + 1) as f64;
        let mean = origin + (sums[at + half + 1] - sums[at - half]) / count;
        (mean, noise_std / count.sqrt())
    })
}

/// Slope of a signal whose samples carry white noise of standard deviation `noise_std`: the difference
/// across the window over its time, so that the slope integrates to the signal.
pub fn slope(time_s: &[f64], values: &[f64], noise_std: f64) -> Smoothed {
    let last = values.len().saturating_sub(1);
    widest(values.len(), |at, half| {
        let half = half.max(1);
        let (from, to) = (at.saturating_sub(half), (at + half).min(last));
        let span_s = time_s[to] - time_s[from];
        if span_s <= 0.0 {
            return (0.0, f64::INFINITY);
        }
        ((values[to] - values[from]) / span_s, std::f64::consts::SQRT_2 * noise_std / span_s)
    })
}

/// Applies the rule; `estimate(at, half)` is the mean over a window and its standard deviation.
fn widest(count: usize, estimate: impl Fn(usize, usize) -> (f64, f64)) -> Smoothed {
    let mut smoothed = Smoothed { values: Vec::with_capacity(count), std: Vec::with_capacity(count) };
    for at in 0..count {
        let room = at.min(count - 1 - at);
        let (mut value, mut std) = estimate(at, 0);
        let (mut low, mut high) = (value - KAPPA * std, value + KAPPA * std);
        for half in HALF_WIDTHS.into_iter().take_while(|half| *half <= room) {
            let (next, next_std) = estimate(at, half);
            low = low.max(next - KAPPA * next_std);
            high = high.min(next + KAPPA * next_std);
            if low > high {
                break;
            }
            (value, std) = (next, next_std);
        }
        smoothed.values.push(value);
        smoothed.std.push(std);
    }
    smoothed
}

#[cfg(test)]
mod tests {
    use super::super::noise::tests::white;
    use super::*;

    #[test]
    fn a_step_stays_sharp_and_the_quiet_around_it_is_averaged() {
        let noise = white(2000, 5);
        let values: Vec<f64> = (0..2000).map(|i| if i < 1000 { 0.0 } else { 20.0 } + noise[i]).collect();
        let smoothed = signal(&values, 1.0);
        let rms = |from: usize, to: usize, level: f64| {
            let sum: f64 = smoothed.values[from..to].iter().map(|x| (x - level).powi(2)).sum();
            (sum / (to - from) as f64).sqrt()
        };
        // Means over 121 samples leave 1/11; windows that stopped early leave more.
        assert!(rms(100, 900, 0.0) < 0.2, "{}", rms(100, 900, 0.0));
        assert!(rms(1100, 1900, 20.0) < 0.2);
        // Next to the step the window is narrow: the noise of single samples is left, never the step's 20.
        let worst = (980..1000).map(|i| smoothed.values[i].abs()).fold(0.0, f64::max);
        assert!(worst < 4.0, "{worst}");
    }

    #[test]
    fn the_slope_of_a_ramp_with_a_corner_is_found() {
        let noise = white(2000, 6);
        let time_s: Vec<f64> = (0..2000).map(|i| f64::from(i) * 1e-3).collect();
        let values: Vec<f64> =
            time_s.iter().zip(&noise).map(|(t, e)| 5.0 * (t - 1.0).max(0.0) + 1e-5 * e).collect();
        let slope = slope(&time_s, &values, 1e-5);
        for i in (100..900).chain(1100..1900) {
            let expected = if i < 1000 { 0.0 } else { 5.0 };
            // Three standard deviations of the narrowest window.
            assert!((slope.values[i] - expected).abs() < 0.03, "{i} {}", slope.values[i]);
        }
    }
}
