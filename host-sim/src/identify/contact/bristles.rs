//! The force of bristles that follow the root itself, without a block between (LuGre).
//!
//! ż = V (1 − sgn(V) k z/(F_N g(|V|))), F = k z + c ż + F_N a2 V + film V
//!
//! Over a step z goes exponentially to F_N g/k with the way, so the equation forgets what it began with over some
//! micrometres and can be followed in open loop. A Kalman filter pulls it to the measurement as far as the noise of the
//! root's way makes z uncertain: where the contact slides that is not at all, at rest it may be all.
//! Left out: what the root did between samples.

use wide::f64x4;

use super::law::Contact;
use super::observer::{Drive, Observed, SLIP_NOISES, least_load_n};

/// Over so many of the bristles' own ways nothing is left of where they were, nor of a bend over so many of its widths: e⁻³⁷ < 2⁻⁵³.
pub(super) const FORGOTTEN: f64 = 37.0;
/// Points of Gauss and Hermite over the noise of the way: deviations from the mean, and weights; the fourth is none.
const OFF: [f64; 4] = [0.0, 1.732_050_807_568_877_2, -1.732_050_807_568_877_2, 0.0];
const WEIGHTS: [f64; 4] = [2.0 / 3.0, 1.0 / 6.0, 1.0 / 6.0, 0.0];

