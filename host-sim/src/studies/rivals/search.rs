//! Least squares for one candidate on one log: Levenberg–Marquardt (Moré's form, crate `levenberg-marquardt`) in coordinates
//! that see no bound, x = low + (high − low)(1 + sin y)/2, logarithmic where the range is.
//!
//! What is judged are the fine residuals. The derivatives, which take nine tenths of the evaluations, come from rough ones at
//! first: they only point the way. A few steps choose among the starts, the best is searched on, at last with fine derivatives.
//! A search ends where a tenth of what can be told apart is reached.

use std::cell::RefCell;

use levenberg_marquardt::LevenbergMarquardt;
use nalgebra::{DMatrix, DVector};

use super::candidates::Candidate;
use crate::least_squares::Problem;
use model_core::friction::FrictionParameters;

/// Step of the one-sided differences.
const DIFFERENCE: f64 = 1e-5;
/// Evaluations, over the number of parameters + 1, of each start, of the best, and at last with fine derivatives.
const PATIENCE: [usize; 3] = [2, 5, 2];

/// How finely a residual is computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Accuracy {
    /// At every control period.
    Fine,
    /// As a derivative needs it.
    Rough,
}

/// Residuals of a set of parameters; their sum of squares is sought to be small.
pub(super) type Residuals<'a> = dyn Fn(&FrictionParameters<f64>, Accuracy) -> Option<Vec<f64>> + 'a;

struct Search<'a> {
    candidate: &'a Candidate,
    residuals: &'a Residuals<'a>,
    /// Of the derivatives.
    accuracy: Accuracy,
    /// Sum of squares with which a search is content.
    enough: f64,
    best: RefCell<(f64, DVector<f64>)>,
}

/// The number at a coordinate.
fn from_search((low, high): (f64, f64), y: f64) -> f64 {
    let share = 0.5 * (1.0 + y.sin());
    if low > 0.0 { low * (high / low).powf(share) } else { low + (high - low) * share }
}

/// The coordinate of a number; on a bound it is moved inside, where the transform has a slope.
fn to_search((low, high): (f64, f64), x: f64) -> f64 {
    let share = if low > 0.0 { (x / low).ln() / (high / low).ln() } else { (x - low) / (high - low) };
    (2.0 * share.clamp(1e-3, 1.0 - 1e-3) - 1.0).asin()
}

fn at(candidate: &Candidate, search: &DVector<f64>) -> FrictionParameters<f64> {
    let specs = candidate.typical.kind().parameters();
    candidate.free.iter().zip(search.iter()).fold(candidate.typical, |p, ((place, low, high), y)| {
        p.with(specs[*place].name, from_search((*low, *high), *y))
    })
}

impl Search<'_> {
    fn evaluate(&self, search: &DVector<f64>, accuracy: Accuracy) -> Option<DVector<f64>> {
        let residuals = (self.residuals)(&at(self.candidate, search), accuracy)?;
        residuals.iter().all(|r| r.is_finite()).then(|| DVector::from_vec(residuals))
    }

    /// `None`, which ends the search, where it has been good enough.
    fn residuals(&self, y: &DVector<f64>) -> Option<DVector<f64>> {
        if self.best.borrow().0 < self.enough {
            return None;
        }
        let residuals = self.evaluate(y, Accuracy::Fine)?;
        let sum = residuals.norm_squared();
        if sum < self.best.borrow().0 {
            *self.best.borrow_mut() = (sum, y.clone());
        }
        Some(residuals)
    }

    fn jacobian(&self, y: &DVector<f64>) -> Option<DMatrix<f64>> {
        if self.best.borrow().0 < self.enough {
            return None;
        }
        let here = self.evaluate(y, self.accuracy)?;
        let columns = (0..y.len()).map(|column| {
            let mut moved = y.clone();
            moved[column] += DIFFERENCE;
            Some((self.evaluate(&moved, self.accuracy)? - &here) / DIFFERENCE)
        });
        Some(DMatrix::from_columns(&columns.collect::<Option<Vec<_>>>()?))
    }
}

/// The best parameters of a candidate from `known` numbers, or from its starts, until one is good `enough`, where none are
/// known; `None` where no start has finite residuals.
pub(super) fn fit(
    candidate: &Candidate,
    known: Option<FrictionParameters<f64>>,
    enough: f64,
    residuals: &Residuals<'_>,
) -> Option<FrictionParameters<f64>> {
    let specs = candidate.typical.kind().parameters();
    let own = || {
        let changed = candidate
            .other_starts
            .iter()
            .map(|changes| changes.iter().fold(candidate.typical, |p, (name, value)| p.with(name, *value)));
        std::iter::once(candidate.typical).chain(changed).collect()
    };
    let starts: Vec<FrictionParameters<f64>> = known.map_or_else(own, |known| vec![known]);
    let search = |start: &FrictionParameters<f64>, accuracy: Accuracy, patience: usize| {
        let coordinates = candidate.free.iter().map(|(place, low, high)| {
            to_search((*low, *high), start.get(specs[*place].name).unwrap_or(*low))
        });
        let first = DVector::from_iterator(candidate.free.len(), coordinates);
        let best = RefCell::new((f64::INFINITY, first.clone()));
        let search = Search { candidate, residuals, accuracy, enough, best };
        let problem = Problem {
            at: first,
            residuals: |y: &DVector<f64>| search.residuals(y),
            jacobian: |y: &DVector<f64>| search.jacobian(y),
        };
        LevenbergMarquardt::new().with_ftol(1e-4).with_xtol(1e-5).with_patience(patience).minimize(problem);
        let (sum, found) = search.best.into_inner();
        sum.is_finite().then(|| (sum, at(candidate, &found)))
    };
    let mut best: Option<(f64, FrictionParameters<f64>)> = None;
    let mut keep = |found: Option<(f64, FrictionParameters<f64>)>| {
        best = [best, found].into_iter().flatten().min_by(|a, b| a.0.total_cmp(&b.0));
        best
    };
    for start in &starts {
        keep(search(start, Accuracy::Rough, PATIENCE[0]));
    }
    let stages = [(Accuracy::Rough, PATIENCE[1]), (Accuracy::Fine, PATIENCE[2])];
    for (accuracy, patience) in stages {
        let (least, found) = keep(None)?;
        if least >= enough {
            keep(search(&found, accuracy, patience));
        }
    }
    keep(None).map(|(_, parameters)| parameters)
}
