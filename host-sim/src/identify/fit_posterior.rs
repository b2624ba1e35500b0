//! What the logs say of parameters that they do not determine one by one.
//!
//! Falling and viscous friction make a ridge: many sets of a0, a1, v0 and a2 give nearly the same curve over the speeds that
//! were slid, and the ridge is bent, so that a deviation at its top says little of its length. The likelihood is quadratic
//! in what is seen, ln g at some speeds, whatever the parameters are; there it is taken from [`super::fit_interval`], and
//! carried to the parameters by a random walk (Metropolis, Rosenbluth, Rosenbluth, Teller and Teller 1953) over
//! likelihood and prior, which costs no pass over the logs. Same logs, same walk.
//! Left out: what the law's form does between those speeds.

use nalgebra::{DMatrix, DVector};
use rand_distr::{Distribution, StandardNormal, StandardUniform};
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::SeedableRng;

use super::contact::problem::{Baseline, Role};
use super::linear;

/// What the engine itself is wrong by, deviations in ln: of the curve at each of the speeds, from what it leaves at the
/// true numbers of rigs without an effect (means over bins of speed are off by 1e-4 to 4e-4 of the friction, beside what an
/// error of the slip makes of slow ones), …
const CURVE_FORM: f64 = 4e-4;
/// … of the stiffness, …
const STIFFNESS_FORM: f64 = 1e-3;
/// … and of the damping, over the square of the smoothing's width in the block's time constant c/k: a response of variance
/// τ² behind a filter of variance σ² has that of a τ longer by ½ σ²/τ². The filter's own is 0 in its pass band and σ² at
/// worst; half of that.
const DAMPING_FORM: f64 = 0.25;
/// Steps of the walk that find its width, and those that count.
const STEPS: [usize; 3] = [4_000, 4_000, 40_000];
/// Every so many steps a point is kept.
const KEPT: usize = 10;
/// Best width of a proposal for a normal target, over its dimension's root (Gelman, Roberts and Gilks 1996).
const WIDTH: f64 = 2.4;
/// Step of differences.
const STEP: f64 = 1e-4;
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
        let columns: Vec<DVector<f64>> = (0..p.len())
            .map(|i| {
                let moved = |step: f64| {
                    let mut q = p.to_vec();
                    q[i] += step;
                    self.at(&q)
                };
                (moved(STEP) - moved(-STEP)) / (2.0 * STEP)
            })
            .collect();
        DMatrix::from_columns(&columns)
    }
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

/// Points of the posterior of the baseline's values about its top `p`; `covariance` is that of the likelihood alone there, for
/// a slip that is smoothed over this width and known to this error.
/// `None` where what is seen has no inverse, as in sliding at one speed.
pub(super) fn points(
    baseline: &Baseline,
    p: &[f64],
    covariance: &DMatrix<f64>,
    slid_m_s: Vec<f64>,
    smoothing_s: f64,
    slip_error_m_s: f64,
) -> Option<Vec<Vec<f64>>> {
    let n = p.len();
    let count = baseline.free.iter().filter(|base| Seen::is_curve(base.role)).count();
    let seen = Seen { baseline, speeds_m_s: speeds(slid_m_s, count)? };
    let g = seen.derivatives(p);
    let singular = g.clone().svd(false, false).singular_values;
    let ratio = singular.min() / singular.max();
    if ratio.is_nan() || ratio < LOST {
        return None;
    }
    let mut of_seen = &g * covariance * g.transpose();
    let rest = baseline.free.iter().map(|base| base.role).filter(|role| !Seen::is_curve(*role));
    let numbers = baseline.numbers(p);
    let width = smoothing_s * numbers.stiffness_n_per_m / numbers.damping_n_s_per_m.max(f64::MIN_POSITIVE);
    let curve = seen.of_slip_error(p, slip_error_m_s).into_iter().map(|error| error.hypot(CURVE_FORM));
    let form = curve.chain(rest.map(|role| match role {
        Role::Stiffness => STIFFNESS_FORM,
        Role::Damping => (DAMPING_FORM * width * width).min(1.0),
        _ => 0.0,
    }));
    for (i, form) in form.enumerate() {
        of_seen[(i, i)] += form * form;
    }
    let precision = linear::factor(&of_seen).inverse();
    let prior = |q: &[f64]| -> f64 {
        baseline.free.iter().zip(q).map(|(b, x)| ((x - b.parameter.mean) / b.parameter.sd).powi(2)).sum()
    };
    // At the top the likelihood's slope stands against the prior's; its own top lies beyond.
    let pull = DVector::from_fn(n, |i, _| {
        (p[i] - baseline.free[i].parameter.mean) / baseline.free[i].parameter.sd.powi(2)
    });
    let top = seen.at(p) + &g * (covariance * pull);
    let cost = |q: &[f64]| {
        let off = seen.at(q) - &top;
        0.5 * (off.dot(&(&precision * &off)) + prior(q))
    };
    let mut local = g.transpose() * &precision * &g;
    for i in 0..n {
        local[(i, i)] += baseline.free[i].parameter.sd.powi(-2);
    }
    let mut shape = linear::factor(&linear::factor(&local).inverse()).l();
    let mut random = Xoshiro256PlusPlus::seed_from_u64(1);
    let mut here = p.to_vec();
    let mut here_cost = cost(&here);
    let mut kept = Vec::new();
    for steps in STEPS {
        kept.clear();
        for step in 0..steps {
            let normal = DVector::from_fn(n, |_, _| -> f64 { StandardNormal.sample(&mut random) });
            // Now and then a long step, along a ridge that is longer than its top lets expect.
            let long = if step % 4 == 0 { 3.0 } else { 0.7 };
            let moved = &shape * normal * (long * WIDTH / (n as f64).sqrt());
            let next: Vec<f64> = here.iter().zip(moved.iter()).map(|(x, d)| x + d).collect();
            let next_cost = cost(&next);
            let chance: f64 = StandardUniform.sample(&mut random);
            if chance < (here_cost - next_cost).exp() {
                (here, here_cost) = (next, next_cost);
            }
            if step % KEPT == 0 {
                kept.push(here.clone());
            }
        }
        shape = linear::factor(&spread(&kept)).l();
    }
    Some(kept)
}

