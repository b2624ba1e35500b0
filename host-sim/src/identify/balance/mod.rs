//! A balance that is linear in its parameters: a torque on the left, columns on the right, all through one filter.
//!
//! y = Σ p_i x_i + e,   e/σ Student-t (ν = 4), one row in T counted as independent, normal priors on p.
//! Solved by iterated weighted least squares; the evidence is Laplace's. What is nonlinear in an effect (a delay, a play,
//! a yield length) is a list of alternatives, which share the effect's prior.
//!
//! The noisy side is the response: torques carry the noise, angles little of it.

mod scoring;
mod search;
mod solve;

use std::ops::Range;

use nalgebra::DMatrix;

pub use self::search::{Company, Propose, search};
pub use self::solve::Weighed;
use super::contact::problem::FREEDOM;
use super::filters::{self, deviation_by_median, local_maximum};
use super::rest;
use super::slow_noise;
use super::spectrum::{SLOW_HZ, share_below};
use super::term::Parameter;
use super::variance_components::{self, Sample};
use super::whitening::{LogPoints, SLOW, Whitening};

/// The disc where it does not move as the motor does.
#[derive(Debug, Clone)]
pub struct DiscMotion {
    /// Its angle in each log with all of the form's parameters at 0, in the ways in which it may be reckoned.
    pub angle_rad: Vec<Vec<Vec<f64>>>,
    /// What a unit of each of the form's parameters adds to it in each log; empty where none does.
    pub angle_per_unit: Vec<Vec<Vec<f64>>>,
}

impl DiscMotion {
    /// Its angle in each log, reckoned in one of the ways, with these values of the form's parameters.
    pub fn angle(&self, way: usize, values: &[f64]) -> Vec<Vec<f64>> {
        let mut angle_rad = self.angle_rad[way].clone();
        for (value, logs) in values.iter().zip(&self.angle_per_unit) {
            for (angle_rad, unit) in angle_rad.iter_mut().zip(logs) {
                angle_rad.iter_mut().zip(unit).for_each(|(angle, unit)| *angle += value * unit);
            }
        }
        angle_rad
    }
}

/// A form of an effect in a balance.
#[derive(Debug, Clone)]
pub struct Alternative {
    /// The effect's id.
    pub effect: &'static str,
    /// Which form or shape, in words with units; empty where there is one.
    pub form: String,
    /// Parameters of the columns.
    pub parameters: Vec<Parameter>,
    /// Columns over all rows.
    pub columns: Vec<Vec<f64>>,
    /// What is added to the response.
    pub response: Option<Vec<f64>>,
    /// Variance at each point that noise of the sensors which that is reckoned from leaves in the balance, beyond what it has without
    /// this form; empty where there is none.
    pub noise_variance: Vec<f64>,
    /// Motion of the disc, where this form parts it from the motor's.
    pub disc: Option<DiscMotion>,
    /// Waves whose amplitude is the same in all logs: of each the places of cosine and sine among the parameters, log by log.
    pub same_amplitude: Vec<Vec<[usize; 2]>>,
    /// Change of the prior means of base parameters.
    pub base_shift: Vec<(usize, f64)>,
    /// Base parameters that are not negative where this form stands; beside others they may be so for what nothing explains.
    pub not_negative: Vec<usize>,
    /// Values of what is not linear.
    pub constants: Vec<(String, f64)>,
    /// ln of the prior probability of this shape among those of the effect.
    pub log_prior: f64,
    /// What its law follows, with its unit, where no coordinate of the balance is that.
    pub coordinate: Option<(String, Vec<f64>)>,
    /// Whether it is an error of a channel as another balance tells it: known there.
    pub told: bool,
}

impl Alternative {
    /// Whether it puts another coupling between motor and disc: there is one.
    pub fn is_coupling(&self) -> bool {
        self.disc.is_some() && self.response.is_some()
    }

    /// Whether each log has values of its own, as the phase of a pattern under an incremental encoder: of another log nothing is known.
    pub fn is_of_each_log(&self) -> bool {
        self.parameters.iter().any(|p| p.name.contains("_log"))
    }

