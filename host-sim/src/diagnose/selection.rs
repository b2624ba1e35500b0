//! Which effects, of all that a subsystem's library has, the logs ask for.
//!
//! Found by adding and taking out one at a time (`stepwise.rs`), by scores on the training logs
//! ([`super::score`]). What is chosen must also lower the error on the held-out logs, which nothing was
//! fitted to.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::analysis::{Analysis, Fit, Role};
use super::score::{Independent, Score, likelihood_ratio, score};
use super::stepwise::Search;

/// An effect must lower the mean square of the subsystem's own signal by this much: below, it is significant only
/// because there are many samples.
const MATERIAL_SHARE: f64 = 0.05;
/// The same, of the baseline's mean square: what is less may be what the laws of the other effects get wrong.
const IMPERFECT_SHARE: f64 = 0.01;

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

/// Chooses the effects of a subsystem. `told` hears of every fit.
///
/// The error says why not even the baseline can be fitted.
pub fn select(analysis: &dyn Analysis, told: &(dyn Fn(&str) + Sync)) -> Result<Selection, String> {
    let mut search = Search::new(analysis, told)?;
    let most = search.forward();
    let (chosen, unconfirmed, independent) = search.backward(most);
    let mut selection =
        Selection { fits: search.fits, failed: search.failed, chosen, unconfirmed, independent };
    selection.order();
    Ok(selection)
}

/// Whether what a step gains in the subsystem's own signal is more than imperfection, of the noise or of the effects that are in already.
pub(super) fn is_material(base: &Fit, from: &Fit, to: &Fit, independent: &Independent) -> bool {
    let fall = |from, to| likelihood_ratio(from, to, Role::Train, independent).1;
    let of_baseline = fall(base, to) - fall(base, from);
    fall(from, to) > MATERIAL_SHARE && of_baseline > IMPERFECT_SHARE
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
