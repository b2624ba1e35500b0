//! Every candidate fitted to the logs of every other.

use std::sync::atomic::{AtomicUsize, Ordering};

use rayon::prelude::*;

use super::candidates::Candidate;
use super::courses::{AT_ONCE, Course, Plan};
use super::search::{Accuracy, fit};
use crate::input_error::InputError;
use crate::plant::PERIOD_S;
use model_core::friction::FrictionParameters;

/// One candidate fitted to another's logs.
#[derive(Debug, Clone, PartialEq)]
pub struct Match {
    /// Place of the model that played the rubber.
    pub truth: usize,
    /// Place of the model that was fitted.
    pub fitted: usize,
    /// Error on the logs fitted, RMS over RMS of the force.
    pub train_nrmse: f64,
    /// The same on each of the logs held out.
    pub held_out_nrmse: Vec<f64>,
    /// The numbers found.
    pub parameters: FrictionParameters<f64>,
}

impl Match {
    /// Root mean square over the logs held out.
    #[must_use]
    pub fn held_out(&self) -> f64 {
        let sum: f64 = self.held_out_nrmse.iter().map(|e| e * e).sum();
        (sum / self.held_out_nrmse.len().max(1) as f64).sqrt()
    }
}

/// All matches on one plan.
#[derive(Debug, Clone, PartialEq)]
pub struct Tournament {
    /// The candidates' names.
    pub names: Vec<String>,
    /// Names of the logs held out.
    pub held_out: Vec<String>,
    /// By the truth, then by the model fitted.
    pub matches: Vec<Match>,
}

impl Tournament {
    /// The match of a truth with a fitted model.
    #[must_use]
    pub fn of(&self, truth: usize, fitted: usize) -> Option<&Match> {
        self.matches.iter().find(|m| m.truth == truth && m.fitted == fitted)
    }

    /// Rivals of a truth that miss by less than `noise`, best first.
    #[must_use]
    pub fn alike(&self, truth: usize, noise: f64) -> Vec<(&str, f64)> {
        let mut alike: Vec<(&str, f64)> = self
            .matches
            .iter()
            .filter(|m| m.truth == truth && m.fitted != truth && m.held_out() < noise)
            .map(|m| (self.names[m.fitted].as_str(), m.held_out()))
            .collect();
        alike.sort_by(|a, b| a.1.total_cmp(&b.1));
        alike
    }
}

/// Residual that stands for a refusal, in parts of a log's RMS: far worse than any prediction.
const REFUSED: f64 = 1.0;
/// Error, over the RMS of a log, with which a search is content: a tenth of the channel's noise.
const ENOUGH: f64 = 2.7e-4;

/// Forces on each course.
type Forces = Vec<Vec<f64>>;

fn forces(p: &FrictionParameters<f64>, courses: &[Course], accuracy: Accuracy) -> Option<Forces> {
    let model = p.model(PERIOD_S).ok()?;
    let long = p.model(PERIOD_S * AT_ONCE as f64).ok()?;
    let force = |course: &Course| match accuracy {
        Accuracy::Fine => course.force_n(&model),
        Accuracy::Rough => course.rough_force_n(&model, &long),
    };
    Some(courses.iter().map(force).collect())
}

/// Each log's error over the RMS of its force.
fn errors(seen: &[Vec<f64>], predicted: &[Vec<f64>]) -> Vec<f64> {
    let error = |(a, b): (&Vec<f64>, &Vec<f64>)| {
        let square: f64 = a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum();
        (square / a.iter().map(|a| a * a).sum::<f64>()).sqrt()
    };
    seen.iter().zip(predicted).map(error).collect()
}

/// The logs of a truth.
struct Logs<'a> {
    truth: usize,
    plan: &'a Plan,
    train: Forces,
    held_out: Forces,
}

