//! Which effects the contact's balance asks for: every single one, then pairs and triples from linear tables.
//!
//! 1. every form of every effect is fitted beside the baseline, a few iterations, and the best ones on;
//! 2. at each of the best, one Gram matrix over the columns of all others gives the linearised evidence of each set with one
//!    more; the best sets are refitted, the best of them with laws in place of its columns too;
//! 3. the noise's sources and the effective sample size are fitted to the residuals of the best set, and the best sets
//!    are fitted again with them.

use std::sync::Arc;

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::log::ContactLog;
use super::noise::MODEL_FORM;
use super::problem::{FREEDOM, Fit, Near, Problem, Slopes, UNDECIDED};
use crate::identify::evidence::{SCALES, log_mean_exp};
use crate::identify::filters::rms;
use crate::identify::fit_interval;
use crate::identify::linear::{self, Slope};

/// A hypothesis with its ln evidence.
#[derive(Debug, Clone)]
pub struct Ranked {
    /// ln evidence, the likelihood with its share.
    pub log_evidence: f64,
    /// The fit.
    pub fit: Fit,
}

/// Values of a term's parameters at several points.
type Points = Vec<Vec<f64>>;

/// Sets from which a larger one is looked for.
const PARENTS: usize = 5;
/// Larger sets refitted, of those that the tables rank.
const CHILDREN: usize = 8;
/// Sets kept for the last comparison.
const FINALISTS: usize = 8;

/// A larger set is looked for where each part of the smaller one changes the prediction by this share of the signal: half
/// of what the model's form is known to.
pub const WORTH: f64 = 0.5 * MODEL_FORM;
/// Iterations of the baseline, and of a set that is fitted from where it stood with one cause more or with another noise.
const ITERATIONS: usize = 6;
/// Iterations of a larger set from where its parent stood, with its parent's slopes.
const FIRST_STEPS: usize = 5;
/// Iterations of a law that takes its columns' place.
const BENDING: usize = 5;
/// Sets whose subsets stay in the comparison, so that what a cause adds is seen beside the same others.
const CLOSED: usize = 3;

/// A set without each of its terms, the others fitted again where that set is not among those that are.
pub fn without_each(problem: &Problem<'_>, fit: &Fit, fitted: &[&Fit]) -> Vec<Fit> {
    let left = |out| {
        let left = without(problem, fit, out);
        match fitted.iter().find(|known| same_set(&known.terms, &left.terms)) {
            Some(known) => (*known).clone(),
            None => problem.refitted(left, ITERATIONS),
        }
    };
    (0..fit.terms.len()).into_par_iter().map(left).collect()
}

/// As [`without_each`], the others as they are: what that leaves is more than the whole truth.
pub fn without_each_as_they_are(problem: &Problem<'_>, fit: &Fit) -> Vec<Fit> {
    let left = |out| {
        let left = without(problem, fit, out);
        Fit { r: problem.residuals(&left.terms, &left.p), ..left }
    };
    (0..fit.terms.len()).into_par_iter().map(left).collect()
}

/// The sets that are left where one cause of these is taken out and that none of `fitted` is, each fitted once.
pub fn subsets<'f>(problem: &Problem<'_>, sets: impl Iterator<Item = &'f Fit>, fitted: &[&Fit]) -> Vec<Fit> {
    missing(problem, sets, fitted, &|_, _| true)
}

/// The same, of `fitted` those counted that are `good` for the set as it is left.
fn missing<'f>(
    problem: &Problem<'_>,
    sets: impl Iterator<Item = &'f Fit>,
    fitted: &[&Fit],
    good: &dyn Fn(&Fit, &Fit) -> bool,
) -> Vec<Fit> {
    let mut missing: Vec<Fit> = Vec::new();
    for set in sets {
        for out in 0..set.terms.len() {
            let left = without(problem, set, out);
            let mut known = fitted.iter().copied().chain(&missing);
            if !known.any(|fit| same_set(&fit.terms, &left.terms) && good(fit, &left)) {
                missing.push(left);
            }
        }
    }
    missing.into_par_iter().map(|left| problem.refitted(left, ITERATIONS)).collect()
}

