//! Symmetric positive definite systems, and least squares with bounds from below.

use std::sync::Arc;

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};
use rayon::prelude::*;
use wide::f64x4;

/// Slopes of residuals (negative) along one parameter; what moves it little shares it.
pub type Slope = Arc<[f64]>;

/// The Cholesky factor of a matrix; where rounding has made it indefinite a ridge is added that grows until it is not.
pub fn factor(matrix: &DMatrix<f64>) -> Cholesky<f64, Dyn> {
    let scale = matrix.diagonal().amax().max(f64::MIN_POSITIVE);
    let mut ridge = 0.0;
    loop {
        let mut shifted = matrix.clone();
        for i in 0..shifted.nrows() {
            shifted[(i, i)] += ridge;
        }
        if let Some(factor) = Cholesky::new(shifted) {
            return factor;
        }
        // From rounding (1e-14 of the largest entry) on.
        ridge = if ridge == 0.0 { 1e-14 * scale } else { 10.0 * ridge };
        if !ridge.is_finite() {
            return Cholesky::pack_dirty(DMatrix::identity(matrix.nrows(), matrix.nrows()));
        }
    }
}

/// ln det.
pub fn log_determinant(factor: &Cholesky<f64, Dyn>) -> f64 {
    2.0 * factor.l_dirty().diagonal().iter().map(|x| x.abs().max(f64::MIN_POSITIVE).ln()).sum::<f64>()
}

/// min ½ xᵀHx − gᵀx with x ≥ `lower`, by Lawson and Hanson's active set: the bound against which the slope is steepest is
/// let go, until none is.
pub fn solve_bounded(h: &DMatrix<f64>, g: &DVector<f64>, lower: &[f64]) -> DVector<f64> {
    let n = g.len();
    let within = |x: &DVector<f64>| x.iter().zip(lower).all(|(x, low)| x >= low);
    // Mostly none binds.
    let all = solve_free(h, g, &DVector::zeros(n), &(0..n).collect::<Vec<_>>());
    if within(&all) {
        return all;
    }
    let mut x = DVector::from_fn(n, |i, _| if lower[i].is_finite() { lower[i] } else { 0.0 });
    let mut free: Vec<usize> = (0..n).filter(|i| !lower[*i].is_finite()).collect();
    x = solve_free(h, g, &x, &free);
    let slope =
        |x: &DVector<f64>, i: usize| (g[i] - h.row(i).tr_dot(x)) / h[(i, i)].max(f64::MIN_POSITIVE).sqrt();
    let least = 1e-12 * (0..n).map(|i| slope(&DVector::zeros(n), i).abs()).fold(0.0, f64::max);
    // Every pass lets one go and may take some back.
    for _ in 0..4 * n {
        let held = (0..n).filter(|i| !free.contains(i)).map(|i| (slope(&x, i), i));
        let Some((steepest, next)) = held.max_by(|a, b| a.0.total_cmp(&b.0)) else { break };
        if steepest <= least {
            break;
        }
        free.push(next);
        loop {
            let solution = solve_free(h, g, &x, &free);
            let reach = |&i: &usize| (x[i] - lower[i]) / (x[i] - solution[i]).max(f64::MIN_POSITIVE);
            let broken = free.iter().filter(|i| solution[**i] <= lower[**i]);
            let Some(share) = broken.map(reach).min_by(f64::total_cmp) else {
                x = solution;
                break;
            };
            x += share * (&solution - &x);
            // What has come to its bound stays there; rounding may leave it a little above.
            let stays =
                |i: &usize| solution[*i] > lower[*i] || x[*i] - lower[*i] > 1e-12 * (x[*i] - solution[*i]);
            free.retain(stays);
            (0..n).filter(|i| !free.contains(i)).for_each(|i| x[i] = lower[i]);
        }
    }
    x
}

