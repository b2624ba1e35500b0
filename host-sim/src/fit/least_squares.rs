//! Bounded, scaled nonlinear least squares with several starts.
//!
//! min_x Σ r_t(x)², Levenberg–Marquardt (Moré's MINPACK form, crate `levenberg-marquardt`) in the search
//! coordinates of [`super::bounds`]. The Jacobian is by central differences, its columns shared among
//! the processor's cores. A start whose Jacobian has a zero column is refused by the parameter's name:
//! an optimiser would stop there after no iteration and call it converged. The best of the starts is
//! examined for what the data cannot tell ([`super::identifiability`]) and gets standard deviations
//! that allow for coloured residuals ([`super::covariance`]).
//! Left out: robust losses; the caller leaves out what should not count.

use std::thread;

use levenberg_marquardt::{LeastSquaresProblem, LevenbergMarquardt};
use nalgebra::{DMatrix, DVector, Dyn, Owned};

use super::bounds::Parameter;
use super::covariance;
use super::error::FitError;
use super::identifiability::{self, Identifiability};

/// Step of the central differences in search coordinates: the error of order step² (1e-8) stays
/// below that of a simulation's rounding over step.
const DIFFERENCE: f64 = 1e-4;

/// The residuals of a model at parameter values, always of the same number; `None` where the model
/// has no finite answer.
pub type Residuals<'a> = dyn Fn(&[f64]) -> Option<Vec<f64>> + Sync + 'a;

/// Settings of the search.
#[derive(Debug, Clone, Copy)]
pub struct Options {
    /// Model evaluations per start, in multiples of the number of parameters + 1.
    pub patience: usize,
    /// Relative change of the sum of squares below which a start has converged.
    pub tolerance: f64,
    /// Largest standard deviation allowed, relative to the typical size of the parameter.
    pub largest_relative_std: f64,
    /// One-sided differences: half the cost, enough on the way to an optimum.
    pub one_sided: bool,
}

impl Default for Options {
    fn default() -> Self {
        Self { patience: 60, tolerance: 1e-8, largest_relative_std: 1.0, one_sided: false }
    }
}

/// What was found.
#[derive(Debug, Clone)]
pub struct Solution {
    /// One value a parameter, in the order they were given.
    pub values: Vec<f64>,
    /// Standard deviations; `NaN` where they could not be had (too few samples).
    pub std: Vec<f64>,
    /// Correlation of each pair.
    pub correlations: DMatrix<f64>,
    /// Residuals at the values.
    pub residuals: Vec<f64>,
    /// Smallest over largest singular value of the scaled Jacobian.
    pub singular_ratio: f64,
    /// Parameters, by position, that ended on a bound.
    pub on_bound: Vec<usize>,
    /// How many of the starts ended within 1 % of the best sum of squares.
    pub starts_agreeing: usize,
}

impl Solution {
    /// Root mean square of the residuals.
    pub fn rms(&self) -> f64 {
        (self.residuals.iter().map(|r| r * r).sum::<f64>() / self.residuals.len().max(1) as f64).sqrt()
    }
}

struct Problem<'a> {
    parameters: &'a [Parameter],
    residuals: &'a Residuals<'a>,
    at: DVector<f64>,
    one_sided: bool,
}

