//! Waves over a position: which orders a residual has, and their columns.

use std::f64::consts::TAU;

/// Wave numbers (radians per unit of position) at which a residual has a line, the strongest first, at most `most`.
///
/// `candidates` are tried one after the other on what the stronger ones leave; powers add up over the logs, since logs need
/// not share the position's zero. A line counts where its power is `over` times the median one.
pub fn lines(logs: &[(&[f64], &[f64])], candidates: &[f64], most: usize, over: f64) -> Vec<f64> {
    let mut left: Vec<Vec<f64>> = logs.iter().map(|(_, r)| r.to_vec()).collect();
    let mut found = Vec::new();
    for _ in 0..most {
        let powers: Vec<f64> = candidates
            .iter()
            .map(|k| {
                logs.iter()
                    .zip(&left)
                    .map(|((x, _), r)| {
                        let (c, s) = coefficients(x, r, *k);
                        (c * c + s * s) * x.len() as f64
                    })
                    .sum::<f64>()
            })
            .collect();
        let mut sorted = powers.clone();
        sorted.sort_by(f64::total_cmp);
        let median = sorted.get(sorted.len() / 2).copied().unwrap_or(0.0);
        let Some((at, power)) = powers.iter().copied().enumerate().max_by(|a, b| a.1.total_cmp(&b.1)) else {
            break;
        };
        if power <= over * median || found.contains(&candidates[at]) {
            break;
        }
        let k = candidates[at];
        found.push(k);
        for ((x, _), r) in logs.iter().zip(&mut left) {
            let (c, s) = coefficients(x, r, k);
            r.iter_mut().zip(*x).for_each(|(r, x)| {
                let (sin, cos) = (k * x).sin_cos();
                *r -= c * cos + s * sin;
            });
        }
    }
    found
}

fn coefficients(x: &[f64], r: &[f64], k: f64) -> (f64, f64) {
    let (mut c, mut s) = (0.0, 0.0);
    for (x, r) in x.iter().zip(r) {
        let (sin, cos) = (k * x).sin_cos();
        c += r * cos;
        s += r * sin;
    }
    let n = 0.5 * x.len().max(1) as f64;
    (c / n, s / n)
}

/// Wave numbers of a length: half a period apart over the travel, up to `periods` of it.
pub fn of_travel(travel: f64, periods: usize) -> Vec<f64> {
    (2..2 * periods).map(|i| TAU * 0.5 * i as f64 / travel.max(1e-12)).collect()
}

/// Travel of a position.
pub fn travel(values: impl Iterator<Item = f64>) -> f64 {
    let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
    if high > low { high - low } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_orders_of_a_sum_of_waves_are_found_with_the_strongest_first() {
        let x: Vec<f64> = (0..4000).map(|i| 0.01 * f64::from(i)).collect();
        let noise = |i: usize| ((i * 7919 % 1000) as f64 / 1000.0 - 0.5) * 0.2;
        let r: Vec<f64> =
            x.iter().enumerate().map(|(i, x)| (5.0 * x).cos() + 0.4 * (12.0 * x).sin() + noise(i)).collect();
        let candidates: Vec<f64> = (1..40).map(f64::from).collect();
        assert_eq!(lines(&[(&x, &r)], &candidates, 4, 60.0), [5.0, 12.0]);
    }
}
