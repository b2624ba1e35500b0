//! The likelihood over ln g at some speeds, in place of the numbers of the law of g.
//!
//! Falling and viscous friction make a ridge: many sets of a0, a1, v0 and a2 give nearly the same curve over the speeds that
//! were slid, and the ridge is narrow and bent, so that a straight step along it leaves it at once. Residuals are nearly linear in
//! ln g at the slip that is observed, whatever the law's numbers are: so Gauss–Newton is taken there, and the law's numbers are
//! those that come closest in the likelihood's own metric (minimum distance: L. P. Hansen, *Econometrica* 50, 1982). That search
//! costs no pass over the logs.
//! Left out: that another curve is slid at another speed.

use levenberg_marquardt::LevenbergMarquardt;
use nalgebra::{DMatrix, DVector};

use super::contact::problem::{Baseline, Fit, Near, Prediction, Problem, Role};
use super::linear::{self, Slope};
use crate::least_squares;

/// Speeds at which the curve stands for all of it: three to each of the law's numbers.
const SPEEDS: usize = 12;
/// Share of the samples that slid slower than all these speeds, and as many faster.
const OUTSIDE: f64 = 3e-3;
/// What is not seen at all is held within so many deviations of the prior, and ln g within so many: so that there is an inverse.
const HELD_WITHIN: f64 = 10.0;
/// Step of differences.
const STEP: f64 = 1e-4;
/// Parts of the way to the top that are tried: residuals are linear in ln g only so far.
const PARTS: [f64; 3] = [1.0, 0.3, 0.1];

/// A column for each value.
pub(super) fn derivatives(p: &[f64], of: impl Fn(&[f64]) -> DVector<f64>) -> DMatrix<f64> {
    let moved = |i: usize, step: f64| {
        let mut q = p.to_vec();
        q[i] += step;
        of(&q)
    };
    let column = |i: usize| (moved(i, STEP) - moved(i, -STEP)) / (2.0 * STEP);
    DMatrix::from_columns(&(0..p.len()).map(column).collect::<Vec<_>>())
}

/// Whether a number is one of the curve's. Static friction of its own is not: what breaks away shows it, and no speed that is slid.
pub(super) fn is_of_curve(role: Role) -> bool {
    matches!(role, Role::A0 | Role::A1 | Role::V0 | Role::Delta | Role::A2 | Role::Factor)
}

/// How many of what is free are.
pub(super) fn numbers_of_curve(baseline: &Baseline) -> usize {
    baseline.free.iter().filter(|base| is_of_curve(base.role)).count()
}

/// Coordinates in which the likelihood is quadratic: ln g at these speeds, then what is no number of the curve; all values of the
/// baseline where there are no speeds.
#[derive(Clone)]
pub(super) struct Seen<'a> {
    pub(super) baseline: &'a Baseline,
    pub(super) speeds_m_s: Vec<f64>,
}

impl Seen<'_> {
    /// The baseline's parameters that are no numbers of the curve.
    fn others(&self) -> impl Iterator<Item = usize> + '_ {
        let free = self.baseline.free.iter().enumerate();
        free.filter(|(_, base)| self.speeds_m_s.is_empty() || !is_of_curve(base.role)).map(|(i, _)| i)
    }

    /// Their roles.
    pub(super) fn other_roles(&self) -> impl Iterator<Item = Role> + '_ {
        self.others().map(|i| self.baseline.free[i].role)
    }

    /// Of values of the baseline.
    pub(super) fn at(&self, p: &[f64]) -> DVector<f64> {
        let n = self.baseline.numbers(p);
        let g = |w: f64| n.a0 + n.a1 * (-(w / n.v0_m_s).powf(n.delta)).exp() + n.a2_s_per_m * w;
        let curve = self.speeds_m_s.iter().map(|w| g(*w).max(f64::MIN_POSITIVE).ln());
        DVector::from_iterator(self.len(), curve.chain(self.others().map(|i| p[i])))
    }

    fn len(&self) -> usize {
        self.speeds_m_s.len() + self.others().count()
    }

    /// How much ln g changes from a slip of this error, at each of the speeds.
    pub(super) fn of_slip_error(&self, p: &[f64], error_m_s: f64) -> Vec<f64> {
        let there = self.at(p);
        let moved = Seen {
            baseline: self.baseline,
            speeds_m_s: self.speeds_m_s.iter().map(|w| w + error_m_s).collect(),
        };
        let here = moved.at(p);
        (0..self.speeds_m_s.len()).map(|i| here[i] - there[i]).collect()
    }

    /// Deviations within which each coordinate is held where nothing shows it.
    pub(super) fn held_within(&self) -> Vec<f64> {
        let of_others = self.others().map(|i| HELD_WITHIN * self.baseline.free[i].parameter.sd);
        self.speeds_m_s.iter().map(|_| HELD_WITHIN).chain(of_others).collect()
    }

    /// Columns of the residuals over the coordinates: those of the curve are the slope along ln friction as a whole, times how
    /// near in ln speed each sample slides to each of the speeds (linear in between).
    fn columns(&self, slip_m_s: &[f64], gain: &[f64], base: &[Slope]) -> Vec<Slope> {
        let at: Vec<f64> = self.speeds_m_s.iter().map(|w| w.ln()).collect();
        let mut of_curve = vec![vec![0.0; gain.len()]; at.len()];
        if let [first, .., last] = at[..] {
            for (t, (slip, gain)) in slip_m_s.iter().zip(gain).enumerate() {
                let w = slip.abs().ln().clamp(first, last);
                let low = at.partition_point(|x| *x <= w).clamp(1, at.len() - 1) - 1;
                let share = (w - at[low]) / (at[low + 1] - at[low]);
                of_curve[low][t] = (1.0 - share) * gain;
                of_curve[low + 1][t] = share * gain;
            }
        }
        of_curve.into_iter().map(Slope::from).chain(self.others().map(|i| base[i].clone())).collect()
    }
}

