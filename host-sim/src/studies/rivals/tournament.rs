//! Every candidate fitted to the logs of every other.

use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;

use super::candidates::Candidate;
use super::courses::{Course, Plan};
use super::search::fit;
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

/// Forces on each course.
type Forces = Vec<Vec<f64>>;

fn forces(p: &FrictionParameters<f64>, courses: &[Course]) -> Option<Forces> {
    let model = p.model(PERIOD_S).ok()?;
    Some(courses.iter().map(|course| course.force_n(&model)).collect())
}

/// Each log's error over the RMS of its force.
fn errors(seen: &[Vec<f64>], predicted: &[Vec<f64>]) -> Vec<f64> {
    let error = |(a, b): (&Vec<f64>, &Vec<f64>)| {
        let square: f64 = a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum();
        (square / a.iter().map(|a| a * a).sum::<f64>()).sqrt()
    };
    seen.iter().zip(predicted).map(error).collect()
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
    let (next, done) = (AtomicUsize::new(0), AtomicUsize::new(0));
    let matches = Mutex::new(Vec::new());
    let truths: Vec<(usize, &Plan, Forces, Forces)> = candidates
        .iter()
        .zip(plans)
        .enumerate()
        .filter_map(|(place, (truth, plan))| plan.as_ref().map(|plan| (place, truth, plan)))
        .map(|(place, truth, plan)| {
            let run = |courses: &[Course]| forces(&truth.typical, courses);
            let both = run(&plan.train).zip(run(&plan.held_out));
            both.map(|(train, held_out)| (place, plan, train, held_out)).ok_or_else(|| {
                InputError::new("a candidate's own numbers are out of range").value(&truth.name)
            })
        })
        .collect::<Result<_, _>>()?;
    let workers = thread::available_parallelism().map_or(1, |n| n.get());
    thread::scope(|scope| {
        for _ in 0..workers {
            scope.spawn(|| {
                loop {
                    let turn = next.fetch_add(1, Ordering::Relaxed);
                    if turn >= truths.len() * count {
                        break;
                    }
                    let fitted = turn % count;
                    let (truth, plan, train, held_out) = &truths[turn / count];
                    let truth = *truth;
                    let known = before.and_then(|t| t.of(truth, fitted)).map(|m| m.parameters);
                    let played = one(&candidates[fitted], known, plan, train, held_out);
                    if let (Some((parameters, train_nrmse, held_out_nrmse)), Ok(mut all)) =
                        (played, matches.lock())
                    {
                        all.push(Match { truth, fitted, train_nrmse, held_out_nrmse, parameters });
                    }
                    progress(done.fetch_add(1, Ordering::Relaxed) + 1, truths.len() * count);
                }
            });
        }
    });
    let mut matches = matches.into_inner().unwrap_or_default();
    matches.sort_by_key(|m| (m.truth, m.fitted));
    Ok(Tournament {
        names: candidates.iter().map(|c| c.name.clone()).collect(),
        held_out: plans
            .iter()
            .flatten()
            .next()
            .map_or(Vec::new(), |p| p.held_out.iter().map(|c| c.name.clone()).collect()),
        matches,
    })
}

fn one(
    candidate: &Candidate,
    known: Option<FrictionParameters<f64>>,
    plan: &Plan,
    train: &[Vec<f64>],
    held_out: &[Vec<f64>],
) -> Option<(FrictionParameters<f64>, f64, Vec<f64>)> {
    let scales: Vec<f64> =
        train.iter().map(|f| f.iter().map(|x| x * x).sum::<f64>().sqrt().max(1e-9)).collect();
    let residuals = |p: &FrictionParameters<f64>| {
        // Numbers that the model refuses (several roots of the modified LuGre model) are no end of the search.
        let Some(predicted) = forces(p, &plan.train) else {
            return Some(vec![REFUSED; train.iter().map(Vec::len).sum()]);
        };
        let each = train.iter().zip(&predicted).zip(&scales);
        Some(
            each.flat_map(|((a, b), scale)| a.iter().zip(b).map(move |(a, b)| (b - a) / scale))
                .collect::<Vec<_>>(),
        )
    };
    let found = fit(candidate, known, &residuals)?;
    let root_mean_square =
        |errors: Vec<f64>| (errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64).sqrt();
    let train_nrmse = root_mean_square(errors(train, &forces(&found, &plan.train)?));
    Some((found, train_nrmse, errors(held_out, &forces(&found, &plan.held_out)?)))
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
        let run = |courses: &[Course]| forces(&truth.typical, courses).unwrap();
        let (train, held_out) = (run(&plan.train), run(&plan.held_out));
        let (own, lugre) = (
            one(&moved, None, &plan, &train, &held_out).unwrap().2[0],
            one(&pick("lugre"), None, &plan, &train, &held_out).unwrap().2[0],
        );
        assert!(own < 1e-3, "the series element on its own log: {own}");
        assert!(lugre > 10.0 * own && lugre > 5e-3, "LuGre: {lugre}");
    }
}
