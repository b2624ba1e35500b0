//! Search of the shapes: grids for starts, then bounded least squares on the projected residual.

use super::effect::Origins;
use super::model::{ColumnName, Model, Part, Shapes, Sizes, Whitened, dot};
use crate::diagnose::analysis::Role;
use crate::fit::bounds::Parameter;
use crate::fit::least_squares::{Options, search};

/// Starts that are taken from a grid into the search.
const STARTS: usize = 2;

/// A second start is searched from where its sum of squares is within this factor of the best one's.
const OTHER_START: f64 = 1.5;

/// A fitted model.
#[derive(Clone)]
pub struct Solved {
    /// Effects in it.
    pub parts: Vec<Part>,
    /// Shapes found, origins of all logs.
    pub shapes: Shapes,
    /// Names of the columns.
    pub names: Vec<ColumnName>,
    /// Sizes.
    pub sizes: Sizes,
}

fn training(model: &Model<'_>) -> Vec<usize> {
    (0..model.logs.len()).filter(|&i| model.logs[i].log.role == Role::Train).collect()
}

fn problems(model: &Model<'_>, shapes: &Shapes, logs: &[usize]) -> Vec<Whitened> {
    logs.iter().map(|&i| model.whitened(shapes, i)).collect()
}

/// Residuals of whitened problems for sizes, one after the other.
pub fn residuals(problems: &[Whitened], sizes: &Sizes) -> Vec<f64> {
    problems.iter().flat_map(|problem| problem.residual(&sizes.values)).collect()
}

/// Fits a model. `start` are shapes to begin with; `grids` replace parts of it: position in the
/// shapes, and values.
pub fn solve(model: &Model<'_>, start: Shapes, grids: &[(usize, Vec<Vec<f64>>)]) -> Result<Solved, String> {
    let logs = training(model);
    let names = model.names(&start);
    let cost = |shapes: &Shapes| -> f64 {
        model.solve(&problems(model, shapes, &logs), &names).map_or(f64::INFINITY, |s| s.sum_of_squares)
    };
    let nothing = || "nothing of the logs is usable: the drive does not move".to_string();
    let mut shapes = start;
    let mut parameters: Vec<Parameter> =
        model.parts.iter().flat_map(|part| part.prepared.shapes().to_vec()).collect();
    let shape_count = parameters.len();
    let origins = origins(model.parts);
    if let Some(origins) = &origins {
        // The first log's origin stays: sines and cosines turn it.
        for (index, &log) in logs.iter().enumerate().skip(1) {
            let at = shapes.origins[log];
            let half = 0.5 * origins.span;
            parameters.push(Parameter::linear(&format!("origin_{index}"), at, at - half, at + half));
        }
    }
    let unpack = |values: &[f64], near: &Shapes| -> Shapes {
        let mut shapes = near.clone();
        shapes.values.copy_from_slice(&values[..shape_count]);
        for (value, &log) in values[shape_count..].iter().zip(logs.iter().skip(1)) {
            shapes.origins[log] = *value;
        }
        shapes
    };
    if !parameters.is_empty() {
        let mut starts: Vec<(f64, Shapes)> = vec![(cost(&shapes), shapes.clone())];
        for (at, grid) in grids {
            let mut tried: Vec<(f64, Shapes)> = grid
                .iter()
                .map(|values| {
                    let mut shapes = starts[0].1.clone();
                    shapes.values[*at..*at + values.len()].copy_from_slice(values);
                    (cost(&shapes), shapes)
                })
                .collect();
            tried.append(&mut starts);
            tried.sort_by(|a, b| a.0.total_cmp(&b.0));
            tried.truncate(STARTS);
            starts = tried;
        }
        let mut best = starts[0].clone();
        let projected = |values: &[f64]| -> Option<Vec<f64>> {
            let problems = problems(model, &unpack(values, &shapes), &logs);
            let sizes = model.solve(&problems, &names)?;
            Some(residuals(&problems, &sizes))
        };
        // One or two shapes are cheap: searched to the end, from each start.
        let few = parameters.len() <= 2;
        let patience = if few { 25 } else { 8 };
        let options = Options { patience, tolerance: 1e-5, one_sided: !few, ..Options::default() };
        let promising = if few { f64::INFINITY } else { OTHER_START * starts[0].0 };
        for (_, start) in starts.iter().filter(|(cost, _)| *cost <= promising) {
            for (parameter, value) in parameters.iter_mut().zip(&start.values) {
                parameter.start = value.clamp(parameter.low, parameter.high);
            }
            // A start without influence or without convergence leaves the grid's best.
            if let Ok(values) = search(&parameters, &[], &projected, options) {
                let found = unpack(&values, &shapes);
                let found_cost = cost(&found);
                if found_cost < best.0 {
                    best = (found_cost, found);
                }
            }
        }
        shapes = best.1;
    }
    let sizes = model.solve(&problems(model, &shapes, &logs), &names).ok_or_else(nothing)?;
    let mut solved = Solved { parts: model.parts.to_vec(), shapes, names, sizes };
    if let Some(origins) = origins {
        align_holdout(model, &mut solved, &origins);
    }
    Ok(solved)
}

