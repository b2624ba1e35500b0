//! The contact's balance as one likelihood: what the friction channel should have shown, given the observed slip.
//!
//! y = channel( F(observed slip; parameters) ) + e,   e/σ Student-t with ν = 4, σ from named sources
//! (`noise.rs`), a share 1/T of the samples counted as independent. Normal priors on all parameters; those of the
//! baseline are bounded smoothly at three deviations, so that nothing else can hide in them.

use std::borrow::Cow;

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::change::{Change, Columns, ContactTerm};
use super::channel::{Channel, ringing};
use super::law::{Contact, Curve};
use super::log::ContactLog;
pub use super::noise::Noise;
use super::observer::{Drive, Observed, SLIP_NOISES, observe};
use super::struck_mode::innovations;
use crate::identify::evidence::{CONTACT_SHARE, Expansion, TYPICAL_SCALE, covariance};
use crate::identify::filters::{exponentials, rms};
use crate::identify::linear::{self, Slope, normal_equations_of};
use crate::identify::term::{Column, Parameter, Starts};

/// Degrees of freedom of Student's t: tails for what the noise model does not name.
pub const FREEDOM: f64 = 4.0;

/// Weight of a residual over its deviation in iterated least squares.
pub fn student_weight(r: f64) -> f64 {
    (FREEDOM + 1.0) / (FREEDOM + r * r)
}

/// The baseline's parameters stay within so many deviations of their prior.
const BOUND: f64 = 3.0;
/// Slip is faster than this share of the root's usual speed.
const SLOWEST_SLIP: f64 = 0.015;
/// Drift of the root against the measured motion, relative to its way while a tip sticks, else to its usual speed: what the elements'
/// way differs by.
pub const DRIFT: f64 = 5e-4;
/// A sample is well known where its deviation is less than this share of the usual torque.
pub const WELL_KNOWN: f64 = 0.1;
/// A step that gains less −ln posterior than this moves no value by more than a seventh of its deviation; so many at most.
const SETTLED: f64 = 0.01;
const MOST_SETTLING: usize = 20;
/// Static friction is looked for within so many deviations of its prior, a little less than its bound, in steps of so much of its
/// logarithm: over half of one breakaway moves by less than a sample of a millisecond, but for the slowest motion.
const STATIC_WITHIN: f64 = 2.5;
const STATIC_STEP: f64 = 0.02;
/// Slopes are good enough where a step gains more than this share of what they promised.
pub const KEPT_PROMISE: f64 = 0.5;
/// The same of slopes that are mended by what the step showed: new ones cost as much as a dozen steps.
pub const MENDED_PROMISE: f64 = 0.1;
/// So much of ln evidence changes no decision.
pub const UNDECIDED: f64 = 0.5;

/// Which number of the contact a baseline parameter is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    /// Coulomb coefficient.
    A0,
    /// Static minus Coulomb coefficient.
    A1,
    /// Static coefficient, in place of A1.
    Static,
    /// Stribeck speed.
    V0,
    /// Stribeck exponent.
    Delta,
    /// Friction per load and slip speed.
    A2,
    /// Stiffness in series.
    Stiffness,
    /// Its damping.
    Damping,
    /// Factor on all friction: of A0 and A1, after them.
    Factor,
    /// How late the channel is, ms; not a logarithm.
    Late,
    /// What the friction bridge shows where nothing pulls, N m; not a logarithm.
    FrictionZero,
    /// What the normal bridge shows where nothing presses, N; not a logarithm.
    NormalZero,
}

impl Role {
    /// Whether it is an error of a sensor, and no number of the contact.
    pub fn is_of_sensor(self) -> bool {
        matches!(self, Self::Late | Self::FrictionZero | Self::NormalZero)
    }
}

/// Numbers of the contact before anything is fitted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Numbers {
    /// Coulomb coefficient, with the road factor.
    pub a0: f64,
    /// Static minus Coulomb coefficient, with the road factor.
    pub a1: f64,
    /// Stribeck speed, m/s.
    pub v0_m_s: f64,
    /// Stribeck exponent.
    pub delta: f64,
    /// Viscous coefficient, s/m.
    pub a2_s_per_m: f64,
    /// Stiffness in series, N/m.
    pub stiffness_n_per_m: f64,
    /// Its damping, N s/m.
    pub damping_n_s_per_m: f64,
    /// Stiffness of bristles in series with a block, N/m; infinite where there is no block.
    pub bristles_n_per_m: f64,
    /// Whether bristles that follow the root are all there is.
    pub bristles_alone: bool,
    /// Whether what slips does so until the motion reverses or stops, however slow it is (brush with reset).
    pub slips_on: bool,
    /// Lateness of the channel beyond the rig file's, ms.
    pub late_ms: f64,
    /// What the friction bridge shows where nothing pulls, N m.
    pub friction_zero_nm: f64,
    /// What the normal bridge shows where nothing presses, N.
    pub normal_zero_n: f64,
}

impl Numbers {
    /// Static minus Coulomb coefficient as a file may have it: a search may be below nothing for a while.
    pub fn static_drop(&self) -> f64 {
        self.a1.max(0.0)
    }

