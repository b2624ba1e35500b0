//! Search of the shapes: the best of the start values, then bounded least squares on the projected
//! residual; the values that held-out logs have for themselves are found last, and nothing else of them.

use super::model::{ColumnName, Filtered, Model, Part, Shapes, Whitened, sizes};
use crate::diagnose::analysis::Role;
use crate::fit::bounds::Parameter;
use crate::fit::least_squares::{Options, search};

/// Start values that are taken into the search.
const STARTS: usize = 2;

/// A fitted model.
#[derive(Clone)]
pub struct Solved {
    /// Effects in it.
    pub parts: Vec<Part>,
    /// Shapes found.
    pub shapes: Shapes,
    /// Names of the columns.
    pub names: Vec<ColumnName>,
    /// Sizes of the columns.
    pub sizes: Vec<f64>,
}

/// Indices of the training logs.
pub fn training(logs: &[Filtered]) -> Vec<usize> {
    (0..logs.len()).filter(|&i| logs[i].log.role == Role::Train).collect()
}

/// Fits a model from `start`; `grid` holds start values of the last part's shapes.
pub fn solve(model: &Model<'_>, start: Shapes, grid: &[Vec<f64>]) -> Result<Solved, String> {
    let logs = training(model.logs);
    let names = model.names(&start);
    let problems =
        |shapes: &Shapes| -> Vec<Whitened> { logs.iter().map(|&i| model.whitened(shapes, i)).collect() };
    let projected = |shapes: &Shapes| -> Option<Vec<f64>> {
        let problems = problems(shapes);
        let sizes = sizes(&problems, &names)?;
        Some(problems.iter().flat_map(|problem| problem.residual(&sizes)).collect())
    };
    let cost = |shapes: &Shapes| projected(shapes).map_or(f64::INFINITY, |r| r.iter().map(|x| x * x).sum());

    // Shapes of all parts, then the values of the training logs.
    let mut parameters: Vec<Parameter> =
        model.parts.iter().flat_map(|part| part.prepared.shapes().to_vec()).collect();
    let shape_count = parameters.len();
    let mut places = Vec::new();
    for (part, own) in model.parts.iter().map(|part| part.prepared.own_value()).enumerate() {
        let Some(own) = own else { continue };
        for &log in logs.iter().skip(usize::from(own.first_stays)) {
            let at = start.own[part][log];
            let half = own.half_span;
            parameters.push(Parameter::linear(own.name, at, at.min(-half), at.max(half)));
            places.push((part, log));
        }
    }
    let pack = |shapes: &Shapes| -> Vec<f64> {
        let own = places.iter().map(|&(part, log)| shapes.own[part][log]);
        shapes.values.iter().copied().chain(own).collect()
    };
    let unpack = |values: &[f64]| -> Shapes {
        let mut shapes = start.clone();
        shapes.values.copy_from_slice(&values[..shape_count]);
        for (value, &(part, log)) in values[shape_count..].iter().zip(&places) {
            shapes.own[part][log] = *value;
        }
        shapes
    };
    let mut tried: Vec<(f64, Shapes)> = grid
        .iter()
        .map(|values| {
            let mut shapes = start.clone();
            shapes.values[shape_count - values.len()..].copy_from_slice(values);
            (cost(&shapes), shapes)
        })
        .collect();
    tried.push((cost(&start), start.clone()));
    tried.sort_by(|a, b| a.0.total_cmp(&b.0));
    tried.truncate(STARTS);
    let mut best = tried[0].clone();
    if !parameters.is_empty() {
        let options = Options { patience: 4, tolerance: 1e-5, one_sided: true, ..Options::default() };
        for (_, from) in &tried {
            for (parameter, value) in parameters.iter_mut().zip(pack(from)) {
                parameter.start = value.clamp(parameter.low, parameter.high);
            }
            // A start without influence or without convergence leaves the grid's best.
            if let Ok(values) = search(&parameters, &[], &|values| projected(&unpack(values)), options) {
                let found = unpack(&values);
                let found_cost = cost(&found);
                if found_cost < best.0 {
                    best = (found_cost, found);
                }
            }
        }
    }
    let nothing = || "nothing of the logs is usable: the press does not move in contact".to_string();
    let sizes = sizes(&problems(&best.1), &names).ok_or_else(nothing)?;
    let mut solved = Solved { parts: model.parts.to_vec(), shapes: best.1, names, sizes };
    for log in (0..model.logs.len()).filter(|&i| model.logs[i].log.role == Role::Holdout) {
        align(model, &mut solved, log);
    }
    Ok(solved)
}

/// Finds the values that a held-out log has for itself, one part after the other.
fn align(model: &Model<'_>, solved: &mut Solved, log: usize) {
    for part in 0..model.parts.len() {
        let Some(own) = model.parts[part].prepared.own_value() else { continue };
        let cost = |value: f64| -> f64 {
            let mut shapes = solved.shapes.clone();
            shapes.own[part][log] = value;
            model.whitened(&shapes, log).residual(&solved.sizes).iter().map(|x| x * x).sum()
        };
        let steps = 6;
        let mut width = own.half_span / f64::from(steps);
        let mut best = (f64::INFINITY, 0.0);
        for i in -steps..=steps {
            let value = width * f64::from(i);
            let here = cost(value);
            if here < best.0 {
                best = (here, value);
            }
        }
        for _ in 0..7 {
            width *= 0.5;
            for value in [best.1 - width, best.1 + width] {
                let value = value.clamp(-own.half_span, own.half_span);
                let here = cost(value);
                if here < best.0 {
                    best = (here, value);
                }
            }
        }
        solved.shapes.own[part][log] = best.1;
    }
}
