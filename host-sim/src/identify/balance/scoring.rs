//! Fisher's scoring of Student's t in a balance, which is linear in its parameters.
//!
//! Reweighted least squares takes steps by the curvature of its weights, which bounds the likelihood's from above; what is
//! expected of that is less, and steps are longer by so much (K. L. Lange, R. J. A. Little, J. M. G. Taylor, *Journal of the
//! American Statistical Association* 84, 1989). The matrix of products is kept, scaled as the weights are, as long as steps
//! shrink; where one overshoots, reweighted least squares goes on, which cannot.

use nalgebra::{DMatrix, DVector};

use crate::identify::contact::problem::{FREEDOM, student_weight};
use crate::identify::evidence::TYPICAL_SCALE;
use crate::identify::linear;
use crate::identify::term::Parameter;

/// Steps at most, and the square of one, in deviations of the posterior, that is the last: slopes along the numbers of a coupling
/// are differences of what is left at such points.
pub(super) const MOST_STEPS: usize = 20;
const CONVERGED: f64 = 1e-5;
/// The curvature of Student's t that is expected, over that of its weights.
const EXPECTED_CURVATURE: f64 = (FREEDOM + 1.0) / (FREEDOM + 3.0);

/// What is new in the rows of a balance: columns and response, over their deviation; so many rows count as one.
pub(super) struct Rows<'x> {
    pub(super) x: Vec<&'x [f64]>,
    pub(super) y: Vec<f64>,
    pub(super) temper: f64,
}

/// A point that a fit has come to.
pub(super) struct Fit {
    pub(super) p: Vec<f64>,
    /// What is new in each row, over its deviation.
    pub(super) innovations: Vec<f64>,
    /// Curvature of −ln likelihood by its weights, and slope of ln likelihood.
    pub(super) curvature: DMatrix<f64>,
    pub(super) slope: DVector<f64>,
}

/// −ln likelihood of what is new in each row, but for constants.
pub(super) fn misfit(innovations: &[f64], temper: f64) -> f64 {
    0.5 * (FREEDOM + 1.0) * linear::sum_of_logs(innovations, FREEDOM) / temper
}

impl Rows<'_> {
    /// From the weights that residuals nearby have, in so many steps at most; the first is least squares with these weights.
    pub(super) fn fit(&self, parameters: &[Parameter], near: Option<&[f64]>, most: usize) -> Fit {
        let prior = Prior::of(parameters);
        let mut w = near.map_or_else(|| vec![1.0 / self.temper; self.y.len()], |near| self.weights(near));
        let (mut curvature, right) = linear::normal_equations(&self.x, &w, &self.y);
        let (mut p, mut size) = prior.step(&curvature, &right, &DVector::zeros(self.x.len()));
        let mut slope = right - &curvature * &p;
        let mut r = self.left(&p);
        let cost = |p: &DVector<f64>, r: &[f64]| prior.cost(p) + misfit(r, self.temper);
        let mut at = cost(&p, &r);
        let mut overshot = false;
        for step in 1..most {
            let before = w.iter().sum::<f64>();
            w = self.weights(&r);
            slope = DVector::from_iterator(self.x.len(), linear::weighted_products(&self.x, &w, &r));
            curvature *= w.iter().sum::<f64>() / before;
            let share = if overshot { 1.0 } else { EXPECTED_CURVATURE };
            let (mut there, mut next) = prior.step(&(share * &curvature), &slope, &p);
            // Weights have changed in kind, and not only in size, where steps do not shrink.
            let first = step == 1 && near.is_none();
            let slow = step > 1 && next > size;
            if next > CONVERGED && (first || slow || overshot) {
                curvature = linear::normal_equations(&self.x, &w, &r).0;
                (there, next) = prior.step(&(share * &curvature), &slope, &p);
            }
            let r_there = self.left(&there);
            let at_there = cost(&there, &r_there);
            if at_there > at {
                if next < CONVERGED {
                    break;
                }
                overshot = true;
                continue;
            }
            (p, r, at, size) = (there, r_there, at_there, next);
            if size < CONVERGED {
                break;
            }
        }
        if most > 1 {
            (curvature, slope) = linear::normal_equations(&self.x, &self.weights(&r), &r);
        }
        Fit { p: p.iter().copied().collect(), innovations: r, curvature, slope }
    }

    fn weights(&self, r: &[f64]) -> Vec<f64> {
        r.iter().map(|r| student_weight(*r) / self.temper).collect()
    }

    /// What these values leave of the response.
    fn left(&self, p: &DVector<f64>) -> Vec<f64> {
        let mut r = self.y.clone();
        for (column, p) in self.x.iter().zip(p) {
            r.iter_mut().zip(*column).for_each(|(r, x)| *r -= p * x);
        }
        r
    }
}