    /// Stiffness and damping in series for those of another element, where there is one.
    pub fn exchange(&mut self, other: &mut Option<(f64, f64)>) {
        if let Some((stiffness_n_per_m, damping_n_s_per_m)) = other {
            std::mem::swap(&mut self.stiffness_n_per_m, stiffness_n_per_m);
            std::mem::swap(&mut self.damping_n_s_per_m, damping_n_s_per_m);
        }
    }
}

/// A baseline parameter.
#[derive(Debug, Clone)]
pub struct BaseParameter {
    /// Which.
    pub role: Role,
    /// Name and prior.
    pub parameter: Parameter,
}

/// The baseline: what the model file says, and how sure it is.
#[derive(Debug, Clone)]
pub struct Baseline {
    /// Numbers of the model file.
    pub numbers: Numbers,
    /// What is fitted.
    pub free: Vec<BaseParameter>,
}

impl Baseline {
    /// Numbers for fitted values.
    pub fn numbers(&self, p: &[f64]) -> Numbers {
        let mut numbers = self.numbers;
        let mut most = None;
        for (at, base) in self.free.iter().enumerate() {
            let value = self.bounded(p, at);
            let slot = match base.role {
                Role::A0 => &mut numbers.a0,
                Role::A1 => &mut numbers.a1,
                Role::Static => most.insert(0.0),
                Role::V0 => &mut numbers.v0_m_s,
                Role::Delta => &mut numbers.delta,
                Role::A2 => &mut numbers.a2_s_per_m,
                Role::Stiffness => &mut numbers.stiffness_n_per_m,
                Role::Damping => &mut numbers.damping_n_s_per_m,
                Role::Factor => {
                    numbers.a0 *= value.exp();
                    numbers.a1 *= value.exp();
                    continue;
                }
                Role::Late => &mut numbers.late_ms,
                Role::FrictionZero => &mut numbers.friction_zero_nm,
                Role::NormalZero => &mut numbers.normal_zero_n,
            };
            *slot = if base.role.is_of_sensor() { value } else { value.exp() };
        }
        if let Some(most) = most {
            // Less than Coulomb friction is nothing that a file may say, but a way back from there.
            numbers.a1 = most - numbers.a0;
        }
        numbers
    }

    /// Deviation of what is known of a parameter; 0 where it is not free.
    pub fn deviation_of(&self, role: Role) -> f64 {
        self.free.iter().find(|base| base.role == role).map_or(0.0, |base| base.parameter.sd)
    }

    /// A fitted value within its bounds.
    pub fn bounded(&self, p: &[f64], at: usize) -> f64 {
        let q = &self.free[at].parameter;
        q.mean + BOUND * q.sd * ((p[at] - q.mean) / (BOUND * q.sd)).tanh()
    }
}

/// What the channel should have shown.
#[derive(Debug, Clone)]
pub struct Prediction {
    /// All logs on end, N m.
    pub shown_nm: Vec<f64>,
    /// What the law made of each log.
    pub observed: Vec<Observed>,
    /// The sensor's mode (Hz, damping ratio) where it rings from sample to sample.
    pub ringing: Option<(f64, f64)>,
}

impl Prediction {
    /// Where the tip slides, all logs on end.
    pub fn slides(&self) -> Vec<bool> {
        self.observed.iter().flat_map(|o| o.sliding.iter().map(|s| *s > 0.5)).collect()
    }
}

/// A fitted hypothesis.
#[derive(Debug, Clone)]
pub struct Fit {
    /// Places of its terms in the list of all terms.
    pub terms: Vec<usize>,
    /// Values: baseline, then term after term.
    pub p: Vec<f64>,
    /// Residuals over their deviations; 0 where a point is not used.
    pub r: Vec<f64>,
    /// −ln of likelihood times prior, but for constants.
    pub cost: f64,
    /// Slopes of the residuals, a column for each value, where those that it ended with are good for this point.
    pub slopes: Option<Vec<Slope>>,
}

/// Slopes that change little while other parameters move: those of the baseline, and of ln friction as a whole.
#[derive(Debug, Clone)]
pub struct Slopes {
    base: Vec<Slope>,
    gain: Slope,
}

impl Slopes {
    /// Those of the baseline.
    pub fn base(&self) -> &[Slope] {
        &self.base
    }

    /// Along ln friction as a whole.
    pub fn gain(&self) -> &[f64] {
        &self.gain
    }
}

/// What is known of the slopes where a fit begins, taken near by.
#[derive(Debug, Clone)]
pub enum Near<'s> {
    /// Nothing.
    Nothing,
    /// Those of the baseline.
    Baseline(&'s Slopes),
    /// All.
    All(Vec<Slope>),
}

impl From<Option<Vec<Slope>>> for Near<'_> {
    /// Those that a fit ended with, where it has them.
    fn from(slopes: Option<Vec<Slope>>) -> Self {
        slopes.map_or(Self::Nothing, Self::All)
    }
}

/// Logs, noise and baseline, ready for any hypothesis.
pub struct Problem<'a> {
    /// Logs.
    pub logs: &'a [ContactLog],
    /// The baseline.
    pub baseline: &'a Baseline,
    /// Every form of every effect.
    pub terms: &'a [ContactTerm],
    /// The noise model.
    pub noise: Noise,
}

