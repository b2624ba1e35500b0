//! The contact simulated from motion and load alone: what `rig fit` ends with where such a simulation follows the rig.
//!
//! The observed slip finds the valley, but between samples of a millisecond it knows the force only by interpolation: a step of the
//! load that rings at 120 Hz is then wrong by a tenth, and what such steps alone tell, the block's damping, is drawn
//! towards F_N |g′|. A simulation goes between the samples, and a rig that slides steadily keeps it on its course. One that
//! sticks and slips does not: there the simulation slips at other instants, leaves more than the observed slip does, and is
//! not used.
//!
//! Plain least squares (Levenberg–Marquardt in Moré's form, crate `levenberg-marquardt`) and no weights: the steps are few
//! samples with large errors, which a robust likelihood would take for outliers.

use levenberg_marquardt::{LeastSquaresProblem, LevenbergMarquardt};
use nalgebra::{DMatrix, DVector, Dyn, Owned};
use rayon::prelude::*;

use super::contact::problem::{Baseline, Role};
use super::filters::gaussian;
use super::fit_parameters::{set_all, values};
use crate::files::log::Log;
use crate::files::model_file::ModelFile;
use crate::files::rig_file::RigFile;
use crate::input_error::InputError;
use crate::predict::curve::shifted;
use crate::predict::{Accuracy, ContactInputs, StepPlan, simulate_planned};

/// Any step size, before the plan sets it.
const SOME_STEP_S: f64 = 1e-4;
/// Step of the differences, in ln: the simulation's own steps leave 1e-6 in its slopes.
const DIFFERENCE: f64 = 1e-3;
/// Steps over the number of parameters + 1, at most, in each search; each takes as many simulations.
const PATIENCE: usize = 1;
/// ln of factors on the damping at which a search begins: below some damping a simulation sticks and slips where the rig did
/// not, which no slope shows.
const DAMPINGS: [f64; 6] = [0.0, -0.4, 0.2, 0.4, 0.7, 1.0];
/// Searches, from the best of those.
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
    pub(super) residual_nm: DVector<f64>,
    /// Its slopes over the values.
    pub(super) jacobian: DMatrix<f64>,
}

/// Root mean square.
fn rms(values: &DVector<f64>) -> f64 {
    values.norm() / (values.len().max(1) as f64).sqrt()
}

/// Over a Gaussian of so many samples; one narrower than a sample leaves them as they are.
fn smoothed(values: &[f64], width: f64) -> Vec<f64> {
    if width < 0.5 { values.to_vec() } else { gaussian(values, width, 0) }
}

/// RMS of residuals on an even grid of this step, smoothed as those of the last search.
pub(super) fn smoothed_rms(residual_nm: &[f64], step_s: f64) -> f64 {
    rms(&DVector::from_vec(smoothed(residual_nm, WIDTHS_S[WIDTHS_S.len() - 1] / step_s)))
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
            let step_s =
                (last - inputs.time_s.first().copied().unwrap_or_default()) / inputs.len().max(2) as f64;
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
        let late = self.baseline.free.iter().position(|base| base.role == Role::Late);
        let late_s = late.map_or(0.0, |at| 1e-3 * self.baseline.bounded(p, at));
        let each = self.runs.par_iter().map(|run| {
            let torque = simulate_planned(&model, self.rig, &run.inputs, &run.plan).ok()?;
            let shown = shifted(&run.inputs.time_s, &torque, -late_s);
            let residual: Vec<f64> = run.measured_nm.iter().zip(&shown).map(|(y, x)| y - x).collect();
            Some(smoothed(&residual, width_s / run.step_s))
        });
        let residual = DVector::from_vec(each.collect::<Option<Vec<_>>>()?.concat());
        residual.iter().all(|r| r.is_finite()).then_some(residual)
    }

    fn jacobian(&self, p: &[f64], width_s: f64) -> Option<DMatrix<f64>> {
        let here = self.residual_nm(p, width_s)?;
        let columns = (0..p.len()).into_par_iter().map(|i| {
            let mut q = p.to_vec();
            q[i] += DIFFERENCE;
            Some((self.residual_nm(&q, width_s)? - &here) / DIFFERENCE)
        });
        Some(DMatrix::from_columns(&columns.collect::<Option<Vec<_>>>()?))
    }

    /// The best fit from the values `from` and others beside them, where it leaves less than the observed slip did.
    pub(super) fn fit(&self, from: &[f64], progress: &(dyn Fn() + Sync)) -> Option<SimulatedFit> {
        let damping = self.baseline.free.iter().position(|base| base.role == Role::Damping);
        let moved = |by: f64| {
            let mut p = from.to_vec();
            p[damping?] += by;
            Some(p)
        };
        let starts = match damping {
            Some(_) => DAMPINGS.into_iter().filter_map(moved).collect(),
            None => vec![from.to_vec()],
        };
        let [widest, .., finest] = WIDTHS_S;
        let mut tried: Vec<(f64, Vec<f64>)> =
            starts.into_par_iter().filter_map(|p| Some((rms(&self.residual_nm(&p, widest)?), p))).collect();
        tried.sort_by(|a, b| a.0.total_cmp(&b.0));
        let search = |from: &[f64], width_s: f64| {
            let search = Search { of: self, width_s, at: DVector::from_column_slice(from), progress };
            let lm = LevenbergMarquardt::new().with_ftol(1e-6).with_xtol(1e-5).with_patience(PATIENCE);
            let p = lm.minimize(search).0.at.as_slice().to_vec();
            Some((rms(&self.residual_nm(&p, width_s)?), p))
        };
        let first = tried.into_par_iter().take(SEARCHES).filter_map(|(_, start)| search(&start, widest));
        let best = first.min_by(|a, b| a.0.total_cmp(&b.0))?;
        // Not on the rig's course even by the wide filter, which passes the least: given up before the dear part.
        if best.0 > self.deviation_nm {
            return None;
        }
        let (left, p) =
            WIDTHS_S.into_iter().skip(1).try_fold(best, |(_, from), width_s| search(&from, width_s))?;
        if left >= self.deviation_nm {
            return None;
        }
        let (residual_nm, jacobian) = (self.residual_nm(&p, finest)?, self.jacobian(&p, finest)?);
        Some(SimulatedFit { p, residual_nm, jacobian })
    }
}

/// Least squares of the residual, and of the values about their prior.
struct Search<'a> {
    of: &'a Simulated<'a>,
    width_s: f64,
    at: DVector<f64>,
    /// Hears of each step.
    progress: &'a (dyn Fn() + Sync),
}

impl LeastSquaresProblem<f64, Dyn, Dyn> for Search<'_> {
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
        let residual = self.of.residual_nm(self.at.as_slice(), self.width_s)?;
        let prior = self.of.baseline.free.iter().zip(self.at.iter()).map(|(base, x)| {
            let q = &base.parameter;
            self.of.deviation_nm * (x - q.mean) / q.sd
        });
        Some(DVector::from_iterator(residual.len() + self.at.len(), residual.iter().copied().chain(prior)))
    }

    fn jacobian(&self) -> Option<DMatrix<f64>> {
        (self.progress)();
        let of_residual = self.of.jacobian(self.at.as_slice(), self.width_s)?;
        let (rows, columns) = of_residual.shape();
        Some(DMatrix::from_fn(rows + columns, columns, |i, j| match i.checked_sub(rows) {
            None => of_residual[(i, j)],
            Some(of) if of == j => self.of.deviation_nm / self.of.baseline.free[j].parameter.sd,
            Some(_) => 0.0,
        }))
    }
}
