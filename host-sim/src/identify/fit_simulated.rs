//! The contact simulated from motion and load alone: what `rig fit` ends with where such a simulation follows the rig.
//!
//! The observed slip finds the valley, but between samples of a millisecond it knows the force only by interpolation: a step of the
//! load that rings at 120 Hz is then wrong by a tenth, and so is what such steps alone tell, the block's damping. A
//! simulation goes between the samples, and a rig that slides steadily keeps it on its course. One that
//! sticks and slips does not: there the simulation slips at other instants, leaves more than the observed slip does, and is
//! not used.
//!
//! Plain least squares (Levenberg–Marquardt in Moré's form, crate `levenberg-marquardt`) and no weights: the steps are few
//! samples with large errors, which a robust likelihood would take for outliers.

use std::borrow::Cow;
use std::cell::RefCell;
use std::ops::Range;

use levenberg_marquardt::LevenbergMarquardt;
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::contact::problem::{Baseline, Numbers, Role};
use super::filters::{gaussian, rms};
use super::fit_interval::Known;
use super::fit_parameters::{set_all, values};
use super::linear::factor;
use super::slow_noise::Errors;
use crate::files::log::Log;
use crate::files::model_file::{ModelFile, SOME_STEP_S};
use crate::files::rig_file::RigFile;
use crate::fit::covariance::sandwich;
use crate::input_error::InputError;
use crate::least_squares::Problem;
use crate::predict::curve::shifted;
use crate::predict::{Accuracy, ContactInputs, StepPlan, simulate_planned};

/// Step of the differences, in ln: the simulation's own steps leave 1e-6 in its slopes.
const DIFFERENCE: f64 = 1e-3;
/// Evaluations over the number of parameters + 1, at most, in each search: from near by, LM needs fewer steps than there are
/// parameters, and each takes as many simulations.
const PATIENCE: usize = 1;
/// ln of factors on the damping at which a search begins, 0.7 to 2.7: the observed slip finds it too low more often than too
/// high, and below some damping a simulation sticks and slips where the rig did not, which no slope shows.
const DAMPINGS: [f64; 6] = [0.0, -0.4, 0.2, 0.4, 0.7, 1.0];
/// Searches, from the best of those: a second one costs nothing on two cores.
const SEARCHES: usize = 2;
/// Widths of the Gaussian over which residuals are smoothed, s, one search after the other. A tip that breaks away at another
/// instant is an error that no slope shows, but over a wider filter it is: so the search begins with a wide one. The last is
/// as wide as it takes for a torque ring that rings between samples of a millisecond to say nothing: it tells of the ring.
const WIDTHS_S: [f64; 3] = [8e-3, 4e-3, 2e-3];

/// A log ready for any number of simulations.
struct Run {
    inputs: ContactInputs,
    plan: StepPlan,
    measured_nm: Vec<f64>,
    /// Mean step, s.
    step_s: f64,
}

/// Logs and what is fitted to them.
pub(super) struct Simulated<'a> {
    model: &'a ModelFile,
    rig: &'a RigFile,
    baseline: &'a Baseline,
    free: &'a [String],
    runs: Vec<Run>,
    /// Deviation that makes the prior's rows comparable, N m.
    deviation_nm: f64,
}

/// A fit by simulation.
pub(super) struct SimulatedFit {
    /// Values of the baseline.
    pub(super) p: Vec<f64>,
    /// Measured less simulated, all logs on end, N m.
    residual_nm: DVector<f64>,
    /// Its slopes over the values.
    jacobian: DMatrix<f64>,
    /// Samples of each log.
    lengths: Vec<usize>,
}

impl SimulatedFit {
    /// What the logs say of the values; `None` where they do not tell them apart.
    pub(super) fn known(&self) -> Option<Known> {
        let residual = self.residual_nm.as_slice();
        let deviation = vec![rms(residual); residual.len()];
        let columns: Vec<Vec<f64>> =
            self.jacobian.column_iter().map(|c| c.iter().copied().collect()).collect();
        let errors = Errors { residual, deviation: &deviation, lengths: &self.lengths };
        let slow = |blocks: &[Range<usize>], within| errors.across_blocks(&columns, blocks, within);
        let covariance = sandwich(&self.jacobian, &self.residual_nm, Some(&slow))?;
        let normal = factor(&(self.jacobian.transpose() * &self.jacobian));
        Some(Known { covariance, to_top: -normal.solve(&(self.jacobian.transpose() * &self.residual_nm)) })
    }
}

