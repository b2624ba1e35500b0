//! Whether time stamps wobble where the samples behind them do not: a computer that stamps rows as they come in writes when it
//! got round to them, a converter's own clock samples evenly.
//!
//! A step of the position is Δx = ẋ (T + w) where the sample was taken as late as its stamp says, by w of the nominal step T, and
//! Δx = ẋ T where it was not. The slope of what is missing, over ẋ w, is 1 for stamps that are right and 0 for samples that are even.
//! Second differences take the motion itself out of both.

use super::log::{median_step, slope};

/// A step that is off its whole number of nominal steps by as much as this has a wobble that stamps of even rounding have not.
const WOBBLE: f64 = 0.01;
/// The slope is below this where samples are even: half way.
const EVEN: f64 = 0.5;
/// … and is known to this: right stamps are then five deviations from it.
const KNOWN: f64 = 0.1;
/// Stamps that go further from an even clock than so many nominal steps do more than wobble.
const FURTHEST: f64 = 1.0;
/// Steps that are off the median one by less than this share of it are steps of no missing row: somewhat more than a half.
const USUAL: f64 = 0.55;
/// Shares of a stamp's wobble that the clock by which missing rows are counted takes over, where the step is known to a thousandth and
/// once it is known to a ten-thousandth: such a step puts the clock off by a fiftieth of a step, and of the wobble √(f/2) is in it.
const FOLLOWS: [f64; 2] = [0.05, 0.005];
/// Samples to either side over which the speed at a step is taken: it swings more slowly, and its noise is a third of one step's.
const SPEED_OVER: usize = 4;

/// Samples that are even though their stamps are not.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct EvenSamples {
    /// When they were taken: the line of least squares through the stamps over the count of nominal steps, s.
    pub(super) time_s: Vec<f64>,
    /// Nominal step, s.
    pub(super) step_s: f64,
    /// Root mean square of what the stamps are off, s.
    pub(super) off_s: f64,
    /// Share of the stamps' wobble that the position shows, with its standard error: 1 where stamps are right.
    pub(super) shown: (f64, f64),
}

/// The even times behind stamps that wobble; `None` where stamps are even, right, or nothing is sure.
///
/// `time_s` rises; `position` is an angle without jumps, or a way, at each.
pub(super) fn even_samples(time_s: &[f64], position: &[f64]) -> Option<EvenSamples> {
    let median = median_step(time_s).filter(|_| time_s.len() > 4 * SPEED_OVER)?;
    // Stamps that are rounded to whole milliseconds have two steps and no median between them: one is half of the other at most. As far
    // to either side, so that a wobble does not shift the mean.
    let steps = time_s.windows(2).map(|t| t[1] - t[0]);
    let usual: Vec<f64> = steps.filter(|step| (step - median).abs() < USUAL * median).collect();
    let roughly = (time_s[0], usual.iter().sum::<f64>() / usual.len() as f64);
    // Counted once more with the line that the first count shows.
    let closely = line(&counted(time_s, roughly, FOLLOWS[0]), time_s);
    let at = counted(time_s, closely, FOLLOWS[1]);
    let counts: Vec<f64> = at.windows(2).map(|k| k[1] - k[0]).collect();
    let (start_s, step_s) = line(&at, time_s);
    let even: Vec<f64> = at.iter().map(|k| start_s + k * step_s).collect();
    let off: Vec<f64> = time_s.iter().zip(&even).map(|(t, e)| t - e).collect();
    let off_s = (off.iter().map(|o| o * o).sum::<f64>() / off.len() as f64).sqrt();
    if off_s < WOBBLE * step_s || off.iter().any(|o| o.abs() > FURTHEST * step_s) {
        return None;
    }
    let (share, std) = shown(&even, &off, position, &counts)?;
    (share < EVEN && std < KNOWN).then_some(EvenSamples { time_s: even, step_s, off_s, shown: (share, std) })
}

/// Nominal steps up to each stamp, rows that are missing counted: by a clock that follows the stamps slowly, so that a wobble may be
/// nearly half a step.
fn counted(time_s: &[f64], (start_s, step_s): (f64, f64), follows: f64) -> Vec<f64> {
    let (mut clock_s, mut count) = (start_s, 0.0);
    let next = |stamp_s: &f64| {
        let steps = ((stamp_s - clock_s) / step_s).round().max(1.0);
        let even_s = clock_s + steps * step_s;
        clock_s = even_s + follows * (stamp_s - even_s);
        count += steps;
        count
    };
    std::iter::once(0.0).chain(time_s[1..].iter().map(next)).collect()
}

