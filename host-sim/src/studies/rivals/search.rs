//! Least squares for one candidate on one log: Levenberg–Marquardt (Moré's form, crate `levenberg-marquardt`) in coordinates
//! that see no bound, x = low + (high − low)(1 + sin y)/2, logarithmic where the range is.

use levenberg_marquardt::{LeastSquaresProblem, LevenbergMarquardt};
use nalgebra::{DMatrix, DVector, Dyn, Owned};

use super::candidates::Candidate;
use model_core::friction::FrictionParameters;

/// Step of the one-sided differences.
const DIFFERENCE: f64 = 1e-5;
/// Evaluations of a start, over the number of parameters + 1.
const PATIENCE: usize = 12;

struct Problem<'a> {
    candidate: &'a Candidate,
    residuals: &'a dyn Fn(&FrictionParameters<f64>) -> Option<Vec<f64>>,
    at: DVector<f64>,
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

impl Problem<'_> {
    fn evaluate(&self, search: &DVector<f64>) -> Option<DVector<f64>> {
        let residuals = (self.residuals)(&at(self.candidate, search))?;
        residuals.iter().all(|r| r.is_finite()).then(|| DVector::from_vec(residuals))
    }
}

impl LeastSquaresProblem<f64, Dyn, Dyn> for Problem<'_> {
    type ResidualStorage = Owned<f64, Dyn>;
    type JacobianStorage = Owned<f64, Dyn, Dyn>;
    type ParameterStorage = Owned<f64, Dyn>;

    fn set_params(&mut self, x: &DVector<f64>) {
        self.at.copy_from(x);
    }

    fn params(&self) -> DVector<f64> {
        self.at.clone()
    }

    fn residuals(&self) -> Option<DVector<f64>> {
        self.evaluate(&self.at)
    }

    fn jacobian(&self) -> Option<DMatrix<f64>> {
        let here = self.evaluate(&self.at)?;
        let columns = (0..self.at.len()).map(|column| {
            let mut moved = self.at.clone();
            moved[column] += DIFFERENCE;
            Some((self.evaluate(&moved)? - &here) / DIFFERENCE)
        });
        Some(DMatrix::from_columns(&columns.collect::<Option<Vec<_>>>()?))
    }
}

/// The best parameters of a candidate from `known` numbers, or from all of its starts where none are known; `None` where
/// no start has finite residuals.
pub(super) fn fit(
    candidate: &Candidate,
    known: Option<FrictionParameters<f64>>,
    residuals: &dyn Fn(&FrictionParameters<f64>) -> Option<Vec<f64>>,
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
    let mut best: Option<(f64, FrictionParameters<f64>)> = None;
    for start in starts {
        let coordinates = candidate.free.iter().map(|(place, low, high)| {
            to_search((*low, *high), start.get(specs[*place].name).unwrap_or(*low))
        });
        let first = DVector::from_iterator(candidate.free.len(), coordinates);
        let problem = Problem { candidate, residuals, at: first };
        let (problem, report) = LevenbergMarquardt::new()
            .with_ftol(1e-5)
            .with_xtol(1e-5)
            .with_patience(PATIENCE)
            .minimize(problem);
        let cost = report.objective_function;
        if cost.is_finite() && best.is_none_or(|(least, _)| cost < least) {
            best = Some((cost, at(candidate, &problem.at)));
        }
    }
    best.map(|(_, parameters)| parameters)
}