/// Over a Gaussian of so many samples; one narrower than a sample leaves them as they are.
fn smoothed(values: &[f64], width: f64) -> Vec<f64> {
    if width < 0.5 { values.to_vec() } else { gaussian(values, width, 0) }
}

/// RMS of residuals on an even grid of this step, smoothed as those of the last search.
pub(super) fn smoothed_rms(residual_nm: &[f64], step_s: f64) -> f64 {
    rms(&smoothed(residual_nm, WIDTHS_S[WIDTHS_S.len() - 1] / step_s))
}

impl<'a> Simulated<'a> {
    /// With steps that suit the values `p`; `deviation_nm` is what the observed slip leaves.
    ///
    /// # Errors
    /// Logs without the columns; a model that does not take these values.
    pub(super) fn new(
        model: &'a ModelFile,
        rig: &'a RigFile,
        baseline: &'a Baseline,
        free: &'a [String],
        logs: &[Log],
        (p, deviation_nm): (&[f64], f64),
    ) -> Result<Self, InputError> {
        let mut there = model.clone();
        set_all(&mut there, free, &values(model, baseline, p, free))?;
        let element = there.friction_model(SOME_STEP_S)?;
        let runs = logs.iter().map(|log| {
            let signals = log.contact()?;
            let inputs = ContactInputs::new(&signals, rig);
            let plan = StepPlan::new(&element, &rig.friction_bridge, &inputs, Accuracy::Fast);
            let last = inputs.time_s.last().copied().unwrap_or_default();
            let step_s = (last - inputs.time_s.first().copied().unwrap_or_default())
                / (inputs.len().max(2) - 1) as f64;
            Ok(Run { inputs, plan, measured_nm: signals.friction_torque_nm.to_vec(), step_s })
        });
        let runs = runs.collect::<Result<_, InputError>>()?;
        Ok(Self { model, rig, baseline, free, runs, deviation_nm })
    }

    /// Measured less simulated, smoothed, all logs on end, N m; `None` where the model does not take these values.
    fn residual_nm(&self, p: &[f64], width_s: f64) -> Option<DVector<f64>> {
        let mut model = self.model.clone();
        model.extensions.clear();
        set_all(&mut model, self.free, &values(self.model, self.baseline, p, self.free)).ok()?;
        let Numbers { late_ms, friction_zero_nm, normal_zero_n, .. } = self.baseline.numbers(p);
        let each = self.runs.par_iter().map(|run| {
            let mut inputs = Cow::Borrowed(&run.inputs);
            if normal_zero_n != 0.0 {
                inputs.to_mut().normal_force_n.iter_mut().for_each(|load| *load -= normal_zero_n);
            }
            let torque = simulate_planned(&model, self.rig, &inputs, &run.plan).ok()?;
            let shown = shifted(&run.inputs.time_s, &torque, -1e-3 * late_ms);
            let off = |(y, x): (&f64, &f64)| y - x - friction_zero_nm;
            let residual: Vec<f64> = run.measured_nm.iter().zip(&shown).map(off).collect();
            Some(smoothed(&residual, width_s / run.step_s))
        });
        let residual = DVector::from_vec(each.collect::<Option<Vec<_>>>()?.concat());
        residual.iter().all(|r| r.is_finite()).then_some(residual)
    }

    /// Slopes of the residual over the values, about `p` where it is `here`.
    fn jacobian(&self, p: &[f64], here: &DVector<f64>, width_s: f64) -> Option<DMatrix<f64>> {
        let columns = (0..p.len()).into_par_iter().map(|i| {
            let mut q = p.to_vec();
            q[i] += DIFFERENCE;
            Some((self.residual_nm(&q, width_s)? - here) / DIFFERENCE)
        });
        Some(DMatrix::from_columns(&columns.collect::<Option<Vec<_>>>()?))
    }