/// Errors of a prediction.
#[derive(Debug, Clone, Default)]
pub struct PredictionErrors {
    /// What is measured less predicted, N m.
    pub left_nm: Vec<f64>,
    /// Deviation of each sample from its named sources, N m.
    pub named_nm: Vec<f64>,
    /// Samples at which they are taken.
    pub compared: Vec<usize>,
}

impl PredictionErrors {
    /// Of a fit.
    pub fn new(problem: &Problem<'_>, fit: &Fit) -> Self {
        let left_nm = problem.left(&problem.predict(&fit.terms, &fit.p));
        let named_nm = (0..left_nm.len()).map(|i| problem.noise.named(i)).collect();
        Self { left_nm, named_nm, compared: problem.compared() }
    }
}

impl<'a> Problem<'a> {
    /// For these logs; the noise model is that of the baseline as the model file has it.
    pub fn new(logs: &'a [ContactLog], baseline: &'a Baseline, terms: &'a [ContactTerm]) -> Self {
        let start: Vec<f64> = baseline.free.iter().map(|b| b.parameter.mean).collect();
        let mut problem = Self { logs, baseline, terms, noise: Noise::default() };
        problem.noise = problem.noise_at(&[], &start);
        problem
    }

    /// The noise model, not fitted, with the slopes, transitions and jumps of a hypothesis.
    pub fn noise_at(&self, terms: &[usize], p: &[f64]) -> Noise {
        let change = self.change(terms, p);
        let contact = self.contact(&self.baseline.numbers(p), &change);
        let prediction = self.predict_changed(&change, p);
        Noise::new(self.logs, &contact, &prediction)
    }

    /// With a noise model that was fitted before.
    pub fn with_noise(
        logs: &'a [ContactLog],
        baseline: &'a Baseline,
        terms: &'a [ContactTerm],
        noise: Noise,
    ) -> Self {
        Self { logs, baseline, terms, noise }
    }

