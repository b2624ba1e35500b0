//! What the logs say of parameters that they do not determine one by one: profiles of the likelihood.
//!
//! Falling and viscous friction make a ridge: many sets of a0, a1, v0 and a2 give nearly the same curve over the speeds that
//! were slid, and the ridge is bent, so that a deviation at its top says little of its length. The likelihood is quadratic
//! in what is seen, ln g at some speeds, whatever the parameters are; there it is taken from [`super::fit_interval`], and a
//! parameter's interval ends where likelihood and prior, all other parameters at their best, have fallen by what 95 % ask for
//! (Venzon and Moolgavkar 1988). That costs no pass over the logs.
//! Left out: what the law's form does between those speeds.

use levenberg_marquardt::LevenbergMarquardt;
use nalgebra::{DMatrix, DVector};

use super::contact::problem::{Baseline, Role};
use super::fit_interval::Known;
use super::linear;
use crate::fit::covariance::INTERVAL_95;
use crate::least_squares::Problem;

/// Share of the correction for the observer's bias that is not known: the simulation that tells it has not all of the rig's
/// noise; the deviation of an even distribution between none of it and twice it, 1/√3.
const CORRECTION_UNKNOWN: f64 = 0.58;
/// What the engine itself is wrong by, deviations in ln.
#[derive(Debug, Clone, Copy)]
pub(super) struct Form {
    /// Of the curve at each of the speeds.
    curve: f64,
    /// Of the stiffness.
    stiffness: f64,
    /// Of the damping, over the square of the smoothing's width in the block's time constant c/k: a response of variance τ² behind
    /// a filter of variance σ² has that of a τ longer by ½ σ²/τ².
    damping: f64,
}

impl Form {
    /// Where the bias is taken off, a tenth of the filter's worst is left of the damping; of the others the correction tells.
    pub(super) const BIAS_REMOVED: Self = Self { curve: 0.0, stiffness: 0.0, damping: 0.05 };
    /// Of a simulation between samples that are joined by cubics: from what is left at the true numbers of rigs without an effect
    /// (means over bins of speed are off by 1e-4 to 4e-4 of the friction), and of the damping half of the worst.
    pub(super) const OF_SIMULATION: Self = Self { curve: 4e-4, stiffness: 1e-3, damping: 0.25 };
}
/// Step of differences.
const STEP: f64 = 1e-4;
/// How tightly a parameter is held where its profile is asked for, over its local deviation: what is read is where it came to be.
const HELD: f64 = 0.01;
/// A profile is followed so far, in ln: beyond a factor of e either way a parameter counts as not determined.
const FARTHEST: f64 = 2.0;
/// Points of a profile at most on either side: it is close to a straight line in the root of what it falls by.
const POINTS: usize = 12;
/// The profile ends here within this share of [`INTERVAL_95`].
const ENDS_WITHIN: f64 = 0.01;
/// Singular values of the map to what is seen below this share of the largest: then no ridge can be followed.
const LOST: f64 = 1e-7;

/// Coordinates in which the likelihood is quadratic.
struct Seen<'a> {
    baseline: &'a Baseline,
    speeds_m_s: Vec<f64>,
}

impl Seen<'_> {
    fn is_curve(role: Role) -> bool {
        matches!(role, Role::A0 | Role::A1 | Role::V0 | Role::Delta | Role::A2 | Role::Factor)
    }

    fn at(&self, p: &[f64]) -> DVector<f64> {
        let n = self.baseline.numbers(p);
        let curve = self
            .speeds_m_s
            .iter()
            .map(|w| (n.a0 + n.a1 * (-(w / n.v0_m_s).powf(n.delta)).exp() + n.a2_s_per_m * w).ln());
        let rest = (0..p.len())
            .filter(|i| !Self::is_curve(self.baseline.free[*i].role))
            .map(|i| self.baseline.bounded(p, i));
        DVector::from_iterator(p.len(), curve.chain(rest))
    }

    /// How much ln g changes from a slip of this error, at each of the speeds.
    fn of_slip_error(&self, p: &[f64], error_m_s: f64) -> Vec<f64> {
        let there = self.at(p);
        let moved = Seen {
            baseline: self.baseline,
            speeds_m_s: self.speeds_m_s.iter().map(|w| w + error_m_s).collect(),
        };
        let here = moved.at(p);
        (0..self.speeds_m_s.len()).map(|i| here[i] - there[i]).collect()
    }

    fn derivatives(&self, p: &[f64]) -> DMatrix<f64> {
        derivatives(p, |p| self.at(p))
    }
}

/// A column for each value.
fn derivatives(p: &[f64], of: impl Fn(&[f64]) -> DVector<f64>) -> DMatrix<f64> {
    let moved = |i: usize, step: f64| {
        let mut q = p.to_vec();
        q[i] += step;
        of(&q)
    };
    let column = |i: usize| (moved(i, STEP) - moved(i, -STEP)) / (2.0 * STEP);
    DMatrix::from_columns(&(0..p.len()).map(column).collect::<Vec<_>>())
}

