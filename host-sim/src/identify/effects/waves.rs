//! Waves over a position: which orders a residual has, and their columns.

use std::f64::consts::TAU;

use rayon::prelude::*;

use crate::identify::balance::{Alternative, Balance};
use crate::identify::linear;
use crate::identify::term::Parameter;

/// End of the name of a wave number whose amplitude is in proportion to the effort.
const OF_EFFORT: &str = "_of_effort";

/// A wave over a position.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wave {
    /// Its wave number, radians per unit of position.
    pub number: f64,
    /// Whether its amplitude is in proportion to the effort.
    pub of_effort: bool,
}

impl Wave {
    /// One whose amplitude is the same at every effort.
    pub fn steady(number: f64) -> Self {
        Self { number, of_effort: false }
    }

    /// What its amplitude is multiplied with at a point.
    fn size(self, effort: Option<&[f64]>, at: usize) -> f64 {
        effort.filter(|_| self.of_effort).map_or(1.0, |effort| effort[at])
    }
}

/// Waves in a residual, the strongest first, at most `most`.
///
/// `candidates` are wave numbers, tried one after the other on what the stronger ones leave, with a steady amplitude and, where
/// there are `efforts`, with one in proportion to these; powers add up over the logs, since logs need not share the position's
/// zero. A line counts where its power is `over` times the median one.
pub fn lines(
    x: &[Vec<f64>],
    r: &[Vec<f64>],
    efforts: &[Vec<f64>],
    candidates: &[f64],
    most: usize,
    over: f64,
) -> Vec<Wave> {
    let mut logs: Vec<Seen<'_>> = x
        .iter()
        .zip(r)
        .enumerate()
        .map(|(log, (x, r))| Seen { x, left: r.clone(), effort: efforts.get(log).map(Vec::as_slice) })
        .collect();
    let kinds = if efforts.is_empty() { 1 } else { 2 };
    let mut found = Vec::new();
    for _ in 0..most {
        let of_number = |number: &f64| -> Vec<(Wave, f64)> {
            let mut powers = [0.0; 2];
            for log in &logs {
                for (power, (c, s, square)) in powers.iter_mut().zip(log.products(*number)) {
                    *power += (c * c + s * s) / square.max(f64::MIN_POSITIVE);
                }
            }
            let waves = [false, true].map(|of_effort| Wave { number: *number, of_effort });
            waves.into_iter().zip(powers).take(kinds).collect()
        };
        let powers: Vec<(Wave, f64)> = candidates.par_iter().flat_map_iter(of_number).collect();
        let mut sorted: Vec<f64> = powers.iter().map(|(_, power)| *power).collect();
        sorted.sort_by(f64::total_cmp);
        let median = sorted.get(sorted.len() / 2).copied().unwrap_or(0.0);
        let Some((wave, power)) = powers.into_iter().max_by(|a, b| a.1.total_cmp(&b.1)) else {
            break;
        };
        if power <= over * median || found.contains(&wave) {
            break;
        }
        found.push(wave);
        logs.iter_mut().for_each(|log| log.take_off(wave));
    }
    found
}

/// What waves are looked for in.
struct Seen<'a> {
    x: &'a [f64],
    left: Vec<f64>,
    effort: Option<&'a [f64]>,
}

impl Seen<'_> {
    /// Products with cosine and sine, and the sum of squares of either, of a wave that is steady, and of one in proportion to the
    /// effort.
    fn products(&self, number: f64) -> [(f64, f64, f64); 2] {
        let mut sums = [(0.0, 0.0, 0.0); 2];
        for (i, (x, left)) in self.x.iter().zip(&self.left).enumerate() {
            let (sin, cos) = (number * x).sin_cos();
            for (sum, size) in sums.iter_mut().zip([1.0, self.effort.map_or(0.0, |effort| effort[i])]) {
                sum.0 += size * left * cos;
                sum.1 += size * left * sin;
                sum.2 += 0.5 * size * size;
            }
        }
        sums
    }

    fn take_off(&mut self, wave: Wave) {
        let (c, s, square) = self.products(wave.number)[usize::from(wave.of_effort)];
        for (i, (x, left)) in self.x.iter().zip(&mut self.left).enumerate() {
            let (sin, cos) = (wave.number * x).sin_cos();
            *left -= wave.size(self.effort, i) * (c * cos + s * sin) / square.max(f64::MIN_POSITIVE);
        }
    }
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

/// Wave numbers of a length: half a period apart over the travel, up to `periods` of it.
pub fn of_travel(travel: f64, periods: usize) -> Vec<f64> {
    (2..2 * periods).map(|i| TAU * 0.5 * i as f64 / travel.max(1e-12)).collect()
}

/// Values of all points of all logs at the rows of each log.
pub fn picked(balance: &Balance, values: &[f64]) -> Vec<Vec<f64>> {
    balance.rows_of_logs().iter().map(|rows| rows.iter().map(|i| values[*i]).collect()).collect()
}

