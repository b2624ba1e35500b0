//! The search for a combination of effects: forward with a beam, then backward.
//!
//! Forward: each round adds each candidate to each of the best combinations so far (`BEAM` of them, so that a
//! strong rival cannot hide a pair) and fits. A round counts if its best gains more than its price and is
//! material. Where the first round does not, a second one looks for pairs: two that hide each other gain nothing
//! alone, since with each of them the other's error is left, slow and so worth few values. Later rounds try
//! only what an estimate ([`super::screening`]) promises something of.
//! Backward: every effect is taken out once again; one that is not missed goes.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use super::analysis::{Analysis, Fit, Role};
use super::pooled::channels;
use super::score::{Independent, Score, likelihood_ratio, score};
use super::screening::estimated_gain;
use super::selection::{Combination, is_material, sorted, without};

/// Combinations that go on into the next round.
const BEAM: usize = 2;
/// Most effects of one subsystem at once.
pub(super) const MOST_EFFECTS: usize = 3;
/// Threads that fit.
const THREADS: usize = 2;
/// A rival that scores within this share of the best one's likelihood gain goes into the beam.
const BEAM_SHARE: f64 = 0.7;
/// Estimated gain in log-likelihood below which an effect is not tried beside others.
const LEAST_ESTIMATE: f64 = 3.0;
/// Effects tried beside others, those with the largest estimates …
const MOST_TRIED: usize = 4;
/// … and where the best of the first round leaves much, since the estimates are then those of another shape.
const MOST_TRIED_IN_ERROR: usize = 9;
/// Mean square, in variances of the noise, that is taken for noise.
const NOISE_LEVEL: f64 = 3.0;
/// Share of the training logs' gain that an effect must show on held-out logs, both per value.
const CONFIRMED_SHARE: f64 = 0.2;
/// Growth of the held-out error at which an effect does harm there, whatever single samples gain.
const HARM: f64 = 1.02;

/// A search and what it has fitted.
pub(super) struct Search<'a> {
    analysis: &'a dyn Analysis,
    told: &'a (dyn Fn(&str) + Sync),
    base: Arc<Fit>,
    /// What it begins with: nothing, or what the logs show by themselves.
    first: Combination,
    /// All fits; the empty combination is the baseline.
    pub(super) fits: BTreeMap<Combination, Arc<Fit>>,
    /// Combinations that could not be fitted, and why.
    pub(super) failed: BTreeMap<Combination, String>,
}

/// Play sits in a soft shaft: one name holds both.
fn exclude_each_other(a: &str, b: &str) -> bool {
    matches!((a, b), ("shaft_torsion", "backlash") | ("backlash", "shaft_torsion"))
}

/// Whether a fit leaves so little of the subsystem's own signal that no search for hidden pairs is worth its time.
fn is_noise(fit: &Fit) -> bool {
    channels(fit, Role::Train).first().is_none_or(|channel| channel.mean_square() < NOISE_LEVEL)
}

impl<'a> Search<'a> {
    /// Fits the baseline; the error says why it cannot be fitted.
    pub(super) fn new(analysis: &'a dyn Analysis, told: &'a (dyn Fn(&str) + Sync)) -> Result<Self, String> {
        let base = Arc::new(analysis.fit(&[], None)?);
        told(analysis.subsystem().name());
        let fits = BTreeMap::from([(Vec::new(), base.clone())]);
        let mut search = Self { analysis, told, base, first: Vec::new(), fits, failed: BTreeMap::new() };
        let seen = sorted(&analysis.seen());
        search.fit_all(&[(seen.clone(), Vec::new())]);
        if search.fits.contains_key(&seen) {
            search.first = seen;
        }
        Ok(search)
    }