    /// Columns alone.
    pub fn columns(effect: &'static str, parameters: Vec<Parameter>, columns: Vec<Vec<f64>>) -> Self {
        Self {
            effect,
            form: String::new(),
            parameters,
            columns,
            response: None,
            noise_variance: Vec::new(),
            disc: None,
            same_amplitude: Vec::new(),
            base_shift: Vec::new(),
            not_negative: Vec::new(),
            constants: Vec::new(),
            log_prior: 0.0,
            coordinate: None,
            told: false,
        }
    }
}

/// The rows of a balance.
#[derive(Debug, Clone)]
pub struct Balance {
    /// Left side, all grid points of all logs on end.
    pub response: Vec<f64>,
    /// Base parameters and columns.
    pub base: Vec<(Parameter, Vec<f64>)>,
    /// Where the errors of the sensors begin among them: they stand last.
    pub sensors: usize,
    /// Which of their columns has a sensor's noise in it, and the variances of the other noise and of that where the parameter is
    /// what its prior says.
    noisy_column: Option<(usize, [f64; 2])>,
    /// Which of them is the share of a sensor's noise that is left out.
    left_out_noise: Option<usize>,
    /// Deviation of each row, as refitted.
    pub deviation: Vec<f64>,
    /// Deviation of each row before it was refitted: from named sources alone.
    pub first_deviation: Vec<f64>,
    /// Squares of the sources at each point, point after point.
    sources: Vec<f64>,
    /// The least factor of each source's variance, and the largest that noise has.
    least: Vec<f64>,
    most: Vec<f64>,
    /// Factors of the sources and variance of each slow process, as refitted.
    factors: Vec<f64>,
    slow_of_each: f64,
    /// Rows that take part.
    pub used: Vec<usize>,
    /// Usual size of the torques whose sum the response is: what errors of form are relative to.
    pub scale: f64,
    /// Deviation of the zero of the bridge in it, in the response's unit; 0 where there is none.
    pub bridge_zero: f64,
    /// Rows that count as one.
    pub temper: f64,
    /// What is new in each row.
    pub(super) whitening: Whitening,
    /// The same of the response and of the base's columns.
    white_response: Vec<f64>,
    white_base: Vec<Vec<f64>>,
    /// Whether the response has quiet stretches; what may ripple all the time has none.
    pub rests: bool,
    /// Distance of the used rows, s.
    pub row_step_s: f64,
    /// Where each log's rows begin.
    pub starts: Vec<usize>,
    /// Distance of two points of each log, s.
    steps_s: Vec<f64>,
}

/// What a log gives to a balance.
pub struct LogRows<'l> {
    /// Width of the balance's filter, samples.
    pub width: f64,
    /// Step, s.
    pub step_s: f64,
    /// Points at which the balance says nothing.
    pub left_out: Vec<bool>,
    /// Deviations at a point from each source that is known.
    pub noise: Box<dyn Fn(usize) -> Vec<f64> + 'l>,
    /// The same from each source that is guessed: how large it is the residuals tell.
    pub guessed: Box<dyn Fn(usize) -> Vec<f64> + 'l>,
    /// The least factor of a guessed source's variance, where more is known of it than nothing.
    pub least: Vec<f64>,
    /// The largest factor of each known source's variance, and of the guessed ones of which the least is known, that noise has: a
    /// filter may pass all of what a channel shows, if that is not white.
    pub most: [Vec<f64>; 2],
}

/// Rows nearer to a point that is left out than so many widths are left out too: there the filter's weight has fallen to an
/// eighth of its largest.
const CLEAR_WIDTHS: f64 = 2.0;
/// Frequencies below which causes live, Hz: those of fast orders, and those of most. A bridge's noise that a converter has averaged is
/// denser the slower it is, and what counts is its density where a cause is.
const TEMPERED_HZ: [f64; 2] = [SLOW_HZ, 0.25 * SLOW_HZ];
/// Rows that count as one before the residuals tell it: neighbours share a part of their filter.
const FIRST_TEMPER: f64 = 1.5;

/// A solved set.
#[derive(Debug, Clone)]
pub struct Solved {
    /// Places of its alternatives.
    pub set: Vec<usize>,
    /// How many parameters the base has.
    pub base: usize,
    /// Values: base, then alternative after alternative.
    pub p: Vec<f64>,
    /// Their covariance.
    pub covariance: DMatrix<f64>,
    /// ln evidence, the likelihood with its share.
    pub log_evidence: f64,
    /// Residuals of all points, in the response's unit.
    pub residual: Vec<f64>,
    /// What is new in each row of them, over its deviation.
    pub(super) innovations: Vec<f64>,
}