/// Where the parts ask for an origin; the widest and finest search where several do.
pub fn origins(parts: &[Part]) -> Option<Origins<'_>> {
    let asked = parts.iter().filter_map(|part| part.prepared.origins());
    asked.reduce(|a, b| Origins { span: a.span.max(b.span), step: a.step.min(b.step), ..a })
}

/// Finds the origins of logs that were not fitted: the only thing that is fitted to them.
///
/// A shift by o turns each pair of columns: cos w(q − o) = cos wo C + sin wo S, sin w(q − o) =
/// cos wo S − sin wo C, so the sum of squares follows from the products of C and S at origin 0.
fn align_holdout(model: &Model<'_>, solved: &mut Solved, origins: &Origins<'_>) {
    // Pairs of columns of all parts that are locked to position, and the wave number of each pair.
    let mut columns = Vec::new();
    let mut waves = Vec::new();
    for part in model.parts {
        let Some(own) = part.prepared.origins() else { continue };
        let Some(first) = solved.names.iter().position(|name| name.effect == Some(part.id)) else { continue };
        columns.extend(first..first + 2 * own.waves.len());
        waves.extend_from_slice(own.waves);
    }
    for log in 0..model.logs.len() {
        if model.logs[log].log.role == Role::Train {
            continue;
        }
        solved.shapes.origins[log] = 0.0;
        let problem = model.whitened(&solved.shapes, log);
        let mut others = solved.sizes.values.clone();
        columns.iter().for_each(|&column| others[column] = 0.0);
        let left = problem.residual(&others);
        let pairs: Vec<&Vec<f64>> = columns.iter().map(|&column| &problem.columns[column]).collect();
        let onto: Vec<f64> = pairs.iter().map(|column| dot(column, &left)).collect();
        let products: Vec<Vec<f64>> =
            pairs.iter().map(|a| pairs.iter().map(|b| dot(a, b)).collect()).collect();
        let sizes: Vec<f64> = columns.iter().map(|&column| solved.sizes.values[column]).collect();
        let cost = |origin: f64| -> f64 {
            let turned: Vec<f64> = waves
                .iter()
                .zip(sizes.chunks(2))
                .flat_map(|(wave, pair)| {
                    let (sin, cos) = (wave * origin).sin_cos();
                    [pair[0] * cos - pair[1] * sin, pair[0] * sin + pair[1] * cos]
                })
                .collect();
            let explained = dot(&turned, &onto);
            let own: f64 = turned.iter().zip(&products).map(|(a, row)| a * dot(row, &turned)).sum();
            own - 2.0 * explained
        };
        let steps = (0.5 * origins.span / origins.step).ceil() as i64;
        let mut best = (f64::INFINITY, 0.0);
        for step in -steps..=steps {
            let origin = origins.step * step as f64;
            let value = cost(origin);
            if value < best.0 {
                best = (value, origin);
            }
        }
        let mut width = 0.5 * origins.step;
        for _ in 0..10 {
            for origin in [best.1 - width, best.1 + width] {
                let value = cost(origin);
                if value < best.0 {
                    best = (value, origin);
                }
            }
            width *= 0.5;
        }
        solved.shapes.origins[log] = best.1;
    }
}
