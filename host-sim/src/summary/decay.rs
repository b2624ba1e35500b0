//! Damping ratio of a step response.
//!
//! θ̈ + a θ̇ + b θ = c, integrated once: ω(t) − ω(t0) = −a (θ − θ0) − b ∫θ + c (t − t0). That is linear in a,
//! b, c and differentiates nothing; least squares over the samples gives them. ζ = a/(2√b).
//! Left out: Coulomb friction, which acts as additional damping in it.

use nalgebra::{DMatrix, DVector};

use crate::predict::integral;

/// After the step, the torque's own lag has died.
const AFTER_STEP_S: f64 = 10e-3;
/// The response is over where the speed stays below this part of its peak.
const OVER: f64 = 0.02;

/// Directions that the samples do not excite are left out.
const SMALLEST_SINGULAR: f64 = 1e-12;

/// The damping ratio of the response to a step at the start of `span`; `None` where the response is no
/// second-order one (no stiffness, or too few samples).
pub(super) fn damping_ratio(time_s: &[f64], angle: &[f64], speed: &[f64], span: (f64, f64)) -> Option<f64> {
    let from = time_s.partition_point(|t| *t < span.0 + AFTER_STEP_S);
    let to = time_s.partition_point(|t| *t < span.1);
    let peak = speed.get(from..to)?.iter().fold(0.0, |peak: f64, w| peak.max(w.abs()));
    let to = from + speed[from..to].iter().rposition(|w| w.abs() > OVER * peak)? + 1;
    if to < from + 8 {
        return None;
    }
    let (time_s, angle, speed) = (&time_s[from..to], &angle[from..to], &speed[from..to]);
    let turned: Vec<f64> = angle.iter().map(|x| x - angle[0]).collect();
    let swept = integral(time_s, &turned);
    let span_s = time_s[time_s.len() - 1] - time_s[0];
    let rows = time_s.len();
    let matrix = DMatrix::from_fn(rows, 3, |i, j| match j {
        0 => -turned[i],
        1 => -swept[i] / span_s,
        _ => (time_s[i] - time_s[0]) / span_s,
    });
    let gained = DVector::from_iterator(rows, speed.iter().map(|w| w - speed[0]));
    let found = matrix.svd(true, true).solve(&gained, SMALLEST_SINGULAR).ok()?;
    let (a, b) = (found[0], found[1] / span_s);
    // Less than a sixth of a period in the window is no oscillation that could be told from a ramp.
    (b * span_s * span_s > 1.0).then(|| a / (2.0 * b.sqrt()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_damping_of_a_known_response_is_found_with_noise_on_the_speed() {
        for zeta in [0.05, 0.2, 0.7] {
            let wn = 73.0;
            let wd = wn * (1.0_f64 - zeta * zeta).sqrt();
            let time_s: Vec<f64> = (0..2000).map(|i| f64::from(i) * 1e-3).collect();
            let decay = |t: f64| (-zeta * wn * t).exp();
            let angle = |t: f64| 0.04 * (1.0 - decay(t) * ((wd * t).cos() + zeta * wn / wd * (wd * t).sin()));
            let speed = |t: f64| 0.04 * wn * wn / wd * decay(t) * (wd * t).sin();
            let since = |t: &f64| (t - 0.5).max(0.0);
            let angles: Vec<f64> = time_s.iter().map(|t| angle(since(t))).collect();
            let mut n = 0.0;
            let speeds: Vec<f64> = time_s
                .iter()
                .map(|t| {
                    n += 0.618_033_988_749_895;
                    speed(since(t)) + 0.01 * (f64::fract(n) - 0.5)
                })
                .collect();
            let found = damping_ratio(&time_s, &angles, &speeds, (0.5, 2.0));
            // Noise of 0.3 % of the speed's peak, over some hundred samples or fewer.
            assert!(found.is_some_and(|found| (found - zeta).abs() < 0.005), "{found:?} {zeta}");
        }
    }

    #[test]
    fn a_disc_that_runs_away_has_no_damping_ratio() {
        let time_s: Vec<f64> = (0..1000).map(|i| f64::from(i) * 1e-3).collect();
        let speed: Vec<f64> = time_s.clone();
        let angle: Vec<f64> = time_s.iter().map(|t| t * t / 2.0).collect();
        assert_eq!(damping_ratio(&time_s, &angle, &speed, (0.0, 1.0)), None);
    }
}