impl Solved {
    /// Standard deviation of a value.
    pub fn std(&self, at: usize) -> f64 {
        self.covariance[(at, at)].max(0.0).sqrt()
    }

    /// The forms of its set, each with the places of its parameters among the values.
    pub fn forms<'s>(
        &'s self,
        alternatives: &'s [Alternative],
    ) -> impl Iterator<Item = (&'s Alternative, Range<usize>)> {
        placed(self.set.iter().map(|chosen| &alternatives[*chosen]), self.base)
    }
}

/// Variance at a point that noise of the sensors leaves of what these forms are reckoned from.
pub fn noise_variance_of(forms: &[&Alternative], point: usize) -> f64 {
    forms.iter().filter_map(|form| form.noise_variance.get(point)).sum()
}

/// Forms with the places of their parameters, which stand one form after the other behind those of the base.
fn placed<'f>(
    forms: impl Iterator<Item = &'f Alternative>,
    base: usize,
) -> impl Iterator<Item = (&'f Alternative, Range<usize>)> {
    forms.scan(base, |at, form| {
        let from = std::mem::replace(at, *at + form.parameters.len());
        Some((form, from..*at))
    })
}

impl Balance {
    /// From the filtered sides and what the logs say of their rows; `scale` is the usual size of the torques.
    pub fn new(
        response: Vec<f64>,
        base: Vec<(Parameter, Vec<f64>)>,
        logs: &[LogRows<'_>],
        scale: f64,
    ) -> Self {
        let (mut deviation, mut used, mut starts) = (Vec::new(), Vec::new(), Vec::new());
        let mut row_step_s = f64::INFINITY;
        let (mut sources, mut least, mut most) = (Vec::new(), Vec::new(), Vec::new());
        for log in logs {
            let (from, count) = (deviation.len(), log.left_out.len());
            starts.push(from);
            for i in 0..count {
                let (known, guessed) = ((log.noise)(i), (log.guessed)(i));
                if i == 0 {
                    let unknown = guessed.len() - log.least.len();
                    let nothing = vec![variance_components::LEAST; unknown];
                    least = [vec![1.0; known.len()], nothing, log.least.clone()].concat();
                    most = [log.most[0].clone(), vec![1.0; unknown], log.most[1].clone()].concat();
                }
                let squares: Vec<f64> = known.iter().chain(&guessed).map(|n| n * n).collect();
                deviation.push(squares.iter().sum::<f64>().sqrt().max(1e-12));
                sources.extend(squares);
            }
            let marked: Vec<f64> = log.left_out.iter().map(|out| f64::from(u8::from(*out))).collect();
            let near = local_maximum(&marked, (CLEAR_WIDTHS * log.width).ceil() as usize);
            // A width apart: of what is faster than half of that rate the filter passes 0.7 %, so that closer rows say the same.
            let every = log.width.round().max(1.0) as usize;
            let border = (filters::REACH * log.width).ceil() as usize;
            row_step_s = row_step_s.min(every as f64 * log.step_s);
            let rows = (border..count.saturating_sub(border)).step_by(every);
            used.extend(rows.filter(|i| near[*i] == 0.0).map(|i| from + i));
        }
        let first_deviation = deviation.clone();
        let mut balance = Self {
            response,
            sensors: base.len(),
            noisy_column: None,
            left_out_noise: None,
            base,
            deviation,
            first_deviation,
            factors: vec![1.0; least.len()],
            slow_of_each: 0.0,
            sources,
            least,
            most,
            used,
            scale,
            bridge_zero: 0.0,
            temper: FIRST_TEMPER,
            whitening: Whitening::default(),
            white_response: Vec::new(),
            white_base: Vec::new(),
            rests: true,
            row_step_s,
            starts,
            steps_s: logs.iter().map(|log| log.step_s).collect(),
        };
        balance.whiten(0.0);
        balance
    }

    /// Takes the rows' deviations, and slow processes of this variance beside them.
    fn whiten(&mut self, of_each: f64) {
        self.slow_of_each = of_each;
        let logs = self.rows_of_logs().into_iter().zip(&self.steps_s);
        let logs: Vec<LogPoints> = logs.map(|(points, &step_s)| LogPoints { points, step_s }).collect();
        self.whitening = Whitening::new(&logs, &self.deviation, |_| true, of_each);
        self.white_response = self.whitening.of(&self.response);
        let base: Vec<&Vec<f64>> = self.base.iter().map(|b| &b.1).collect();
        self.white_base = self.whitening.of_columns(&base);
    }

    /// With another response of the same rows.
    #[must_use]
    pub fn with_response(self, response: Vec<f64>) -> Self {
        let white_response = self.whitening.of(&response);
        Self { response, white_response, ..self }
    }

    /// As one whose response may ripple all the time.
    #[must_use]
    pub fn without_rests(self) -> Self {
        Self { rests: false, ..self }
    }

    /// With the base's parameters from this place on as errors of the sensors, and the deviation of its bridge's zero.
    #[must_use]
    pub fn with_sensors(self, sensors: usize, bridge_zero: f64) -> Self {
        Self { sensors, bridge_zero, ..self }
    }

    /// With a sensor's noise in this column of the base, `own` its deviation in the response where the parameter is what its prior
    /// says, and that of the response itself.
    #[must_use]
    pub fn with_noise_in(self, place: usize, [own, of_response]: [f64; 2]) -> Self {
        Self { noisy_column: Some((place, [of_response, own].map(|sd| sd * sd))), ..self }
    }

    /// By how much −ln likelihood is expected to be less where the parameter of a column with noise in it is smaller than its prior
    /// says: the balance has less of that noise then, and nothing is explained (errors in variables; W. A. Fuller, *Measurement
    /// Error Models*, 1987).
    fn noise_avoided(&self, p: &[f64]) -> f64 {
        let Some((place, [of_response, own])) = self.noisy_column else { return 0.0 };
        let times = (p[place] / self.base[place].0.mean).powi(2).min(1.0);
        let expected = |variance: f64| 0.5 * (FREEDOM + 1.0) * (variance / FREEDOM).ln_1p();
        let of_row = |(_, deviation): (usize, f64)| {
            let [all, left] = [1.0, times].map(|times| (of_response + times * own) / deviation.powi(2));
            expected(all) - expected(left)
        };
        self.whitening.rows().map(of_row).sum::<f64>() / self.temper
    }

    /// With the base's parameter of this name as the share of a sensor's noise that is left out of the response.
    #[must_use]
    pub fn without_noise_of(self, name: &str) -> Self {
        let left_out_noise = self.base.iter().position(|(parameter, _)| parameter.name == name);
        Self { left_out_noise, ..self }
    }

    /// The points of each log, as places in all.
    fn points_of_logs(&self) -> impl Iterator<Item = Range<usize>> + '_ {
        let ends = self.starts.iter().skip(1).copied().chain([self.response.len()]);
        self.starts.iter().zip(ends).map(|(start, end)| *start..end)
    }