/// Priors of parameters, as a step takes them.
struct Prior {
    mean: DVector<f64>,
    precision: DVector<f64>,
    lower: Vec<f64>,
}

impl Prior {
    fn of(parameters: &[Parameter]) -> Self {
        let each =
            |of: fn(&Parameter) -> f64| DVector::from_iterator(parameters.len(), parameters.iter().map(of));
        Self {
            mean: each(|q| q.mean),
            precision: each(|q| q.width(TYPICAL_SCALE).powi(-2)),
            lower: parameters.iter().map(|q| q.lower).collect(),
        }
    }

    /// −ln of the prior, but for constants.
    fn cost(&self, p: &DVector<f64>) -> f64 {
        0.5 * (p - &self.mean).map(|off| off * off).dot(&self.precision)
    }

    /// Where the posterior is largest by the curvature of −ln likelihood and the slope of ln likelihood at a point, and the
    /// square of the step there in deviations of the posterior.
    fn step(&self, curvature: &DMatrix<f64>, slope: &DVector<f64>, p: &DVector<f64>) -> (DVector<f64>, f64) {
        let mut a = curvature.clone();
        a.set_diagonal(&(a.diagonal() + &self.precision));
        let g = curvature * p + slope + self.precision.component_mul(&self.mean);
        let there = linear::solve_bounded(&a, &g, &self.lower);
        let moved = &there - p;
        let size = moved.dot(&(&a * &moved));
        (there, size)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::identify::noise::tests::white;

    const ROWS: usize = 2000;

    /// Reweighted least squares, as long as it takes.
    fn reweighted(rows: &Rows<'_>, parameters: &[Parameter]) -> DVector<f64> {
        let prior = Prior::of(parameters);
        let mut p = DVector::zeros(parameters.len());
        for _ in 0..500 {
            let r = rows.left(&p);
            let (h, g) = linear::normal_equations(&rows.x, &rows.weights(&r), &r);
            p = prior.step(&h, &g, &p).0;
        }
        p
    }

    #[test]
    fn scoring_comes_where_reweighted_least_squares_does() {
        let slow: Vec<f64> = (0..ROWS).map(|i| (0.01 * i as f64).sin()).collect();
        let fast: Vec<f64> = (0..ROWS).map(|i| (0.7 * i as f64).cos()).collect();
        let noise = white(ROWS, 11);
        let sizes = [
            Parameter::amplitude("slow", 50.0),
            Parameter { lower: 0.0, ..Parameter::amplitude("fast", 50.0) },
        ];
        // Noise as it should be, a tenth of the rows far off, and a third; a size within its range and one beyond.
        for (off, every, fast_size) in [(0.0, 1, 0.3), (40.0, 10, 0.3), (40.0, 10, -0.3), (40.0, 3, 0.3)] {
            // They pull one size.
            let stray = |i: usize| if i.is_multiple_of(every) { off * slow[i] } else { 0.0 };
            let y = (0..ROWS).map(|i| 5.0 * slow[i] + fast_size * fast[i] + noise[i] + stray(i)).collect();
            let rows = Rows { x: vec![&slow, &fast], y, temper: 2.0 };
            let truth = reweighted(&rows, &sizes);
            let close = |near: Option<&[f64]>| {
                let fit = rows.fit(&sizes, near, MOST_STEPS);
                for (i, (p, truth)) in fit.p.iter().zip(&truth).enumerate() {
                    let sd = fit.curvature[(i, i)].sqrt().recip();
                    assert!((p - truth).abs() < 0.01 * sd, "{off} {every} {i}: {p} for {truth} ± {sd}");
                }
                assert_eq!(fit.innovations, rows.left(&DVector::from_column_slice(&fit.p)));
            };
            close(None);
            // Weights of a point that is not near.
            close(Some(&vec![30.0; ROWS]));
            close(Some(&rows.left(&truth)));
        }
    }
}