/// Speeds that stand for all at which the tip slid, even in ln, without this share of the samples at either end.
pub(super) fn speeds(mut slid_m_s: Vec<f64>, count: usize, outside: f64) -> Option<Vec<f64>> {
    slid_m_s.sort_by(f64::total_cmp);
    let at = |share: f64| slid_m_s.get((share * slid_m_s.len() as f64) as usize).copied();
    let (low, high) = (at(outside)?, at(1.0 - outside)?);
    let share = |j: usize| j as f64 / count.saturating_sub(1).max(1) as f64;
    (low > 0.0 && high > low).then(|| (0..count).map(|j| low * (high / low).powf(share(j))).collect())
}

/// Sizes of the slip where the tip slides.
pub(super) fn slid_m_s(prediction: &Prediction) -> Vec<f64> {
    let of_log = prediction.observed.iter().flat_map(|o| o.slip_m_s.iter().zip(&o.sliding));
    of_log.filter(|(_, sliding)| **sliding > 0.5).map(|(w, _)| w.abs()).filter(|w| *w > 0.0).collect()
}

/// A number that values of the baseline give.
pub(super) type Number<'a> = &'a dyn Fn(&[f64]) -> f64;

/// −ln of likelihood and prior as half a sum of squares.
pub(super) struct Posterior<'a> {
    pub(super) seen: Seen<'a>,
    /// Top of the likelihood.
    pub(super) top: DVector<f64>,
    /// Lower triangle of its covariance in what is seen.
    pub(super) spread: DMatrix<f64>,
}

impl Posterior<'_> {
    /// Root of twice −ln, number by number.
    pub(super) fn residuals(&self, p: &[f64]) -> DVector<f64> {
        let off = self.seen.at(p) - &self.top;
        let likely = self.spread.solve_lower_triangular(&off).unwrap_or(off);
        let free = &self.seen.baseline.free;
        let prior = free.iter().zip(p).map(|(base, x)| (x - base.parameter.mean) / base.parameter.sd);
        DVector::from_iterator(likely.len() + p.len(), likely.iter().copied().chain(prior))
    }

    /// Best from here on, with one more residual where there is one.
    pub(super) fn best(&self, from: &[f64], held: Option<Number<'_>>) -> Vec<f64> {
        let residuals = |p: &[f64]| {
            let r = self.residuals(p);
            let held = held.map(|held| held(p));
            let count = r.len() + usize::from(held.is_some());
            DVector::from_iterator(count, r.iter().copied().chain(held))
        };
        let problem = least_squares::Problem {
            at: DVector::from_column_slice(from),
            residuals: |p: &DVector<f64>| Some(residuals(p.as_slice())),
            jacobian: |p: &DVector<f64>| Some(derivatives(p.as_slice(), residuals)),
        };
        LevenbergMarquardt::new().minimize(problem).0.at.as_slice().to_vec()
    }
}

/// The likelihood about a fit of the baseline, in what is seen.
pub(super) struct Likelihood<'a> {
    pub(super) seen: Seen<'a>,
    /// Where it was fitted.
    at: DVector<f64>,
    /// From there to the top.
    pub(super) to_top: DVector<f64>,
    /// Covariance, the samples taken for independent ones.
    pub(super) covariance: DMatrix<f64>,
    /// Slopes −∂r/∂φ that it was taken from.
    pub(super) columns: Vec<Slope>,
}