    /// The used rows of each log, as places in all points.
    pub fn rows_of_logs(&self) -> Vec<Vec<usize>> {
        let used = |points: Range<usize>| self.used.iter().copied().filter(|i| points.contains(i)).collect();
        self.points_of_logs().map(used).collect()
    }

    /// What a solution beside these forms makes of the response but by the base's first column.
    pub fn all_but_inertia(&self, solved: &Solved, beside: &[&Alternative]) -> Vec<f64> {
        let Solved { p, residual, .. } = solved;
        let inertial = &self.base[0].1;
        let added = |i: usize| beside.iter().filter_map(|a| Some(a.response.as_ref()?[i])).sum::<f64>();
        (0..self.response.len())
            .map(|i| self.response[i] + added(i) - residual[i] - p[0] * inertial[i])
            .collect()
    }

    /// Deviation at each point that noise alone leaves, as `fitted`, a balance of logs of the same rig, tells of its sources, and
    /// of what is slow no more than a bridge's class allows: beyond that it is nothing of a sensor's. `residual` is what is left
    /// there. Each with the forms that stand in it.
    pub fn noise_alone(
        &self,
        forms: &[&Alternative],
        (fitted, fitted_forms): (&Self, &[&Alternative]),
        residual: &[f64],
    ) -> Vec<f64> {
        let left = rest::over_named(&fitted.of_sensors(fitted, fitted_forms), residual, &fitted.used);
        self.of_sensors(fitted, forms).into_iter().map(|deviation| left * deviation).collect()
    }