    /// Adds effects as long as they are worth it.
    pub(super) fn forward(&mut self) -> Combination {
        let mut independent = Independent::of(&self.base, Role::Train);
        let mut best = self.first.clone();
        let mut beam: Vec<Combination> = vec![best.clone()];
        for round in 0..MOST_EFFECTS {
            let mut ranked = self.widen(&beam, round, &mut independent);
            let Some((top, _)) = ranked.first().cloned() else { break };
            // A search that ended early would leave something to be found for any other effect.
            self.fit_again(std::slice::from_ref(&top), &top);
            let (before, after) = (self.rated(&best, &independent), self.rated(&top, &independent));
            let material = is_material(&self.base, &self.fits[&best], &self.fits[&top], &independent);
            if after.penalised > before.penalised && material {
                let floor = before.likelihood + BEAM_SHARE * (after.likelihood - before.likelihood);
                ranked.retain(|(_, score)| score.likelihood >= floor);
                best = top;
            } else if round == 0 && !is_noise(&self.fits[&self.first]) {
                ranked.sort_by(|a, b| b.1.likelihood.total_cmp(&a.1.likelihood));
            } else {
                break;
            }
            beam = ranked.into_iter().take(BEAM).map(|(set, _)| set).collect();
        }
        best
    }

    /// Fits what a beam may grow to and ranks it. The independent values become those that the best fit leaves.
    fn widen(
        &mut self,
        beam: &[Combination],
        round: usize,
        independent: &mut Independent,
    ) -> Vec<(Combination, Score)> {
        let wanted: Vec<(Combination, Combination)> =
            (0..beam.len()).flat_map(|at| self.worthwhile(&beam[at], round == 1 && at == 0)).collect();
        self.fit_all(&wanted);
        let mut tried: Vec<Combination> = wanted.into_iter().map(|(set, _)| set).collect();
        tried.retain(|set| self.fits.contains_key(set));
        tried.sort_unstable();
        tried.dedup();
        let gain =
            |set: &Combination| likelihood_ratio(&self.base, &self.fits[set], Role::Train, independent).0;
        if let Some(most) = tried.iter().max_by(|a, b| gain(a).total_cmp(&gain(b))) {
            *independent = Independent::of(&self.fits[most], Role::Train);
        }
        let mut ranked: Vec<(Combination, Score)> =
            tried.into_iter().map(|set| (set.clone(), self.rated(&set, independent))).collect();
        ranked.sort_by(|a, b| b.1.penalised.total_cmp(&a.1.penalised));
        ranked
    }

    fn rated(&self, set: &Combination, independent: &Independent) -> Score {
        score(&self.base, &self.fits[set], independent)
    }

