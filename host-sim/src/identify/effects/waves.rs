//! Waves over a position: which orders a residual has, and their columns.

use std::f64::consts::TAU;
use std::ops::Range;

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use crate::identify::balance::{Alternative, Balance, Company};
use crate::identify::contact::problem::FREEDOM;
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

/// Wave numbers that together with the base columns and those of `company` leave least, one after the other, at most `most`: for
/// a position that dwells at few values, where all orders look alike and only the whole balance tells them apart. With a phase
/// for each log where `own_phase` is set.
pub fn joint(
    balance: &Balance,
    position: &[f64],
    company: Company<'_>,
    candidates: &Candidates,
    most: usize,
    own_phase: bool,
) -> Vec<f64> {
    let used = &balance.used;
    let step = candidates.step();
    let y = balance.whitening.of(company.residual);
    let weight: Vec<f64> = y.iter().map(|r| (FREEDOM + 1.0) / (FREEDOM + r * r)).collect();
    // The rows over which a wave has one phase.
    let starts = if own_phase { balance.starts.as_slice() } else { &[0] };
    let ends = starts.iter().skip(1).copied().chain([usize::MAX]);
    let row = |point: usize| used.partition_point(|i| *i < point);
    let stretches: Vec<Range<usize>> =
        starts.iter().zip(ends).map(|(from, end)| row(*from)..row(end)).collect();
    let wave = |k: f64| -> [Vec<f64>; 2] {
        let mut columns = [vec![0.0; position.len()], vec![0.0; position.len()]];
        for i in used {
            (columns[1][*i], columns[0][*i]) = (k * position[*i]).sin_cos();
        }
        let mut white = balance.whitening.of_columns(&columns.each_ref()).into_iter();
        std::array::from_fn(|_| white.next().unwrap_or_default())
    };
    // Columns may be nearly the same where the position dwells.
    let ridged = |mut h: DMatrix<f64>| {
        for i in 0..h.nrows() {
            h[(i, i)] += 1e-6 * h[(i, i)] + f64::MIN_POSITIVE;
        }
        h
    };
    let known = balance.base.iter().map(|(_, column)| column);
    let known = known.chain(company.forms.iter().flat_map(|form| &form.columns));
    let mut columns = balance.whitening.of_columns(&known.collect::<Vec<_>>());
    let mut found = Vec::new();
    for _ in 0..most {
        // What a wave explains beside these columns, by Schur's complement: those are factored once for all waves.
        let (h, g) = linear::normal_equations(&columns, &weight, &y);
        let known = linear::factor(&ridged(h));
        let solved = known.solve(&g);
        let weighted: Vec<Vec<f64>> =
            columns.iter().map(|c| c.iter().zip(&weight).map(|(x, w)| x * w).collect()).collect();
        let explained = |k: &f64| -> f64 {
            let waves = wave(*k);
            let count = 2 * stretches.len();
            let mut across = DMatrix::zeros(weighted.len(), count);
            let mut own = DMatrix::zeros(count, count);
            let mut right = DVector::zeros(count);
            for (at, rows) in stretches.iter().enumerate() {
                let part = |values: &[f64]| values[rows.clone()].to_vec();
                let pair = waves.each_ref().map(|wave| part(wave));
                let (h, g) = linear::normal_equations(&pair, &weight[rows.clone()], &y[rows.clone()]);
                own.view_mut((2 * at, 2 * at), (2, 2)).copy_from(&h);
                right.rows_mut(2 * at, 2).copy_from(&g);
                for (of, wave) in pair.iter().enumerate() {
                    for (row, column) in weighted.iter().enumerate() {
                        across[(row, 2 * at + of)] = linear::dot(&column[rows.clone()], wave);
                    }
                }
            }
            let left = ridged(own) - across.transpose() * known.solve(&across);
            let right = right - across.transpose() * &solved;
            right.dot(&linear::factor(&left).solve(&right))
        };
        let best = |wave_numbers: &[f64]| {
            // Two waves nearer than that are one over the travel.
            let apart = |k: &f64| found.iter().all(|other: &f64| (k - other).abs() > 0.5 * step);
            let free = wave_numbers.par_iter().copied().filter(apart).map(|k| (explained(&k), k));
            free.max_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, k)| k)
        };
        let Some(k) = best(&candidates.wave_numbers).and_then(|k| best(&candidates.about(k))) else { break };
        found.push(k);
        let [cosine, sine] = wave(k);
        for rows in &stretches {
            let only = |values: &[f64]| -> Vec<f64> {
                values.iter().enumerate().map(|(i, x)| if rows.contains(&i) { *x } else { 0.0 }).collect()
            };
            columns.extend([only(&cosine), only(&sine)]);
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

/// Wave numbers that are tried, and others between them.
pub struct Candidates {
    /// Those that are tried, in steps of one size.
    pub wave_numbers: Vec<f64>,
    /// Into how many parts a step is divided about the best of them.
    pub parts: usize,
}

impl Candidates {
    /// How many there are in all.
    pub fn count(&self) -> usize {
        self.wave_numbers.len() * self.parts
    }

    /// Distance of two that are tried.
    fn step(&self) -> f64 {
        self.wave_numbers.get(1).map_or(0.0, |next| next - self.wave_numbers[0])
    }

    /// Those that are nearer to this one than to others which are tried.
    fn about(&self, k: f64) -> Vec<f64> {
        let step = self.step();
        let half = (self.parts / 2) as i32;
        (-half..=half).map(|part| k + f64::from(part) * step / self.parts as f64).collect()
    }
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
    use crate::identify::balance::tests::white_log;
    use crate::identify::noise::tests::white;

    #[test]
    fn the_orders_of_a_sum_of_waves_are_found_with_the_strongest_first() {
        let x: Vec<f64> = (0..4000).map(|i| 0.01 * f64::from(i)).collect();
        let noise = |i: usize| ((i * 7919 % 1000) as f64 / 1000.0 - 0.5) * 0.2;
        let r: Vec<f64> =
            x.iter().enumerate().map(|(i, x)| (5.0 * x).cos() + 0.4 * (12.0 * x).sin() + noise(i)).collect();
        let candidates: Vec<f64> = (1..40).map(f64::from).collect();
        assert_eq!(lines(&[x], &[r], &candidates, 4, 60.0), [5.0, 12.0]);
    }

    #[test]
    fn waves_with_a_phase_for_each_log_are_found_beside_a_balance_that_has_one_of_them() {
        const ROWS: usize = 1500;
        let position: Vec<f64> = (0..2 * ROWS).map(|i| 0.01 * (i % ROWS) as f64).collect();
        let phase = |i: usize| if i < ROWS { 0.3 } else { 2.1 };
        let noise = white(2 * ROWS, 5);
        // The base holds order 3 in one phase: what it takes is not told again.
        let of_base: Vec<f64> = position.iter().map(|x| (3.0 * x).cos()).collect();
        let residual: Vec<f64> = (0..2 * ROWS)
            .map(|i| {
                let x = position[i];
                4.0 * of_base[i] + (7.0 * x + phase(i)).cos() + 0.5 * (12.0 * x).sin() + 0.3 * noise[i]
            })
            .collect();
        let base = vec![(Parameter::amplitude("base", 10.0), of_base)];
        let balance =
            Balance::new(residual.clone(), base, &[white_log(ROWS, 0.3), white_log(ROWS, 0.3)], 1.0);
        let candidates = Candidates { wave_numbers: (1..30).map(f64::from).collect(), parts: 1 };
        let alone = Company { forms: &[], residual: &residual };
        let found = |own| joint(&balance, &position, alone, &candidates, 2, own);
        assert_eq!(found(true), [7.0, 12.0]);
        // What stands in the balance already is not found again.
        let seventh =
            [f64::cos, f64::sin].map(|of| position.iter().map(|x| of(7.0 * x)).collect::<Vec<f64>>());
        let apart = |wave: &Vec<f64>, log: usize| -> Vec<f64> {
            wave.iter().enumerate().map(|(i, w)| if i / ROWS == log { *w } else { 0.0 }).collect()
        };
        let columns: Vec<Vec<f64>> = seventh.iter().flat_map(|w| [apart(w, 0), apart(w, 1)]).collect();
        let parameters = (0..columns.len()).map(|n| Parameter::amplitude(n.to_string(), 1.0)).collect();
        let known = Alternative::columns("m1_ripple", parameters, columns);
        let beside = Company { forms: &[&known], residual: &residual };
        assert_eq!(joint(&balance, &position, beside, &candidates, 1, true), [12.0]);
        // In one phase, against the whole equations.
        let explained = |k: f64| {
            let scaled = |of: &dyn Fn(usize) -> f64| -> Vec<f64> {
                balance.used.iter().map(|i| of(*i) / balance.deviation[*i]).collect()
            };
            let columns = vec![
                scaled(&|i| balance.base[0].1[i]),
                scaled(&|i| (k * position[i]).cos()),
                scaled(&|i| (k * position[i]).sin()),
            ];
            let y = scaled(&|i| residual[i]);
            let weight: Vec<f64> = y.iter().map(|r| (FREEDOM + 1.0) / (FREEDOM + r * r)).collect();
            let (h, g) = linear::normal_equations(&columns, &weight, &y);
            g.dot(&linear::factor(&h).solve(&g))
        };
        let best = candidates
            .wave_numbers
            .iter()
            .copied()
            .filter(|k| *k > 3.5)
            .max_by(|a, b| explained(*a).total_cmp(&explained(*b)));
        assert_eq!(Some(found(false)[0]), best);
    }

    #[test]
    fn a_wave_between_those_that_are_tried_leaves_nothing_for_another_one() {
        const ROWS: usize = 3000;
        // Over 2.3 of a position that dwells at levels, where half a period is a step of 1.37.
        let position: Vec<f64> =
            (0..ROWS).map(|i| 0.3 * (i / 400) as f64 + 2e-4 * (i % 400) as f64).collect();
        let noise = white(ROWS, 3);
        let truth = 21.0 * 1.37 + 0.55;
        let residual: Vec<f64> =
            position.iter().zip(&noise).map(|(x, n)| (truth * x).sin() + 0.01 * n).collect();
        let base = vec![(Parameter::amplitude("base", 10.0), vec![1.0; ROWS])];
        let balance = Balance::new(residual.clone(), base, &[white_log(ROWS, 0.01)], 1.0);
        let company = Company { forms: &[], residual: &residual };
        let found = |parts: usize| {
            let wave_numbers = (2..60).map(|i| 1.37 * f64::from(i)).collect();
            joint(&balance, &position, company, &Candidates { wave_numbers, parts }, 2, false)
        };
        let (coarse, fine) = (found(1), found(8));
        assert!((coarse[0] - truth).abs() > 0.5, "{coarse:?}");
        assert!((fine[0] - truth).abs() < 0.5 * 1.37 / 8.0, "{fine:?}");
        // What is left of it is no second wave beside it.
        assert!((fine[1] - fine[0]).abs() > 0.5 * 1.37, "{fine:?}");
    }
}