/// The minimum over these unknowns, the others as they are in `x`.
fn solve_free(h: &DMatrix<f64>, g: &DVector<f64>, x: &DVector<f64>, free: &[usize]) -> DVector<f64> {
    let mut out = x.clone();
    if free.is_empty() {
        return out;
    }
    let mut held = x.clone();
    free.iter().for_each(|i| held[*i] = 0.0);
    let moved = h * held;
    let part = DMatrix::from_fn(free.len(), free.len(), |i, j| h[(free[i], free[j])]);
    let solution = factor(&part).solve(&DVector::from_fn(free.len(), |i, _| g[free[i]] - moved[free[i]]));
    free.iter().zip(&solution).for_each(|(i, value)| out[*i] = *value);
    out
}

/// Least squares with coefficients that are not negative: min |Ax − b|, given AᵀA and Aᵀb.
pub fn non_negative(normal: &DMatrix<f64>, right: &DVector<f64>) -> DVector<f64> {
    solve_bounded(normal, right, &vec![0.0; right.len()])
}

/// Sum of products, in eight lanes so that it can be computed in parallel; the order of summation is fixed.
#[inline]
pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    let ((a8, a_rest), (b8, b_rest)) = (a.as_chunks::<8>(), b.as_chunks::<8>());
    let rest: f64 = a_rest.iter().zip(b_rest).map(|(x, y)| x * y).sum();
    let [mut low, mut high] = [f64x4::ZERO; 2];
    for ([a0, a1, a2, a3, a4, a5, a6, a7], [b0, b1, b2, b3, b4, b5, b6, b7]) in a8.iter().zip(b8) {
        low += f64x4::from([*a0, *a1, *a2, *a3]) * f64x4::from([*b0, *b1, *b2, *b3]);
        high += f64x4::from([*a4, *a5, *a6, *a7]) * f64x4::from([*b4, *b5, *b6, *b7]);
    }
    low.to_array().iter().chain(&high.to_array()).sum::<f64>() + rest
}

/// Σ ln(1 + x²/scale), as logarithms of products in place of a sum of logarithms.
pub fn sum_of_logs(values: &[f64], scale: f64) -> f64 {
    values.chunks(8).map(|x| x.iter().map(|x| 1.0 + x * x / scale).product::<f64>().ln()).sum()
}

/// Rows that are taken together: some 20 columns of them, and the same with weights, fit in a core's own cache.
const ROWS_AT_ONCE: usize = 128;
/// Rows of a task of its own.
const ROWS_OF_A_TASK: usize = 64 * ROWS_AT_ONCE;

/// JᵀWJ and JᵀWr; the order of summation is fixed, however many threads there are.
pub fn normal_equations<C: AsRef<[f64]> + Sync>(
    j: &[C],
    w: &[f64],
    r: &[f64],
) -> (DMatrix<f64>, DVector<f64>) {
    normal_equations_of(j, w, r, |_, _| true)
}

/// The same with the products of these pairs of columns alone, the later column first; those of others are zero.
pub fn normal_equations_of<C: AsRef<[f64]> + Sync>(
    j: &[C],
    w: &[f64],
    r: &[f64],
    wanted: impl Fn(usize, usize) -> bool + Sync,
) -> (DMatrix<f64>, DVector<f64>) {
    let n = j.len();
    let tasks: Vec<(DMatrix<f64>, DVector<f64>)> = (0..r.len().div_ceil(ROWS_OF_A_TASK))
        .into_par_iter()
        .map(|task| {
            let (mut h, mut g) = (DMatrix::zeros(n, n), DVector::zeros(n));
            let mut weighted = [0.0; ROWS_AT_ONCE];
            let end = ((task + 1) * ROWS_OF_A_TASK).min(r.len());
            for from in (task * ROWS_OF_A_TASK..end).step_by(ROWS_AT_ONCE) {
                let rows = from..(from + ROWS_AT_ONCE).min(end);
                for a in 0..n {
                    let weighted = &mut weighted[..rows.len()];
                    let pairs = j[a].as_ref()[rows.clone()].iter().zip(&w[rows.clone()]);
                    weighted.iter_mut().zip(pairs).for_each(|(out, (x, w))| *out = x * w);
                    for b in (0..=a).filter(|b| wanted(a, *b)) {
                        h[(a, b)] += dot(weighted, &j[b].as_ref()[rows.clone()]);
                    }
                    g[a] += dot(weighted, &r[rows.clone()]);
                }
            }
            (h, g)
        })
        .collect();
    let (mut h, mut g) = (DMatrix::zeros(n, n), DVector::zeros(n));
    for (of_task, right) in tasks {
        h += of_task;
        g += right;
    }
    h.fill_upper_triangle_with_lower_triangle();
    (h, g)
}