impl<'a> Likelihood<'a> {
    /// About a fit of the baseline.
    pub(super) fn about(problem: &Problem<'a>, fit: &Fit) -> Self {
        let baseline = problem.baseline;
        let prediction = problem.predict(&[], &fit.p);
        // Where it slides at one speed, or one number of the curve is free, there is no ridge.
        let ridge = numbers_of_curve(baseline) > 1;
        let slid = ridge.then(|| speeds(slid_m_s(&prediction), SPEEDS, OUTSIDE)).flatten();
        Self::of(Seen { baseline, speeds_m_s: slid.unwrap_or_default() }, problem, fit, prediction)
    }

    /// The same in these coordinates.
    pub(super) fn seen(seen: Seen<'a>, problem: &Problem<'a>, fit: &Fit) -> Self {
        Self::of(seen, problem, fit, problem.predict(&[], &fit.p))
    }

    fn of(seen: Seen<'a>, problem: &Problem<'a>, fit: &Fit, prediction: Prediction) -> Self {
        let slopes = problem.slopes_of(fit);
        let slip = prediction.observed.into_iter().flat_map(|o| o.slip_m_s);
        let columns = seen.columns(&slip.collect::<Vec<_>>(), slopes.gain(), slopes.base());
        let (mut h, g) = problem.normal_equations(&columns, &fit.r);
        seen.held_within().iter().enumerate().for_each(|(i, sd)| h[(i, i)] += sd.powi(-2));
        let factor = linear::factor(&h);
        let (to_top, covariance) = (factor.solve(&g), factor.inverse());
        Self { at: seen.at(&fit.p), to_top, covariance, columns, seen }
    }

    /// Its top.
    pub(super) fn top(&self) -> DVector<f64> {
        &self.at + &self.to_top
    }

    /// With the prior.
    pub(super) fn posterior(&self) -> Posterior<'a> {
        let spread = linear::factor(&self.covariance).l();
        Posterior { seen: self.seen.clone(), top: self.top(), spread }
    }
}