    /// Measured values, all logs on end.
    pub fn measured(&self) -> impl Iterator<Item = f64> + '_ {
        self.logs.iter().flat_map(|log| log.friction_nm.iter().copied())
    }

    /// Deviation up to which a sample of the friction channel is well known, N m: sizes and rests are taken there.
    pub fn well_known_nm(&self) -> f64 {
        WELL_KNOWN * rms(&self.measured().collect::<Vec<_>>())
    }

    /// Samples at which errors of a prediction are taken.
    pub fn compared(&self) -> Vec<usize> {
        let usable = self.logs.iter().flat_map(|log| log.usable.iter().copied());
        self.noise.compared(usable, self.well_known_nm())
    }

    /// What is measured less predicted, but for what it was seen to swing with, N m.
    pub fn left(&self, predicted: &Prediction) -> Vec<f64> {
        let mut left: Vec<f64> = self.measured().zip(&predicted.shown_nm).map(|(y, x)| y - x).collect();
        self.noise.innovations(&mut left);
        left
    }

    fn contact(&self, numbers: &Numbers, change: &Change) -> Contact {
        let n = numbers;
        let mut curve = Curve::new(|w| n.a0 + n.a1 * (-(w / n.v0_m_s).powf(n.delta)).exp());
        if let Some(log_factor) = &change.log_curve {
            curve.scale(log_factor);
        }
        let has_no_block = n.bristles_alone && change.block.is_none();
        let (k, c) = change.block.unwrap_or((n.stiffness_n_per_m, n.damping_n_s_per_m));
        Contact {
            curve,
            stiffness_n_per_m: k,
            damping_n_s_per_m: c,
            bristles_n_per_m: n.bristles_n_per_m,
            bristles_alone: has_no_block,
            slips_on: n.slips_on,
            // They stand beside a block.
            branches: if has_no_block { [(0.0, 1.0); 3] } else { change.branches },
            viscous: (n.a2_s_per_m, change.film_n_s_per_m),
            ageing: change.ageing,
        }
    }

    /// What the terms change.
    pub fn change(&self, terms: &[usize], p: &[f64]) -> Change {
        self.change_but(terms, p, None)
    }

    /// What the terms change but for one.
    fn change_but(&self, terms: &[usize], p: &[f64], out: Option<usize>) -> Change {
        let mut change = Change::default();
        let mut at = self.baseline.free.len();
        for &term in terms {
            let own = at..at + self.terms[term].parameters.len();
            at = own.end;
            if out != Some(term) {
                (self.terms[term].act)(&p[own], &mut change);
            }
        }
        change
    }

    /// What the channel should have shown.
    pub fn predict(&self, terms: &[usize], p: &[f64]) -> Prediction {
        self.predict_changed(&self.change(terms, p), p)
    }

    fn predict_changed(&self, change: &Change, p: &[f64]) -> Prediction {
        let numbers = self.baseline.numbers(p);
        let contact = self.contact(&numbers, change);
        let mut shown_nm = Vec::with_capacity(self.logs.iter().map(ContactLog::len).sum());
        let mut all = Vec::with_capacity(self.logs.len());
        for (at, log) in self.logs.iter().enumerate() {
            // What the channel adds is taken off first, so that it changes the observed slip too.
            let mut channel = Channel::new(log, at, change, &numbers);
            let seen_nm = channel.seen_nm();
            let smoothed = log.smoothing.ahead(channel.late());
            let mut force_n: Vec<f64> = seen_nm.iter().map(|t| t / log.radius_m).collect();
            let ends = channel.ends(seen_nm);
            let usual = rms(&log.root_speed_m_s);
            let load_n = log.load_above(numbers.normal_zero_n);
            let factor = change.log_factor.as_ref().map(|m| exponentials(&m[at]));
            let drive = Drive {
                step_s: log.grid.step_s,
                root_m: change.root_m.as_ref().map_or(&log.root_m, |root| &root[at]),
                load_n: &load_n,
                force_n: &[],
                ends: ends.as_deref(),
                factor: factor.as_deref(),
                slip_threshold_m_s: (SLOWEST_SLIP * usual).max(SLIP_NOISES * log.speed_noise_m_s).max(1e-9),
                late: channel.late(),
                smoothed: &smoothed,
                noise: (
                    log.speed_noise_m_s.max(DRIFT * usual),
                    log.friction_noise_nm.max(1e-12) / log.radius_m,
                ),
                unsure_m_s: log.unsure_m_s,
            };
            let mut observed = observe(&contact, &Drive { force_n: &force_n, ..drive });
            if let Some(ends) = ends.as_ref().filter(|ends| ends.iter().any(|end| *end != 0)) {
                // The law's own force stands in for one that is beyond the end.
                for ((end, force), by_law) in ends.iter().zip(&mut force_n).zip(&observed.force_n) {
                    match end {
                        1 => *force = force.max(*by_law),
                        -1 => *force = force.min(*by_law),
                        _ => (),
                    }
                }
                observed = observe(&contact, &Drive { force_n: &force_n, ..drive });
            }
            let torque_nm = observed.force_n.iter().map(|f| f * log.radius_m).collect();
            shown_nm.extend(channel.shown_nm(torque_nm));
            all.push(observed);
        }
        let rings = |log: &ContactLog| ringing(change.mode, log.grid.step_s);
        let ringing = change.mode.filter(|_| self.logs.iter().all(|log| rings(log).is_some()));
        Prediction { shown_nm, observed: all, ringing }
    }

    /// Residuals over their deviations.
    pub fn residuals(&self, terms: &[usize], p: &[f64]) -> Vec<f64> {
        self.scaled(&self.predict(terms, p))
    }

    fn scaled(&self, prediction: &Prediction) -> Vec<f64> {
        let mut left = Vec::with_capacity(prediction.shown_nm.len());
        for (log, observed) in self.logs.iter().zip(&prediction.observed) {
            let from = left.len();
            left.extend(log.friction_nm.iter().enumerate().map(|(i, measured_nm)| {
                let scale = self.noise.scale(from + i, observed.own_noise[i]);
                scale * (measured_nm - prediction.shown_nm[from + i])
            }));
        }
        if let Some(mode) = prediction.ringing {
            self.behind_mode(&mut left, mode);
        }
        self.noise.innovations(&mut left);
        let usable = self.logs.iter().flat_map(|log| &log.usable);
        let of_noise = self.noise.deviation.iter().zip(&self.noise.known);
        for ((left, (deviation, known)), usable) in left.iter_mut().zip(of_noise).zip(usable) {
            *left = if *usable && *known { *left / deviation } else { 0.0 };
        }
        left
    }

    /// Takes off what the sensor's mode is seen to ring with for what is uncertain of the force.
    fn behind_mode(&self, residual: &mut [f64], mode: (f64, f64)) {
        let variance: Vec<f64> = self.noise.deviation.iter().map(|s| s * s).collect();
        let mut from = 0;
        for log in self.logs {
            let own = from..from + log.len();
            from = own.end;
            let [of_force, of_all] = [&self.noise.of_force[own.clone()], &variance[own.clone()]];
            innovations(&mut residual[own], mode, log.grid.step_s, of_force, of_all, &log.usable);
        }
    }

    /// All parameters of a hypothesis.
    pub fn parameters<'s>(&'s self, terms: &'s [usize]) -> impl Iterator<Item = &'s Parameter> + 's {
        let base = self.baseline.free.iter().map(|b| &b.parameter);
        base.chain(terms.iter().flat_map(|t| self.terms[*t].parameters.iter()))
    }

    /// −ln of likelihood times prior at a point, but for constants.
    pub fn cost_at(&self, terms: &[usize], p: &[f64]) -> f64 {
        self.cost(terms, p, &self.residuals(terms, p))
    }

    fn cost(&self, terms: &[usize], p: &[f64], r: &[f64]) -> f64 {
        let prior: f64 =
            self.parameters(terms).zip(p).map(|(q, x)| ((x - q.mean) / q.width(TYPICAL_SCALE)).powi(2)).sum();
        self.misfit(r) + 0.5 * prior
    }

    /// −ln likelihood, but for constants.
    pub fn misfit(&self, r: &[f64]) -> f64 {
        0.5 * (FREEDOM + 1.0) * linear::sum_of_logs(&self.noise.whitened(r), FREEDOM) / self.noise.temper
    }

    /// −∂r/∂p at a point, a column for each parameter.
    pub fn jacobian(&self, terms: &[usize], p: &[f64], r: &[f64]) -> Vec<Slope> {
        let slopes = self.slopes(terms, p, r);
        self.jacobian_with(&slopes, terms, p, r)
    }

    /// The same of a fit: those that it ended with, where they are good.
    pub fn jacobian_of(&self, fit: &Fit) -> Vec<Slope> {
        fit.slopes.clone().unwrap_or_else(|| self.jacobian(&fit.terms, &fit.p, &fit.r))
    }

    /// As [`Self::slopes`] of a fit, with those that it ended with, where they are good.
    pub fn slopes_of(&self, fit: &Fit) -> Slopes {
        let Some(known) = &fit.slopes else { return self.slopes(&fit.terms, &fit.p, &fit.r) };
        Slopes {
            base: known[..self.baseline.free.len()].to_vec(),
            gain: self.gain_slope(self.change(&fit.terms, &fit.p), &fit.p, &fit.r),
        }
    }

    /// Slopes at a point that change little while other parameters move.
    pub fn slopes(&self, terms: &[usize], p: &[f64], r: &[f64]) -> Slopes {
        let change = self.change(terms, p);
        let base = (0..self.baseline.free.len())
            .into_par_iter()
            // What the terms change is the same.
            .map(|i| {
                self.difference(p, r, i, self.baseline.free[i].parameter.step, |_| Cow::Borrowed(&change))
            })
            .collect();
        Slopes { base, gain: self.gain_slope(change, p, r) }
    }

    /// Slope along ln friction as a whole.
    fn gain_slope(&self, change: Change, p: &[f64], r: &[f64]) -> Slope {
        self.raised(change, p, r, |change| &mut change.log_factor)
    }

    /// Slope along what a column of a change is raised by everywhere.
    fn raised(
        &self,
        mut change: Change,
        p: &[f64],
        r: &[f64],
        column: impl Fn(&mut Change) -> &mut Option<Column>,
    ) -> Slope {
        const STEP: f64 = 0.01;
        let nothing = || self.logs.iter().map(|log| vec![0.0; log.len()]).collect();
        let raised = column(&mut change).get_or_insert_with(nothing);
        raised.iter_mut().flatten().for_each(|x| *x += STEP);
        self.slope_to(&change, p, r, STEP)
    }

    /// Slope along one value, by what the terms change there.
    fn difference<'c>(
        &self,
        p: &[f64],
        r: &[f64],
        i: usize,
        step: f64,
        change: impl Fn(&[f64]) -> Cow<'c, Change>,
    ) -> Slope {
        let mut q = p.to_vec();
        q[i] += step;
        self.slope_to(&change(&q), &q, r, step)
    }

    /// Slope from these residuals to those of a point that is a step away.
    fn slope_to(&self, change: &Change, p: &[f64], r: &[f64], step: f64) -> Slope {
        let moved = self.scaled(&self.predict_changed(change, p));
        moved.iter().zip(r).map(|(a, b)| (b - a) / step).collect()
    }

    /// As [`Self::jacobian`], with slopes taken near by.
    pub fn jacobian_with(&self, slopes: &Slopes, terms: &[usize], p: &[f64], r: &[f64]) -> Vec<Slope> {
        let mut columns = slopes.base.clone();
        let mut at = columns.len();
        for count in 1..=terms.len() {
            let own = self.terms[terms[count - 1]].parameters.len();
            at += own;
            columns.extend(self.columns_of(slopes, terms, p, r, terms[count - 1], at - own));
        }
        columns
    }

    /// Columns of the last term alone.
    pub fn term_columns(&self, slopes: &Slopes, terms: &[usize], p: &[f64], r: &[f64]) -> Vec<Slope> {
        let Some(&last) = terms.last() else { return Vec::new() };
        self.columns_of(slopes, terms, p, r, last, p.len() - self.terms[last].parameters.len())
    }

    /// Columns of a term whose parameters begin at a place.
    fn columns_of(
        &self,
        slopes: &Slopes,
        terms: &[usize],
        p: &[f64],
        r: &[f64],
        place: usize,
        at: usize,
    ) -> Vec<Slope> {
        let term = &self.terms[place];
        let through = |slope: &[f64], column: &Column| -> Slope {
            column.iter().flatten().zip(slope).map(|(x, slope)| x * slope).collect()
        };
        let zero = self.baseline.free.iter().position(|base| base.role == Role::FrictionZero);
        match (&term.columns, zero) {
            (Some(Columns::LogFactor(own)), _) => own.iter().map(|c| through(&slopes.gain, c)).collect(),
            (Some(Columns::Amplifier([zeros, gains])), Some(zero)) => {
                let mut columns: Vec<_> = zeros.iter().map(|c| through(&slopes.base[zero], c)).collect();
                if !gains.is_empty() {
                    let slope = self.raised(self.change(terms, p), p, r, |change| &mut change.gain);
                    columns.extend(gains.iter().map(|c| through(&slope, c)));
                }
                columns
            }
            _ => {
                let others = self.change_but(terms, p, Some(place));
                let own = at..at + term.parameters.len();
                let moved = |q: &[f64]| {
                    let mut change = others.clone();
                    (term.act)(&q[own.clone()], &mut change);
                    Cow::Owned(change)
                };
                let column = |i: usize| self.difference(p, r, at + i, term.parameters[i].step, moved);
                (0..term.parameters.len()).into_par_iter().map(column).collect()
            }
        }
    }

    /// JᵀWJ, of these pairs of columns, and JᵀWr of iterated least squares on what is new in each sample; it counts as so much.
    fn normal(
        &self,
        columns: &[Slope],
        r: &[f64],
        counts: impl Iterator<Item = f64>,
        wanted: impl Fn(usize, usize) -> bool + Sync,
    ) -> (DMatrix<f64>, DVector<f64>) {
        let new = self.noise.whitened(r);
        let weight = |(r, counts): (&f64, f64)| counts * (FREEDOM + 1.0) / (FREEDOM + r * r);
        let weights: Vec<f64> = new.iter().zip(counts).map(weight).collect();
        normal_equations_of(&self.noise.whitened_columns(columns), &weights, &new, wanted)
    }

    /// The same as a fit takes them: all samples count alike.
    pub fn normal_equations(&self, columns: &[Slope], r: &[f64]) -> (DMatrix<f64>, DVector<f64>) {
        self.normal_equations_of(columns, r, |_, _| true)
    }

    /// The same with the products of these pairs of columns alone, the later column first.
    pub fn normal_equations_of(
        &self,
        columns: &[Slope],
        r: &[f64],
        wanted: impl Fn(usize, usize) -> bool + Sync,
    ) -> (DMatrix<f64>, DVector<f64>) {
        self.normal(columns, r, std::iter::repeat(1.0 / self.noise.temper), wanted)
    }

    /// Gauss–Newton with damping from a start, at most so many iterations. The slopes are those given, or taken at the start; they
    /// are kept as long as steps gain what they promise, where there are causes mended by what each step showed: what is
    /// minimised is evaluated in each.
    pub fn fit(&self, terms: &[usize], start: Vec<f64>, iterations: usize, near: Near<'_>) -> Fit {
        let r = self.residuals(terms, &start);
        let cost = self.cost(terms, &start, &r);
        let at = Fit { terms: terms.to_vec(), p: start, r, cost, slopes: None };
        self.descended(at, iterations, near)
    }

    /// Begins where a fit to something else stood, with the slopes that it ended with.
    pub fn refitted(&self, fit: Fit, iterations: usize) -> Fit {
        self.fit(&fit.terms, fit.p, iterations, fit.slopes.into())
    }

    /// Goes on from a fit to these logs and this noise, with the slopes that it ended with.
    pub fn fitted_on(&self, mut fit: Fit, iterations: usize) -> Fit {
        let near = fit.slopes.take().into();
        self.descended(fit, iterations, near)
    }

    fn descended(&self, at: Fit, iterations: usize, mut near: Near<'_>) -> Fit {
        let Fit { terms, mut p, mut r, mut cost, .. } = at;
        let terms = terms.as_slice();
        let parameters: Vec<&Parameter> = self.parameters(terms).collect();
        let n = parameters.len();
        let mut damping = 1e-3;
        let widths: Vec<f64> = parameters.iter().map(|q| q.width(TYPICAL_SCALE)).collect();
        // The bias of `rig fit` is a small difference of fits of the baseline to noise of either sign: there slopes stay those of the
        // point, and not of what one step made of its noise.
        let mends = !terms.is_empty();
        let kept_promise = if mends { MENDED_PROMISE } else { KEPT_PROMISE };
        let mut kept: Option<Vec<Slope>> = None;
        for _ in 0..iterations {
            let fresh = matches!(near, Near::Nothing) && kept.is_none();
            let mut j = kept.take().unwrap_or_else(|| match std::mem::replace(&mut near, Near::Nothing) {
                Near::All(slopes) => slopes,
                Near::Baseline(slopes) => self.jacobian_with(slopes, terms, &p, &r),
                Near::Nothing => self.jacobian(terms, &p, &r),
            });
            let (mut h, mut g) = self.normal_equations(&j, &r);
            for (i, (q, sd)) in parameters.iter().zip(&widths).enumerate() {
                h[(i, i)] += 1.0 / (sd * sd);
                g[i] -= (p[i] - q.mean) / (sd * sd);
            }
            let mut found = None;
            // Each step is shorter than the one before; it costs little beside new slopes.
            let tried = if fresh {
                6
            } else if mends {
                3
            } else {
                1
            };
            for _ in 0..tried {
                let mut damped = h.clone();
                for i in 0..n {
                    damped[(i, i)] *= 1.0 + damping;
                }
                let lower: Vec<f64> = parameters.iter().zip(&p).map(|(q, x)| q.lower - x).collect();
                let d = linear::solve_bounded(&damped, &g, &lower);
                // Each as far as slopes are good for: one that wants to go further does not hold the others.
                let moved = p.iter().zip(d.iter()).zip(&parameters);
                let next: Vec<f64> =
                    moved.map(|((p, d), q)| (p + d.clamp(-q.reach, q.reach)).max(q.lower)).collect();
                let next_r = self.residuals(terms, &next);
                let next_cost = self.cost(terms, &next, &next_r);
                if next_cost < cost {
                    found = Some((next, next_r, next_cost));
                    break;
                }
                damping = (10.0 * damping).max(1e-2);
            }
            let Some((next, next_r, next_cost)) = found else {
                if fresh {
                    kept = Some(j);
                    break;
                }
                continue;
            };
            let gained = cost - next_cost;
            let step = DVector::from_fn(n, |i, _| next[i] - p[i]);
            let promised = g.dot(&step) - 0.5 * step.dot(&(&h * &step));
            if gained > kept_promise * promised {
                if mends {
                    linear::mend_slopes(&mut j, [&r, &next_r], step.as_slice(), &widths);
                }
                kept = Some(j);
            }
            (p, r, cost) = (next, next_r, next_cost);
            damping = (0.3 * damping).max(1e-6);
            // Causes are decided with the likelihood's share, but a step along slopes that are kept costs little; of a baseline
            // alone values are stated.
            let enough = if mends && fresh { UNDECIDED / CONTACT_SHARE } else { UNDECIDED };
            if gained < enough && (fresh || kept.is_some()) {
                break;
            }
        }
        Fit { terms: terms.to_vec(), p, r, cost, slopes: kept }
    }

    /// Values of a fit with better static friction, looked for within its prior: breaking loose moves in time with it, from sample
    /// to sample, and slopes say little of that.
    pub fn better_static(&self, fit: &Fit) -> Option<Vec<f64>> {
        let at = self.baseline.free.iter().position(|base| base.role == Role::Static)?;
        let prior = &self.baseline.free[at].parameter;
        let steps = (STATIC_WITHIN * prior.sd / STATIC_STEP).ceil() as i32;
        let tried = (-steps..=steps).into_par_iter().map(|step| {
            let mut p = fit.p.clone();
            p[at] = prior.mean + STATIC_STEP * f64::from(step);
            (self.cost_at(&fit.terms, &p), p)
        });
        let best = tried.min_by(|a, b| a.0.total_cmp(&b.0));
        best.filter(|(cost, _)| *cost < fit.cost).map(|(_, p)| p)
    }

    /// A fit brought to its optimum: what is stated of it is less than what decides.
    pub fn settled(&self, mut fit: Fit) -> Fit {
        for _ in 0..MOST_SETTLING {
            let next = self.fit(&fit.terms, fit.p.clone(), 1, Near::Nothing);
            let gained = fit.cost - next.cost;
            fit = next;
            if gained < SETTLED {
                break;
            }
        }
        fit
    }

    /// Points at which the search over a term starts, beside the values of the others.
    pub fn starts(&self, others: &Fit, term: usize) -> Vec<Vec<f64>> {
        match &self.terms[term].starts {
            Starts::At(points) => points.clone(),
            Starts::BestOf(points, count) => {
                let terms: Vec<usize> = others.terms.iter().copied().chain([term]).collect();
                let mut tried: Vec<(f64, &Vec<f64>)> = points
                    .par_iter()
                    .map(|point| {
                        let p = [others.p.as_slice(), point.as_slice()].concat();
                        (self.misfit(&self.residuals(&terms, &p)), point)
                    })
                    .collect();
                tried.sort_by(|a, b| a.0.total_cmp(&b.0));
                tried.into_iter().take(*count).map(|(_, point)| point.clone()).collect()
            }
        }
    }

    /// ln ∫ likelihood^share · prior by Laplace's method, averaged over the scale of the amplitudes: the whole evidence, and
    /// that with [`CONTACT_SHARE`].
    pub fn log_evidence(&self, fit: &Fit) -> [f64; 2] {
        let (h, g) = self.curvature(fit);
        let parameters: Vec<&Parameter> = self.parameters(&fit.terms).collect();
        let new = self.noise.whitened(&fit.r);
        let each = new.iter().zip(self.noise.counts());
        let misfit: f64 = each.map(|(r, counts)| counts * (r * r / FREEDOM).ln_1p()).sum();
        let at = Expansion {
            p: &fit.p,
            parameters: &parameters,
            misfit: 0.5 * (FREEDOM + 1.0) * misfit,
            slope: &g,
            curvature: &h,
        };
        [1.0, CONTACT_SHARE].map(|share| at.log_evidence(share, |_| 0.0))
    }

    /// What a fit leaves open of its values, the likelihood with its share: their covariance.
    pub fn open(&self, fit: &Fit) -> DMatrix<f64> {
        let sd: Vec<f64> = self.parameters(&fit.terms).map(|q| q.width(TYPICAL_SCALE)).collect();
        covariance(&self.curvature(fit).0, CONTACT_SHARE, &sd)
    }

    /// Curvature of −ln likelihood at a fit, and the slope of ln likelihood.
    fn curvature(&self, fit: &Fit) -> (DMatrix<f64>, DVector<f64>) {
        self.normal(&self.jacobian_of(fit), &fit.r, self.noise.counts(), |_, _| true)
    }

    /// Takes the noise from what a fit leaves. What would leave no sample well known is no noise of a bench but what no cause
    /// explains: it stays a residual.
    pub fn refit_noise(&mut self, fit: &Fit) {
        let slides = self.slides(fit);
        let mut noise = self.noise.clone();
        noise.refit_coloured(self.logs, &fit.r, &slides);
        let limit = self.well_known_nm();
        if noise.deviation.iter().any(|deviation| *deviation < limit) {
            self.noise = noise;
        }
    }

    /// Where the tip slides.
    pub fn slides(&self, fit: &Fit) -> Vec<bool> {
        self.predict(&fit.terms, &fit.p).slides()
    }
}

