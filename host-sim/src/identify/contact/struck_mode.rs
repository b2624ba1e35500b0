//! A mode of the sensor that is struck by what is uncertain of the force.
//!
//! What a hypothesis does not know of the force from sample to sample passes the sensor's mode as the force does, and where
//! that is hardly damped it rings on: the residual e is no white noise, but
//!
//! e = x + n,  ẍ + 2ζω ẋ + ω² x = ω² u,  u white with the variance of the force's own error.
//!
//! Kalman's filter makes innovations of it, a map with determinant 1. What is known of the force strikes the mode as well, and
//! one that is not there would have to ring after each of its steps: the filter takes off no more than what the force's own
//! error can have struck, so that it does not take back what the mode was wrong to show.

use model_core::sensor::SecondOrder;

/// What rings on is no larger than so many deviations of what the force's error keeps up.
const MOST_DEVIATIONS: f64 = 3.0;

/// Innovations of residuals behind a mode (Hz, damping ratio); `of_force` and `of_all` are the variances of the force's error
/// and of the whole residual, sample by sample. What is not used tells nothing.
pub(super) fn innovations(
    residual: &mut [f64],
    (hz, zeta): (f64, f64),
    step_s: f64,
    of_force: &[f64],
    of_all: &[f64],
    used: &[bool],
) {
    let [[a, b], [c, d]] = SecondOrder::new(hz, zeta, step_s).transition();
    // Response to a unit of force that lasts from one sample to the next.
    let (u, v) = (1.0 - a, -c);
    let (mut x, mut y) = (0.0, 0.0);
    let mut known = [0.0; 3];
    // The same where nothing is seen.
    let mut struck = [0.0; 3];
    let on = |[p11, p12, p22]: [f64; 3], q: f64| {
        [
            a * a * p11 + 2.0 * a * b * p12 + b * b * p22 + u * u * q,
            a * c * p11 + (a * d + b * c) * p12 + b * d * p22 + u * v * q,
            c * c * p11 + 2.0 * c * d * p12 + d * d * p22 + v * v * q,
        ]
    };
    let per_omega = (std::f64::consts::TAU * hz).recip();
    for (((r, q), all), used) in residual.iter_mut().zip(of_force).zip(of_all).zip(used) {
        (x, y) = (a * x + b * y, c * x + d * y);
        struck = on(struck, *q);
        let [mut p11, mut p12, mut p22] = on(known, *q);
        *r -= x;
        if *used {
            let [k, l] = [p11, p12].map(|p| p / (p11 + (all - q).max(0.0)).max(f64::MIN_POSITIVE));
            x += k * *r;
            y += l * *r;
            p22 -= l * p12;
            p12 -= k * p12;
            p11 -= k * p11;
            let (size, most) =
                (x * x + (y * per_omega).powi(2), MOST_DEVIATIONS.powi(2) * struck[0].max(0.0));
            if size > most {
                let within = (most / size).sqrt();
                (x, y) = (x * within, y * within);
            }
        }
        known = [p11, p12, p22];
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::identify::filters::rms;
    use crate::identify::noise::tests::white;
    use model_core::sensor::SecondOrderState;

    const STEP_S: f64 = 1e-3;
    const NOISE: f64 = 0.02;

    /// White noise of the sensor beside a mode that a white force strikes.
    fn struck(mode: (f64, f64), force: f64) -> Vec<f64> {
        let ring = SecondOrder::new(mode.0, mode.1, STEP_S);
        let mut state = SecondOrderState::holding(0.0);
        let each = white(20_000, 1).into_iter().zip(white(20_000, 2));
        each.map(|(u, n)| ring.step(&mut state, force * u) + NOISE * n).collect()
    }

    fn left(mode: (f64, f64), force: f64, residual: &[f64]) -> Vec<f64> {
        let mut left = residual.to_vec();
        let (q, all) = (vec![force * force; left.len()], vec![force * force + NOISE * NOISE; left.len()]);
        innovations(&mut left, mode, STEP_S, &q, &all, &vec![true; residual.len()]);
        left
    }

    #[test]
    fn what_a_struck_mode_rings_with_is_known_but_for_what_is_new() {
        let (force, zeta) = (0.02, 0.003);
        let residual = struck((163.0, zeta), force);
        let known = left((163.0, zeta), force, &residual);
        let along: f64 = known.windows(2).map(|w| w[0] * w[1]).sum();
        let share = along / known.iter().map(|x| x * x).sum::<f64>();
        // White, within three deviations of what chance makes of it.
        assert!(share.abs() < 3.0 / (known.len() as f64).sqrt(), "{share}");
        assert!(rms(&known) < 0.3 * rms(&residual), "{} {}", rms(&known), rms(&residual));
        // No other mode knows it as well.
        for hz in [155.0, 171.0] {
            assert!(rms(&left((hz, zeta), force, &residual)) > rms(&known), "{hz}");
        }
    }

    #[test]
    fn a_swing_elsewhere_is_left() {
        let swing: Vec<f64> = (0..20_000).map(|i| (0.19 * f64::from(i)).sin()).collect();
        let left = rms(&left((163.0, 0.003), 0.02, &swing)) / rms(&swing);
        assert!(left > 0.9, "{left}");
    }

    #[test]
    fn a_hum_that_the_forces_error_cannot_strike_is_left() {
        // What the error keeps up is a twentieth of it.
        let hum: Vec<f64> = (0..20_000).map(|i| (0.314 * f64::from(i)).sin()).collect();
        let left = rms(&left((0.314 / STEP_S / std::f64::consts::TAU, 0.0025), 0.006, &hum)) / rms(&hum);
        assert!(left > 0.8, "{left}");
    }

    #[test]
    fn what_is_not_used_strikes_nothing() {
        let mut residual = vec![0.0; 100];
        residual[50] = 1.0;
        let mut used = vec![true; 100];
        used[50] = false;
        innovations(&mut residual, (163.0, 0.003), STEP_S, &[4e-4; 100], &[8e-4; 100], &used);
        assert!(residual[51..].iter().all(|x| *x == 0.0), "{residual:?}");
    }
}