/// RMS of the difference of two predictions over that of the signal, where the channel is well known.
pub fn difference(problem: &Problem<'_>, a: &[f64], b: &[f64]) -> f64 {
    let limit = problem.well_known_nm();
    let (mut sum, mut count, mut signal, mut all) = (0.0, 0.0f64, 0.0, 0.0f64);
    for (((a, b), s), y) in a.iter().zip(b).zip(&problem.noise.deviation).zip(problem.measured()) {
        signal += y * y;
        all += 1.0;
        if *s < limit && *a != 0.0 {
            sum += ((a - b) * s).powi(2);
            count += 1.0;
        }
    }
    if signal > 0.0 { (sum / count.max(1.0) / (signal / all)).sqrt() } else { 0.0 }
}

/// What the search found, best first; the baseline is among them.
pub struct Found {
    /// Sets with their evidence.
    pub ranked: Vec<Ranked>,
}

/// Searches for causes in other forms than these.
pub fn search(problem: &mut Problem<'_>, denied: &[usize], progress: &(dyn Fn(&str) + Sync)) -> Found {
    let as_in_file = baseline(problem);
    // What the file's numbers take for sliding may be slip and stick by those found. Their noise is not taken: a baseline has part of
    // what it does not explain in its slopes, and would have it in the noise too.
    let found = problem.noise_at(&[], &as_in_file.p);
    problem.noise.leave_out(&found);
    let base = problem.fit(&[], as_in_file.p, ITERATIONS, Near::Nothing);
    progress("single causes");
    let (singles, known) = singles(problem, denied, &base);
    let mut all: Vec<Fit> = singles.iter().take(FINALISTS).cloned().collect();
    all.push(base.clone());
    let mut parents: Vec<Fit> = singles.into_iter().take(PARENTS).collect();
    for what in ["pairs of causes", "three causes at once"] {
        // A set whose parts are too small to matter has no larger one worth a search.
        let worth = parents.first().is_some_and(|best| {
            let left = without_each(problem, best, &all.iter().collect::<Vec<_>>());
            left.iter().all(|left| difference(problem, &best.r, &left.r) > WORTH)
        });
        if !worth {
            break;
        }
        progress(what);
        let children = children(problem, denied, &parents, &known);
        parents = children.iter().take(2).cloned().collect();
        all.extend(children.into_iter().take(FINALISTS));
    }
    progress("evidence");
    let mut ranked = rank(problem, Vec::new(), all);
    for _ in 0..2 {
        let refitted_to = ranked[0].fit.terms.clone();
        let before = problem.noise.deviation.clone();
        // Beside noise so much smaller than what the best set leaves, it says little which sets lead: all stay, and those that lead
        // now are looked beside again.
        let far_off = softening(&ranked[0].fit).is_some();
        problem.refit_noise(&ranked[0].fit);
        // What repeats itself is told from what no cause explains by the set that explains most.
        if let Some(fullest) = ranked.iter().map(|r| &r.fit).min_by(|a, b| a.cost.total_cmp(&b.cost)) {
            let samples = repeated(problem, fullest);
            problem.noise.set_repeated(samples);
        }
        let kept = if far_off { ranked.len() } else { FINALISTS };
        let mut kept: Vec<Fit> = ranked.iter().take(kept).map(|r| r.fit.clone()).collect();
        // The baseline and the best set of each size stay in the comparison.
        for size in 0..=3 {
            if !kept.iter().any(|fit| fit.terms.len() == size) {
                kept.extend(ranked.iter().find(|r| r.fit.terms.len() == size).map(|r| r.fit.clone()));
            }
        }
        ranked = rank(problem, Vec::new(), refitted_from(problem, kept, &before, ITERATIONS));
        if far_off {
            progress("larger sets");
            let parents = ranked.iter().map(|r| &r.fit).filter(|fit| (1..3).contains(&fit.terms.len()));
            let parents: Vec<Fit> = parents.take(2).cloned().collect();
            let children = children(problem, denied, &parents, &known);
            ranked = rank(problem, ranked, children);
        }
        ranked = closed(problem, ranked);
        // The noise is that of the answer.
        if same_set(&ranked[0].fit.terms, &refitted_to) {
            break;
        }
    }
    if let Some(best) = ranked.first_mut() {
        best.fit = problem.settled(best.fit.clone());
    }
    Found { ranked }
}

/// Sets that were found with another noise model beside those of this one.
pub fn beside(problem: &Problem<'_>, ranked: Vec<Ranked>, found: Vec<Fit>) -> Vec<Ranked> {
    let again = |fit: Fit| problem.fit(&fit.terms, fit.p, ITERATIONS, Near::Nothing);
    rank(problem, ranked, found.into_par_iter().map(again).collect())
}