/// Goes from a fit of the baseline to the top that the likelihood has over ln g, or a part of the way; the fit itself where that
/// gains nothing.
pub(super) fn along_curve(problem: &Problem<'_>, fit: Fit) -> Fit {
    let likelihood = Likelihood::about(problem, &fit);
    let mut posterior = likelihood.posterior();
    for part in PARTS {
        posterior.top = &likelihood.at + part * &likelihood.to_top;
        let next = problem.fit(&[], posterior.best(&fit.p, None), 0, Near::Nothing);
        if next.cost < fit.cost {
            return next;
        }
    }
    fit
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::files::log::Log;
    use crate::files::model_file::{ModelFile, ModelKind};
    use crate::files::rig_file::RigFile;
    use crate::files::signal::Signal;
    use crate::identify::contact::log::ContactLog;
    use crate::identify::fit_parameters::baseline_of;
    use crate::identify::noise::White;
    use crate::predict::{ContactInputs, simulate_friction};

    /// Speeds of falling and of viscous friction, so that the numbers make a ridge.
    const NUMBERS: [(&str, f64); 5] =
        [("sigma0_n_per_m", 3e4), ("a0", 0.5), ("a1", 0.5), ("v0_m_s", 0.4), ("a2_s_per_m", 0.04)];

    fn model(numbers: &[(&str, f64)]) -> ModelFile {
        ModelFile::new("model", ModelKind::Lugre, numbers).unwrap()
    }

    /// Reversals at several speeds and loads, with noise on the friction torque.
    fn log(rig: &RigFile, noise_nm: f64) -> Log {
        let time: Vec<f64> = (0..8000).map(|i| 1e-3 * f64::from(i)).collect();
        let speed = |t: &f64| 8.0 * (1.3 * t).sin() + 4.0 * (3.1 * t).sin();
        let mut log = Log::default();
        log.set_signal(Signal::M2Speed, time.iter().map(speed).collect());
        log.set_signal(Signal::NormalForce, time.iter().map(|t| 70.0 + 25.0 * (0.7 * t).sin()).collect());
        log.set_signal(Signal::FrictionTorque, vec![0.0; time.len()]);
        log.set_signal(Signal::Time, time);
        let inputs = ContactInputs::new(&log.contact().unwrap(), rig);
        let torque_nm = simulate_friction(&model(&NUMBERS), rig, &inputs).unwrap();
        let mut white = White::new(3);
        let shown = torque_nm.iter().map(|t| t + noise_nm * white.next()).collect();
        log.set_signal(Signal::FrictionTorque, shown);
        log
    }

    /// With what is free of a model, in a log with noise: the problem, and the values of the file.
    fn with_free<T>(model: &ModelFile, free: &[&str], check: impl FnOnce(&Problem<'_>, Vec<f64>) -> T) -> T {
        let rig = RigFile::assumed_rig(&[]).unwrap();
        let logs = [ContactLog::new(&log(&rig, 0.01), &rig).unwrap()];
        let free: Vec<String> = free.iter().copied().map(String::from).collect();
        let baseline = baseline_of(model, &rig, &free).unwrap();
        let p = baseline.free.iter().map(|base| base.parameter.mean).collect();
        check(&Problem::new(&logs, &baseline, &[]), p)
    }

    /// The four numbers of the curve come first.
    const FREE: [&str; 5] = ["a0", "a1", "v0_m_s", "a2_s_per_m", "sigma0_n_per_m"];

    #[test]
    fn slopes_over_the_curve_make_those_over_the_laws_numbers() {
        with_free(&model(&NUMBERS), &FREE, |problem, p| {
            let fit = problem.fit(&[], p.clone(), 0, Near::Nothing);
            let seen = Likelihood::about(problem, &fit).seen;
            assert_eq!(seen.speeds_m_s.len(), SPEEDS);
            let slopes = problem.slopes_of(&fit);
            let observed = problem.predict(&[], &p).observed;
            let slip: Vec<f64> = observed.into_iter().flat_map(|o| o.slip_m_s).collect();
            let columns = seen.columns(&slip, slopes.gain(), slopes.base());
            let to_seen = derivatives(&p, |p| seen.at(p));
            for i in 0..4 {
                let own = &slopes.base()[i];
                let made =
                    |t: usize| columns.iter().enumerate().map(|(k, c)| c[t] * to_seen[(k, i)]).sum::<f64>();
                let off: f64 = own.iter().enumerate().map(|(t, own)| (own - made(t)).powi(2)).sum();
                let size: f64 = own.iter().map(|own| own * own).sum();
                assert!(off < 0.01 * size, "{i}: {off} of {size}");
            }
        });
    }

    #[test]
    fn a_bent_ridge_is_followed_to_its_lowest_point_from_either_end() {
        with_free(&model(&NUMBERS), &FREE, |problem, file| {
            // About the same curve over what is slid, with v0 at half and at twice of what it is.
            let ends = [[1.2, 0.8, 0.5, 0.7], [0.7, 1.3, 2.0, 1.4]].map(|factors: [f64; 4]| {
                let mut p = file.clone();
                p.iter_mut().zip(factors).for_each(|(p, factor)| *p += factor.ln());
                problem.fit(&[], p, 0, Near::Nothing)
            });
            let apart = |follow: &dyn Fn(Fit) -> Fit| {
                let [a, b] = ends.clone().map(|end| (0..4).fold(end, |fit, _| follow(fit)).cost);
                (a - b).abs()
            };
            let straight = apart(&|fit| problem.fit(&[], fit.p, 4, Near::Nothing));
            let bent = apart(&|fit| along_curve(problem, fit));
            // One standard deviation costs a half.
            assert!(bent < 0.5 && straight > 4.0 * bent, "{bent} {straight}");
        });
    }

    #[test]
    fn a_curve_that_is_not_asked_for_leaves_the_values_themselves() {
        with_free(&model(&NUMBERS), &["a0"], |problem, p| {
            let fit = problem.fit(&[], p, 4, Near::Nothing);
            let seen = Likelihood::about(problem, &fit).seen;
            assert_eq!(seen.at(&fit.p).as_slice(), fit.p);
        });
    }

    /// What breaks away shows it: were it a number of the curve that is slid, nothing but the prior would hold it.
    #[test]
    fn static_friction_of_a_brush_is_seen_for_itself() {
        let numbers = [("mu_s", 0.9), ("mu_c", 0.6), ("c_n_per_m", 3e4)];
        let brush = ModelFile::new("model", ModelKind::Brush, &numbers).unwrap();
        with_free(&brush, &["mu_s", "mu_c", "c_n_per_m"], |problem, p| {
            let seen = Likelihood::about(problem, &problem.fit(&[], p.clone(), 0, Near::Nothing)).seen;
            let mut other = p.clone();
            other[0] += 0.1;
            assert!((seen.at(&other) - seen.at(&p)).amax() > 0.05);
        });
    }
}
