//! The parameters of a set of forms in a balance, and its evidence.

use std::borrow::Cow;

use nalgebra::DMatrix;

use super::scoring::{Fit, MOST_STEPS, Rows, misfit};
use super::{Alternative, Balance, Solved, placed};
use crate::identify::evidence::{BALANCE_SHARE, Expansion};
use crate::identify::linear;
use crate::identify::same_amplitude::{Seen, log_ratio};
use crate::identify::term::Parameter;

/// What is held moves by no more than this share of its prior's deviation: no signal tells it so well.
const HELD: f64 = 1e-4;

/// What is new in each row of the columns of a form, and of what it adds to the response.
#[derive(Debug, Clone)]
pub(super) struct White {
    columns: Vec<Vec<f64>>,
    response: Option<Vec<f64>>,
}

/// Forms that stand together, each with what is new in its rows.
pub(super) type Chosen<'f> = [(&'f Alternative, Cow<'f, White>)];

/// A fit with the parameters that were fitted.
struct Point {
    parameters: Vec<Parameter>,
    fit: Fit,
}

/// What forms that stand together leave, and its evidence.
pub struct Weighed {
    /// ln evidence, the likelihood with its share.
    pub log_evidence: f64,
    /// What is new in each row, over its deviation.
    pub innovations: Vec<f64>,
}

impl Balance {
    /// What is new in each row of a form's columns.
    pub(super) fn white(&self, form: &Alternative) -> White {
        let all: Vec<&Vec<f64>> = form.columns.iter().chain(&form.response).collect();
        let mut columns = self.whitening.of_columns(&all);
        let response = form.response.as_ref().and_then(|_| columns.pop());
        White { columns, response }
    }