    /// The best fit from the values `from` and others beside them, where it leaves less than the observed slip did.
    pub(super) fn fit(&self, from: &[f64], progress: &(dyn Fn() + Sync)) -> Option<SimulatedFit> {
        let [widest, .., finest] = WIDTHS_S;
        let of = |p: &[f64], width_s: f64| Some(rms(self.residual_nm(p, width_s)?.as_slice()));
        let mut tried: Vec<(f64, Vec<f64>)> = self
            .starts(from)
            .into_par_iter()
            .filter_map(|start| Some((of(&start, widest)?, start)))
            .collect();
        tried.sort_by(|a, b| a.0.total_cmp(&b.0));
        // Not on the rig's course even by the wide filter, which passes the least: given up before the dear part.
        if tried.first()?.0 > self.deviation_nm {
            return None;
        }
        let search = |from: &[f64], width_s: f64| {
            let p = self.search(from, width_s, progress);
            Some((of(&p, width_s)?, p))
        };
        let first = tried.into_par_iter().take(SEARCHES).filter_map(|(_, start)| search(&start, widest));
        let best = first.min_by(|a, b| a.0.total_cmp(&b.0))?;
        let (left, p) =
            WIDTHS_S.into_iter().skip(1).try_fold(best, |(_, from), width_s| search(&from, width_s))?;
        if left >= self.deviation_nm {
            return None;
        }
        let residual_nm = self.residual_nm(&p, finest)?;
        let jacobian = self.jacobian(&p, &residual_nm, finest)?;
        let lengths = self.runs.iter().map(|run| run.measured_nm.len()).collect();
        Some(SimulatedFit { p, residual_nm, jacobian, lengths })
    }

    /// The values `from`, with other dampings where the model has one.
    fn starts(&self, from: &[f64]) -> Vec<Vec<f64>> {
        let Some(damping) = self.baseline.free.iter().position(|base| base.role == Role::Damping) else {
            return vec![from.to_vec()];
        };
        let moved = |by: f64| {
            let mut p = from.to_vec();
            p[damping] += by;
            p
        };
        DAMPINGS.into_iter().map(moved).collect()
    }

    /// Least squares of the residual, and of the values about their prior.
    fn search(&self, from: &[f64], width_s: f64, progress: &(dyn Fn() + Sync)) -> Vec<f64> {
        let free = &self.baseline.free;
        // The search asks for residuals and then for the slopes there.
        let known: RefCell<Option<(DVector<f64>, DVector<f64>)>> = RefCell::new(None);
        let residuals = |p: &DVector<f64>| {
            let residual = self.residual_nm(p.as_slice(), width_s)?;
            let prior = free.iter().zip(p.iter()).map(|(base, x)| {
                let q = &base.parameter;
                self.deviation_nm * (x - q.mean) / q.sd
            });
            let all = DVector::from_iterator(residual.len() + p.len(), residual.iter().copied().chain(prior));
            *known.borrow_mut() = Some((p.clone(), residual));
            Some(all)
        };
        let jacobian = |p: &DVector<f64>| {
            progress();
            let here = match known.take() {
                Some((at, residual)) if at == *p => residual,
                _ => self.residual_nm(p.as_slice(), width_s)?,
            };
            let of_residual = self.jacobian(p.as_slice(), &here, width_s)?;
            let (rows, columns) = of_residual.shape();
            Some(DMatrix::from_fn(rows + columns, columns, |i, j| match i.checked_sub(rows) {
                None => of_residual[(i, j)],
                Some(of) if of == j => self.deviation_nm / free[j].parameter.sd,
                Some(_) => 0.0,
            }))
        };
        let problem = Problem { at: DVector::from_column_slice(from), residuals, jacobian };
        let lm = LevenbergMarquardt::new().with_ftol(1e-6).with_xtol(1e-5).with_patience(PATIENCE);
        lm.minimize(problem).0.at.as_slice().to_vec()
    }
}
