//! Waves over a position that dwells at few values, where all orders look alike: only the whole balance tells them apart.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use crate::identify::balance::{Balance, Company};
use crate::identify::contact::problem::student_weight;
use crate::identify::linear;

/// Steps by which wave numbers are moved between those that were tried, at most: each squares what is left of a radian's error, and
/// no further step is taken where one gains nothing.
const STEPS: usize = 6;

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

/// A balance in which waves over a position are looked for, beside its base columns and those that stand in it already.
pub struct Joint<'a> {
    balance: &'a Balance,
    position: &'a [f64],
    /// Rows over which a wave has one phase.
    stretches: Vec<Range<usize>>,
    /// What the base and the others leave, whitened.
    y: Vec<f64>,
    weight: Vec<f64>,
    /// Columns of the base and of the others, whitened.
    known: Vec<Vec<f64>>,
}

impl<'a> Joint<'a> {
    /// With a phase for each log where `own_phase` is set.
    pub fn new(balance: &'a Balance, position: &'a [f64], company: Company<'_>, own_phase: bool) -> Self {
        let y = balance.whitening.of(company.residual);
        let starts = if own_phase { balance.starts.as_slice() } else { &[0] };
        let ends = starts.iter().skip(1).copied().chain([usize::MAX]);
        let row = |point: usize| balance.used.partition_point(|i| *i < point);
        let known = balance.base.iter().map(|(_, column)| column);
        let known = known.chain(company.forms.iter().flat_map(|form| &form.columns));
        Self {
            balance,
            position,
            stretches: starts.iter().zip(ends).map(|(from, end)| row(*from)..row(end)).collect(),
            weight: y.iter().copied().map(student_weight).collect(),
            y,
            known: balance.whitening.of_columns(&known.collect::<Vec<_>>()),
        }
    }

    /// Two functions of the position, whitened.
    fn whitened(&self, of: impl Fn(f64) -> [f64; 2]) -> [Vec<f64>; 2] {
        let mut columns = [vec![0.0; self.position.len()], vec![0.0; self.position.len()]];
        for i in &self.balance.used {
            [columns[0][*i], columns[1][*i]] = of(self.position[*i]);
        }
        let mut white = self.balance.whitening.of_columns(&columns.each_ref()).into_iter();
        std::array::from_fn(|_| white.next().unwrap_or_default())
    }

    fn wave(&self, k: f64) -> [Vec<f64>; 2] {
        self.whitened(|x| [(k * x).cos(), (k * x).sin()])
    }

    /// The pair of columns in each of the stretches alone.
    fn apart(&self, pair: &[Vec<f64>; 2]) -> Vec<Vec<f64>> {
        let only = |rows: &Range<usize>, values: &[f64]| -> Vec<f64> {
            values.iter().enumerate().map(|(i, x)| if rows.contains(&i) { *x } else { 0.0 }).collect()
        };
        self.stretches.iter().flat_map(|rows| pair.each_ref().map(|wave| only(rows, wave))).collect()
    }

