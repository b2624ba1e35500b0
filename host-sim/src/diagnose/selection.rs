//! Which effects, of all that a subsystem's library has, the logs ask for.
//!
//! Stepwise: each round adds each candidate to each of the best combinations so far (`BEAM` of them, so
//! that a strong rival cannot hide a pair), fits, and scores on the training logs ([`super::score`]). A
//! round counts if its best gains more than its price and is material; where the first does not, a second one
//! looks for pairs. Then every effect is taken out once
//! again; one that is not missed goes. What is left must also lower the error on the held-out logs, which
//! nothing was fitted to.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use super::analysis::{Analysis, Fit, Role};
use super::pooled::channels;
use super::score::{Independent, Score, likelihood_ratio, score};
use super::screening::estimated_gain;

/// Combinations that go on into the next round.
const BEAM: usize = 2;
/// Most effects of one subsystem at once.
pub(super) const MOST_EFFECTS: usize = 3;
/// Threads that fit.
const THREADS: usize = 2;
/// A rival that scores within this share of the best one's likelihood gain goes into the beam.
const BEAM_SHARE: f64 = 0.7;
/// An effect must lower the mean square of the subsystem's own signal by this much: below, it is significant only
/// because there are many samples.
const MATERIAL_SHARE: f64 = 0.05;
/// The same, of the baseline's mean square: what is less may be what the laws of the other effects get wrong.
const IMPERFECT_SHARE: f64 = 0.01;
/// Estimated gain in log-likelihood below which an effect is not tried beside others.
const LEAST_ESTIMATE: f64 = 3.0;
/// Effects tried beside others, those with the largest estimates …
const MOST_TRIED: usize = 4;
/// … and where the best of the first round leaves much, since the estimates are then those of another shape.
const MOST_TRIED_IN_ERROR: usize = 9;
/// Share of the training logs' gain per value that an effect must show on held-out logs.
const CONFIRMED_SHARE: f64 = 0.2;

/// Mean square, in variances of the noise, that is taken for noise.
const NOISE_LEVEL: f64 = 3.0;
/// Growth of the held-out error at which an effect does harm there, whatever single samples gain.
const HARM: f64 = 1.02;

/// A combination of effects, sorted.
pub type Combination = Vec<&'static str>;

/// What the search found.
pub struct Selection {
    /// All fits made; the empty combination is the baseline.
    pub fits: BTreeMap<Combination, Arc<Fit>>,
    /// Combinations that could not be fitted, and why.
    pub failed: BTreeMap<Combination, String>,
    /// Effects chosen, the strongest first.
    pub chosen: Combination,
    /// Effects that gained on the training logs but not on the held-out ones.
    pub unconfirmed: Vec<&'static str>,
    /// Independent values that the chosen fit leaves.
    pub independent: Independent,
}

impl Selection {
    /// The baseline.
    pub fn baseline(&self) -> Option<&Fit> {
        self.fits.get(&Vec::new()).map(Arc::as_ref)
    }