    /// The same where the noise of the channels is as large as they show it.
    fn of_sensors(&self, fitted: &Self, forms: &[&Alternative]) -> Vec<f64> {
        let slow = (SLOW as f64 * fitted.slow_of_each).min(fitted.bridge_zero.powi(2));
        let deviation = |(i, squares): (usize, &[f64])| {
            let of_source = squares
                .iter()
                .zip(fitted.factors.iter().zip(&fitted.most))
                .map(|(n, (a, most))| n * a.min(*most));
            (of_source.sum::<f64>() + noise_variance_of(forms, i) + slow).sqrt().max(1e-12)
        };
        self.sources.chunks(fitted.factors.len()).enumerate().map(deviation).collect()
    }

    /// RMS over the used rows.
    pub fn rms(&self, values: &[f64]) -> f64 {
        (self.used.iter().map(|&i| values[i] * values[i]).sum::<f64>() / self.used.len().max(1) as f64).sqrt()
    }

    /// RMS of the difference of two residuals over the used rows.
    pub fn difference(&self, a: &[f64], b: &[f64]) -> f64 {
        let sum: f64 = self.used.iter().map(|&i| (a[i] - b[i]).powi(2)).sum();
        (sum / self.used.len().max(1) as f64).sqrt()
    }

    /// Takes the noise from the residuals of a solved set: the level of what is slow, that of what is new in each row, and the
    /// effective sample size.
    pub fn refit_noise(&mut self, solved: &Solved) {
        if !self.rests {
            // What ripples all the time would be taken for noise.
            return self.refit_level(solved, 0.0);
        }
        let logs = self.rows_of_logs();
        let of_rows = |of: &[f64]| -> Vec<f64> { logs.iter().flatten().map(|i| of[*i]).collect() };
        let lengths: Vec<usize> = logs.iter().map(Vec::len).collect();
        // White noise that is left out from sample to sample is still there in means: what is left of it looks slow.
        let mut residual = solved.residual.clone();
        if let Some(place) = self.left_out_noise {
            let noise = self.base[place].1.iter();
            residual.iter_mut().zip(noise).for_each(|(r, noise)| *r += solved.p[place] * noise);
        }
        let [residual, deviation] = [&residual, &self.deviation].map(|of| of_rows(of));
        let errors = slow_noise::Errors { residual: &residual, deviation: &deviation, lengths: &lengths };
        let of_each = errors.likeliest_of_decade();
        self.whiten(of_each);
        self.refit_sources(solved);
        self.refit_level(solved, of_each);
    }

    /// Takes the size of each guessed source from what a solved set leaves new in each row.
    fn refit_sources(&mut self, solved: &Solved) {
        let Self { sources, least, .. } = self;
        let of_row = |((point, deviation), new): ((usize, f64), f64)| Sample {
            sources: &sources[point * least.len()..][..least.len()],
            square: (new * deviation).powi(2),
            besides: (deviation * deviation - self.deviation[point].powi(2)).max(0.0),
        };
        let new = self.whitening.of(&solved.residual);
        let samples: Vec<Sample<'_>> = self.whitening.rows().zip(new).map(of_row).collect();
        let typical =
            samples.iter().map(|s| s.sources.iter().sum::<f64>()).sum::<f64>() / samples.len().max(1) as f64;
        let factors = variance_components::fitted(&samples, least, typical);
        for (deviation, squares) in self.deviation.iter_mut().zip(sources.chunks(least.len())) {
            let variance: f64 = squares.iter().zip(&factors).map(|(n, a)| n * a).sum();
            *deviation = variance.sqrt().max(1e-12);
        }
        self.factors = factors;
    }

