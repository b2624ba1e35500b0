//! Bounded Gauss–Newton for the many small fits of a diagnosis.
//!
//! Identification itself ([`crate::fit::least_squares`]) recomputes every derivative in every iteration
//! and starts in several places. Here dozens of candidates share one baseline: a fit starts from the
//! derivatives of the fit that it extends and renews them only when progress stalls, so a candidate
//! costs tens of simulations instead of hundreds.
//!
//! min Σ ρ(r), ρ(r) = ν ln(1 + r²/ν) (Student's t): residuals of some ten standard deviations, where a
//! sample's timing is off in a jump, must not outvote a second of sliding. Steps are damped after
//! Levenberg and Marquardt, in ln x for parameters that span decades, and cut to the bounds.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use crate::fit::bounds::{Parameter, Scale};

/// ν of the loss: near Gaussian up to three standard deviations.
const FREEDOM: f64 = 20.0;
/// Step of the difference quotients relative to a parameter's typical size.
const DIFFERENCE: f64 = 1e-3;
/// Relative fall of the loss below which the search ends.
const TOLERANCE: f64 = 1e-4;

/// Relative fall of the loss above which derivatives of an earlier point go on being used.
const BRISK: f64 = 0.02;

/// ρ(r) of one residual; masked ones (NaN) count nothing.
#[inline]
pub fn loss(residual: f64) -> f64 {
    if residual.is_nan() { 0.0 } else { FREEDOM * (residual * residual / FREEDOM).ln_1p() }
}

/// Residuals of a model at parameter values; `None` where the model refuses them.
pub type Residuals<'a> = dyn Fn(&[f64]) -> Option<Vec<f64>> + Sync + 'a;

/// A point of the search.
#[derive(Debug, Clone)]
pub struct Point {
    /// Parameter values.
    pub values: Vec<f64>,
    /// Residuals there; NaN is masked.
    pub residuals: Vec<f64>,
    /// Derivatives of the residuals, one column a parameter, by the parameter's search coordinate (its
    /// logarithm for a logarithmic one); may stem from a neighbouring point.
    pub columns: Vec<Vec<f64>>,
    /// Sum of the losses.
    pub loss: f64,
}

impl Point {
    /// Evaluates the model without derivatives.
    pub fn at(values: Vec<f64>, residuals: &Residuals<'_>) -> Option<Self> {
        let found = residuals(&values)?;
        let loss = found.iter().map(|r| loss(*r)).sum::<f64>();
        loss.is_finite().then_some(Self { values, residuals: found, columns: Vec::new(), loss })
    }

    /// Computes the derivatives by difference quotients.
    pub fn differentiate(&mut self, parameters: &[Parameter], residuals: &Residuals<'_>) {
        self.columns = (0..parameters.len())
            .into_par_iter()
            .map(|at| column(parameters, self, at, residuals).unwrap_or_default())
            .collect();
    }
}

/// One column of derivatives; empty where the model has no finite neighbour.
pub fn column(
    parameters: &[Parameter],
    point: &Point,
    at: usize,
    residuals: &Residuals<'_>,
) -> Option<Vec<f64>> {
    let parameter = &parameters[at];
    let size = match parameter.scale {
        Scale::Logarithmic => DIFFERENCE,
        Scale::Linear => DIFFERENCE * parameter.typical(point.values[at]),
    };
    for step in [size, -size] {
        let mut values = point.values.clone();
        values[at] = moved(parameter, values[at], step);
        if !(parameter.low..=parameter.high).contains(&values[at]) {
            continue;
        }
        if let Some(neighbour) = residuals(&values) {
            return Some(neighbour.iter().zip(&point.residuals).map(|(a, b)| (a - b) / step).collect());
        }
    }
    None
}

fn moved(parameter: &Parameter, value: f64, step: f64) -> f64 {
    match parameter.scale {
        Scale::Linear => value + step,
        Scale::Logarithmic => value * step.exp(),
    }
}

/// JᵀWJ and JᵀWr with the weights of the loss.
fn normal_equations(point: &Point) -> (DMatrix<f64>, DVector<f64>) {
    let count = point.columns.len();
    let weights: Vec<f64> = point
        .residuals
        .iter()
        .map(|r| if r.is_nan() { 0.0 } else { 1.0 / (1.0 + r * r / FREEDOM) })
        .collect();
    let product = |a: &[f64], b: &[f64]| -> f64 {
        let terms = a.iter().zip(b).zip(&weights);
        terms
            .map(|((x, y), w)| if *w > 0.0 && x.is_finite() && y.is_finite() { w * x * y } else { 0.0 })
            .sum()
    };
    let pairs: Vec<(usize, usize)> = (0..count).flat_map(|i| (0..=i).map(move |j| (i, j))).collect();
    let products: Vec<f64> =
        pairs.par_iter().map(|(i, j)| product(&point.columns[*i], &point.columns[*j])).collect();
    let mut matrix = DMatrix::zeros(count, count);
    for ((i, j), value) in pairs.into_iter().zip(products) {
        matrix[(i, j)] = value;
        matrix[(j, i)] = value;
    }
    let gradient =
        DVector::from_iterator(count, point.columns.iter().map(|column| product(column, &point.residuals)));
    (matrix, gradient)
}