    /// Wave numbers that together leave least, one after the other, at most `most`.
    pub fn orders(&self, candidates: &Candidates, most: usize) -> Vec<f64> {
        let step = candidates.step();
        let mut columns = self.known.clone();
        let mut found = Vec::new();
        for _ in 0..most {
            // What a wave explains beside these columns, by Schur's complement: those are factored once for all waves.
            let (h, g) = linear::normal_equations(&columns, &self.weight, &self.y);
            let known = linear::factor(&ridged(h));
            let solved = known.solve(&g);
            let weighted: Vec<Vec<f64>> =
                columns.iter().map(|c| c.iter().zip(&self.weight).map(|(x, w)| x * w).collect()).collect();
            let explained = |k: &f64| -> f64 {
                let waves = self.wave(*k);
                let count = 2 * self.stretches.len();
                let mut across = DMatrix::zeros(weighted.len(), count);
                let mut own = DMatrix::zeros(count, count);
                let mut right = DVector::zeros(count);
                for (at, rows) in self.stretches.iter().enumerate() {
                    let part = |values: &[f64]| values[rows.clone()].to_vec();
                    let pair = waves.each_ref().map(|wave| part(wave));
                    let (h, g) =
                        linear::normal_equations(&pair, &self.weight[rows.clone()], &self.y[rows.clone()]);
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
            let Some(k) = best(&candidates.wave_numbers).and_then(|k| best(&candidates.about(k))) else {
                break;
            };
            found.push(k);
            columns.extend(self.apart(&self.wave(k)));
        }
        found
    }

    /// Columns of what is known, and of these waves.
    fn columns_of(&self, orders: &[f64]) -> Vec<Vec<f64>> {
        let waves = orders.iter().flat_map(|k| self.apart(&self.wave(*k)));
        self.known.iter().cloned().chain(waves).collect()
    }

    /// What columns explain, and their values.
    fn solved(&self, columns: &[Vec<f64>]) -> (f64, DVector<f64>) {
        let (h, g) = linear::normal_equations(columns, &self.weight, &self.y);
        let p = linear::factor(&ridged(h)).solve(&g);
        (g.dot(&p), p)
    }

    /// The steepest slope of a single one of these waves, fitted together, per unit of the position.
    pub fn steepest(&self, orders: &[f64]) -> f64 {
        let (_, p) = self.solved(&self.columns_of(orders));
        let slopes = orders.iter().enumerate().flat_map(|(at, k)| {
            let from = self.known.len() + 2 * at * self.stretches.len();
            let of_stretch = move |stretch| (from + 2 * stretch, *k);
            (0..self.stretches.len()).map(of_stretch)
        });
        slopes.map(|(at, k)| k * p[at].hypot(p[at + 1])).fold(0.0, f64::max)
    }

    /// These wave numbers moved to where the waves together leave least, by Gauss–Newton, no further than half of the step between
    /// two that are tried, and not below the lowest of those.
    pub fn sharpened(&self, orders: &[f64], candidates: &Candidates) -> Vec<f64> {
        let of_wave = 2 * self.stretches.len();
        let (within, lowest) =
            (0.5 * candidates.step(), candidates.wave_numbers.first().copied().unwrap_or(0.0));
        let mut best = orders.to_vec();
        let mut columns = self.columns_of(&best);
        let (mut explained, mut p) = self.solved(&columns);
        for _ in 0..STEPS {
            let moves: Vec<Vec<f64>> = best
                .iter()
                .enumerate()
                .map(|(at, k)| {
                    let [down, up] = self.whitened(|x| [-x * (k * x).sin(), x * (k * x).cos()]);
                    let mut slope = vec![0.0; self.y.len()];
                    for (stretch, rows) in self.stretches.iter().enumerate() {
                        let from = self.known.len() + at * of_wave + 2 * stretch;
                        for i in rows.clone() {
                            slope[i] = p[from] * down[i] + p[from + 1] * up[i];
                        }
                    }
                    slope
                })
                .collect();
            let count = columns.len();
            columns.extend(moves);
            let (_, with_moves) = self.solved(&columns);
            let next: Vec<f64> = best
                .iter()
                .zip(orders)
                .enumerate()
                .map(|(at, (k, from))| {
                    (k + with_moves[count + at]).min(from + within).max(from - within).max(lowest)
                })
                .collect();
            columns = self.columns_of(&next);
            let (by_next, of_next) = self.solved(&columns);
            if by_next <= explained {
                break;
            }
            (best, explained, p) = (next, by_next, of_next);
        }
        best
    }
}

/// Columns may be nearly the same where the position dwells.
fn ridged(mut h: DMatrix<f64>) -> DMatrix<f64> {
    for i in 0..h.nrows() {
        h[(i, i)] += 1e-6 * h[(i, i)] + f64::MIN_POSITIVE;
    }
    h
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::identify::balance::Alternative;
    use crate::identify::balance::tests::white_log;
    use crate::identify::noise::tests::white;
    use crate::identify::term::Parameter;

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
        let found = |own| Joint::new(&balance, &position, alone, own).orders(&candidates, 2);
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
        assert_eq!(Joint::new(&balance, &position, beside, true).orders(&candidates, 1), [12.0]);
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
            let weight: Vec<f64> = y.iter().copied().map(student_weight).collect();
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
            Joint::new(&balance, &position, company, false).orders(&Candidates { wave_numbers, parts }, 2)
        };
        let (coarse, fine) = (found(1), found(8));
        assert!((coarse[0] - truth).abs() > 0.5, "{coarse:?}");
        assert!((fine[0] - truth).abs() < 0.5 * 1.37 / 8.0, "{fine:?}");
        // What is left of it is no second wave beside it.
        assert!((fine[1] - fine[0]).abs() > 0.5 * 1.37, "{fine:?}");
    }