    /// Takes the level of what is new in each row, and the effective sample size, beside slow processes of this variance.
    fn refit_level(&mut self, solved: &Solved, of_each: f64) {
        self.whiten(of_each);
        let new = self.whitening.of(&solved.residual);
        // Not below the sensors' noise: where most rows rest, the angle's noise is not in them, and a deviation taken from them
        // makes outliers of those that move.
        let factor = deviation_by_median(new.into_iter()).max(1.0);
        self.deviation.iter_mut().for_each(|d| *d *= factor);
        self.whiten(of_each);
        let new = self.whitening.of(&solved.residual);
        let pull: Vec<f64> = new.iter().map(|r| r * (FREEDOM + 1.0) / (FREEDOM + r * r)).collect();
        // A drive alone has no bridge, and what it leaves slowly is the form of its friction.
        let bands = if self.rests { &TEMPERED_HZ[..] } else { &TEMPERED_HZ[..1] };
        self.temper = bands.iter().map(|hz| share_below(*hz, &pull, self.row_step_s)).fold(1.0, f64::max);
    }

    /// Takes back what [`Self::refit_noise`] has done.
    fn forget_residuals(&mut self) {
        self.deviation.copy_from_slice(&self.first_deviation);
        self.factors.fill(1.0);
        self.whiten(0.0);
        self.temper = FIRST_TEMPER;
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::identify::noise::White;
    use crate::identify::noise::tests::white;

    pub(super) const ROWS: usize = 4000;

    /// A log of rows a millisecond apart with white noise of this deviation.
    pub(in crate::identify) fn white_log(rows: usize, deviation: f64) -> LogRows<'static> {
        LogRows {
            width: 1.0,
            step_s: 1e-3,
            left_out: vec![false; rows],
            noise: Box::new(move |_| vec![deviation]),
            guessed: Box::new(|_| Vec::new()),
            least: Vec::new(),
            most: [vec![1.0], Vec::new()],
        }
    }

    /// A balance with one base column, a slow swing, and rows whose named deviation is one.
    pub(super) fn balance(response: Vec<f64>) -> Balance {
        beside(response, Vec::new())
    }

    /// The same with more columns of the base.
    fn beside(response: Vec<f64>, more: Vec<(Parameter, Vec<f64>)>) -> Balance {
        let column = (0..ROWS).map(|i| (0.01 * i as f64).sin()).collect();
        let base = [vec![(Parameter::amplitude("swing", 10.0), column)], more].concat();
        Balance::new(response, base, &[white_log(ROWS, 1.0)], 1.0)
    }

    /// A mean over long blocks of noise of which a sample keeps nine tenths has 19 times the variance of one of white noise.
    #[test]
    fn noise_that_a_converter_averages_counts_as_often_as_it_repeats_itself() {
        let temper = |kept: f64| {
            let of_seed = |seed: u64| {
                let keep = |state: &mut f64, new: f64| {
                    *state = kept * *state + new;
                    Some(*state)
                };
                let mut balance = balance(white(ROWS, seed).into_iter().scan(0.0, keep).collect());
                let solved = balance.solve(&[], &[]);
                balance.refit_level(&solved, 0.0);
                balance.temper
            };
            (1..=8).map(of_seed).sum::<f64>() / 8.0
        };
        let [white, averaged] = [0.0, 0.9].map(temper);
        assert!((1.0..1.2).contains(&white) && (14.0..22.0).contains(&averaged), "{white} {averaged}");
    }

    #[test]
    fn rows_that_rest_do_not_sharpen_those_that_move() {
        let mut quiet = white(ROWS, 1);
        quiet.iter_mut().take(ROWS * 9 / 10).for_each(|r| *r = 0.0);
        let mut balance = balance(quiet);
        let solved = balance.solve(&[], &[]);
        balance.refit_noise(&solved);
        assert_eq!(balance.deviation, balance.first_deviation);
        // Rows with more noise than is named widen it.
        let mut balance = self::balance(white(ROWS, 1).iter().map(|r| 3.0 * r).collect());
        let solved = balance.solve(&[], &[]);
        balance.refit_noise(&solved);
        assert!((balance.deviation[ROWS / 2] - 3.0).abs() < 0.2, "{}", balance.deviation[ROWS / 2]);
    }