/// Share of the stamps' wobble that the position shows, with its standard error.
fn shown(even_s: &[f64], off_s: &[f64], position: &[f64], counts: &[f64]) -> Option<(f64, f64)> {
    let speed = slope(even_s, position);
    let second = |x: &dyn Fn(usize) -> f64, i: usize| x(i) - 0.5 * (x(i - 1) + x(i + 1));
    let mut pairs = Vec::new();
    for i in SPEED_OVER..position.len() - 1 - SPEED_OVER {
        let near = i - SPEED_OVER..=i + SPEED_OVER;
        if counts[near.clone()].iter().any(|count| *count > 1.0) {
            continue;
        }
        let mean = speed[near.clone()].iter().sum::<f64>() / near.count() as f64;
        let moved = second(&|j| position[j + 1] - position[j], i);
        pairs.push((moved, mean * second(&|j| off_s[j + 1] - off_s[j], i)));
    }
    let square = pairs.iter().map(|(_, stamped)| stamped * stamped).sum::<f64>();
    let share = pairs.iter().map(|(moved, stamped)| moved * stamped).sum::<f64>() / square;
    // What is missing and the wobble are both differences of neighbours, so that their products go together over several: the sum's
    // variance is that of sums over stretches that are longer.
    let stretches = pairs.chunks_exact(4 * SPEED_OVER);
    let off = |(moved, stamped): &(f64, f64)| (moved - share * stamped) * stamped;
    let variance: f64 = stretches.map(|pairs| pairs.iter().map(off).sum::<f64>().powi(2)).sum();
    let std = variance.sqrt() / square;
    std.is_finite().then_some((share, std))
}

/// Start and slope of the line of least squares.
fn line(x: &[f64], y: &[f64]) -> (f64, f64) {
    let mean = |of: &[f64]| of.iter().sum::<f64>() / of.len() as f64;
    let (x0, y0) = (mean(x), mean(y));
    let products = x.iter().zip(y).map(|(x, y)| (x - x0) * (y - y0)).sum::<f64>();
    let slope = products / x.iter().map(|x| (x - x0).powi(2)).sum::<f64>();
    (y0 - slope * x0, slope)
}

#[cfg(test)]
mod tests {
    use super::*;

    const STEP_S: f64 = 5e-4;

    /// A repeatable number from -1 to 1.
    fn noise(i: usize, of: u64) -> f64 {
        let mut x =
            (i as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ of.wrapping_mul(0xd1b5_4a32_d192_ed03);
        x = (x ^ (x >> 29)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        (x >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    /// A disc that speeds up and slows down, read by an encoder; stamps that wobble by `wobble` of a step, samples that are taken
    /// as late as this share of it; and every 100th row lost.
    fn log(wobble: f64, real: f64) -> (Vec<f64>, Vec<f64>, Vec<f64>) {
        let quantum = std::f64::consts::TAU / 120_000.0;
        let angle = |t: f64| ((4.0 * t - 1.5 * (2.0 * t).cos()) / quantum).round() * quantum;
        let rows = (0..20_000).filter(|i| i % 100 != 50);
        let nominal: Vec<f64> = rows.clone().map(|i| STEP_S * i as f64).collect();
        let late = |i: usize| STEP_S * wobble * noise(i, 1);
        let stamps = rows.clone().map(|i| STEP_S * i as f64 + late(i)).collect();
        let angles = rows.map(|i| angle(STEP_S * i as f64 + real * late(i))).collect();
        (stamps, angles, nominal)
    }

    #[test]
    fn stamps_that_wobble_where_the_samples_do_not_are_evened() {
        for wobble in [0.05, 0.2, 0.4] {
            let (stamps, angles, nominal) = log(wobble, 0.0);
            let found = even_samples(&stamps, &angles).expect("the samples are even");
            for (found, nominal) in found.time_s.iter().zip(&nominal) {
                assert!((found - nominal).abs() < 0.02 * STEP_S, "{wobble}: {found} {nominal}");
            }
            let (share, std) = found.shown;
            assert!(share.abs() < 4.0 * std, "{wobble}: {share} {std}");
        }
    }

    #[test]
    fn stamps_in_whole_milliseconds_are_evened() {
        let even: Vec<f64> = (0..6000).map(|i| f64::from(i) / 600.0).collect();
        let stamps: Vec<f64> = even.iter().map(|t| (1e3 * t).floor() / 1e3).collect();
        let angles: Vec<f64> = even.iter().map(|t| 4.0 * t - 1.5 * (2.0 * t).cos()).collect();
        let found = even_samples(&stamps, &angles).expect("the samples are even");
        // The rounding makes all of them early alike.
        let late = even[0] - found.time_s[0];
        assert!(late.abs() < 1e-3, "{late}");
        for (found, even) in found.time_s.iter().zip(&even) {
            assert!((found + late - even).abs() < 1e-5, "{found} {even}");
        }
    }

    #[test]
    fn stamps_that_are_even_or_right_or_say_nothing_are_believed() {
        for (wobble, real) in [(0.0, 0.0), (0.2, 1.0), (0.05, 1.0), (0.2, 0.8)] {
            let (stamps, angles, _) = log(wobble, real);
            assert_eq!(even_samples(&stamps, &angles), None, "{wobble} {real}");
        }
        // A disc that stands tells nothing of when it was looked at.
        let (stamps, _, _) = log(0.2, 0.0);
        assert_eq!(even_samples(&stamps, &vec![1.0; stamps.len()]), None);
    }
}