/// A fit whose slopes are of residuals over these deviations, in those of the noise as it is.
fn rescaled(problem: &Problem<'_>, mut fit: Fit, before: &[f64]) -> Fit {
    for slope in fit.slopes.iter_mut().flatten() {
        let each = Arc::make_mut(slope).iter_mut().zip(before).zip(&problem.noise.deviation);
        each.for_each(|((slope, before), after)| *slope *= before / after);
    }
    fit
}

/// Fits to residuals over these deviations, fitted on under the noise as it is.
fn refitted_from(problem: &Problem<'_>, fits: Vec<Fit>, before: &[f64], iterations: usize) -> Vec<Fit> {
    let again = |fit: Fit| problem.refitted(rescaled(problem, fit, before), iterations);
    fits.into_par_iter().map(again).collect()
}

/// How many of the samples that swing count as one to what is fitted.
fn repeated(problem: &Problem<'_>, fit: &Fit) -> f64 {
    let left = problem.residuals(&fit.terms, &fit.p);
    let slopes = problem.jacobian(&fit.terms, &fit.p, &left);
    let columns = problem.noise.whitened_columns(&slopes);
    let mut r = problem.noise.whitened(&left).into_owned();
    // Samples without a residual say nothing.
    r.iter_mut().zip(problem.noise.swinging()).for_each(|(r, swings)| *r *= f64::from(u8::from(*swings)));
    let lengths: Vec<usize> = problem.logs.iter().map(ContactLog::len).collect();
    let prior_sd: Vec<f64> = problem.parameters(&fit.terms).map(|q| q.sd).collect();
    fit_interval::repeated(&columns, &r, &lengths, &prior_sd)
}

/// With the subsets of the best sets that are missing or stand in a side valley, each fitted from where its set stood.
fn closed(problem: &Problem<'_>, mut ranked: Vec<Ranked>) -> Vec<Ranked> {
    // Fitted, and not as well as the larger set's own point without the cause: it stood in a side valley.
    let good = |fit: &Fit, left: &Fit| fit.cost < problem.cost_at(&left.terms, &left.p) + UNDECIDED;
    for _ in 0..2 {
        let known: Vec<&Fit> = ranked.iter().map(|r| &r.fit).collect();
        let fits = missing(problem, known.iter().copied().take(CLOSED), &known, &good);
        if fits.is_empty() {
            break;
        }
        ranked = rank(problem, ranked, fits);
    }
    ranked
}

fn same_set(a: &[usize], b: &[usize]) -> bool {
    a.len() == b.len() && a.iter().all(|term| b.contains(term))
}

/// A fit with one of its terms taken out, values and slopes of the others as they were.
fn without(problem: &Problem<'_>, fit: &Fit, out: usize) -> Fit {
    let count = |term: &usize| problem.terms[*term].parameters.len();
    let from = problem.baseline.free.len() + fit.terms[..out].iter().map(count).sum::<usize>();
    let own = from..from + count(&fit.terms[out]);
    let mut left = fit.clone();
    left.p.drain(own.clone());
    left.slopes.iter_mut().for_each(|slopes| drop(slopes.drain(own.clone())));
    left.terms.remove(out);
    left
}

/// The baseline fitted without any cause.
pub fn baseline(problem: &Problem<'_>) -> Fit {
    let start: Vec<f64> = problem.baseline.free.iter().map(|b| b.parameter.mean).collect();
    let near = problem.fit(&[], start, ITERATIONS, Near::Nothing);
    problem.fit(&[], problem.better_static(&near).unwrap_or(near.p), ITERATIONS, Near::Nothing)
}

/// Of each set the fit that costs least, the least first.
fn unique(mut fits: Vec<Fit>) -> Vec<Fit> {
    fits.sort_by(|a, b| a.cost.total_cmp(&b.cost));
    let mut kept: Vec<Fit> = Vec::new();
    for fit in fits {
        if !kept.iter().any(|known| same_set(&known.terms, &fit.terms)) {
            kept.push(fit);
        }
    }
    kept
}

/// The best ones fitted on.
fn improved(problem: &Problem<'_>, mut fits: Vec<Fit>, (keep, iterations): (usize, usize)) -> Vec<Fit> {
    fits.sort_by(|a, b| a.cost.total_cmp(&b.cost));
    fits.truncate(keep);
    let again = |fit: Fit| problem.fitted_on(fit, iterations);
    unique(fits.into_par_iter().map(again).collect())
}

