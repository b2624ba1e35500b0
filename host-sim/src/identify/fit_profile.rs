//! What the logs say of parameters that they do not determine one by one: profiles of the likelihood.
//!
//! The numbers of the friction curve make a ridge that is narrow and bent ([`super::fit_curve`]), so that a deviation at its top says
//! little of its length. The likelihood is quadratic in what is seen, ln g at some speeds, whatever those numbers are: there it is
//! taken from its slopes, as much wider as [`super::fit_interval`] finds the way from the top to an end less certain than independent
//! samples would leave it (vertical scaling: R. E. Chandler and S. Bate, *Biometrika* 94, 2007; along one way it takes no inverse
//! of what forty blocks say of as many coordinates). A parameter's interval ends where likelihood and prior, all other parameters at
//! their best, have fallen by what 95 % ask for (Venzon and Moolgavkar 1988). That costs no pass over the logs.
//! Left out: errors that are alike at some of the speeds only.

use nalgebra::{DMatrix, DVector};

use super::contact::baseline::KNOWN_WITHIN;
use super::contact::problem::{Baseline, Role};
use super::fit_curve::{Likelihood, Number, Posterior, Seen, derivatives, numbers_of_curve, speeds};
use super::fit_interval::Known;
use super::linear;
use crate::fit::covariance::INTERVAL_95;

/// Share of the correction for the observer's bias that is not known: the simulation that tells it has not all of the rig's
/// noise; the deviation of an even distribution between none of it and twice it, 1/√3.
const CORRECTION_UNKNOWN: f64 = 0.58;
/// What the engine itself is wrong by, deviations in ln.
#[derive(Debug, Clone, Copy)]
pub(super) struct Form {
    /// Of the curve at each of the speeds.
    curve: f64,
    /// Of the stiffness; that of bristles in series with it is held, and known as well as a model file's numbers are.
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
/// How tightly a parameter is held where its profile is asked for, over its local deviation: what is read is where it came to be.
const HELD: f64 = 0.01;
/// A profile is followed so far, in ln: beyond a factor of e either way a parameter counts as not determined.
const FARTHEST: f64 = 2.0;
/// How often an end is sought at most with the uncertainty of the way to the last: where the ridge is bent that is another than at its top.
const ROUNDS: usize = 4;
/// Points of a profile at most on either side: it is close to a straight line in the root of what it falls by.
const POINTS: usize = 12;
/// The profile ends here within this share of [`INTERVAL_95`].
const ENDS_WITHIN: f64 = 0.01;
/// Share of the samples that slid slower than all speeds of the curve, and as many faster, where it is seen at no more than it has
/// numbers.
const OUTSIDE: f64 = 0.03;
/// Singular values of the map to what is seen below this share of the largest: then no ridge can be followed.
const LOST: f64 = 1e-7;

/// Values where the profile of a parameter ends in one direction, `of` being its ln.
fn end(posterior: &Posterior<'_>, top: &[f64], of: Number<'_>, deviation: f64, direction: f64) -> Vec<f64> {
    let least = posterior.residuals(top).norm_squared();
    let centre = of(top);
    let mut p = top.to_vec();
    // Root of what it fell by, over how far away.
    let mut last = (0.0, 0.0);
    let mut away = INTERVAL_95 * deviation;
    for _ in 0..POINTS {
        away = away.min(FARTHEST);
        let off = |p: &[f64]| (of(p) - centre - direction * away) / (HELD * deviation);
        p = posterior.best(&p, Some(&off));
        let here = direction * (of(&p) - centre);
        let fell = (posterior.residuals(&p).norm_squared() - least).max(0.0).sqrt();
        if (fell - INTERVAL_95).abs() < ENDS_WITHIN * INTERVAL_95 || (away >= FARTHEST && fell < INTERVAL_95)
        {
            return p;
        }
        let slope = (fell - last.0) / (here - last.1);
        let next = here + (INTERVAL_95 - fell) / slope;
        last = (fell, here);
        // A flat stretch says little of how far it goes.
        away = if slope > 0.0 { next.clamp(0.5 * here, 2.0 * here) } else { 2.0 * here };
    }
    p
}

/// What a likelihood says in what is seen, and how much more uncertain each of the file's parameters is than it pretends.
pub(super) struct Told<'a> {
    pub(super) seen: Seen<'a>,
    /// From where it was fitted to its top.
    pub(super) to_top: DVector<f64>,
    /// Its covariance.
    pub(super) covariance: DMatrix<f64>,
    /// The one that it has in truth, where that is another: as wide along each way, and not of its form, which forty blocks leave open.
    pub(super) likely: Option<DMatrix<f64>>,
}

impl<'a> Told<'a> {
    /// Of a likelihood whose samples are taken for independent ones; `likely` is its covariance when they are not.
    pub(super) fn observed(likelihood: Likelihood<'a>, likely: DMatrix<f64>) -> Self {
        let Likelihood { seen, to_top, covariance, .. } = likelihood;
        Self { seen, to_top, covariance, likely: Some(likely) }
    }

    /// Of a covariance of the values that is as it is known, about values `p`. `None` where what is seen has no inverse, as in
    /// sliding at one speed.
    pub(super) fn known(
        baseline: &'a Baseline,
        p: &[f64],
        known: &Known,
        slid_m_s: Vec<f64>,
    ) -> Option<Self> {
        let speeds_m_s = speeds(slid_m_s, numbers_of_curve(baseline), OUTSIDE)?;
        let seen = Seen { baseline, speeds_m_s };
        let g = derivatives(p, |p| seen.at(p));
        let singular = g.clone().svd(false, false).singular_values;
        let ratio = singular.min() / singular.max();
        let covariance = &g * &known.covariance * g.transpose();
        (ratio > LOST).then(|| Self { seen, to_top: &g * &known.to_top, covariance, likely: None })
    }
}