/// Covariance of points.
pub(super) fn spread(points: &[Vec<f64>]) -> DMatrix<f64> {
    let n = points.first().map_or(0, Vec::len);
    let count = points.len().max(1) as f64;
    let mean = DVector::from_fn(n, |i, _| points.iter().map(|p| p[i]).sum::<f64>() / count);
    let mut sum = DMatrix::zeros(n, n);
    for point in points {
        let off = DVector::from_column_slice(point) - &mean;
        sum += &off * off.transpose();
    }
    sum / count
}

/// Values below which a share of the points lies; they are sorted for it.
pub(super) fn quantile(values: &mut [f64], share: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    let place = share * (values.len() - 1) as f64;
    let (at, part) = (place as usize, place.fract());
    values[at] + part * (values[(at + 1).min(values.len() - 1)] - values[at])
}

#[cfg(test)]
mod tests {
    use super::super::fit_parameters::baseline_of;
    use super::*;
    use crate::files::model_file::ModelFile;

    #[test]
    fn a_straight_problem_keeps_its_covariance_and_a_bent_one_gets_a_tail() {
        let model = ModelFile::assumed(&[]).unwrap();
        let free: Vec<String> = ["a0", "a1", "v0_m_s"].map(String::from).to_vec();
        let baseline = baseline_of(&model, &free).unwrap();
        let p: Vec<f64> = baseline.free.iter().map(|base| base.parameter.mean).collect();
        let slid = || (1..1000).map(|i| 1e-3 * f64::from(i)).collect::<Vec<f64>>();
        // With what the engine's own form adds where the likelihood is quadratic, carried back to the parameters.
        let straight = |deviation: f64| {
            let count = baseline.free.iter().filter(|base| Seen::is_curve(base.role)).count();
            let seen = Seen { baseline: &baseline, speeds_m_s: speeds(slid(), count).unwrap() };
            let g = seen.derivatives(&p);
            let mut of_seen = &g * g.transpose() * (deviation * deviation);
            (0..count).for_each(|i| of_seen[(i, i)] += CURVE_FORM * CURVE_FORM);
            let mut local = g.transpose() * linear::factor(&of_seen).inverse() * &g;
            (0..p.len()).for_each(|i| local[(i, i)] += baseline.free[i].parameter.sd.powi(-2));
            linear::factor(&local).inverse()[(2, 2)].sqrt()
        };
        let of = |deviation: f64| {
            let covariance = DMatrix::from_diagonal_element(p.len(), p.len(), deviation * deviation);
            let points = points(&baseline, &p, &covariance, slid(), 0.0, 0.0).unwrap();
            let mut v0: Vec<f64> = points.iter().map(|q| q[2] - p[2]).collect();
            (quantile(&mut v0, 0.025), quantile(&mut v0, 0.975))
        };
        let (low, high) = of(0.02);
        // Some thousand independent points know an end of the interval within 5 %; the rest is the bend.
        let half = 1.96 * straight(0.02);
        assert!(half > 0.0392, "{half}");
        assert!(
            (low / -half - 1.0).abs() < 0.2 && (high / half - 1.0).abs() < 0.2,
            "{low} {high} for {half}"
        );
        let (low, high) = of(0.3);
        assert!(high > 0.3 && low < -0.3 && (high + low).abs() > 0.05, "{low} {high}");
    }
}