/// JᵀWr alone.
pub fn weighted_products<C: AsRef<[f64]>>(j: &[C], w: &[f64], r: &[f64]) -> impl Iterator<Item = f64> {
    let weighted: Vec<f64> = w.iter().zip(r).map(|(w, r)| w * r).collect();
    j.iter().map(move |column| dot(column.as_ref(), &weighted))
}

/// Slopes of residuals (negative, a column for each parameter) mended by what a step made of the residuals: the least change,
/// each parameter in its own width, with which they would have told it (C. G. Broyden, *Mathematics of Computation* 19, 1965).
pub fn mend_slopes(columns: &mut [Slope], [before, after]: [&[f64]; 2], step: &[f64], widths: &[f64]) {
    let size: f64 = step.iter().zip(widths).map(|(d, width)| (d / width).powi(2)).sum();
    if size == 0.0 {
        return;
    }
    let mut untold: Vec<f64> = before.iter().zip(after).map(|(before, after)| before - after).collect();
    for (column, d) in columns.iter().zip(step) {
        untold.iter_mut().zip(column.iter()).for_each(|(untold, slope)| *untold -= d * slope);
    }
    for (column, (d, width)) in columns.iter_mut().zip(step.iter().zip(widths)) {
        let share = d / (width * width) / size;
        Arc::make_mut(column).iter_mut().zip(&untold).for_each(|(slope, untold)| *slope += share * untold);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rounding shows in what order is summed: eight lanes, then these in turn, then what is left over.
    #[test]
    fn a_sum_of_products_is_summed_in_the_order_that_is_promised() {
        for length in [0, 5, 8, 1003] {
            let a: Vec<f64> = (0..length).map(|i| (f64::from(i) * 1.7).sin() * 1e3).collect();
            let b: Vec<f64> = (0..length).map(|i| 1.0 / (1.0 + f64::from(i))).collect();
            let whole = a.len() / 8 * 8;
            let lane = |lane: usize| (lane..whole).step_by(8).map(|i| a[i] * b[i]).sum::<f64>();
            let rest: f64 = (whole..a.len()).map(|i| a[i] * b[i]).sum();
            assert_eq!(dot(&a, &b), (0..8).map(lane).sum::<f64>() + rest, "{length}");
        }
    }

    #[test]
    fn products_that_are_not_asked_for_are_nothing_and_the_others_the_same() {
        let rows = ROWS_OF_A_TASK + 300;
        let columns: Vec<Vec<f64>> =
            (1..5).map(|c| (0..rows).map(|i| (0.01 * (c * i) as f64).sin()).collect()).collect();
        let (w, r): (Vec<f64>, Vec<f64>) = (0..rows).map(|i| (1.0 + (i % 7) as f64, (i % 11) as f64)).unzip();
        let (all, right) = normal_equations(&columns, &w, &r);
        let wanted = |a: usize, b: usize| b < 2 || a == b;
        let (some, same) = normal_equations_of(&columns, &w, &r, wanted);
        assert_eq!(right, same);
        for (a, b) in (0..4).flat_map(|a| (0..4).map(move |b| (a, b))) {
            let expected = if wanted(a.max(b), a.min(b)) { all[(a, b)] } else { 0.0 };
            assert_eq!(some[(a, b)], expected, "{a} {b}");
        }
        for (product, right) in weighted_products(&columns, &w, &r).zip(&right) {
            assert!((product - right).abs() < 1e-9 * rows as f64);
        }
    }

    #[test]
    fn mended_slopes_tell_the_step_and_what_is_across_it_stays() {
        let residual = |p: [f64; 2]| vec![1.0 - p[0] - 0.3 * p[0] * p[0], 2.0 - 4.0 * p[1], p[0] * p[1]];
        let [from, to] = [[0.2, 0.1], [0.5, -0.1]];
        let (before, after) = (residual(from), residual(to));
        let mut columns: Vec<Slope> = vec![[1.0, 0.2, -0.1].into(), [0.1, 3.0, -0.2].into()];
        let (step, widths) = ([to[0] - from[0], to[1] - from[1]], [2.0, 0.5]);
        // Across the step as the widths measure it.
        let across = [step[1] / (widths[1] * widths[1]), -step[0] / (widths[0] * widths[0])];
        let told =
            |columns: &[Slope], step: [f64; 2], i: usize| columns[0][i] * step[0] + columns[1][i] * step[1];
        let of_across: Vec<f64> = (0..3).map(|i| told(&columns, across, i)).collect();
        mend_slopes(&mut columns, [&before, &after], &step, &widths);
        for i in 0..3 {
            assert!((told(&columns, step, i) - (before[i] - after[i])).abs() < 1e-12, "{i}");
            assert!((told(&columns, across, i) - of_across[i]).abs() < 1e-12, "{i}");
        }
        let known = columns.clone();
        mend_slopes(&mut columns, [&before, &before], &[0.0, 0.0], &widths);
        assert_eq!(columns, known);
    }

    #[test]
    fn a_bound_that_binds_holds_and_the_others_move() {
        let h = DMatrix::from_row_slice(2, 2, &[2.0, 1.0, 1.0, 2.0]);
        let g = DVector::from_vec(vec![-3.0, 3.0]);
        let x = solve_bounded(&h, &g, &[0.0, f64::NEG_INFINITY]);
        assert_eq!(x[0], 0.0);
        assert!((x[1] - 1.5).abs() < 1e-12);
    }

    #[test]
    fn bounds_are_let_go_again_where_that_lowers_the_sum() {
        // Laws that saturate at widths close to each other: columns that are nearly one another, of which two make the signal.
        let rows = 400;
        let saturates = |width: f64| -> Vec<f64> {
            let input = (0..rows).map(|i| (0.05 * f64::from(i)).sin() + 0.3 * (0.21 * f64::from(i)).sin());
            input.map(|x| (x / width).clamp(-1.0, 1.0)).collect()
        };
        let columns: Vec<Vec<f64>> =
            (0..13).map(|i| saturates(0.01 * 2f64.powf(0.5 * f64::from(i)))).collect();
        let noise = crate::identify::noise::tests::white(rows as usize, 7);
        let y: Vec<f64> =
            (0..rows as usize).map(|k| columns[4][k] + 0.5 * columns[9][k] + 0.02 * noise[k]).collect();
        let (h, g) = normal_equations(&columns, &vec![1.0; y.len()], &y);
        let x = solve_bounded(&h, &g, &[0.0; 13]);
        // At the minimum no slope leads into the allowed range, and there is none along what is free.
        let slope = &g - &h * &x;
        for i in 0..13 {
            let scale = 1e-9 * g.amax();
            assert!(
                x[i] >= 0.0 && slope[i] <= scale && (x[i] == 0.0 || slope[i].abs() < scale),
                "{i}: {x} {slope}"
            );
        }
        assert!((x.sum() - 1.5).abs() < 0.02, "{x}");
    }

    #[test]
    fn non_negative_least_squares_drops_the_negative_coefficient() {
        let a = DMatrix::from_row_slice(3, 2, &[1.0, 1.0, 1.0, 2.0, 1.0, 3.0]);
        let b = DVector::from_vec(vec![3.0, 2.0, 1.0]);
        let x = non_negative(&(a.transpose() * &a), &(a.transpose() * b));
        assert!((x[0] - 2.0).abs() < 1e-12 && x[1] == 0.0);
    }
}