/// How many times the noise a fit leaves, where that is in the tails of the distribution.
fn softening(fit: &Fit) -> Option<f64> {
    let times = rms(&fit.r);
    (times > FREEDOM.sqrt()).then_some(times)
}

/// The problem with noise as large as what the baseline leaves, where that is in the tails of the distribution: there the cost has
/// valleys that each leave out other samples, and a cause as large as a tenth of the signal is not reached from the baseline.
fn softened<'a>(problem: &Problem<'a>, base: &Fit) -> Option<Problem<'a>> {
    softening(base).map(|times| {
        let mut noise = problem.noise.clone();
        noise.deviation.iter_mut().for_each(|deviation| *deviation *= times);
        Problem::with_noise(problem.logs, problem.baseline, problem.terms, noise)
    })
}

/// The best single terms, and for each nonlinear one the points where it stood after a few iterations.
fn singles(problem: &Problem<'_>, denied: &[usize], base: &Fit) -> (Vec<Fit>, Vec<Option<Points>>) {
    let soft = softened(problem, base);
    let own = soft.as_ref().map(|soft| soft.fit(&[], base.p.clone(), ITERATIONS, Near::Nothing));
    let hardened = |fits: Vec<Fit>| match &soft {
        Some(soft) => refitted_from(problem, fits, &soft.noise.deviation, 3),
        None => fits,
    };
    let (best, known) = {
        let (problem, base) = (soft.as_ref().unwrap_or(problem), own.as_ref().unwrap_or(base));
        singles_beside(problem, denied, base, hardened)
    };
    (improved(problem, best, (10, 5)), known)
}

/// The same beside this baseline, the best ones and their laws each brought on by `hardened`.
fn singles_beside(
    problem: &Problem<'_>,
    denied: &[usize],
    base: &Fit,
    hardened: impl Fn(Vec<Fit>) -> Vec<Fit>,
) -> (Vec<Fit>, Vec<Option<Points>>) {
    let slopes = problem.slopes(&[], &base.p, &base.r);
    let first = |terms: Vec<usize>| -> Vec<Fit> {
        let starts: Vec<(usize, Vec<f64>)> = terms
            .into_iter()
            .flat_map(|term| problem.starts(base, term).into_iter().map(move |start| (term, start)))
            .collect();
        starts
            .into_par_iter()
            .map(|(term, start)| {
                problem.fit(&[term], [base.p.as_slice(), &start].concat(), 2, Near::Baseline(&slopes))
            })
            .collect()
    };
    let wanted = |term: &usize| !problem.terms[*term].law && !denied.contains(term);
    let forms = (0..problem.terms.len()).filter(wanted).collect();
    let tried = first(forms);
    let mut known: Vec<Option<Points>> = vec![None; problem.terms.len()];
    for fit in &tried {
        let term = &problem.terms[fit.terms[0]];
        if !term.parameters.iter().all(|p| p.amplitude) {
            known[fit.terms[0]].get_or_insert_with(Vec::new).push(fit.p[base.p.len()..].to_vec());
        }
    }
    let mut fits = unique(hardened(improved(problem, tried, (16, 3))));
    // The laws of the effects that lead: a law bends as its columns cannot.
    let leading: Vec<&str> =
        fits.iter().take(PARENTS).map(|fit| problem.terms[fit.terms[0]].effect).collect();
    let laws = |term: &usize| problem.terms[*term].law && leading.contains(&problem.terms[*term].effect);
    fits.extend(hardened(first((0..problem.terms.len()).filter(laws).collect())));
    (fits, known)
}

/// The set with each of its terms in the form that can be exported.
pub fn as_laws(problem: &Problem<'_>, fit: &Fit) -> Fit {
    let mut current = fit.clone();
    for place in 0..fit.terms.len() {
        let term = &problem.terms[current.terms[place]];
        if term.export.is_some() && (term.law || term.columns.is_none()) {
            continue;
        }
        if let Some(best) = with_law(problem, &current, place, ITERATIONS) {
            // The places of the others have moved by one: the law stands last.
            current = problem.settled(best);
            return as_laws(problem, &current);
        }
    }
    current
}