/// Improves a point until the loss stalls or `rounds` renewals of the derivatives are spent. The point's
/// columns, where it has them, are used before they are renewed.
pub fn refine(mut point: Point, parameters: &[Parameter], residuals: &Residuals<'_>, rounds: usize) -> Point {
    let mut fresh = false;
    if point.columns.len() != parameters.len() {
        point.differentiate(parameters, residuals);
        fresh = true;
    }
    let mut damping = 1e-4;
    let mut renewals = usize::from(fresh);
    loop {
        let (matrix, gradient) = normal_equations(&point);
        let before = point.loss;
        let mut improved = false;
        for _ in 0..6 {
            let Some(values) = step(&point, parameters, &matrix, &gradient, damping) else { break };
            match Point::at(values, residuals) {
                Some(next) if next.loss < point.loss => {
                    let columns = std::mem::take(&mut point.columns);
                    point = Point { columns, ..next };
                    damping = (damping * 0.1).max(1e-7);
                    improved = true;
                    break;
                }
                _ => damping = (damping * 10.0).max(1e-3),
            }
        }
        let fall = before - point.loss;
        let small = fall < TOLERANCE * before.max(1.0);
        // Old derivatives are used for as long as they lead on briskly.
        if improved && fall > BRISK * before {
            fresh = false;
            continue;
        }
        let ended = fresh && (small || !improved);
        if ended || renewals >= rounds {
            break;
        }
        point.differentiate(parameters, residuals);
        renewals += 1;
        fresh = true;
        damping = 1e-4;
    }
    point
}

/// A damped step, cut to the bounds: a parameter on a bound that wants to leave is held there.
fn step(
    point: &Point,
    parameters: &[Parameter],
    matrix: &DMatrix<f64>,
    gradient: &DVector<f64>,
    damping: f64,
) -> Option<Vec<f64>> {
    let mut held: Vec<bool> = (0..parameters.len()).map(|i| matrix[(i, i)] <= 0.0).collect();
    for _ in 0..=parameters.len() {
        let free: Vec<usize> = (0..parameters.len()).filter(|i| !held[*i]).collect();
        if free.is_empty() {
            return None;
        }
        let mut reduced = DMatrix::from_fn(free.len(), free.len(), |i, j| matrix[(free[i], free[j])]);
        for i in 0..free.len() {
            reduced[(i, i)] *= 1.0 + damping;
            reduced[(i, i)] += 1e-12;
        }
        let right = DVector::from_iterator(free.len(), free.iter().map(|i| -gradient[*i]));
        let solution = reduced.cholesky()?.solve(&right);
        let mut values = point.values.clone();
        let mut newly_held = false;
        for (k, i) in free.iter().enumerate() {
            let parameter = &parameters[*i];
            let change = match parameter.scale {
                // A factor of e² at a time: beyond it the linear model means nothing.
                Scale::Logarithmic => solution[k].clamp(-2.0, 2.0),
                Scale::Linear => solution[k],
            };
            let wanted = moved(parameter, point.values[*i], change);
            values[*i] = wanted.clamp(parameter.low, parameter.high);
            if values[*i] != wanted && values[*i] == point.values[*i] {
                held[*i] = true;
                newly_held = true;
            }
        }
        if !newly_held {
            return values.iter().all(|v| v.is_finite()).then_some(values);
        }
    }
    None
}

/// Loss that a linear step in the given extra columns, together with the point's own, would take off:
/// (fall of the loss, coefficients of the extra columns).
pub fn promise(point: &Point, extra: &[Vec<f64>]) -> Option<(f64, Vec<f64>)> {
    let own = point.columns.len();
    let joint = Point {
        values: point.values.clone(),
        residuals: point.residuals.clone(),
        columns: point.columns.iter().chain(extra).cloned().collect(),
        loss: point.loss,
    };
    let (matrix, gradient) = normal_equations(&joint);
    let free: Vec<usize> = (0..matrix.nrows()).filter(|i| matrix[(*i, *i)] > 0.0).collect();
    let mut reduced = DMatrix::from_fn(free.len(), free.len(), |i, j| matrix[(free[i], free[j])]);
    for i in 0..free.len() {
        reduced[(i, i)] *= 1.0 + 1e-6;
    }
    let right = DVector::from_iterator(free.len(), free.iter().map(|i| -gradient[*i]));
    let solution = reduced.cholesky()?.solve(&right);
    let mut coefficients = vec![0.0; extra.len()];
    for (k, i) in free.iter().enumerate() {
        if *i >= own {
            coefficients[i - own] = solution[k];
        }
    }
    Some((solution.dot(&right), coefficients))
}