impl Problem<'_> {
    fn values(&self, search: &DVector<f64>) -> Vec<f64> {
        self.parameters.iter().zip(search.iter()).map(|(parameter, y)| parameter.from_search(*y)).collect()
    }

    fn evaluate(&self, search: &DVector<f64>) -> Option<DVector<f64>> {
        let residuals = (self.residuals)(&self.values(search))?;
        residuals.iter().all(|r| r.is_finite()).then(|| DVector::from_vec(residuals))
    }

    fn difference(&self, column: usize, here: Option<&DVector<f64>>) -> Option<DVector<f64>> {
        let mut search = self.at.clone();
        search[column] += DIFFERENCE;
        let up = self.evaluate(&search)?;
        if let Some(here) = here {
            return Some((up - here) / DIFFERENCE);
        }
        search[column] -= 2.0 * DIFFERENCE;
        Some((up - self.evaluate(&search)?) / (2.0 * DIFFERENCE))
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
        let count = self.at.len();
        let here = if self.one_sided { Some(self.evaluate(&self.at)?) } else { None };
        let here = here.as_ref();
        let workers = thread::available_parallelism().map_or(1, |n| n.get()).min(count).max(1);
        let shares: Vec<Vec<Option<DVector<f64>>>> = thread::scope(|scope| {
            let running: Vec<_> = (0..workers)
                .map(|worker| {
                    scope.spawn(move || {
                        (worker..count).step_by(workers).map(|c| self.difference(c, here)).collect()
                    })
                })
                .collect();
            running.into_iter().map(|thread| thread.join().unwrap_or_default()).collect()
        });
        let mut columns: Vec<Option<DVector<f64>>> = vec![None; count];
        for (worker, share) in shares.into_iter().enumerate() {
            for (turn, column) in share.into_iter().enumerate() {
                columns[worker + turn * workers] = column;
            }
        }
        let columns: Vec<DVector<f64>> = columns.into_iter().collect::<Option<_>>()?;
        Some(DMatrix::from_columns(&columns))
    }
}

/// Minimises the sum of squares from the parameters' start values and from `other_starts`, and
/// examines what the data tell about the parameters.
pub fn minimise(
    parameters: &[Parameter],
    other_starts: &[Vec<f64>],
    residuals: &Residuals<'_>,
    options: Options,
) -> Result<Solution, FitError> {
    let Best { at, starts_agreeing } = best_of_starts(parameters, other_starts, residuals, options)?;
    finish(&Problem { parameters, residuals, at, one_sided: false }, starts_agreeing, options)
}

/// Minimises like [`minimise`] without examining the result: for parameters that are nuisances, or are
/// examined together with others elsewhere.
pub fn search(
    parameters: &[Parameter],
    other_starts: &[Vec<f64>],
    residuals: &Residuals<'_>,
    options: Options,
) -> Result<Vec<f64>, FitError> {
    let Best { at, .. } = best_of_starts(parameters, other_starts, residuals, options)?;
    Ok(parameters.iter().zip(at.iter()).map(|(parameter, y)| parameter.from_search(*y)).collect())
}

struct Best {
    at: DVector<f64>,
    starts_agreeing: usize,
}

fn best_of_starts(
    parameters: &[Parameter],
    other_starts: &[Vec<f64>],
    residuals: &Residuals<'_>,
    options: Options,
) -> Result<Best, FitError> {
    let first: Vec<f64> = parameters.iter().map(|parameter| parameter.start).collect();
    let mut found: Vec<(f64, DVector<f64>)> = Vec::new();
    let mut last_reason = None;
    for start in std::iter::once(&first).chain(other_starts) {
        check_bounds(parameters, start)?;
        let at =
            DVector::from_iterator(start.len(), parameters.iter().zip(start).map(|(p, x)| p.to_search(*x)));
        let problem = Problem { parameters, residuals, at, one_sided: options.one_sided };
        let Some(jacobian) = problem.jacobian() else { continue };
        if jacobian.nrows() <= parameters.len() {
            let (samples, needed) = (jacobian.nrows(), parameters.len() + 1);
            return Err(FitError::TooFewSamples { samples, needed });
        }
        let without = without_influence(&jacobian);
        if !without.is_empty() {
            let names = without.into_iter().map(|at| parameters[at].name.clone()).collect();
            last_reason = Some(FitError::NoInfluence { names });
            continue;
        }
        let (problem, report) = LevenbergMarquardt::new()
            .with_ftol(options.tolerance)
            .with_xtol(options.tolerance)
            .with_gtol(1e-12)
            .with_patience(options.patience)
            .minimize(problem);
        if report.objective_function.is_finite() {
            found.push((report.objective_function, problem.at));
        } else {
            last_reason = Some(FitError::NotConverged(format!("{:?}", report.termination)));
        }
    }
    let best = found.iter().map(|(sum, _)| *sum).fold(f64::INFINITY, f64::min);
    let starts_agreeing = found.iter().filter(|(sum, _)| *sum <= best * 1.01).count();
    match found.into_iter().find(|(sum, _)| *sum <= best) {
        Some((_, at)) => Ok(Best { at, starts_agreeing }),
        None => Err(last_reason.unwrap_or(FitError::NotFinite)),
    }
}