/// A set with the best law of an effect, at the end, in place of the form of it that stands at a place.
fn with_law(problem: &Problem<'_>, fit: &Fit, place: usize, iterations: usize) -> Option<Fit> {
    let effect = problem.terms[fit.terms[place]].effect;
    let law = |at: &usize| problem.terms[*at].law && problem.terms[*at].effect == effect;
    let others = without(problem, fit, place);
    let starts: Vec<(usize, Vec<f64>)> = (0..problem.terms.len())
        .filter(law)
        .flat_map(|law| problem.starts(&others, law).into_iter().map(move |start| (law, start)))
        .collect();
    let slopes = problem.slopes_of(fit);
    let fits = starts.into_par_iter().map(|(law, start)| {
        let terms: Vec<usize> = others.terms.iter().copied().chain([law]).collect();
        problem.fit(&terms, [others.p.as_slice(), &start].concat(), iterations, Near::Baseline(&slopes))
    });
    fits.min_by(|a, b| a.cost.total_cmp(&b.cost))
}

/// With the best set's laws in place of its columns, one at a time: beside another cause a law may bend as a law that stood
/// alone had no reason to.
fn bent(problem: &Problem<'_>, mut fits: Vec<Fit>) -> Vec<Fit> {
    let Some(best) = fits.first() else { return fits };
    let columns = |place: &usize| !problem.terms[best.terms[*place]].law;
    let places: Vec<usize> = (0..best.terms.len()).filter(columns).collect();
    let laws: Vec<Fit> =
        places.into_par_iter().filter_map(|place| with_law(problem, best, place, BENDING)).collect();
    fits.extend(laws);
    unique(fits)
}

/// Linearised gain in evidence of each term beside a fit, with the values at which it starts.
fn table(
    problem: &Problem<'_>,
    denied: &[usize],
    parent: &Fit,
    slopes: &Slopes,
    known: &[Option<Points>],
    afresh: bool,
) -> Vec<(f64, usize, Vec<Vec<f64>>)> {
    let j0 = parent.slopes.clone();
    let j0 = j0.unwrap_or_else(|| problem.jacobian_with(slopes, &parent.terms, &parent.p, &parent.r));
    let has = |effect: &str| parent.terms.iter().any(|t| problem.terms[*t].effect == effect);
    let others: Vec<usize> = (0..problem.terms.len())
        .filter(|t| !problem.terms[*t].law && !denied.contains(t) && !has(problem.terms[*t].effect))
        .collect();
    // Columns of each other term, and the points that they stand for where it is not linear.
    let blocks: Vec<(Vec<Slope>, Points)> = others
        .par_iter()
        .map(|&term| {
            let terms: Vec<usize> = parent.terms.iter().copied().chain([term]).collect();
            let q = &problem.terms[term];
            let linear = q.parameters.iter().all(|p| p.amplitude);
            if linear {
                let p = [parent.p.as_slice(), &vec![0.0; q.parameters.len()]].concat();
                let j = problem.term_columns(slopes, &terms, &p, &parent.r);
                (j, Vec::new())
            } else {
                // A grid is gone through beside the baseline and beside the best set; else only near what was best there.
                let starts = match &known[term] {
                    Some(points) if !afresh => points.clone(),
                    points => [points.clone().unwrap_or_default(), problem.starts(parent, term)].concat(),
                };
                let columns = starts
                    .iter()
                    .map(|start| {
                        let r = problem.residuals(&terms, &[parent.p.as_slice(), start].concat());
                        r.iter().zip(&parent.r).map(|(a, b)| b - a).collect()
                    })
                    .collect();
                (columns, starts)
            }
        })
        .collect();
    let parameters: Vec<_> = problem.parameters(&parent.terms).cloned().collect();
    let mut out = Vec::new();
    let base_count = j0.len();
    let mut all = j0;
    let mut places = Vec::new();
    // Of each column the first beside which it is tried, but for the parent's; a point is tried by itself.
    let mut beside = vec![0; base_count];
    for (columns, starts) in &blocks {
        places.push(all.len()..all.len() + columns.len());
        beside.extend(
            (all.len()..all.len() + columns.len()).map(|own| if starts.is_empty() { all.len() } else { own }),
        );
        all.extend(columns.iter().cloned());
    }
    let (h, g) = problem.normal_equations_of(&all, &parent.r, |a, b| b < base_count || b >= beside[a]);
    // `prior` of the added columns: deviation and lower bound.
    let gain = |columns: &[usize], prior: &dyn Fn(usize) -> (f64, f64)| -> f64 {
        let index: Vec<usize> = (0..base_count).chain(columns.iter().copied()).collect();
        let (width, lower): (Vec<f64>, Vec<f64>) = index
            .iter()
            .map(|i| if *i < base_count { (parameters[*i].sd, f64::NEG_INFINITY) } else { prior(*i) })
            .unzip();
        let a = DMatrix::from_fn(index.len(), index.len(), |i, j| {
            h[(index[i], index[j])] * width[i] * width[j] + f64::from(u8::from(i == j))
        });
        let b = DVector::from_fn(index.len(), |i, _| {
            let off =
                if i < base_count { (parent.p[i] - parameters[i].mean) / (width[i] * width[i]) } else { 0.0 };
            (g[index[i]] - off) * width[i]
        });
        let lower: Vec<f64> = lower.iter().zip(&width).map(|(lower, width)| lower / width).collect();
        let x = linear::solve_bounded(&a, &b, &lower);
        b.dot(&x) - 0.5 * x.dot(&(&a * &x)) - 0.5 * linear::log_determinant(&linear::factor(&a))
    };
    let none = gain(&[], &|_| (1.0, f64::NEG_INFINITY));
    for ((&term, (_, starts)), place) in others.iter().zip(&blocks).zip(places) {
        let q = &problem.terms[term];
        if starts.is_empty() {
            let columns: Vec<usize> = place.clone().collect();
            let prior = |scale: f64| {
                move |i: usize| {
                    let own = &q.parameters[i - place.start];
                    (own.sd * scale, own.lower)
                }
            };
            let value = log_mean_exp(SCALES.iter().map(|s| gain(&columns, &prior(*s)))) - none;
            // The first step of its fit is what this table says, held to what lowers the cost.
            out.push((value, term, vec![vec![0.0; q.parameters.len()]]));
        } else {
            // Each point is a direction of its own.
            let free = |_| (1.0, f64::NEG_INFINITY);
            let tried = place.zip(starts).map(|(i, start)| (gain(&[i], &free) - none, start.clone()));
            let mut tried: Vec<(f64, Vec<f64>)> = tried.collect();
            tried.sort_by(|a, b| b.0.total_cmp(&a.0));
            let value = tried.first().map_or(f64::NEG_INFINITY, |t| t.0);
            out.push((value, term, tried.into_iter().take(2).map(|t| t.1).collect()));
        }
    }
    out
}