    /// The fit of a combination.
    pub fn fit(&self, effects: &[&'static str]) -> Option<&Fit> {
        self.fits.get(&sorted(effects)).map(Arc::as_ref)
    }

    /// The chosen fit.
    pub fn extended(&self) -> Option<&Fit> {
        self.fit(&self.chosen)
    }

    /// Score of a combination that was fitted.
    pub fn score(&self, effects: &[&'static str]) -> Option<Score> {
        Some(score(self.baseline()?, self.fit(effects)?, &self.independent))
    }
}

/// A combination in the order of its key.
pub fn sorted(effects: &[&'static str]) -> Combination {
    let mut key = effects.to_vec();
    key.sort_unstable();
    key
}

/// A combination without one effect.
pub fn without(effects: &[&'static str], effect: &str) -> Combination {
    effects.iter().copied().filter(|id| *id != effect).collect()
}

/// Play sits in a soft shaft: one name holds both.
fn exclude_each_other(a: &str, b: &str) -> bool {
    matches!((a, b), ("shaft_torsion", "backlash") | ("backlash", "shaft_torsion"))
}

struct Search<'a> {
    analysis: &'a dyn Analysis,
    told: &'a (dyn Fn(&str) + Sync),
    fits: BTreeMap<Combination, Arc<Fit>>,
    failed: BTreeMap<Combination, String>,
}

/// Chooses the effects of a subsystem. `told` hears of every fit.
///
/// The error says why not even the baseline can be fitted.
pub fn select(analysis: &dyn Analysis, told: &(dyn Fn(&str) + Sync)) -> Result<Selection, String> {
    let base = Arc::new(analysis.fit(&[], None)?);
    told(analysis.subsystem().name());
    let mut search = Search { analysis, told, fits: BTreeMap::new(), failed: BTreeMap::new() };
    search.fits.insert(Vec::new(), base.clone());
    let candidates = analysis.candidates();
    let mut independent = Independent::of(&base, Role::Train);
    let seen = sorted(&analysis.seen());
    search.fit_all(&[(seen.clone(), Vec::new())]);
    let mut best: Combination = if search.fits.contains_key(&seen) { seen } else { Vec::new() };
    let first = best.clone();
    let mut beam: Vec<Combination> = vec![best.clone()];
    for round in 0..MOST_EFFECTS {
        let wanted: Vec<(Combination, Combination)> = (0..beam.len())
            .flat_map(|at| search.worthwhile(&beam[at], &candidates, at == 0 && round <= 1))
            .collect();
        search.fit_all(&wanted);
        let tried = || wanted.iter().map(|(set, _)| set).filter(|set| search.fits.contains_key(*set));
        // The independent values are those that the best fit leaves.
        let most = tried().max_by(|a, b| {
            let value =
                |set: &Combination| likelihood_ratio(&base, &search.fits[set], Role::Train, &independent).0;
            value(a).total_cmp(&value(b))
        });
        if let Some(most) = most {
            independent = Independent::of(&search.fits[most], Role::Train);
        }
        let rated = |set: &Combination| score(&base, &search.fits[set], &independent);
        let mut ranked: Vec<(Combination, Score)> = tried().map(|set| (set.clone(), rated(set))).collect();
        ranked.sort_by(|a, b| b.1.penalised.total_cmp(&a.1.penalised));
        ranked.dedup_by(|a, b| a.0 == b.0);
        let Some((set, _)) = ranked.first().cloned() else { break };
        // A search that ended early would leave something to be found for any other effect.
        search.fit_again(std::slice::from_ref(&set), &set);
        let rated = |set: &Combination| score(&base, &search.fits[set], &independent);
        let (before, top) = (rated(&best), rated(&set));
        let material = is_material(&base, &search.fits[&best], &search.fits[&set], &independent);
        if top.penalised <= before.penalised || !material {
            // Two that hide each other gain nothing alone: with each of them the other's error is left, slow
            // and so worth few values.
            let looks_ahead = beam == [first.clone()] && !is_noise(&search.fits[&first]);
            if !looks_ahead {
                break;
            }
            ranked.sort_by(|a, b| b.1.likelihood.total_cmp(&a.1.likelihood));
            beam = ranked.into_iter().take(BEAM).map(|(set, _)| set).collect();
            continue;
        }
        best = set;
        let floor = before.likelihood + BEAM_SHARE * (top.likelihood - before.likelihood);
        beam = ranked
            .into_iter()
            .filter(|(_, s)| s.likelihood >= floor)
            .take(BEAM)
            .map(|(set, _)| set)
            .collect();
    }
    let unconfirmed = search.eliminate(&mut best, &mut independent);
    let mut selection =
        Selection { fits: search.fits, failed: search.failed, chosen: best, unconfirmed, independent };
    selection.order();
    Ok(selection)
}

/// Whether a fit leaves so little of the subsystem's own signal that no search for hidden pairs is worth its time.
fn is_noise(fit: &Fit) -> bool {
    channels(fit, Role::Train).first().is_none_or(|channel| channel.mean_square() < NOISE_LEVEL)
}

/// Whether what a step gains in the subsystem's own signal is more than imperfection, of the noise or of the effects that are in already.
pub(super) fn is_material(base: &Fit, from: &Fit, to: &Fit, independent: &Independent) -> bool {
    let fall = |from, to| likelihood_ratio(from, to, Role::Train, independent).1;
    let of_baseline = fall(base, to) - fall(base, from);
    fall(from, to) > MATERIAL_SHARE && of_baseline > IMPERFECT_SHARE
}

impl Search<'_> {
    /// A combination with each candidate that may gain something beside it, and where its fit starts.
    fn worthwhile(
        &self,
        set: &Combination,
        candidates: &[&'static str],
        widely: bool,
    ) -> Vec<(Combination, Combination)> {
        let fit = &self.fits[set];
        // A structured rest holds few independent values, and yet may be just what one more effect explains.
        let independent = Independent::at_most(fit, Role::Train);
        let mut rated: Vec<(f64, &'static str)> = candidates
            .iter()
            .filter(|id| !set.contains(id) && !self.failed.contains_key(&vec![**id]))
            .filter(|id| !set.iter().any(|known| exclude_each_other(known, id)))
            .map(|id| {
                let alone = self.fits.get(&vec![*id]).filter(|_| !set.is_empty());
                let gain = alone.and_then(|alone| estimated_gain(fit, alone, id, &independent));
                (gain.unwrap_or(f64::INFINITY), *id)
            })
            .filter(|(gain, _)| *gain > LEAST_ESTIMATE)
            .collect();
        rated.sort_by(|a, b| b.0.total_cmp(&a.0));
        if !set.is_empty() {
            rated.truncate(if is_noise(fit) || !widely { MOST_TRIED } else { MOST_TRIED_IN_ERROR });
        }
        rated.into_iter().map(|(_, id)| (sorted(&[set.as_slice(), &[id]].concat()), set.clone())).collect()
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

    /// Takes out what is not missed, on the training logs or on the held-out ones; gives the latter.
    fn eliminate(&mut self, best: &mut Combination, independent: &mut Independent) -> Vec<&'static str> {
        let base = self.fits[&Vec::new()].clone();
        let mut unconfirmed = Vec::new();
        loop {
            let fewer: Vec<Combination> = best.iter().map(|effect| without(best, effect)).collect();
            self.fit_again(&fewer, best);
            let full = self.fits[best].clone();
            *independent = Independent::of(&full, Role::Train);
            let has_holdout = channels(&full, Role::Holdout).iter().any(|channel| channel.count() > 0);
            let whole = score(&base, &full, independent);
            let mut weakest: Option<(f64, &'static str, bool)> = None;
            for effect in best.iter().copied() {
                let Some(less) = self.fits.get(&without(best, effect)) else { continue };
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
            let Some((_, effect, on_training)) = weakest else { return unconfirmed };
            if on_training {
                unconfirmed.push(effect);
            }
            *best = without(best, effect);
        }
    }
}

impl Selection {
    /// Brings the chosen effects into the order of what is lost without each.
    fn order(&mut self) {
        let Some(full) = self.extended() else { return };
        let loss = |effect: &&'static str| {
            self.fit(&without(&self.chosen, effect))
                .map_or(0.0, |less| likelihood_ratio(less, full, Role::Train, &self.independent).0)
        };
        let mut ordered: Vec<(f64, &'static str)> = self.chosen.iter().map(|e| (loss(e), *e)).collect();
        ordered.sort_by(|a, b| b.0.total_cmp(&a.0));
        self.chosen = ordered.into_iter().map(|(_, effect)| effect).collect();
    }
}

#[cfg(test)]
mod tests {
    use super::super::synthetic::{Wave, Waves, wave};
    use super::*;

    fn selected(waves: Vec<Wave>) -> Selection {
        select(&Waves::new(waves), &|_| ()).unwrap()
    }

    #[test]
    fn the_two_effects_that_are_there_are_found_the_stronger_first_and_no_third() {
        let found = selected(vec![
            wave("wear_drift", 0.8),
            wave("viscous_film", 0.0),
            wave("disc_angle", 1.5),
            wave("bell_curve", 0.0),
            wave("static_ageing", 0.0),
        ]);
        assert_eq!(found.chosen, ["disc_angle", "wear_drift"]);
        assert!(found.unconfirmed.is_empty());
        let size = |id| found.extended().unwrap().get(Some(id), "size").unwrap();
        // Amplitude of a wave in white noise over two logs: √(2/8000) of it.
        assert!(
            (size("disc_angle").value - 1.5).abs() < 0.06 && (size("wear_drift").value - 0.8).abs() < 0.06
        );
    }

    #[test]
    fn a_clean_residual_asks_for_no_effect() {
        let found =
            selected(vec![wave("wear_drift", 0.0), wave("viscous_film", 0.0), wave("disc_angle", 0.0)]);
        assert!(found.chosen.is_empty() && found.unconfirmed.is_empty());
    }

    #[test]
    fn what_is_significant_but_hardly_lowers_the_error_is_not_taken() {
        // 0.15²/2 of the noise's variance: 45 in log-likelihood over 8000 samples, and 1.1 % of the mean square.
        let found = selected(vec![wave("disc_angle", 1.5), wave("viscous_film", 0.15)]);
        assert_eq!(found.chosen, ["disc_angle"]);
        let both = found.score(&["disc_angle", "viscous_film"]).unwrap();
        assert!(both.penalised > found.score(&["disc_angle"]).unwrap().penalised + 10.0, "it is significant");
    }

    #[test]
    fn an_effect_that_gains_only_on_the_training_logs_is_taken_out_and_told() {
        let only_trained = Wave { id: "wear_drift", trained: 0.9, held_out: 0.0 };
        let found = selected(vec![wave("disc_angle", 1.5), only_trained, wave("viscous_film", 0.0)]);
        assert_eq!(found.chosen, ["disc_angle"]);
        assert_eq!(found.unconfirmed, ["wear_drift"]);
    }
}