fn check_bounds(parameters: &[Parameter], start: &[f64]) -> Result<(), FitError> {
    match parameters.iter().zip(start).find(|(p, x)| !(p.low..=p.high).contains(*x)) {
        None => Ok(()),
        Some((p, x)) => {
            Err(FitError::StartOutOfBounds { name: p.name.clone(), value: *x, low: p.low, high: p.high })
        }
    }
}

fn without_influence(jacobian: &DMatrix<f64>) -> Vec<usize> {
    match identifiability::examine(jacobian) {
        Identifiability::NoInfluence(parameters) => parameters,
        _ => Vec::new(),
    }
}

fn finish(problem: &Problem<'_>, starts_agreeing: usize, options: Options) -> Result<Solution, FitError> {
    let parameters = problem.parameters;
    let values = problem.values(&problem.at);
    let residual = problem.evaluate(&problem.at).ok_or(FitError::NotFinite)?;
    let search_jacobian = problem.jacobian().ok_or(FitError::NotFinite)?;
    let on_bound = bound_hits(parameters, &values);
    // dr/dx = dr/dy / (dx/dy), with the slope of the transform by differences.
    let slope: Vec<f64> = (0..values.len())
        .map(|i| {
            let y = problem.at[i];
            (parameters[i].from_search(y + 1e-6) - parameters[i].from_search(y - 1e-6)) / 2e-6
        })
        .collect();
    // A parameter on its bound is held there by the bound, not by the data: it takes no part here.
    let free: Vec<usize> = (0..values.len()).filter(|i| !on_bound.contains(i)).collect();
    let jacobian = DMatrix::from_fn(residual.len(), free.len(), |row, column| {
        search_jacobian[(row, free[column])] / slope[free[column]]
    });
    let typical: Vec<f64> = free.iter().map(|&i| parameters[i].typical(values[i])).collect();
    let scaled = DMatrix::from_fn(residual.len(), free.len(), |row, c| jacobian[(row, c)] * typical[c]);
    let name = |column: usize| parameters[free[column]].name.clone();
    let singular_ratio = match identifiability::examine(&scaled) {
        Identifiability::Full { singular_ratio } => singular_ratio,
        Identifiability::NoInfluence(columns) => {
            return Err(FitError::NoInfluence { names: columns.into_iter().map(name).collect() });
        }
        Identifiability::Inseparable { parameters, singular_ratio } => {
            let names = parameters.into_iter().map(name).collect();
            return Err(FitError::Inseparable { names, singular_ratio });
        }
    };
    let mut std = vec![f64::NAN; values.len()];
    let mut correlations = DMatrix::identity(values.len(), values.len());
    if let Some(covariance) = covariance::sandwich(&jacobian, &residual) {
        let among_free = covariance::correlations(&covariance);
        for (a, &i) in free.iter().enumerate() {
            std[i] = covariance[(a, a)].max(0.0).sqrt();
            for (b, &j) in free.iter().enumerate() {
                correlations[(i, j)] = among_free[(a, b)];
            }
        }
        let names: Vec<(String, f64)> = (0..free.len())
            .map(|c| (name(c), std[free[c]] / typical[c].abs()))
            .filter(|(_, relative)| *relative > options.largest_relative_std)
            .collect();
        if !names.is_empty() {
            return Err(FitError::Undetermined { names });
        }
    }
    let residuals = residual.as_slice().to_vec();
    Ok(Solution { values, std, correlations, residuals, singular_ratio, on_bound, starts_agreeing })
}