    #[test]
    fn the_steepest_wave_is_told_where_waves_nearly_cancel_each_other() {
        const ROWS: usize = 3000;
        let position: Vec<f64> = (0..2 * ROWS).map(|i| 8e-4 * (i % ROWS) as f64).collect();
        let noise = white(2 * ROWS, 3);
        let residual: Vec<f64> = (0..2 * ROWS)
            .map(|i| {
                let size = if i < ROWS { 1.0 } else { 0.5 };
                size * ((20.0 * position[i]).sin() - (21.3 * position[i]).sin()) + 1e-4 * noise[i]
            })
            .collect();
        let base = vec![(Parameter::amplitude("base", 10.0), vec![1.0; 2 * ROWS])];
        let logs = [white_log(ROWS, 1e-4), white_log(ROWS, 1e-4)];
        let balance = Balance::new(residual.clone(), base, &logs, 1.0);
        let joint = Joint::new(&balance, &position, Company { forms: &[], residual: &residual }, true);
        let steepest = joint.steepest(&[20.0, 21.3]);
        // Waves of a quarter of a period's difference over the travel are known to a few hundredths.
        assert!((steepest / 21.3 - 1.0).abs() < 0.03, "{steepest}");
    }

    #[test]
    fn wave_numbers_are_moved_to_where_waves_of_each_log_leave_nothing() {
        const ROWS: usize = 3000;
        let position: Vec<f64> = (0..2 * ROWS).map(|i| 8e-4 * (i % ROWS) as f64).collect();
        let noise = white(2 * ROWS, 3);
        let [first, second] = [21.3, 43.1];
        let residual: Vec<f64> = (0..2 * ROWS)
            .map(|i| {
                let phase = if i < ROWS { 0.3 } else { 2.1 };
                (first * position[i] + phase).sin() + 0.4 * (second * position[i]).cos() + 0.01 * noise[i]
            })
            .collect();
        let base = vec![(Parameter::amplitude("base", 10.0), vec![1.0; 2 * ROWS])];
        let logs = [white_log(ROWS, 0.01), white_log(ROWS, 0.01)];
        let balance = Balance::new(residual.clone(), base, &logs, 1.0);
        let company = Company { forms: &[], residual: &residual };
        let candidates = Candidates { wave_numbers: (2..60).map(|i| 1.3 * f64::from(i)).collect(), parts: 1 };
        let joint = Joint::new(&balance, &position, company, true);
        let found = joint.sharpened(&[16.0 * 1.3, 33.0 * 1.3], &candidates);
        assert!((found[0] - first).abs() < 2e-3 && (found[1] - second).abs() < 5e-3, "{found:?}");
        // Beyond half of a step another wave number stands.
        let far = joint.sharpened(&[15.0 * 1.3], &candidates);
        assert!((far[0] - 15.0 * 1.3).abs() <= 0.65 + 1e-9, "{far:?}");
        // Nor below the lowest that is tried, where a wave is a spring's law.
        let slow: Vec<f64> = (0..2 * ROWS).map(|i| (2.2 * position[i]).sin() + 0.01 * noise[i]).collect();
        let joint = Joint::new(&balance, &position, Company { forms: &[], residual: &slow }, true);
        assert_eq!(joint.sharpened(&[2.0 * 1.3], &candidates), [2.0 * 1.3]);
        // One that was found half of a step below it stays, where moving it up explains less.
        assert_eq!(joint.sharpened(&[1.4 * 1.3], &candidates), [1.4 * 1.3]);
    }
}