/// Standard deviations of the parameters in their own units, from the inverse of JᵀWJ times `inflation`;
/// NaN where the residuals do not determine one.
pub fn standard_deviations(point: &Point, parameters: &[Parameter], inflation: f64) -> Vec<f64> {
    let (matrix, _) = normal_equations(point);
    let free: Vec<usize> = (0..parameters.len()).filter(|i| matrix[(*i, *i)] > 1e-12).collect();
    let scale: Vec<f64> = free.iter().map(|i| matrix[(*i, *i)].sqrt()).collect();
    let reduced =
        DMatrix::from_fn(free.len(), free.len(), |i, j| matrix[(free[i], free[j])] / (scale[i] * scale[j]));
    let mut std = vec![f64::NAN; parameters.len()];
    if let Some(inverse) = reduced.try_inverse() {
        for (k, i) in free.iter().enumerate() {
            let own = (inverse[(k, k)].max(0.0) * inflation).sqrt() / scale[k];
            std[*i] = match parameters[*i].scale {
                Scale::Linear => own,
                Scale::Logarithmic => own * point.values[*i],
            };
        }
    }
    std
}

#[cfg(test)]
mod tests {
    use super::super::noise::tests::white;
    use super::*;

    fn exponential(noise: &[f64], values: &[f64]) -> Vec<f64> {
        (0..noise.len())
            .map(|i| {
                let t = i as f64 * 0.01;
                let truth = 3.0 * (-t / 1.5).exp() + 0.7;
                truth + 0.01 * noise[i] - values[0] * (-t / values[1]).exp() - values[2]
            })
            .map(|r| r / 0.01)
            .collect()
    }

    #[test]
    fn parameters_of_a_curve_are_found_within_their_standard_deviations() {
        let noise = white(1000, 3);
        let parameters = [
            Parameter::linear("a", 1.0, -10.0, 10.0),
            Parameter::logarithmic("tau", 0.3, 0.01, 100.0),
            Parameter::linear("c", 0.0, -10.0, 10.0),
        ];
        let model = |values: &[f64]| Some(exponential(&noise, values));
        let start = Point::at(vec![1.0, 0.3, 0.0], &model).unwrap();
        let found = refine(start, &parameters, &model, 8);
        let std = standard_deviations(&found, &parameters, 1.0);
        for ((value, truth), std) in found.values.iter().zip([3.0, 1.5, 0.7]).zip(std) {
            assert!((value - truth).abs() < 3.5 * std && std < 0.01, "{value} {truth} {std}");
        }
    }

    #[test]
    fn a_parameter_stays_within_its_bounds_and_the_others_do_their_best() {
        let noise = white(1000, 4);
        let parameters = [
            Parameter::linear("a", 1.0, -10.0, 2.0),
            Parameter::logarithmic("tau", 0.3, 0.01, 100.0),
            Parameter::linear("c", 0.0, -10.0, 10.0),
        ];
        let model = |values: &[f64]| Some(exponential(&noise, values));
        let found = refine(Point::at(vec![1.0, 0.3, 0.0], &model).unwrap(), &parameters, &model, 8);
        assert_eq!(found.values[0], 2.0);
        assert!(found.values[1] > 1.6);
    }

    #[test]
    fn a_promise_is_kept_by_a_linear_parameter() {
        let noise = white(500, 5);
        let ramp: Vec<f64> = (0..500).map(|i| f64::from(i) / 500.0).collect();
        let residuals: Vec<f64> = ramp.iter().zip(&noise).map(|(x, e)| 0.8 * x + 0.3 * e).collect();
        let point = Point {
            values: vec![],
            loss: residuals.iter().map(|r| loss(*r)).sum(),
            residuals: residuals.clone(),
            columns: vec![],
        };
        let (fall, found) = promise(&point, &[ramp.iter().map(|x| -x).collect()]).unwrap();
        let left: f64 = residuals.iter().zip(&ramp).map(|(r, x)| loss(r - found[0] * x)).sum();
        assert!((found[0] - 0.8).abs() < 0.1);
        // The loss is quadratic to r²/(2ν), here below 5 %.
        assert!(((point.loss - left) / fall - 1.0).abs() < 0.05);
    }
}