    fn chosen<'f>(
        &self,
        forms: impl Iterator<Item = &'f Alternative>,
    ) -> Vec<(&'f Alternative, Cow<'f, White>)> {
        forms.map(|form| (form, Cow::Owned(self.white(form)))).collect()
    }

    fn priors(&self) -> Vec<Parameter> {
        self.base.iter().map(|b| b.0.clone()).collect()
    }

    /// Solves a set of alternatives.
    pub fn solve(&self, alternatives: &[Alternative], set: &[usize]) -> Solved {
        let forms = self.chosen(set.iter().map(|a| &alternatives[*a]));
        self.solve_white(set, &forms, None)
    }

    /// The same of forms of which it is known what is new in their rows, from the weights that residuals nearby have.
    pub(super) fn solve_white(&self, set: &[usize], forms: &Chosen<'_>, near: Option<&[f64]>) -> Solved {
        Solved { set: set.to_vec(), ..self.solved(self.priors(), forms, near) }
    }

    /// The same for so many steps, without what nobody asks of most sets.
    pub(super) fn weighed(&self, forms: &Chosen<'_>, near: Option<&[f64]>, steps: usize) -> Weighed {
        let point = self.point(self.priors(), forms, near, steps);
        let log_evidence = self.log_evidence(&point, forms, &self.covariance(&point));
        Weighed { log_evidence, innovations: point.fit.innovations }
    }

    /// Solves these forms; the set of what it gives is empty.
    pub fn solve_forms(&self, chosen: &[&Alternative]) -> Solved {
        self.solve_white(&[], &self.chosen(chosen.iter().copied()), None)
    }

    /// Weighs these forms, from the weights of innovations where some are near.
    pub fn weigh(&self, chosen: &[&Alternative], near: Option<&[f64]>) -> Weighed {
        self.weighed(&self.chosen(chosen.iter().copied()), near, MOST_STEPS)
    }

    /// The same for one step, not reweighted: shapes compare, and slopes are the same.
    pub fn glance(&self, chosen: &[&Alternative], near: &[f64]) -> Weighed {
        self.weighed(&self.chosen(chosen.iter().copied()), Some(near), 1)
    }

    /// Of what a solution takes for errors of the sensors as much as they are known to have: a deviation of each.
    pub fn possible_errors(&self, values: &[f64]) -> Vec<f64> {
        let sensors = self.base.iter().zip(values).skip(self.sensors);
        sensors.map(|((q, _), value)| value.clamp(q.mean - q.sd, q.mean + q.sd)).collect()
    }

    /// What a solution leaves without its errors of the sensors.
    pub fn left_by_causes(&self, solved: &Solved) -> Vec<f64> {
        let mut left = solved.residual.clone();
        for ((_, column), value) in self.base.iter().zip(&solved.p).skip(self.sensors) {
            left.iter_mut().zip(column).for_each(|(left, x)| *left += value * x);
        }
        left
    }

    /// What a solved set leaves beside these errors of the sensors.
    pub fn left_beside_errors(
        &self,
        errors: &[f64],
        alternatives: &[Alternative],
        solved: &Solved,
    ) -> Vec<f64> {
        let mut parameters = self.priors();
        for (q, error) in parameters.iter_mut().skip(self.sensors).zip(errors) {
            (q.mean, q.sd) = (*error, HELD * q.sd);
        }
        let forms = self.chosen(solved.set.iter().map(|a| &alternatives[*a]));
        self.solved(parameters, &forms, Some(&solved.innovations)).residual
    }

    /// These forms, with these priors of the base.
    fn solved(&self, priors: Vec<Parameter>, forms: &Chosen<'_>, near: Option<&[f64]>) -> Solved {
        let point = self.point(priors, forms, near, MOST_STEPS);
        let covariance = self.covariance(&point);
        let log_evidence = self.log_evidence(&point, forms, &covariance);
        let mut residual = self.response.clone();
        for added in forms.iter().filter_map(|(form, _)| form.response.as_ref()) {
            residual.iter_mut().zip(added).for_each(|(y, a)| *y += a);
        }
        let base = self.base.iter().map(|b| &b.1);
        let columns = base.chain(forms.iter().flat_map(|(form, _)| form.columns.iter()));
        for (c, p) in columns.zip(&point.fit.p) {
            residual.iter_mut().zip(c).for_each(|(r, x)| *r -= p * x);
        }
        let Fit { p, innovations, .. } = point.fit;
        Solved { set: Vec::new(), base: self.base.len(), p, covariance, log_evidence, residual, innovations }
    }

    /// Parameters of these forms, from the weights that residuals nearby have, in so many steps at most.
    fn point(
        &self,
        mut parameters: Vec<Parameter>,
        forms: &Chosen<'_>,
        near: Option<&[f64]>,
        iterations: usize,
    ) -> Point {
        let mut y = self.white_response.clone();
        for (form, white) in forms {
            if let Some(added) = &white.response {
                y.iter_mut().zip(added).for_each(|(y, a)| *y += a);
            }
            for (place, shift) in &form.base_shift {
                parameters[*place].mean += shift;
            }
            for place in &form.not_negative {
                parameters[*place].lower = 0.0;
            }
        }
        parameters.extend(forms.iter().flat_map(|(form, _)| form.parameters.iter().cloned()));
        let x: Vec<&[f64]> = self
            .white_base
            .iter()
            .chain(forms.iter().flat_map(|(_, white)| &white.columns))
            .map(Vec::as_slice)
            .collect();
        let fit = Rows { x, y, temper: self.temper }.fit(&parameters, near, iterations);
        Point { parameters, fit }
    }

    fn covariance(&self, point: &Point) -> DMatrix<f64> {
        let mut posterior = point.fit.curvature.clone();
        for (i, q) in point.parameters.iter().enumerate() {
            posterior[(i, i)] += 1.0 / q.sd.powi(2);
        }
        linear::factor(&posterior).inverse()
    }

    fn log_evidence(&self, point: &Point, forms: &Chosen<'_>, covariance: &DMatrix<f64>) -> f64 {
        let Point { parameters, fit: Fit { p, innovations, curvature, slope } } = point;
        let parameters: Vec<&Parameter> = parameters.iter().collect();
        let at = Expansion {
            p,
            parameters: &parameters,
            misfit: misfit(innovations, self.temper) + self.noise_avoided(p),
            slope,
            curvature,
        };
        let waves = self.waves(forms, p, covariance);
        let one_amplitude = |scale: f64| waves.iter().map(|(logs, sd)| log_ratio(logs, sd * scale)).sum();
        let log_prior: f64 = forms.iter().map(|(form, _)| form.log_prior).sum();
        // A bound that is reached takes nothing from what its parameter costs.
        let reached = |place: &&usize| p[**place] <= 0.0;
        let cost = |place: &usize| {
            let told = curvature[(*place, *place)] * parameters[*place].sd.powi(2);
            0.5 * (1.0 + BALANCE_SHARE * told).ln()
        };
        let bounds = forms.iter().flat_map(|(form, _)| &form.not_negative).filter(reached);
        let bounded: f64 = bounds.map(cost).sum();
        log_prior - bounded + at.log_evidence(BALANCE_SHARE, one_amplitude)
    }

    /// Waves of one amplitude in all logs, as each log sees them, with the deviation of their prior.
    fn waves(&self, forms: &Chosen<'_>, p: &[f64], covariance: &DMatrix<f64>) -> Vec<(Vec<Seen>, f64)> {
        let mut out = Vec::new();
        for (alternative, own) in placed(forms.iter().map(|(form, _)| *form), self.base.len()) {
            for wave in &alternative.same_amplitude {
                let seen = wave.iter().map(|places| {
                    let [c, s] = places.map(|place| own.start + place);
                    let determinant = covariance[(c, c)] * covariance[(s, s)] - covariance[(c, s)].powi(2);
                    Seen {
                        amplitude: p[c].hypot(p[s]),
                        precision: BALANCE_SHARE * determinant.max(f64::MIN_POSITIVE).sqrt().recip(),
                    }
                });
                let sd = wave.first().map_or(0.0, |[c, _]| alternative.parameters[*c].sd);
                out.push((seen.collect(), sd));
            }
        }
        out
    }
}
