//! A ring after a stretch in which the friction is not known.
//!
//! While stiff bristles stick, friction is a matter of motion below the encoder's resolution, and such samples
//! are masked. A ring that is hardly damped remembers what happened there for a quarter of a second. So its
//! displacement and rate at the end of such a stretch are taken from what the channel shows next: two
//! amplitudes of the ring's own free motion, by linear least squares. A ring that forgets within
//! milliseconds is left as it is.

use std::f64::consts::TAU;

/// Fastest decay of a ring that is worth it, 1/s.
const FASTEST_PER_S: f64 = 60.0;
/// Decay times over which the free motion is followed.
const TIMES: f64 = 5.0;
/// Least masked values that make a stretch, and least values after it.
const LEAST_MASKED: usize = 2;
const LEAST_AFTER: usize = 10;

/// Adds the free motion of a ring (undamped frequency, damping ratio) to what is predicted, after each
/// stretch of masked (NaN) `sigma`.
pub fn add(time_s: &[f64], measured: &[f64], sigma: &[f64], shown: &mut [f64], ring: (f64, f64)) {
    let (omega, damping) = (TAU * ring.0, ring.1);
    let decay = damping * omega;
    if decay > FASTEST_PER_S || decay <= 0.0 {
        return;
    }
    let swing = omega * (1.0 - damping * damping).max(0.0).sqrt();
    let mut at = 0;
    while at < sigma.len() {
        let masked = sigma[at..].iter().take_while(|s| s.is_nan()).count();
        let from = at + masked;
        let last_s = time_s.get(from).map_or(0.0, |t| t + TIMES / decay);
        let open =
            sigma[from..].iter().zip(&time_s[from..]).take_while(|(s, t)| !s.is_nan() && **t <= last_s);
        let to = from + open.count();
        let is_start = from == 0;
        if (masked >= LEAST_MASKED || is_start) && to - from >= LEAST_AFTER {
            let free = |i: usize| {
                let t = time_s[i] - time_s[from];
                let (sine, cosine) = (swing * t).sin_cos();
                ((-decay * t).exp() * cosine, (-decay * t).exp() * sine)
            };
            let (mut cc, mut cs, mut ss, mut rc, mut rs) = (0.0, 0.0, 0.0, 0.0, 0.0);
            for i in from..to {
                let (c, s) = free(i);
                let weight = 1.0 / (sigma[i] * sigma[i]);
                let left = measured[i] - shown[i];
                cc += weight * c * c;
                cs += weight * c * s;
                ss += weight * s * s;
                rc += weight * c * left;
                rs += weight * s * left;
            }
            let determinant = cc * ss - cs * cs;
            if determinant > 1e-6 * cc * ss {
                let (a, b) = ((rc * ss - rs * cs) / determinant, (rs * cc - rc * cs) / determinant);
                for (i, shown) in shown.iter_mut().enumerate().take(to).skip(from) {
                    let (c, s) = free(i);
                    *shown += a * c + b * s;
                }
            }
        }
        // What is left of an open stretch needs no second look.
        at = to.max(from) + sigma[to.max(from)..].iter().take_while(|s| !s.is_nan()).count();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_free_ring_after_a_masked_stretch_is_explained_and_a_step_is_not() {
        let time_s: Vec<f64> = (0..1000).map(|i| 1e-3 * f64::from(i)).collect();
        let mut sigma = vec![0.01; 1000];
        sigma[200..260].fill(f64::NAN);
        let ring: Vec<f64> = time_s
            .iter()
            .map(|t| if *t < 0.26 { 0.0 } else { (-8.0 * (t - 0.26)).exp() * (TAU * 99.0 * t + 1.0).cos() })
            .collect();
        let omega = (TAU * 99.0).hypot(8.0);
        let mode = (omega / TAU, 8.0 / omega);
        let mut shown = vec![0.0; 1000];
        add(&time_s, &ring, &sigma, &mut shown, mode);
        let worst = (260..800).map(|i| (shown[i] - ring[i]).abs()).fold(0.0, f64::max);
        assert!(worst < 1e-6, "{worst}");
        let step: Vec<f64> = time_s.iter().map(|t| if *t < 0.26 { 0.0 } else { 1.0 }).collect();
        let mut shown = vec![0.0; 1000];
        add(&time_s, &step, &sigma, &mut shown, mode);
        let most = shown.iter().map(|x| x.abs()).fold(0.0, f64::max);
        assert!(most < 0.1, "{most}");
    }
}