fn children(problem: &Problem<'_>, denied: &[usize], parents: &[Fit], known: &[Option<Points>]) -> Vec<Fit> {
    let slopes: Vec<Slopes> = parents.iter().map(|parent| problem.slopes_of(parent)).collect();
    let mut candidates: Vec<(f64, Vec<usize>, (&Slopes, Points))> = Vec::new();
    for (place, (parent, slopes)) in parents.iter().zip(&slopes).enumerate() {
        let [level, _] = problem.log_evidence(parent);
        for (gain, term, starts) in table(problem, denied, parent, slopes, known, place == 0) {
            let terms: Vec<usize> = parent.terms.iter().copied().chain([term]).collect();
            let starts = starts.into_iter().map(|s| [parent.p.as_slice(), &s].concat()).collect();
            candidates.push((level + gain, terms, (slopes, starts)));
        }
    }
    candidates.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut seen: Vec<Vec<usize>> = Vec::new();
    candidates.retain(|(_, terms, _)| {
        let mut sorted = terms.clone();
        sorted.sort_unstable();
        let new = !seen.contains(&sorted);
        seen.push(sorted);
        new
    });
    let starts: Vec<(Vec<usize>, &Slopes, Vec<f64>)> = candidates
        .into_iter()
        .take(CHILDREN)
        .flat_map(|(_, terms, (slopes, starts))| {
            starts.into_iter().map(move |start| (terms.clone(), slopes, start))
        })
        .collect();
    let first: Vec<Fit> = starts
        .into_par_iter()
        .map(|(terms, slopes, start)| problem.fit(&terms, start, FIRST_STEPS, Near::Baseline(slopes)))
        .collect();
    bent(problem, improved(problem, first, (6, 5)))
}