/// Runs over a log.
pub(super) fn follow(contact: &Contact, drive: &Drive<'_>) -> Observed {
    let n = drive.root_m.len();
    let (dt, k, c) = (drive.step_s, contact.stiffness_n_per_m, contact.damping_n_s_per_m);
    let force = drive.force_n;
    let mut out = Observed::new(n);
    out.force_n[0] = force[0];
    let (per_load, film) = contact.viscous;
    let least_load = least_load_n(drive);
    let (speed_noise, channel) = (drive.noise.0, drive.noise.1.powi(2).max(1e-24));
    let mut held_n = force[0];
    let mut variance = channel;
    let mut age = contact.ageing.map(|ageing| ageing.first_age_s);
    let off = f64x4::from(OFF) * f64x4::splat(speed_noise * dt);
    for i in 1..n {
        let way = drive.root_m[i] - drive.root_m[i - 1];
        let v = 0.5 * (way + drive.root_m[(i + 1).min(n - 1)] - drive.root_m[i.min(n - 2)]) / dt;
        // Noise makes a speed near zero look faster than it is.
        let speed = (v * v - speed_noise * speed_noise).max(0.0).sqrt();
        let load = drive.load_n[i];
        if load <= least_load {
            (held_n, variance) = (0.0, channel);
            out.slip_m_s[i] = v;
            out.sliding[i] = 1.0;
            continue;
        }
        let mut limit = drive.factor.map_or(load, |factor| load * factor[i]);
        if let (Some(ageing), Some(age)) = (&contact.ageing, age) {
            limit *= ageing.factor(age);
        }
        limit *= contact.curve.at(speed);

        // The bristles, and how the noise of the way makes them uncertain: over a reversal it is the direction itself.
        let ways = f64x4::splat(way) + off;
        let target = f64x4::splat(limit).copysign(ways);
        let left = (ways.abs() * f64x4::splat(-k / limit)).max(f64x4::splat(-FORGOTTEN)).exp();
        let points = target + (f64x4::splat(held_n) - target) * left;
        let weights = f64x4::from(WEIGHTS);
        let mean = (weights * points).reduce_add();
        let off_mean = points - f64x4::splat(mean);
        let [left, ..] = left.to_array();
        variance = left * left * variance + (weights * off_mean * off_mean).reduce_add();
        held_n = mean;

        let direction = 1f64.copysign(way);
        let share = (direction * held_n / limit).clamp(0.0, 1.0);
        let shown = held_n + c * v * (1.0 - share) + (per_load * load + film) * v;
        out.force_n[i] = shown;
        out.slip_m_s[i] = v * share;
        // What noise alone moves does not slip.
        let slips = if v.abs() > SLIP_NOISES * speed_noise { share } else { 0.0 };
        out.sliding[i] = slips;
        out.certainty[i] = (channel / (variance + channel)).sqrt();
        let gain = variance / (variance + channel);
        held_n += gain * drive.innovation_n(i, shown);
        if !drive.at_end(i) {
            variance *= 1.0 - gain;
        }
        if let (Some(ageing), Some(age)) = (&contact.ageing, &mut age) {
            *age = ageing.renewed(*age, v.abs() * slips, dt);
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::identify::contact::law::Curve;
    use crate::identify::noise::White;

    const STEP_S: f64 = 1e-3;
    const LOAD_N: f64 = 50.0;
    const STIFFNESS_N_PER_M: f64 = 1e7;

    fn coefficient(slip_m_s: f64) -> f64 {
        0.6 + 0.6 * (-(slip_m_s / 0.3).sqrt()).exp()
    }

    fn contact(stiffness_n_per_m: f64, bristles_alone: bool) -> Contact {
        Contact {
            curve: Curve::new(coefficient),
            stiffness_n_per_m,
            damping_n_s_per_m: 0.0,
            bristles_n_per_m: f64::INFINITY,
            bristles_alone,
            slips_on: false,
            branches: [(0.0, 1.0); 3],
            viscous: (0.0, 0.0),
            ageing: None,
        }
    }

    fn drive<'a>(root_m: &'a [f64], force_n: &'a [f64], load_n: &'a [f64], noise: (f64, f64)) -> Drive<'a> {
        Drive {
            step_s: STEP_S,
            root_m,
            load_n,
            force_n,
            ends: None,
            factor: None,
            slip_threshold_m_s: 5e-3,
            late: 0.0,
            smoothed: &[],
            noise,
            unsure_m_s: 0.0,
        }
    }

    /// Slow reversals of LuGre's equation, integrated in steps of half a microsecond.
    #[test]
    fn slow_reversals_are_followed() {
        const FINE: usize = 2000;
        let root = |t: f64| 0.02 * (1.0 - (3.0 * t).cos()) / 3.0;
        let (mut z, mut root_m, mut force_n) = (0.0, Vec::new(), Vec::new());
        for i in 0..2000 * FINE {
            let t = i as f64 * STEP_S / FINE as f64;
            if i % FINE == 0 {
                root_m.push(root(t));
                force_n.push(STIFFNESS_N_PER_M * z);
            }
            let v = 0.02 * (3.0 * t).sin();
            z += STEP_S / FINE as f64
                * (v - v.abs() * STIFFNESS_N_PER_M * z / (LOAD_N * coefficient(v.abs())));
        }
        let load_n = [LOAD_N; 2000];
        let worst = |bristles_alone: bool| {
            let seen = super::super::observer::observe(
                &contact(STIFFNESS_N_PER_M, bristles_alone),
                &drive(&root_m, &force_n, &load_n, (1e-5, 0.02)),
            );
            let error = |i: usize| seen.certainty[i] * (seen.force_n[i] - force_n[i]).abs() / LOAD_N;
            (5..2000).map(error).fold(0.0, f64::max)
        };
        assert!(worst(true) < 0.01, "{}", worst(true));
        // A tip that sticks up to its limit and breaks away then is another thing.
        assert!(worst(false) > 0.04, "{}", worst(false));
    }

    /// At rest the noise of the root's way comes through the stiffness, and the certainty is as much less.
    #[test]
    fn a_stiffness_has_no_weight_where_the_disc_rests() {
        const NOISE: (f64, f64) = (3e-4, 0.1);
        let mut white = White::new(3);
        let root_m: Vec<f64> = (0..4000)
            .scan(0.0, |at, _| {
                *at += NOISE.0 * STEP_S * white.next();
                Some(*at)
            })
            .collect();
        let force_n: Vec<f64> = (0..4000).map(|_| 20.0 + NOISE.1 * white.next()).collect();
        let load_n = [LOAD_N; 4000];
        let left = |stiffness: f64, by_certainty: bool| {
            let seen = follow(&contact(stiffness, true), &drive(&root_m, &force_n, &load_n, NOISE));
            let square = |i: usize| {
                let certainty = if by_certainty { seen.certainty[i] } else { 1.0 };
                (certainty * (force_n[i] - seen.force_n[i])).powi(2)
            };
            ((5..4000).map(square).sum::<f64>() / 3995.0).sqrt() / NOISE.1
        };
        let ratio = left(1e7, true) / left(1e6, true);
        assert!((0.7..1.4).contains(&ratio), "{ratio}");
        let ratio = left(1e7, false) / left(1e6, false);
        assert!(ratio > 3.0, "{ratio}");
    }
}