/// Speeds that stand for all at which the tip slid, one for each number of the curve.
fn speeds(mut slid_m_s: Vec<f64>, count: usize) -> Option<Vec<f64>> {
    /// Share of the samples left out at either end.
    const OUTSIDE: f64 = 0.03;
    slid_m_s.sort_by(f64::total_cmp);
    let at = |share: f64| slid_m_s.get((share * slid_m_s.len() as f64) as usize).copied();
    let (low, high) = (at(OUTSIDE)?, at(1.0 - OUTSIDE)?);
    let share = |j: usize| j as f64 / count.saturating_sub(1).max(1) as f64;
    (low > 0.0 && high > low).then(|| (0..count).map(|j| low * (high / low).powf(share(j))).collect())
}

/// What is known of the file's parameters, in ln.
pub(super) struct Profiles {
    /// Ends of the 95 % intervals.
    pub(super) ends: Vec<(f64, f64)>,
    /// Covariance at the top.
    pub(super) local: DMatrix<f64>,
}

/// −ln of likelihood and prior as half a sum of squares.
struct Posterior<'a, F> {
    seen: Seen<'a>,
    /// Top of the likelihood.
    top: DVector<f64>,
    /// Lower triangle of its covariance in what is seen.
    spread: DMatrix<f64>,
    /// ln of the file's parameters.
    logs: F,
}

impl<F: Fn(&[f64]) -> DVector<f64>> Posterior<'_, F> {
    fn residuals(&self, p: &[f64]) -> DVector<f64> {
        let off = self.seen.at(p) - &self.top;
        let likely = self.spread.solve_lower_triangular(&off).unwrap_or(off);
        let free = &self.seen.baseline.free;
        let prior = free.iter().zip(p).map(|(base, x)| (x - base.parameter.mean) / base.parameter.sd);
        DVector::from_iterator(2 * p.len(), likely.iter().copied().chain(prior))
    }

    /// Best from here on, a parameter of the file held at a value in ln to this deviation where one is.
    fn best(&self, from: &[f64], held: Option<(usize, f64, f64)>) -> Vec<f64> {
        let residuals = |p: &[f64]| {
            let r = self.residuals(p);
            let held = held.map(|(which, value, sd)| ((self.logs)(p)[which] - value) / sd);
            let count = r.len() + usize::from(held.is_some());
            DVector::from_iterator(count, r.iter().copied().chain(held))
        };
        let problem = Problem {
            at: DVector::from_column_slice(from),
            residuals: |p: &DVector<f64>| Some(residuals(p.as_slice())),
            jacobian: |p: &DVector<f64>| Some(derivatives(p.as_slice(), residuals)),
        };
        LevenbergMarquardt::new().minimize(problem).0.at.as_slice().to_vec()
    }

    /// Where the profile of a parameter ends in one direction.
    fn end(&self, top: &[f64], which: usize, deviation: f64, direction: f64) -> f64 {
        let least = self.residuals(top).norm_squared();
        let centre = (self.logs)(top)[which];
        let mut p = top.to_vec();
        // Root of what it fell by, over how far away.
        let mut last = (0.0, 0.0);
        let mut away = INTERVAL_95 * deviation;
        for _ in 0..POINTS {
            away = away.min(FARTHEST);
            p = self.best(&p, Some((which, centre + direction * away, HELD * deviation)));
            let here = direction * ((self.logs)(&p)[which] - centre);
            let fell = (self.residuals(&p).norm_squared() - least).max(0.0).sqrt();
            if (fell - INTERVAL_95).abs() < ENDS_WITHIN * INTERVAL_95
                || (away >= FARTHEST && fell < INTERVAL_95)
            {
                return centre + direction * here;
            }
            let slope = (fell - last.0) / (here - last.1);
            let next = here + (INTERVAL_95 - fell) / slope;
            last = (fell, here);
            // A flat stretch says little of how far it goes.
            away = if slope > 0.0 { next.clamp(0.5 * here, 2.0 * here) } else { 2.0 * here };
        }
        centre + direction * last.1
    }
}