/// Plays the matches of each truth that has a plan, on that plan, from what `before` found where it is given. `progress` is told the matches played of all.
///
/// # Errors
/// A truth that cannot be run.
pub fn play(
    candidates: &[Candidate],
    plans: &[Option<Plan>],
    before: Option<&Tournament>,
    progress: impl Fn(usize, usize) + Sync,
) -> Result<Tournament, InputError> {
    let count = candidates.len();
    let logs = candidates.iter().zip(plans).enumerate().filter_map(|(truth, (candidate, plan))| {
        let plan = plan.as_ref()?;
        let run = |courses: &[Course]| forces(&candidate.typical, courses, Accuracy::Fine);
        let refused = || InputError::new("a candidate's own numbers are out of range").value(&candidate.name);
        let both = run(&plan.train).zip(run(&plan.held_out)).ok_or_else(refused);
        Some(both.map(|(train, held_out)| Logs { truth, plan, train, held_out }))
    });
    let logs: Vec<Logs<'_>> = logs.collect::<Result<_, _>>()?;
    let (done, all) = (AtomicUsize::new(0), logs.len() * count);
    let one = |turn: usize| {
        let (logs, fitted) = (&logs[turn / count], turn % count);
        let known = before.and_then(|t| t.of(logs.truth, fitted)).map(|m| m.parameters);
        let found = logs.fitted(&candidates[fitted], known);
        progress(done.fetch_add(1, Ordering::Relaxed) + 1, all);
        found.map(|(parameters, train_nrmse, held_out_nrmse)| Match {
            truth: logs.truth,
            fitted,
            train_nrmse,
            held_out_nrmse,
            parameters,
        })
    };
    let matches: Vec<Match> = (0..all).into_par_iter().with_max_len(1).filter_map(one).collect();
    let held_out = plans.iter().flatten().next().map_or(&[][..], |p| &p.held_out);
    Ok(Tournament {
        names: candidates.iter().map(|c| c.name.clone()).collect(),
        held_out: held_out.iter().map(|c| c.name.clone()).collect(),
        matches,
    })
}

impl Logs<'_> {
    /// The candidate's best numbers, its error on the logs fitted, and that on each held out.
    fn fitted(
        &self,
        candidate: &Candidate,
        known: Option<FrictionParameters<f64>>,
    ) -> Option<(FrictionParameters<f64>, f64, Vec<f64>)> {
        let norm = |f: &Vec<f64>| f.iter().map(|x| x * x).sum::<f64>().sqrt().max(1e-9);
        let scales: Vec<f64> = self.train.iter().map(norm).collect();
        let residuals = |p: &FrictionParameters<f64>, accuracy: Accuracy| {
            // Numbers that the model refuses (several roots of the modified LuGre model) are no end of the search.
            let Some(predicted) = forces(p, &self.plan.train, accuracy) else {
                return Some(vec![REFUSED; self.train.iter().map(Vec::len).sum()]);
            };
            let each = self.train.iter().zip(&predicted).zip(&scales);
            let each = each.flat_map(|((a, b), scale)| a.iter().zip(b).map(move |(a, b)| (b - a) / scale));
            Some(each.collect())
        };
        let enough = self.train.len() as f64 * ENOUGH * ENOUGH;
        let found = fit(candidate, known, enough, &residuals)?;
        let predicted = |courses: &[Course]| forces(&found, courses, Accuracy::Fine);
        let train = errors(&self.train, &predicted(&self.plan.train)?);
        let mean_square = train.iter().map(|e| e * e).sum::<f64>() / train.len() as f64;
        Some((found, mean_square.sqrt(), errors(&self.held_out, &predicted(&self.plan.held_out)?)))
    }
}

#[cfg(test)]
mod tests {
    use super::super::candidates::all;
    use super::*;

    /// Truth and rival on the paper's plan: the truth finds itself, LuGre does not become a series element.
    #[test]
    fn a_model_fitted_to_its_own_logs_predicts_them_and_lugre_does_not_explain_the_series_element() {
        let pick = |name: &str| all().into_iter().find(|c| c.name == name).unwrap();
        let truth = pick("series");
        let moved =
            Candidate { typical: truth.typical.with("k_u_n_per_m", 3.5e4).with("a1", 0.6), ..truth.clone() };
        let plan = Plan::figures(&truth.typical).unwrap();
        let run = |courses: &[Course]| forces(&truth.typical, courses, Accuracy::Fine).unwrap();
        let logs = Logs { truth: 0, plan: &plan, train: run(&plan.train), held_out: run(&plan.held_out) };
        let (own, lugre) =
            (logs.fitted(&moved, None).unwrap().2[0], logs.fitted(&pick("lugre"), None).unwrap().2[0]);
        assert!(own < 1e-3, "the series element on its own log: {own}");
        assert!(lugre > 10.0 * own && lugre > 5e-3, "LuGre: {lugre}");
    }
}
