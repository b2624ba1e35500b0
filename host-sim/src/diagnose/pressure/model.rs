//! Normal force from M1's torque with any set of effects, linear in its sizes.
//!
//! F_N = B P[G τ − F0 − Σ θ_i φ_i] + lag·d/dt, P the press's mode and B the normal bridge, both of the
//! rig file. Measured force and columns go through one low-pass ([`Whitener`]) that makes the error of a
//! true model white with variance one; for given shapes the sizes follow from linear least squares.
//! What slow motion shows of the mode is its lag 2ζ/ω alone, so a change of the lag is what is fitted
//! of it. The bridge is left out for the effects' columns: its lag there is a fraction of a millisecond.
//!
//! [`Whitener`]: crate::diagnose::drive::whitening::Whitener

use std::sync::Arc;

use nalgebra::{DMatrix, DVector};

use super::conditioned::PressureLog;
use super::effect::Prepared;
use crate::diagnose::drive::model::dot;
use crate::files::rig_file::{Mode, RigFile};
use crate::fit::drive::record::central_difference;
use crate::predict::{BridgeModel, SecondOrder};

/// Names of the baseline's sizes.
pub const BASELINE: [&str; 3] = ["lever_gain_n_per_nm", "preload_n", "lag_n_s_per_nm"];

/// An effect in the model.
#[derive(Clone)]
pub struct Part {
    /// Its id.
    pub id: &'static str,
    /// The effect, set up.
    pub prepared: Arc<dyn Prepared>,
}

/// A log with what no shape changes.
pub struct Filtered {
    /// The log.
    pub log: PressureLog,
    press: Mode,
    measured: Vec<f64>,
    baseline: [Vec<f64>; 3],
    white: [Vec<f64>; 3],
}

/// A column of the linear problem.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ColumnName {
    /// Effect, or the baseline.
    pub effect: Option<&'static str>,
    /// Name with unit.
    pub name: &'static str,
    /// Whether it may not be negative.
    pub not_negative: bool,
}

/// Everything nonlinear: shapes of all parts in order, and for each part a value per log.
#[derive(Debug, Clone, PartialEq)]
pub struct Shapes {
    /// Shapes of all parts.
    pub values: Vec<f64>,
    /// `own[part][log]`.
    pub own: Vec<Vec<f64>>,
}

/// Measured force and columns of a log behind the filter.
pub struct Whitened {
    /// Measured force.
    pub measured: Vec<f64>,
    /// Columns.
    pub columns: Vec<Vec<f64>>,
}

impl Filtered {
    /// Filters a log.
    pub fn new(rig: &RigFile, log: PressureLog) -> Self {
        let step_s = log.step_s;
        let start = log.torque_nm.first().copied().unwrap_or(0.0);
        let mut press = SecondOrder::new(rig.pressure.mode_hz, rig.pressure.damping_ratio, start);
        let mut bridge = BridgeModel::new(&rig.normal_bridge, start);
        let pressed: Vec<f64> =
            log.torque_nm.iter().map(|torque| bridge.step(step_s, press.step(step_s, *torque))).collect();
        let rate = central_difference(&pressed, step_s);
        let baseline = [pressed, vec![-1.0; log.len()], rate];
        let white = baseline.clone().map(|column| log.whitener.apply(&column, &log.weight));
        let measured = log.whitener.apply(&log.normal_n, &log.weight);
        Self { press: rig.pressure, measured, baseline, white, log }
    }

    /// A column that the effect takes from the force, as the normal force shows it.
    fn through_press(&self, values: &[f64]) -> Vec<f64> {
        let start = values.first().copied().unwrap_or(0.0);
        let mut press = SecondOrder::new(self.press.mode_hz, self.press.damping_ratio, start);
        values.iter().map(|x| -press.step(self.log.step_s, *x)).collect()
    }
}

impl Whitened {
    /// What given sizes leave of the measured force.
    pub fn residual(&self, sizes: &[f64]) -> Vec<f64> {
        let mut left = self.measured.clone();
        for (column, size) in self.columns.iter().zip(sizes) {
            left.iter_mut().zip(column).for_each(|(left, x)| *left -= size * x);
        }
        left
    }
}