#[cfg(test)]
mod tests {
    use super::super::baseline::{KNOWN_WITHIN, baseline};
    use super::*;
    use crate::files::log::Log;
    use crate::files::model_file::{ModelFile, ModelKind};
    use crate::files::rig_file::RigFile;
    use crate::files::signal::Signal;
    use crate::identify::noise::White;

    #[test]
    fn bridges_that_show_something_where_nothing_pulls_are_seen_through() {
        const COUNT: usize = 3000;
        let rig = RigFile::assumed_rig(&[]).unwrap();
        let series = |of: &dyn Fn(f64) -> f64| (0..COUNT).map(|i| of(1e-3 * i as f64)).collect::<Vec<f64>>();
        let log = |friction_zero_nm: f64, normal_zero_n: f64| {
            let mut log = Log::default();
            log.set_signal(Signal::Time, series(&|t| t));
            log.set_signal(Signal::M2Speed, series(&|t| 4.0 * (2.0 * t).sin()));
            log.set_signal(Signal::NormalForce, series(&|t| 60.0 + 20.0 * (3.0 * t).cos() + normal_zero_n));
            let torque_nm = |t: f64| 2.5 * (30.0 * (2.0 * t).sin()).tanh() + 0.1 * (9.0 * t).cos();
            log.set_signal(Signal::FrictionTorque, series(&|t| torque_nm(t) + friction_zero_nm));
            ContactLog::new(&log, &rig).unwrap()
        };
        let baseline = baseline(&ModelFile::assumed(&[]).unwrap(), KNOWN_WITHIN).with_bridge_zeros(&rig);
        let predict = |log: ContactLog, p: &[f64]| {
            Problem::new(std::slice::from_ref(&log), &baseline, &[]).predict(&[], p).shown_nm
        };
        let without: Vec<f64> = baseline.free.iter().map(|b| b.parameter.mean).collect();
        let mut with = without.clone();
        let last = with.len();
        with[last - 2..].copy_from_slice(&[0.02, 0.7]);
        let [friction_zero_nm, normal_zero_n] = [last - 2, last - 1].map(|at| baseline.bounded(&with, at));
        assert!(friction_zero_nm > 0.01 && normal_zero_n > 0.4, "{friction_zero_nm} {normal_zero_n}");
        let (ideal, shown) =
            (predict(log(0.0, 0.0), &without), predict(log(friction_zero_nm, normal_zero_n), &with));
        let off = |zero_nm: f64| {
            let each = ideal.iter().zip(&shown).map(|(ideal, shown)| (ideal + zero_nm - shown).abs());
            each.fold(0.0, f64::max)
        };
        assert!(off(friction_zero_nm) < 1e-9, "{}", off(friction_zero_nm));
    }