    #[test]
    fn a_form_may_ask_that_what_stands_beside_it_is_not_negative() {
        let wave: Vec<f64> = (0..ROWS).map(|i| (0.03 * i as f64).sin()).collect();
        let gained = |constant: f64| {
            let response =
                wave.iter().zip(white(ROWS, 6)).map(|(x, e)| 3.0 * x + constant + 0.1 * e).collect();
            let balance = beside(response, vec![(Parameter::amplitude("constant", 10.0), vec![1.0; ROWS])]);
            let place = balance.base.len() - 1;
            let evidence = |not_negative: Vec<usize>| {
                let is_bounded = !not_negative.is_empty();
                let size = vec![Parameter::amplitude("size", 10.0)];
                let form = Alternative::columns("wave", size, vec![wave.clone()]);
                let solved = balance.solve_forms(&[&Alternative { not_negative, ..form }]);
                assert!((solved.p[place] < 0.0) == (constant < 0.0 && !is_bounded), "{:?}", solved.p);
                solved.log_evidence
            };
            evidence(vec![place]) - evidence(Vec::new())
        };
        assert_eq!(gained(2.0), 0.0);
        assert!(gained(-2.0) < -100.0, "{}", gained(-2.0));
    }

    #[test]
    fn white_noise_that_is_left_out_from_sample_to_sample_is_not_slow() {
        // The response has a sensor's white noise, and the base may leave out what of it is faster than a mean of 65 rows.
        let noise: Vec<f64> = white(ROWS, 4);
        let slow = filters::gaussian(&noise, 16.0, 0);
        let column = noise.iter().zip(&slow).map(|(e, slow)| e - slow).collect();
        let share = (Parameter { amplitude: false, ..Parameter::amplitude("share", 1.0) }, column);
        let slow_of_each = |told: bool| {
            let balance = beside(noise.clone(), vec![share.clone()]).with_sensors(1, 0.0);
            let mut balance = if told { balance.without_noise_of("share") } else { balance };
            let solved = balance.solve(&[], &[]);
            assert!((solved.p[1] - 1.0).abs() < 0.05, "{:?}", solved.p);
            balance.refit_noise(&solved);
            balance.slow_of_each
        };
        // Of all four together a hundredth of the white noise's variance is a mean of a hundred rows.
        assert!(slow_of_each(true) < 2.5e-3 && slow_of_each(false) > 5e-3);
    }

    #[test]
    fn what_changes_as_slowly_as_the_noise_tells_as_little() {
        // White noise with processes of three time constants, and a form that is as slow: three waves over the log.
        let gained = |seed: u64| {
            let mut slow = vec![0.0; ROWS];
            for (at, long) in [30.0, 300.0, 3000.0].into_iter().enumerate() {
                let kept = f64::exp(-1.0 / long);
                let mut state = 0.0;
                for (sum, new) in slow.iter_mut().zip(white(ROWS, 10 * seed + at as u64)) {
                    state = kept * state + (1.0 - kept * kept).sqrt() * new;
                    *sum += 0.5 * state;
                }
            }
            let response = slow.iter().zip(white(ROWS, 10 * seed + 9)).map(|(s, n)| s + n).collect();
            let mut balance = balance(response);
            let empty = balance.solve(&[], &[]);
            balance.refit_noise(&empty);
            let wave = |n: usize| (0..ROWS).map(move |i| (1e-3 * (n * i) as f64).sin()).collect::<Vec<f64>>();
            let parameters = (0..3).map(|n| Parameter::amplitude(n.to_string(), 2.0)).collect();
            let form = Alternative::columns("slow", parameters, (1..=3).map(wave).collect());
            let [none, with] = [&[][..], &[&form][..]].map(|forms| balance.solve_forms(forms).log_evidence);
            with - none
        };
        let gained: Vec<f64> = (1..=8).map(gained).collect();
        // The prior of a cause asks for 3.9.
        assert!(gained.iter().all(|g| *g < 2.0), "{gained:?}");
    }