    /// A combination with each candidate that may gain something beside it, and where its fit starts.
    fn worthwhile(&self, set: &Combination, widely: bool) -> Vec<(Combination, Combination)> {
        let fit = &self.fits[set];
        // A structured rest holds few independent values, and yet may be just what one more effect explains.
        let independent = Independent::at_most(fit, Role::Train);
        let is_first = *set == self.first;
        let mut rated: Vec<(f64, &'static str)> = self
            .analysis
            .candidates()
            .into_iter()
            .filter(|id| !set.contains(id) && !self.failed.contains_key(&self.alone(id)))
            .filter(|id| !set.iter().any(|known| exclude_each_other(known, id)))
            .map(|id| {
                let alone = self.fits.get(&self.alone(id)).filter(|_| !is_first);
                let gain = alone.and_then(|alone| estimated_gain(fit, alone, id, &independent));
                (gain.unwrap_or(f64::INFINITY), id)
            })
            .filter(|(gain, _)| *gain > LEAST_ESTIMATE)
            .collect();
        rated.sort_by(|a, b| b.0.total_cmp(&a.0));
        if !is_first {
            rated.truncate(if widely && !is_noise(fit) { MOST_TRIED_IN_ERROR } else { MOST_TRIED });
        }
        rated.into_iter().map(|(_, id)| (sorted(&[set.as_slice(), &[id]].concat()), set.clone())).collect()
    }

    /// The combination in which an effect stands without others that were searched for.
    fn alone(&self, id: &'static str) -> Combination {
        sorted(&[self.first.as_slice(), &[id]].concat())
    }

    /// Fits combinations again from one with more effects, and keeps what is better: a search that ended too early alone may not
    /// have done so there.
    fn fit_again(&mut self, sets: &[Combination], from: &Combination) {
        let near = self.fits[from].clone();
        for set in sets {
            if let Ok(fit) = self.analysis.fit(set, Some(&near)) {
                (self.told)(self.analysis.subsystem().name());
                let better = self.fits.get(set).is_none_or(|known| {
                    let independent = Independent::of(known, Role::Train);
                    likelihood_ratio(known, &fit, Role::Train, &independent).0 > 0.0
                });
                if better {
                    self.fits.insert(set.clone(), Arc::new(fit));
                }
            }
        }
    }

    /// Fits what is not known yet, some at a time.
    fn fit_all(&mut self, wanted: &[(Combination, Combination)]) {
        let mut todo: Vec<&(Combination, Combination)> = wanted
            .iter()
            .filter(|(set, _)| !self.fits.contains_key(set) && !self.failed.contains_key(set))
            .collect();
        todo.dedup_by(|a, b| a.0 == b.0);
        let next = AtomicUsize::new(0);
        let done: Mutex<Vec<(Combination, Result<Fit, String>)>> = Mutex::new(Vec::new());
        let work = || {
            while let Some((set, near)) = todo.get(next.fetch_add(1, Ordering::Relaxed)) {
                let fit = self.analysis.fit(set, self.fits.get(near).map(Arc::as_ref));
                (self.told)(self.analysis.subsystem().name());
                done.lock().unwrap_or_else(PoisonError::into_inner).push((set.clone(), fit));
            }
        };
        std::thread::scope(|scope| {
            for _ in 1..THREADS {
                scope.spawn(work);
            }
            work();
        });
        for (set, fit) in done.into_inner().unwrap_or_else(PoisonError::into_inner) {
            match fit {
                Ok(fit) => {
                    self.fits.insert(set, Arc::new(fit));
                }
                Err(why) => {
                    self.failed.insert(set, why);
                }
            }
        }
    }

    /// Takes out what is not missed, on the training logs or on the held-out ones; gives what is left, the latter, and the
    /// independent values of what is left.
    pub(super) fn backward(
        &mut self,
        mut best: Combination,
    ) -> (Combination, Vec<&'static str>, Independent) {
        let base = self.base.clone();
        let mut unconfirmed = Vec::new();
        loop {
            let fewer: Vec<Combination> = best.iter().map(|effect| without(&best, effect)).collect();
            self.fit_again(&fewer, &best);
            let full = self.fits[&best].clone();
            let independent = &Independent::of(&full, Role::Train);
            let has_holdout = channels(&full, Role::Holdout).iter().any(|channel| channel.count() > 0);
            let whole = score(&base, &full, independent);
            let mut weakest: Option<(f64, &'static str, bool)> = None;
            for effect in best.iter().copied() {
                let Some(less) = self.fits.get(&without(&best, effect)) else { continue };
                let missed = whole.penalised - score(&base, less, independent).penalised;
                let (trained, _) = likelihood_ratio(less, &full, Role::Train, independent);
                // Weighed as on the training logs: what one rest there hides from one channel must not decide.
                let (held, _) = likelihood_ratio(less, &full, Role::Holdout, independent);
                let seen = held >= CONFIRMED_SHARE * trained;
                let harms = less.nrmse(Role::Holdout).zip(full.nrmse(Role::Holdout));
                let harms = harms.is_some_and(|(less, full)| full > HARM * less);
                let confirmed = !has_holdout || (seen && !harms);
                let wanted = missed > 0.0 && is_material(&base, less, &full, independent);
                if !(wanted && confirmed) && weakest.is_none_or(|(least, ..)| missed < least) {
                    weakest = Some((missed, effect, wanted));
                }
            }
            let Some((_, effect, on_training)) = weakest else {
                return (best, unconfirmed, independent.clone());
            };
            if on_training {
                unconfirmed.push(effect);
            }
            best = without(&best, effect);
        }
    }
}