fn bound_hits(parameters: &[Parameter], values: &[f64]) -> Vec<usize> {
    let on = |p: &Parameter, x: f64| {
        p.low.is_finite() && p.high.is_finite() && {
            let share = 0.5 * (1.0 + p.to_search(x).sin());
            !(1e-4..=1.0 - 1e-4).contains(&share)
        }
    };
    (0..values.len()).filter(|&i| on(&parameters[i], values[i])).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn decay(rate: f64, size: f64) -> Vec<f64> {
        (0..300).map(|i| size * (-rate * 0.01 * f64::from(i)).exp()).collect()
    }

    fn noisy(clean: &[f64], size: f64) -> Vec<f64> {
        let mut seed = 11u64;
        clean
            .iter()
            .map(|c| {
                seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                c + size * ((seed >> 11) as f64 / (1u64 << 53) as f64 - 0.5)
            })
            .collect()
    }

    #[test]
    fn parameters_that_span_decades_are_found_with_honest_intervals() {
        let data = noisy(&decay(2.0, 1e4), 100.0);
        let model =
            |x: &[f64]| Some(decay(x[0], x[1]).iter().zip(&data).map(|(m, d)| (m - d) / 100.0).collect());
        let parameters =
            [Parameter::logarithmic("rate", 0.1, 1e-3, 1e3), Parameter::logarithmic("size", 10.0, 1.0, 1e8)];
        let solution = minimise(&parameters, &[], &model, Options::default()).unwrap();
        for (i, truth) in [2.0, 1e4].into_iter().enumerate() {
            let error = (solution.values[i] - truth).abs();
            // Four standard deviations of an estimate from 300 samples.
            assert!(error < 4.0 * solution.std[i], "{i}: {error} {}", solution.std[i]);
            assert!(solution.std[i] < 0.01 * truth);
        }
    }

    #[test]
    fn a_parameter_that_never_reaches_the_model_is_refused_by_name() {
        let data = decay(2.0, 1.0);
        let model = |x: &[f64]| Some(decay(x[0], 1.0).iter().zip(&data).map(|(m, d)| m - d).collect());
        let parameters =
            [Parameter::linear("rate", 1.0, 0.1, 10.0), Parameter::linear("unused", 1.0, 0.1, 10.0)];
        let error = minimise(&parameters, &[], &model, Options::default()).unwrap_err();
        assert_eq!(error, FitError::NoInfluence { names: vec!["unused".into()] });
    }

    #[test]
    fn two_parameters_that_only_act_as_a_product_are_refused_by_name() {
        let data = noisy(&decay(2.0, 6.0), 0.1);
        let model =
            |x: &[f64]| Some(decay(x[0], x[1] * x[2]).iter().zip(&data).map(|(m, d)| m - d).collect());
        let parameters = [
            Parameter::linear("rate", 1.0, 0.1, 10.0),
            Parameter::logarithmic("theta", 1.0, 0.1, 10.0),
            Parameter::logarithmic("a0", 2.0, 0.1, 10.0),
        ];
        match minimise(&parameters, &[], &model, Options::default()).unwrap_err() {
            FitError::Inseparable { names, .. } => assert_eq!(names, ["theta", "a0"]),
            other => panic!("{other}"),
        }
    }

    #[test]
    fn a_second_start_leaves_a_local_minimum() {
        let wave = |f: f64| (0..400).map(|i| (f * 0.02 * f64::from(i)).sin()).collect::<Vec<_>>();
        let data = noisy(&wave(5.0), 0.05);
        let model = |x: &[f64]| Some(wave(x[0]).iter().zip(&data).map(|(m, d)| m - d).collect());
        let parameters = [Parameter::linear("frequency", 8.0, 1.0, 12.0)];
        let stuck = minimise(&parameters, &[], &model, Options::default()).unwrap();
        assert!((stuck.values[0] - 5.0).abs() > 0.5, "the test needs a start that gets stuck");
        let starts = [vec![3.0], vec![5.2], vec![10.0]];
        let solution = minimise(&parameters, &starts, &model, Options::default()).unwrap();
        assert!((solution.values[0] - 5.0).abs() < 0.01);
    }

    #[test]
    fn an_optimum_outside_the_bounds_is_reported_on_the_bound() {
        let data = noisy(&decay(2.0, 1.0), 0.01);
        let model = |x: &[f64]| Some(decay(x[0], x[1]).iter().zip(&data).map(|(m, d)| m - d).collect());
        let parameters = [Parameter::linear("rate", 1.0, 0.1, 1.5), Parameter::linear("size", 0.5, 0.1, 3.0)];
        let solution = minimise(&parameters, &[], &model, Options::default()).unwrap();
        assert_eq!(solution.on_bound, [0]);
        assert!((solution.values[0] - 1.5).abs() < 1e-3);
    }
}