/// Logs and effects.
pub struct Model<'a> {
    /// Training logs first.
    pub logs: &'a [Filtered],
    /// Effects in the order of their shapes.
    pub parts: &'a [Part],
}

impl Model<'_> {
    fn part_columns(&self, shapes: &Shapes, index: usize) -> Vec<(ColumnName, Vec<f64>)> {
        let mut at = 0;
        let mut all = Vec::new();
        for (k, part) in self.parts.iter().enumerate() {
            let count = part.prepared.shapes().len();
            let own = shapes.own[k][index];
            for column in part.prepared.columns(&shapes.values[at..at + count], own, &self.logs[index].log) {
                let (name, not_negative) = (column.name, column.not_negative);
                all.push((ColumnName { effect: Some(part.id), name, not_negative }, column.values));
            }
            at += count;
        }
        all
    }

    /// Names of all columns.
    pub fn names(&self, shapes: &Shapes) -> Vec<ColumnName> {
        let baseline = BASELINE.map(|name| ColumnName { effect: None, name, not_negative: false });
        baseline.into_iter().chain(self.part_columns(shapes, 0).into_iter().map(|(name, _)| name)).collect()
    }

    /// Columns of a log at its own rate.
    pub fn columns(&self, shapes: &Shapes, index: usize) -> Vec<Vec<f64>> {
        let filtered = &self.logs[index];
        let parts = self.part_columns(shapes, index);
        let parts = parts.into_iter().map(|(_, values)| filtered.through_press(&values));
        filtered.baseline.iter().cloned().chain(parts).collect()
    }

    /// The linear problem of a log.
    pub fn whitened(&self, shapes: &Shapes, index: usize) -> Whitened {
        let filtered = &self.logs[index];
        let log = &filtered.log;
        let parts = self.part_columns(shapes, index);
        let parts =
            parts.into_iter().map(|(_, x)| log.whitener.apply(&filtered.through_press(&x), &log.weight));
        let columns = filtered.white.iter().cloned().chain(parts).collect();
        Whitened { measured: filtered.measured.clone(), columns }
    }
}

/// Sizes that fit problems best, those that may not be negative held at 0 where they would be; `None`
/// where the columns do not determine them.
pub fn sizes(problems: &[Whitened], names: &[ColumnName]) -> Option<Vec<f64>> {
    let count = names.len();
    let mut normal = DMatrix::<f64>::zeros(count, count);
    let mut right = DVector::<f64>::zeros(count);
    for problem in problems {
        for i in 0..count {
            right[i] += dot(&problem.columns[i], &problem.measured);
            for j in 0..=i {
                normal[(i, j)] += dot(&problem.columns[i], &problem.columns[j]);
                normal[(j, i)] = normal[(i, j)];
            }
        }
    }
    let mut free: Vec<usize> = (0..count).filter(|&i| normal[(i, i)] > 0.0).collect();
    loop {
        let scale: Vec<f64> = free.iter().map(|&i| 1.0 / normal[(i, i)].sqrt()).collect();
        let scaled = DMatrix::from_fn(free.len(), free.len(), |a, b| {
            // Columns that are alike within rounding share their size instead of failing.
            let ridge = if a == b { 1e-10 } else { 0.0 };
            normal[(free[a], free[b])] * scale[a] * scale[b] + ridge
        });
        let target = DVector::from_iterator(free.len(), free.iter().zip(&scale).map(|(&i, s)| right[i] * s));
        let solution = scaled.cholesky()?.solve(&target);
        let least = free
            .iter()
            .zip(solution.iter())
            .filter(|(i, x)| names[**i].not_negative && **x < 0.0)
            .min_by(|a, b| a.1.total_cmp(b.1));
        if let Some((&worst, _)) = least {
            free.retain(|i| *i != worst);
            continue;
        }
        let mut values = vec![0.0; count];
        for ((&i, x), s) in free.iter().zip(solution.iter()).zip(&scale) {
            values[i] = x * s;
        }
        return values.iter().all(|x| x.is_finite()).then_some(values);
    }
}