/// Ends of the 95 % intervals of the file's parameters, in ln, about the values `p`, which the likelihood had at `found` before its
/// bias was taken off; for a slip that is smoothed over this width and known to this error. `logs` gives the parameters, and
/// `deviations` about how well each is known.
pub(super) fn profiles(
    told: Told<'_>,
    (p, found): (&[f64], &[f64]),
    (smoothing_s, slip_error_m_s, form): (f64, f64, Form),
    logs: impl Fn(&[f64]) -> DVector<f64>,
    deviations: &[f64],
) -> Vec<(f64, f64)> {
    let Told { seen, to_top, covariance, likely } = told;
    let baseline = seen.baseline;
    let correction = seen.at(p) - seen.at(found);
    // An error of the curve's form is one for each of the law's numbers, and is spread over all speeds that are looked at.
    let spread = (seen.speeds_m_s.len() as f64 / numbers_of_curve(baseline).max(1) as f64).sqrt();
    let curve = seen.of_slip_error(p, slip_error_m_s).into_iter().map(|of_slip| of_slip.hypot(form.curve));
    let curve = curve.zip(correction.iter());
    let of_curve = curve.map(|(form, correction)| spread * form.hypot(CORRECTION_UNKNOWN * correction));
    let numbers = baseline.numbers(p);
    let width = smoothing_s * numbers.stiffness_n_per_m / numbers.damping_n_s_per_m.max(f64::MIN_POSITIVE);
    let of_others = seen.other_roles().zip(correction.iter().skip(seen.speeds_m_s.len()));
    let of_others = of_others.map(|(role, correction)| {
        let form = match role {
            Role::Stiffness => {
                form.stiffness.hypot(KNOWN_WITHIN * numbers.stiffness_n_per_m / numbers.bristles_n_per_m)
            }
            Role::Damping => (form.damping * width * width).min(1.0),
            _ => 0.0,
        };
        form.hypot(CORRECTION_UNKNOWN * correction)
    });
    let of_form = DVector::from_vec(of_curve.chain(of_others).map(|sd| sd * sd).collect());
    // The prior holds what was found; the likelihood's own top lies beyond.
    let top = seen.at(p) + to_top;
    let of_form = DMatrix::from_diagonal(&of_form);
    let information = linear::factor(&covariance);
    // Variance along the way between these values over what independent samples would leave; a way that shows nowhere has its prior.
    let larger = |p: &[f64], q: &[f64]| {
        let way = seen.at(q) - seen.at(p);
        let along = information.solve(&way);
        let own = way.dot(&along);
        let likely = likely.as_ref().filter(|_| own > 0.0);
        likely.map_or(1.0, |likely| along.dot(&(likely * &along)) / own)
    };
    let mut posterior = Posterior { seen: seen.clone(), top, spread: DMatrix::zeros(0, 0) };
    let mut ends = Vec::with_capacity(deviations.len());
    for (which, deviation) in deviations.iter().enumerate() {
        let of = |p: &[f64]| logs(p)[which];
        let mut end_towards = |direction: f64| {
            let (mut scale, mut ended) = (1.0, p.to_vec());
            for _ in 0..ROUNDS {
                posterior.spread = linear::factor(&(scale * &covariance + &of_form)).l();
                let best = posterior.best(p, None);
                ended = end(&posterior, &best, &of, *deviation, direction);
                let next = larger(&best, &ended);
                if next == scale {
                    break;
                }
                scale = next;
            }
            of(&ended)
        };
        ends.push((end_towards(-1.0), end_towards(1.0)));
    }
    ends
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
        let count = numbers_of_curve(&baseline);
        let straight = |deviation: f64| {
            let seen = Seen { baseline: &baseline, speeds_m_s: speeds(slid(), count, OUTSIDE).unwrap() };
            let g = derivatives(&p, |p| seen.at(p));
            let of_seen = &g * g.transpose() * (deviation * deviation);
            let mut local = g.transpose() * linear::factor(&of_seen).inverse() * &g;
            (0..p.len()).for_each(|i| local[(i, i)] += baseline.free[i].parameter.sd.powi(-2));
            linear::factor(&local).inverse()[(2, 2)].sqrt()
        };
        let of = |deviation: f64, repeated: f64| {
            let covariance = DMatrix::from_diagonal_element(p.len(), p.len(), deviation * deviation);
            let logs = |q: &[f64]| DVector::from_vec(values(&model, &baseline, q, &free)).map(f64::ln);
            let known = Known { covariance, to_top: DVector::zeros(p.len()) };
            let told = Told::known(&baseline, &p, &known, slid()).unwrap();
            let likely = Some(repeated * &told.covariance);
            let told = Told { likely, ..told };
            let ends = profiles(told, (&p, &p), (0.0, 0.0, Form::BIAS_REMOVED), logs, &[deviation; 3]);
            (ends[2].0 - p[2], ends[2].1 - p[2])
        };
        let (low, high) = of(0.02, 1.0);
        let half = INTERVAL_95 * straight(0.02);
        assert!(half > 0.04, "{half}");
        // The rest is the bend.
        assert!(
            (low / -half - 1.0).abs() < 0.1 && (high / half - 1.0).abs() < 0.1,
            "{low} {high} for {half}"
        );
        // Samples of which four say what one would are known half as well.
        let (wider_low, wider_high) = of(0.02, 4.0);
        for ratio in [wider_low / low, wider_high / high] {
            assert!((ratio / 2.0 - 1.0).abs() < 0.15, "{ratio}");
        }
        let (low, high) = of(0.3, 1.0);
        assert!(high > 0.3 && low < -0.3 && (high + low).abs() > 0.05, "{low} {high}");
    }
}