/// Waves over a position as columns of a balance.
pub struct Waves<'a> {
    /// The effect's id.
    pub effect: &'static str,
    /// Position in each log.
    pub positions: &'a [&'a [f64]],
    /// Effort in each log, relative to what it usually is; none where no amplitude is in proportion to it.
    pub efforts: &'a [Vec<f64>],
    /// A log's signal through the balance's filter.
    pub filtered: &'a dyn Fn(usize, &[f64]) -> Vec<f64>,
    /// A large amplitude.
    pub size: f64,
    /// Whether the position is an angle.
    pub rotary: bool,
}

impl Waves<'_> {
    /// Waves of these orders, chosen among `candidates`: with one phase for all logs, and with one for each.
    pub fn alternatives(&self, orders: &[Wave], candidates: usize) -> Vec<Alternative> {
        if orders.is_empty() {
            return Vec::new();
        }
        [false, true].into_iter().map(|own| self.alternative(orders, candidates, own)).collect()
    }

    /// Waves of these orders, chosen among `candidates`, with one phase for all logs or one for each.
    pub fn alternative(&self, orders: &[Wave], candidates: usize, own_phase: bool) -> Alternative {
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
                        let effort = self.efforts.get(at).map(Vec::as_slice);
                        let wave = |(i, x): (usize, &f64)| {
                            let turn = k.number * x;
                            k.size(effort, i) * if sine { turn.sin() } else { turn.cos() }
                        };
                        (self.filtered)(at, &x.iter().enumerate().map(wave).collect::<Vec<_>>())
                    });
                    columns.push(column.collect());
                    parameters.push(Parameter::amplitude(format!("{name}_{}{log}", i + 1), self.size));
                }
            }
        }
        let orders_count = orders.len();
        // Where each log has a phase of its own, its waves do not lie on each other.
        let coordinate = orders.first().filter(|_| !own_phase || self.positions.len() == 1).map(|wave| {
            let k = wave.number;
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
        let constant = |(i, wave): (usize, &Wave)| {
            let of_effort = if wave.of_effort { OF_EFFORT } else { "" };
            if self.rotary {
                (format!("order_{}{of_effort}", i + 1), wave.number)
            } else {
                (format!("wavelength_{}{of_effort}", i + 1), TAU / wave.number)
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

/// The waves of a shape found on other logs.
pub fn fixed(constants: &[(String, f64)]) -> Vec<Wave> {
    let wave = |(name, value): &(String, f64)| {
        let length = name.starts_with("wavelength");
        let number = if length { TAU / value } else { *value };
        (length || name.starts_with("order")).then(|| Wave { number, of_effort: name.ends_with(OF_EFFORT) })
    };
    constants.iter().filter_map(wave).collect()
}

/// Travel of a position.
pub fn travel(values: impl Iterator<Item = f64>) -> f64 {
    let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
    if high > low { high - low } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::identify::noise::tests::white;

    #[test]
    fn the_orders_of_a_sum_of_waves_are_found_with_the_strongest_first() {
        let x: Vec<f64> = (0..4000).map(|i| 0.01 * f64::from(i)).collect();
        let noise = white(x.len(), 3);
        let effort: Vec<f64> = (0..4000).map(|i| (0.7 + 0.004 * f64::from(i)).sin()).collect();
        let r = |of_effort: f64| -> Vec<Vec<f64>> {
            let waves = |(i, x): (usize, &f64)| {
                (5.0 * x).cos() + (0.4 + of_effort * (effort[i] - 0.4)) * (12.0 * x).sin() + 0.06 * noise[i]
            };
            vec![x.iter().enumerate().map(waves).collect()]
        };
        let candidates: Vec<f64> = (1..40).map(f64::from).collect();
        let found = |of_effort: f64, efforts: &[Vec<f64>]| {
            lines(std::slice::from_ref(&x), &r(of_effort), efforts, &candidates, 4, 60.0)
        };
        let [steady, of_effort] = [false, true].map(|of_effort| Wave { number: 12.0, of_effort });
        assert_eq!(found(0.0, &[]), [Wave::steady(5.0), steady]);
        let efforts = [effort.clone()];
        assert_eq!(found(0.0, &efforts), [Wave::steady(5.0), steady]);
        assert_eq!(found(1.0, &efforts), [Wave::steady(5.0), of_effort]);
    }

    #[test]
    fn a_shape_is_read_back_as_it_is_told() {
        let waves = [Wave::steady(6.0), Wave { number: 5.0, of_effort: true }];
        let (positions, efforts) = ([&[0.1, 0.2][..]], [vec![1.0, -2.0]]);
        for rotary in [true, false] {
            let make = Waves {
                effect: "ripple",
                positions: &positions,
                efforts: &efforts,
                filtered: &|_, values| values.to_vec(),
                size: 1.0,
                rotary,
            };
            let form = make.alternative(&waves, 1, false);
            let read = fixed(&form.constants);
            let same =
                |(a, b): (&Wave, &Wave)| (a.number - b.number).abs() < 1e-12 && a.of_effort == b.of_effort;
            assert!(read.len() == 2 && read.iter().zip(&waves).all(same), "{read:?}");
            assert_eq!(form.columns[2], [0.5f64.cos(), -2.0 * 1f64.cos()]);
        }
    }
}