/// All of these sets with their evidence, best first; of those that were ranked under the same noise it is known.
fn rank(problem: &Problem<'_>, mut ranked: Vec<Ranked>, fits: Vec<Fit>) -> Vec<Ranked> {
    let mut fits = unique(fits);
    let better = |a: &Fit, b: &Fit| same_set(&a.terms, &b.terms) && a.cost < b.cost;
    ranked.retain(|known| !fits.iter().any(|fit| better(fit, &known.fit)));
    fits.retain(|fit| !ranked.iter().any(|known| same_set(&known.fit.terms, &fit.terms)));
    ranked.par_extend(
        fits.into_par_iter().map(|fit| Ranked { log_evidence: problem.log_evidence(&fit)[1], fit }),
    );
    ranked.sort_by(|a, b| b.log_evidence.total_cmp(&a.log_evidence));
    ranked
}

#[cfg(test)]
mod tests {
    use super::super::baseline::{KNOWN_WITHIN, baseline};
    use super::super::change::ContactTerm;
    use super::super::problem::Baseline;
    use super::*;
    use crate::files::log::Log;
    use crate::files::model_file::ModelFile;
    use crate::files::rig_file::RigFile;
    use crate::files::signal::Signal;
    use crate::identify::contact_part::contact_terms;
    use crate::identify::effects::coordinates::Scales;
    use crate::identify::evidence::CONTACT_SHARE;
    use crate::identify::linear::dot;
    use crate::identify::noise::White;

    const COUNT: usize = 4000;

    /// A log under loads that change, baseline and terms; the torque is the model's own with noise.
    fn logged() -> (Vec<ContactLog>, Baseline, Vec<ContactTerm>) {
        let rig = RigFile::assumed_rig(&[]).unwrap();
        let baseline = baseline(&ModelFile::assumed(&[]).unwrap(), KNOWN_WITHIN).with_bridge_zeros(&rig);
        let series = |of: &dyn Fn(f64) -> f64| (0..COUNT).map(|i| of(1e-3 * i as f64)).collect::<Vec<f64>>();
        let mut log = Log::default();
        log.set_signal(Signal::Time, series(&|t| t));
        log.set_signal(Signal::M2Speed, series(&|t| 4.0 * (2.0 * t).sin()));
        log.set_signal(Signal::NormalForce, series(&|t| 60.0 + 20.0 * (3.0 * t).cos()));
        log.set_signal(Signal::FrictionTorque, series(&|t| 2.5 * (30.0 * (2.0 * t).sin()).tanh()));
        let p: Vec<f64> = baseline.free.iter().map(|b| b.parameter.mean).collect();
        // The slip is observed from the torque: a few rounds make the two agree.
        for round in 0..8 {
            let logs = [ContactLog::new(&log, &rig).unwrap()];
            let mut torque = Problem::new(&logs, &baseline, &[]).predict(&[], &p).shown_nm;
            let mut white = White::new(3);
            if round == 7 {
                torque.iter_mut().for_each(|torque| *torque += 0.01 * white.next());
            }
            log.set_signal(Signal::FrictionTorque, torque);
        }
        let logs = vec![ContactLog::new(&log, &rig).unwrap()];
        let terms = contact_terms(&logs, &Scales::new(&logs), true, 1, true);
        (logs, baseline, terms)
    }

    /// Two terms of columns, of different effects.
    fn two(terms: &[ContactTerm]) -> Vec<usize> {
        let first = terms.iter().position(|term| term.columns.is_some()).unwrap();
        let other = |term: &ContactTerm| term.columns.is_some() && term.effect != terms[first].effect;
        vec![first, terms.iter().position(other).unwrap()]
    }

    fn fitted(problem: &Problem<'_>, terms: &[usize], iterations: usize) -> Fit {
        let start = problem.parameters(terms).map(|q| q.mean).collect();
        problem.fit(terms, start, iterations, Near::Nothing)
    }

    /// Cosine of the angle between two columns.
    fn alike(a: &[f64], b: &[f64]) -> f64 {
        dot(a, b) / (dot(a, a) * dot(b, b)).sqrt()
    }