/// What is known about the top `p`, which the likelihood had at `found` before its bias was taken off; `likely` is what the
/// likelihood alone says there, for a slip that is smoothed over this width and known to this error, and `logs` gives the file's
/// parameters. `None` where what is seen has no inverse, as in sliding at one speed.
pub(super) fn profiles(
    baseline: &Baseline,
    (p, found): (&[f64], &[f64]),
    likely: &Known,
    slid_m_s: Vec<f64>,
    (smoothing_s, slip_error_m_s, form): (f64, f64, Form),
    logs: impl Fn(&[f64]) -> DVector<f64>,
) -> Option<Profiles> {
    let n = p.len();
    let count = baseline.free.iter().filter(|base| Seen::is_curve(base.role)).count();
    let seen = Seen { baseline, speeds_m_s: speeds(slid_m_s, count)? };
    let g = seen.derivatives(p);
    let singular = g.clone().svd(false, false).singular_values;
    let ratio = singular.min() / singular.max();
    if ratio.is_nan() || ratio < LOST {
        return None;
    }
    let mut of_seen = &g * &likely.covariance * g.transpose();
    let correction = seen.at(p) - seen.at(found);
    let curve = seen.of_slip_error(p, slip_error_m_s).into_iter().map(|of_slip| of_slip.hypot(form.curve));
    let numbers = baseline.numbers(p);
    let width = smoothing_s * numbers.stiffness_n_per_m / numbers.damping_n_s_per_m.max(f64::MIN_POSITIVE);
    let rest = baseline.free.iter().map(|base| base.role).filter(|role| !Seen::is_curve(*role));
    let left = curve.chain(rest.map(|role| match role {
        Role::Stiffness => form.stiffness,
        Role::Damping => (form.damping * width * width).min(1.0),
        _ => 0.0,
    }));
    for (i, left) in left.enumerate() {
        let form = left.hypot(CORRECTION_UNKNOWN * correction[i]);
        of_seen[(i, i)] += form * form;
    }
    // The prior holds what was found; the likelihood's own top lies beyond.
    let top = seen.at(p) + &g * &likely.to_top;
    let posterior = Posterior { seen, top, spread: linear::factor(&of_seen).l(), logs };
    let best = posterior.best(p, None);
    let mut precision = {
        let g = posterior.seen.derivatives(&best);
        g.transpose() * linear::factor(&of_seen).inverse() * &g
    };
    for i in 0..n {
        precision[(i, i)] += baseline.free[i].parameter.sd.powi(-2);
    }
    let to_logs = derivatives(&best, &posterior.logs);
    let local = &to_logs * linear::factor(&precision).inverse() * to_logs.transpose();
    let ends = (0..local.nrows()).map(|which| {
        let deviation = local[(which, which)].sqrt();
        (posterior.end(&best, which, deviation, -1.0), posterior.end(&best, which, deviation, 1.0))
    });
    let ends = ends.collect();
    Some(Profiles { ends, local })
}

#[cfg(test)]
mod tests {
    use super::super::fit_parameters::{baseline_of, values};
    use super::*;
    use crate::files::model_file::ModelFile;
    use crate::files::rig_file::RigFile;

    #[test]
    fn a_straight_problem_keeps_its_covariance_and_a_bent_one_gets_a_tail() {
        let model = ModelFile::assumed(&[]).unwrap();
        let free: Vec<String> = ["a0", "a1", "v0_m_s"].map(String::from).to_vec();
        let baseline = baseline_of(&model, &RigFile::assumed_rig(&[]).unwrap(), &free).unwrap();
        let p: Vec<f64> = baseline.free.iter().map(|base| base.parameter.mean).collect();
        let slid = || (1..1000).map(|i| 1e-3 * f64::from(i)).collect::<Vec<f64>>();
        // Where the likelihood is quadratic, carried back to the parameters.
        let straight = |deviation: f64| {
            let count = baseline.free.iter().filter(|base| Seen::is_curve(base.role)).count();
            let seen = Seen { baseline: &baseline, speeds_m_s: speeds(slid(), count).unwrap() };
            let g = seen.derivatives(&p);
            let of_seen = &g * g.transpose() * (deviation * deviation);
            let mut local = g.transpose() * linear::factor(&of_seen).inverse() * &g;
            (0..p.len()).for_each(|i| local[(i, i)] += baseline.free[i].parameter.sd.powi(-2));
            linear::factor(&local).inverse()[(2, 2)].sqrt()
        };
        let of = |deviation: f64| {
            let covariance = DMatrix::from_diagonal_element(p.len(), p.len(), deviation * deviation);
            let logs = |q: &[f64]| DVector::from_vec(values(&model, &baseline, q, &free)).map(f64::ln);
            let likely = Known { covariance, to_top: DVector::zeros(p.len()) };
            let known =
                profiles(&baseline, (&p, &p), &likely, slid(), (0.0, 0.0, Form::BIAS_REMOVED), logs).unwrap();
            (known.ends[2].0 - p[2], known.ends[2].1 - p[2])
        };
        let (low, high) = of(0.02);
        let half = INTERVAL_95 * straight(0.02);
        assert!(half > 0.04, "{half}");
        // The rest is the bend.
        assert!(
            (low / -half - 1.0).abs() < 0.1 && (high / half - 1.0).abs() < 0.1,
            "{low} {high} for {half}"
        );
        let (low, high) = of(0.3);
        assert!(high > 0.3 && low < -0.3 && (high + low).abs() > 0.05, "{low} {high}");
    }
}