    /// Stiffer bristles make more of the way's noise, and a sample at rest would be the less certain the stiffer they are: numbers
    /// are compared under the same weights.
    #[test]
    fn stiffer_bristles_do_not_pay_by_samples_that_say_less() {
        const COUNT: usize = 4000;
        const AT_REST: usize = COUNT / 2;
        let mut white = White::new(5);
        let mut noise = |size: f64| size * white.next();
        let time = |i: usize| 1e-3 * i as f64;
        let turns = |i: usize| if i < AT_REST { 0.0 } else { 4.0 * (2.0 * time(i - AT_REST)).sin() };
        let mut log = Log::default();
        log.set_signal(Signal::Time, (0..COUNT).map(time).collect());
        let speed = |i: usize| if i < AT_REST { 0.0 } else { turns(i) + noise(0.02) };
        log.set_signal(Signal::M2Speed, (0..COUNT).map(speed).collect());
        log.set_signal(Signal::NormalForce, (0..COUNT).map(|_| 60.0 + noise(0.2)).collect());
        let torque = |i: usize| 2.5 * (30.0 * turns(i)).tanh() + noise(0.1);
        log.set_signal(Signal::FrictionTorque, (0..COUNT).map(torque).collect());
        let rig = RigFile::assumed_rig(&[]).unwrap();
        let logs = [ContactLog::new(&log, &rig).unwrap()];
        let numbers = [("sigma0_n_per_m", 1e6), ("a0", 0.7), ("a1", 0.2), ("v0_m_s", 0.3)];
        let model = ModelFile::new("model", ModelKind::Lugre, &numbers).unwrap();
        let baseline = baseline(&model, KNOWN_WITHIN);
        let problem = Problem::new(&logs, &baseline, &[]);
        let mut p: Vec<f64> = baseline.free.iter().map(|b| b.parameter.mean).collect();
        let square = |p: &[f64]| problem.residuals(&[], p)[10..AT_REST].iter().map(|r| r * r).sum::<f64>();
        let soft = square(&p);
        let at = baseline.free.iter().position(|b| b.role == Role::Stiffness).unwrap();
        p[at] += 1.0;
        assert!(square(&p) > 0.98 * soft && soft > 0.0, "{} for {soft}", square(&p));
    }
}