    #[test]
    fn what_is_left_of_a_set_keeps_values_and_slopes_of_the_others() {
        let (logs, baseline, terms) = logged();
        let problem = Problem::new(&logs, &baseline, &terms);
        let set = two(&terms);
        let mut fit = fitted(&problem, &set, 1);
        fit.slopes = Some(problem.jacobian(&fit.terms, &fit.p, &fit.r));
        for out in 0..2 {
            let left = without(&problem, &fit, out);
            let fresh = problem.jacobian(&left.terms, &left.p, &problem.residuals(&left.terms, &left.p));
            let slopes = left.slopes.unwrap();
            assert_eq!((slopes.len(), fresh.len()), (left.p.len(), left.p.len()));
            for (at, (kept, fresh)) in slopes.iter().zip(&fresh).enumerate() {
                assert!(
                    dot(fresh, fresh) == 0.0 || alike(kept, fresh) > 0.9,
                    "{out} {at} {}",
                    alike(kept, fresh)
                );
            }
        }
    }

    #[test]
    fn slopes_under_one_noise_are_those_under_another_in_its_deviations() {
        let (logs, baseline, terms) = logged();
        let mut problem = Problem::new(&logs, &baseline, &terms);
        let set = two(&terms);
        let mut fit = fitted(&problem, &set, 1);
        fit.slopes = Some(problem.jacobian(&fit.terms, &fit.p, &fit.r));
        let before = problem.noise.deviation.clone();
        problem.noise.deviation.iter_mut().enumerate().for_each(|(i, s)| *s *= 1.0 + (i % 7) as f64);
        let fresh = problem.jacobian(&fit.terms, &fit.p, &problem.residuals(&fit.terms, &fit.p));
        let slopes = rescaled(&problem, fit, &before).slopes.unwrap();
        for (at, (kept, fresh)) in slopes.iter().zip(&fresh).enumerate() {
            assert!(dot(fresh, fresh) == 0.0 || alike(kept, fresh) > 0.9999, "{at}: {}", alike(kept, fresh));
        }
    }

    #[test]
    fn what_would_leave_no_sample_well_known_is_no_noise() {
        let (logs, baseline, terms) = logged();
        let as_guessed = Problem::new(&logs, &baseline, &terms);
        // This share of the torque itself is left.
        let refitted = |share: f64| {
            let mut problem = Problem::new(&logs, &baseline, &terms);
            let mut left = fitted(&problem, &[], 1);
            let torque = problem.measured().zip(&problem.noise.deviation);
            left.r = torque.map(|(nm, deviation)| share * nm / deviation).collect();
            problem.refit_noise(&left);
            problem.noise.deviation
        };
        assert_ne!(refitted(0.02), as_guessed.noise.deviation);
        assert_eq!(refitted(1.0), as_guessed.noise.deviation);
    }

    /// The friction bridge's gain swings by an eighth: what the baseline leaves is sixteen times the noise.
    #[test]
    fn a_cause_is_reached_from_a_baseline_that_is_far_off() {
        for (period_s, phase) in [(4.0, 0.0), (9.6, 1.95)] {
            let (mut logs, baseline, _) = logged();
            let turn = |i: usize| std::f64::consts::TAU * 1e-3 * i as f64 / period_s + phase;
            for log in &mut logs {
                for signal in [&mut log.friction_nm, &mut log.observed_nm] {
                    signal.iter_mut().enumerate().for_each(|(i, nm)| *nm *= 1.0 + 0.12 * turn(i).sin());
                }
            }
            let terms = contact_terms(&logs, &Scales::new(&logs), true, 1, true);
            let problem = Problem::new(&logs, &baseline, &terms);
            let base = super::baseline(&problem);
            assert!(softened(&problem, &base).is_some());
            let (found, _) = singles(&problem, &[], &base);
            let [effect, form] = [terms[found[0].terms[0]].effect, terms[found[0].terms[0]].form];
            assert!(found[0].cost < 0.1 * base.cost, "{period_s}: {} of {}", found[0].cost, base.cost);
            assert_eq!((effect, form), ("bridge_drift", "friction wanders"), "{period_s}");
        }
    }

    #[test]
    fn a_fit_that_goes_on_with_its_slopes_comes_as_far_as_one_that_takes_new_ones() {
        let (logs, baseline, terms) = logged();
        let problem = Problem::new(&logs, &baseline, &terms);
        let set = two(&terms);
        let start = fitted(&problem, &set, 1);
        assert!(start.slopes.is_some());
        let on = problem.fitted_on(start.clone(), 6);
        let anew = problem.fit(&start.terms, start.p.clone(), 6, Near::Nothing);
        assert!(on.cost < anew.cost + UNDECIDED / CONTACT_SHARE, "{} {} {}", start.cost, on.cost, anew.cost);
    }
}
