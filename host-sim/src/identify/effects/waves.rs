//! Waves over a position: which orders a residual has, and their columns.

use std::f64::consts::TAU;

use rayon::prelude::*;

use crate::identify::balance::{Alternative, Balance};
use crate::identify::linear;
use crate::identify::term::Parameter;

/// Wave numbers (radians per unit of position) at which a residual has a line, the strongest first, at most `most`.
///
/// `candidates` are tried one after the other on what the stronger ones leave; powers add up over the logs, since logs need
/// not share the position's zero. A line counts where its power is `over` times the median one.
pub fn lines(x: &[Vec<f64>], r: &[Vec<f64>], candidates: &[f64], most: usize, over: f64) -> Vec<f64> {
    let logs: Vec<(&Vec<f64>, &Vec<f64>)> = x.iter().zip(r).collect();
    let mut left: Vec<Vec<f64>> = r.to_vec();
    let mut found = Vec::new();
    for _ in 0..most {
        let powers: Vec<f64> = candidates
            .par_iter()
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
            r.iter_mut().zip(x.iter()).for_each(|(r, x)| {
                let (sin, cos) = (k * x).sin_cos();
                *r -= c * cos + s * sin;
            });
        }
    }
    found
}

/// Amplitude of a wave in a signal about its mean, by least squares, over all logs, each with a phase of its own.
pub fn amplitude(positions: &[&[f64]], signal: &[Vec<f64>], k: f64) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0);
    for (x, values) in positions.iter().zip(signal) {
        let columns: Vec<Vec<f64>> = [f64::cos as fn(f64) -> f64, f64::sin, |_| 1.0]
            .into_iter()
            .map(|wave| x.iter().map(|x| wave(k * x)).collect())
            .collect();
        // Each stretch of the way counts as much as another, however long the motion dwells there.
        let way: Vec<f64> = (0..x.len()).map(|i| (x[(i + 1).min(x.len() - 1)] - x[i]).abs()).collect();
        let (h, g) = linear::normal_equations(&columns, &way, values);
        let p = linear::factor(&h).solve(&g);
        let travelled: f64 = way.iter().sum();
        sum += (p[0] * p[0] + p[1] * p[1]) * travelled;
        count += travelled;
    }
    (sum / f64::max(count, f64::MIN_POSITIVE)).sqrt()
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

/// Position and residual at the rows of each log.
pub fn picked(balance: &Balance, position: &[f64], residual: &[f64]) -> (Vec<Vec<f64>>, Vec<Vec<f64>>) {
    let at = |values: &[f64], rows: &[usize]| rows.iter().map(|i| values[*i]).collect::<Vec<f64>>();
    let rows = balance.rows_of_logs();
    (
        rows.iter().map(|rows| at(position, rows)).collect(),
        rows.iter().map(|rows| at(residual, rows)).collect(),
    )
}

/// Waves over a position as columns of a balance.
pub struct Waves<'a> {
    /// The effect's id.
    pub effect: &'static str,
    /// Position in each log.
    pub positions: &'a [&'a [f64]],
    /// A log's signal through the balance's filter.
    pub filtered: &'a dyn Fn(usize, &[f64]) -> Vec<f64>,
    /// A large amplitude.
    pub size: f64,
    /// Whether the position is an angle.
    pub rotary: bool,
}

impl Waves<'_> {
    /// Waves of these orders, chosen among `candidates`: with one phase for all logs, and with one for each.
    pub fn alternatives(&self, orders: &[f64], candidates: usize) -> Vec<Alternative> {
        if orders.is_empty() {
            return Vec::new();
        }
        [false, true].into_iter().map(|own| self.alternative(orders, candidates, own)).collect()
    }

    /// Waves of these orders, chosen among `candidates`, with one phase for all logs or one for each.
    pub fn alternative(&self, orders: &[f64], candidates: usize, own_phase: bool) -> Alternative {
        let (form, logs) = if own_phase {
            ("a phase for each log", (0..self.positions.len()).map(Some).collect())
        } else {
            ("one phase", vec![None])
        };
        let (mut columns, mut parameters) = (Vec::new(), Vec::new());
        for only in logs {
            let log = only.map_or(String::new(), |log| format!("_log{}", log + 1));
            for (i, k) in orders.iter().enumerate() {
                for (name, sine) in [("cos", false), ("sin", true)] {
                    let column = self.positions.iter().enumerate().flat_map(|(at, x)| {
                        if only.is_some_and(|only| only != at) {
                            return vec![0.0; x.len()];
                        }
                        let wave = |x: &f64| if sine { (k * x).sin() } else { (k * x).cos() };
                        (self.filtered)(at, &x.iter().map(wave).collect::<Vec<_>>())
                    });
                    columns.push(column.collect());
                    parameters.push(Parameter::amplitude(format!("{name}_{}{log}", i + 1), self.size));
                }
            }
        }
        let orders_count = orders.len();
        // Where each log has a phase of its own, its waves do not lie on each other.
        let coordinate = orders.first().filter(|_| !own_phase || self.positions.len() == 1).map(|k| {
            let within = |x: &f64| x.rem_euclid(TAU / k);
            let name = if self.rotary {
                format!("angle within a wave of order {k:.2}, rad")
            } else {
                format!("position within a wave of {:.2} mm, m", 1e3 * TAU / k)
            };
            (name, self.positions.iter().flat_map(|x| x.iter().map(within)).collect())
        });
        // In the order in which the parameters stand: log after log, order after order, cosine and sine.
        let same_amplitude = if own_phase && self.positions.len() > 1 {
            let places = |order: usize| {
                (0..self.positions.len()).map(move |log| {
                    let first = 2 * (log * orders_count + order);
                    [first, first + 1]
                })
            };
            (0..orders_count).map(|order| places(order).collect()).collect()
        } else {
            Vec::new()
        };
        let constant = |(i, k): (usize, &f64)| {
            if self.rotary {
                (format!("order_{}", i + 1), *k)
            } else {
                (format!("wavelength_{}", i + 1), TAU / k)
            }
        };
        Alternative {
            form: format!("{orders_count} orders, {form}"),
            same_amplitude,
            constants: orders.iter().enumerate().map(constant).collect(),
            // The orders were chosen among so many.
            log_prior: -(orders_count as f64) * (candidates.max(1) as f64).ln(),
            coordinate,
            ..Alternative::columns(self.effect, parameters, columns)
        }
    }
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
        assert_eq!(lines(&[x], &[r], &candidates, 4, 60.0), [5.0, 12.0]);
    }
}