    #[test]
    fn noise_of_another_log_is_as_large_as_its_sensors_make_it_and_no_larger() {
        // White noise, and slow processes as 1/f noise has them, of this deviation each.
        let noisy = |seed: u64, white_sd: f64, of_each: f64| -> Vec<f64> {
            let mut noise = White::new(seed);
            let constants = [50.0, 500.0, 5000.0];
            let mut slow = constants.map(|_| of_each * noise.next());
            let mut next = |_| {
                for (slow, constant) in slow.iter_mut().zip(constants) {
                    let kept = f64::exp(-1.0 / constant);
                    *slow = kept * *slow + (1.0 - kept * kept).sqrt() * of_each * noise.next();
                }
                white_sd * noise.next() + slow.iter().sum::<f64>()
            };
            (0..ROWS).map(&mut next).collect()
        };
        // What is said of the noise and what there is, in logs other than those fitted.
        let said_of = |white_sd: f64, of_each: f64, zero: f64, most: f64| {
            let (mut noise, mut there) = (0.0, 0.0);
            for seed in 1..=8 {
                let mut fitted = balance(noisy(seed, white_sd, of_each)).with_sensors(1, zero);
                fitted.most = vec![most];
                let solved = fitted.solve(&[], &[]);
                fitted.refit_noise(&solved);
                let other = balance(noisy(100 + seed, white_sd, of_each));
                noise += other.rms(&other.noise_alone(&[], (&fitted, &[]), &solved.residual)).powi(2);
                there += other.rms(&other.response).powi(2);
            }
            [noise, there].map(|sum| (sum / 8.0).sqrt())
        };
        let said = |white_sd: f64, of_each: f64, zero: f64| said_of(white_sd, of_each, zero, 1.0);
        for [noise, there] in [said(1.0, 0.0, 9.0), said(1.0, 2.0, 9.0)] {
            assert!((0.8..1.25).contains(&(noise / there)), "{noise} {there}");
        }
        // Of a channel whose noise is not white a filter passes more than it would of white noise.
        let [noise, there] = said_of(3.0, 0.0, 0.1, 16.0);
        assert!((0.8..1.25).contains(&(noise / there)), "{noise} {there}");
        // A bridge wanders by no more than its zero is known to, and noise is no larger than it is known within.
        let bound = rest::NAMED_WITHIN * 1f64.hypot(0.1);
        for [noise, there] in [said(1.0, 2.0, 0.1), said(3.0, 0.0, 0.1)] {
            assert!(noise <= bound && there > bound, "{noise} {there}");
        }
    }

    #[test]
    fn a_cause_with_the_shape_of_a_sensors_error_has_its_whole_size() {
        // An offset of the motor beside a bridge whose zero is known to a tenth of it.
        let zero = (Parameter { amplitude: false, ..Parameter::amplitude("zero", 0.1) }, vec![1.0; ROWS]);
        let response = white(ROWS, 2).iter().map(|n| 1.0 + n).collect();
        let balance = beside(response, vec![zero]).with_sensors(1, 0.1);
        let column = vec![vec![1.0; ROWS]];
        let forms = [Alternative::columns("offset", vec![Parameter::amplitude("size", 10.0)], column)];
        let [with, without] = [&[0][..], &[]].map(|set| balance.solve(&forms, set));
        assert!(with.log_evidence > without.log_evidence + 10.0);
        assert!((with.p[2] - 1.0).abs() < 0.1, "{:?}", with.p);
        // Rows are so many that the zero takes nearly all of it without the cause; it may be a tenth of it.
        assert!(balance.difference(&with.residual, &without.residual) < 0.2);
        // That the zero does what the cause would is a difference all the same.
        let causes = [&with, &without].map(|solved| balance.left_by_causes(solved));
        assert!(balance.difference(&causes[0], &causes[1]) > 0.7);
        let errors = balance.possible_errors(&without.p);
        assert!((errors[0] - 0.1).abs() < 1e-12, "{errors:?}");
        let [with, without] =
            [&with, &without].map(|solved| balance.left_beside_errors(&errors, &forms, solved));
        assert!((balance.difference(&with, &without) - 0.9).abs() < 0.05);
    }

    #[test]
    fn a_disc_turns_by_its_own_angle_and_what_the_parameters_add() {
        let disc = DiscMotion {
            angle_rad: vec![vec![vec![1.0, 2.0], vec![3.0]]],
            angle_per_unit: vec![vec![vec![0.1, 0.2], vec![0.0]], vec![vec![0.0, 0.0], vec![1.0]]],
        };
        assert_eq!(disc.angle(0, &[10.0, -1.0]), [vec![2.0, 4.0], vec![2.0]]);
        assert_eq!(disc.angle(0, &[]), disc.angle_rad[0]);
    }
}
