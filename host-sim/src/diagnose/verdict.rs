//! From the fits of a subsystem to what is said about it.
//!
//! `none`: no effect earns its price and the baseline's residual is noise, or so little that no real model
//! would do better. `named`: the chosen effects explain the structured part of the residual. `unknown`: it is structured and nothing
//! explains it, or what is left after the best explanation is still more than `LEFT_SHARE` of it: then a nearest name would
//! be a wrong one. What is left is judged without its worst moments ([`super::events`]).
//!
//! Probabilities: each chosen effect against each rival in its place and against nothing in its place, by the
//! differences of the penalised scores, which count independent values as the chosen fit leaves them.

use std::sync::Arc;

use super::analysis::{Analysis, Fit, Role};
use super::coordinates::Coordinates;
use super::events::Moments;
use super::score::{Independent, Score, likelihood_ratio};
use super::selection::{Selection, is_material, without};
use super::stepwise::MOST_EFFECTS;
use super::structure::{Structure, structures};

/// Structured rest that an explanation may leave, of what the baseline leaves.
const LEFT_SHARE: f64 = 0.25;
/// Share of a residual's mean square that no imperfection of a model, which is tolerated up to 0.8 variances of the noise, can
/// be: 0.8/1.8 …
const MOST: f64 = 0.45;
/// … and a share that takes a witness beside it, …
const GOOD_PART: f64 = 0.25;
/// … of which effects explain so much …
const MOST_OF_A_WITNESS: f64 = 0.75;
/// … and which is far from noise, in variances of it.
const LOUD: f64 = 5.0;
/// Scores closer than this (natural logarithm) are not told apart: odds of 20 to 1.
const INDISTINCT: f64 = 3.0;
/// Certainty that is never exceeded.
const MOST_CERTAIN: f64 = 0.999;
/// Rejected rivals that are reported.
const MOST_REJECTED: usize = 6;

/// What is said.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// Noise.
    None,
    /// Causes are named.
    Named,
    /// Structured, and nothing explains it.
    Unknown,
}

impl Verdict {
    /// Name in result files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Named => "named",
            Self::Unknown => "unknown",
        }
    }
}

/// A chosen effect.
#[derive(Debug, Clone, PartialEq)]
pub struct Cause {
    /// Effect id.
    pub id: &'static str,
    /// Probability against its rivals.
    pub probability: f64,
    /// Log-likelihood that is lost without it.
    pub weight: f64,
    /// Sentences with numbers.
    pub evidence: Vec<String>,
}

/// A rival that was not chosen.
#[derive(Debug, Clone, PartialEq)]
pub struct Rejected {
    /// Effect id.
    pub id: &'static str,
    /// Probability.
    pub probability: f64,
    /// One sentence with a number.
    pub why: String,
}

/// All that is known about a subsystem.
pub struct Judged {
    /// The subsystem's analysis.
    pub analysis: Arc<dyn Analysis>,
    /// Its fits.
    pub selection: Selection,
    /// What is said.
    pub verdict: Verdict,
    /// Chosen effects, the strongest first; none where the verdict is not `named`.
    pub causes: Vec<Cause>,
    /// Rivals, the closest first.
    pub rejected: Vec<Rejected>,
    /// Pairs that the logs cannot separate.
    pub indistinguishable: Vec<Vec<&'static str>>,
    /// Residual of the baseline on the training logs.
    pub before: Vec<Structure>,
    /// Residual of the best explanation.
    pub after: Vec<Structure>,
}

impl Judged {
    /// The fit that the results stand for: extended where causes are named, else the baseline.
    pub fn result(&self) -> Option<&Fit> {
        match self.verdict {
            Verdict::Named => self.selection.extended(),
            _ => self.selection.baseline(),
        }
    }

    /// The structured part of the baseline's residual of the subsystem's own signal, in variances of the noise.
    pub fn structured_before(&self) -> f64 {
        self.before.first().map_or(0.0, |s| s.structured)
    }
}

/// Judges a subsystem.
pub fn judge(analysis: Arc<dyn Analysis>, selection: Selection, coordinates: &[Coordinates]) -> Judged {
    let tested = |fit: Option<&Fit>| fit.map_or(Vec::new(), |fit| structures(fit, Role::Train, coordinates));
    let before = tested(selection.baseline());
    let after = if selection.chosen.is_empty() { before.clone() } else { tested(selection.extended()) };
    // Only the subsystem's own signal: other witnesses may carry what is another subsystem's.
    let left = match (selection.baseline(), selection.extended()) {
        (Some(base), Some(full)) => {
            // What is left must be there without its worst moments.
            let moments = Moments::of(full, Role::Train);
            let calm = |fit: &Fit| structures(&moments.taken_from(fit), Role::Train, coordinates);
            calm(base).iter().zip(&calm(full)).take(1).any(|(before, after)| {
                after.is_material()
                    && (selection.chosen.is_empty() || after.structured > LEFT_SHARE * before.structured)
            })
        }
        _ => false,
    };
    let wrong = before.iter().take(1).any(Structure::is_material) || explains(&before, &after);
    let verdict = match (wrong, left, selection.chosen.is_empty()) {
        // What is significant and yet below any real model's imperfection is not worth a name.
        (false, ..) | (true, false, true) => Verdict::None,
        (true, true, _) => Verdict::Unknown,
        (true, false, false) => Verdict::Named,
    };
    let mut judged = Judged {
        analysis,
        selection,
        verdict,
        causes: Vec::new(),
        rejected: Vec::new(),
        indistinguishable: Vec::new(),
        before,
        after,
    };
    judged.name_causes();
    judged.reject();
    judged
}

/// Whether effects explain so much of a residual that it is no imperfection, however small it is or however well it
/// hides from the tests: most of the signal's own, or a good part of it and nearly all of a witness's.
fn explains(before: &[Structure], after: &[Structure]) -> bool {
    let falls = |at: usize| match (before.get(at), after.get(at)) {
        (Some(before), Some(after)) => 1.0 - after.mean_square / before.mean_square.max(1e-12),
        _ => 0.0,
    };
    let speaks = |at: usize| before[at].mean_square > LOUD && falls(at) > MOST_OF_A_WITNESS;
    falls(0) > MOST || falls(0) > GOOD_PART && (1..before.len()).any(speaks)
}

impl Judged {
    fn name_causes(&mut self) {
        if self.verdict != Verdict::Named {
            return;
        }
        let selection = &self.selection;
        let chosen = selection.chosen.clone();
        let (Some(full), Some(best)) = (selection.extended(), selection.score(&chosen)) else { return };
        for id in &chosen {
            let rest = without(&chosen, id);
            let mut odds = 0.0;
            for rival in std::iter::once(None).chain(self.analysis.candidates().into_iter().map(Some)) {
                if rival.is_some_and(|rival| chosen.contains(&rival)) {
                    continue;
                }
                let set: Vec<&'static str> = rest.iter().copied().chain(rival).collect();
                let Some(score) = selection.score(&set) else { continue };
                let behind = best.penalised - score.penalised;
                odds += (-behind).exp();
                if let Some(rival) = rival
                    && behind < INDISTINCT
                {
                    self.indistinguishable.push(vec![id, rival]);
                }
            }
            let probability = (1.0 / (1.0 + odds)).min(MOST_CERTAIN);
            let mut evidence = self.analysis.evidence(id, full);
            let mut weight = 0.0;
            if let Some(less) = selection.fit(&rest) {
                let (lost, share) = likelihood_ratio(less, full, Role::Train, &selection.independent);
                weight = lost;
                evidence.push(format!(
                    "it takes {:.1} % off the mean square of the residual of the training logs{}",
                    100.0 * share,
                    held_out(less, full)
                ));
            }
            self.causes.push(Cause { id, probability, weight, evidence });
        }
    }

    fn reject(&mut self) {
        let selection = &self.selection;
        let chosen = &selection.chosen;
        let named = self.verdict == Verdict::Named;
        let Some(best) = selection.score(chosen) else { return };
        let mut rejected: Vec<(f64, Rejected)> = Vec::new();
        for id in self.analysis.candidates() {
            if named && chosen.contains(&id) {
                continue;
            }
            // In the place of one of the chosen, or beside them.
            let places: Vec<Vec<&'static str>> = chosen
                .iter()
                .map(|replaced| [without(chosen, replaced), vec![id]].concat())
                .chain([[chosen.as_slice(), &[id]].concat(), vec![id]])
                .collect();
            let scored = places.iter().filter_map(|set| Some((set, selection.score(set)?)));
            let closest = scored.max_by(|a, b| a.1.penalised.total_cmp(&b.1.penalised));
            let Some((set, score)) = closest else {
                if let Some(why) = selection.failed.get(&vec![id]) {
                    rejected.push((f64::INFINITY, Rejected { id, probability: 0.0, why: why.clone() }));
                }
                continue;
            };
            let behind = best.penalised - score.penalised;
            let why = if selection.unconfirmed.contains(&id) {
                self.unconfirmed(id, set)
            } else if self.verdict == Verdict::None && chosen.contains(&id) {
                "it gains, but what the baseline leaves is within the imperfection that any model of a rig has".into()
            } else if !named && chosen.contains(&id) {
                self.too_little(id)
            } else if behind < 0.0 {
                self.turned_down(set, best, score)
            } else {
                self.too_dear(set, best, score)
            };
            let probability = (1.0 / (1.0 + behind.exp())).clamp(0.0, 0.5);
            rejected.push((behind, Rejected { id, probability, why }));
        }
        rejected.sort_by(|a, b| a.0.total_cmp(&b.0));
        self.rejected = rejected.into_iter().map(|(_, r)| r).take(MOST_REJECTED).collect();
    }

    /// What an effect does to the training logs and to the held-out ones, which did not confirm it.
    fn unconfirmed(&self, id: &str, set: &[&'static str]) -> String {
        let (Some(less), Some(full)) = (self.selection.fit(&without(set, id)), self.selection.fit(set))
        else {
            return "it gains on the training logs and not on the held-out logs".into();
        };
        let gain = |role| likelihood_ratio(less, full, role, &Independent::of(full, role)).0;
        let errors = match (less.nrmse(Role::Holdout), full.nrmse(Role::Holdout)) {
            (Some(from), Some(to)) => {
                format!(", where the error goes from {:.2} % to {:.2} %", 100.0 * from, 100.0 * to)
            }
            _ => String::new(),
        };
        format!(
            "it gains {:.1} in log-likelihood on the training logs, but {:.1} on the held-out ones{errors}",
            gain(Role::Train),
            gain(Role::Holdout)
        )
    }

    /// Why a combination with an effect that was not chosen scores less than the chosen one.
    fn too_dear(&self, set: &[&'static str], best: Score, score: Score) -> String {
        let chosen = &self.selection.chosen;
        let behind = best.penalised - score.penalised;
        let gain = score.likelihood - best.likelihood;
        let instead = instead_of(chosen, set);
        if !instead.is_empty() {
            let place = format!("in the place of {}", instead.join(" and "));
            if gain >= 0.0 {
                return format!(
                    "{place} it explains {gain:.1} more in log-likelihood, {behind:.1} short of the price of its parameters"
                );
            }
            let share = 100.0 * (score.likelihood / best.likelihood.max(1e-9)).max(0.0);
            return format!("{place} it explains {share:.0} % of the log-likelihood, {:.1} less", -gain);
        }
        let beside = beside(chosen);
        if gain < 0.05 {
            return format!(
                "{beside}it gains nothing, and is {behind:.1} short of the price of its parameters"
            );
        }
        if chosen.is_empty() {
            return format!(
                "it takes {:.2} % off the mean square of the residual: {gain:.1} in log-likelihood, {behind:.1} short of \
                 the price of its parameters",
                100.0 * score.share.max(0.0)
            );
        }
        format!(
            "{beside}it gains {gain:.1} in log-likelihood and misses the price of its parameters by {behind:.1}"
        )
    }

    /// Why a combination was not chosen that scores better on the training logs: what else it would have had to do.
    fn turned_down(&self, set: &[&'static str], best: Score, score: Score) -> String {
        let selection = &self.selection;
        let chosen = &selection.chosen;
        let (gain, ahead) = (score.likelihood - best.likelihood, score.penalised - best.penalised);
        let instead = instead_of(chosen, set);
        let place = match instead.as_slice() {
            [] => beside(chosen),
            instead => format!("in the place of {} ", instead.join(" and ")),
        };
        let won = format!(
            "{place}it explains {gain:.1} more in log-likelihood, {ahead:.1} beyond the price of its parameters"
        );
        let (Some(base), Some(now), Some(then)) =
            (selection.baseline(), selection.extended(), selection.fit(set))
        else {
            return won;
        };
        if set.len() > MOST_EFFECTS {
            return format!(
                "{won}, but {MOST_EFFECTS} effects of one subsystem are the most that logs can tell apart"
            );
        }
        if instead.is_empty() && !is_material(base, now, then, &selection.independent) {
            let (_, share) = likelihood_ratio(now, then, Role::Train, &selection.independent);
            let (_, of_base) = likelihood_ratio(base, now, Role::Train, &selection.independent);
            let share = 100.0 * share;
            let of = if chosen.is_empty() {
                format!("{share:.2} % off the mean square of the residual")
            } else {
                let of_base = 100.0 * (score.share - of_base);
                format!("{share:.2} % off the mean square of what is left, {of_base:.2} % of the baseline's")
            };
            return format!("{won}, but it takes only {of}: no more than a model of a rig gets wrong");
        }
        match (now.nrmse(Role::Holdout), then.nrmse(Role::Holdout)) {
            (Some(from), Some(to)) if to > from => format!(
                "{won}, but with it the error on the held-out logs is {:.2} % and not {:.2} %",
                100.0 * to,
                100.0 * from
            ),
            _ if instead.is_empty() => {
                format!("{won}, but the search, which adds and takes out one effect at a time, left it out")
            }
            _ => format!(
                "{won}, but the search, which adds and takes out one effect at a time, did not come back to it"
            ),
        }
    }

    /// Why an effect that was the best at hand is not named.
    fn too_little(&self, id: &str) -> String {
        let worst = self.after.iter().max_by(|a, b| a.structured.total_cmp(&b.structured));
        let (Some(worst), effects) = (worst, self.selection.chosen.join(" and ")) else {
            return format!("{id} does not explain the residual");
        };
        let start = self
            .before
            .iter()
            .find(|b| b.channel == worst.channel)
            .map_or(worst.structured, |b| b.structured);
        format!(
            "the nearest that the library has ({effects}), but {:.0} % of the structured residual is left",
            100.0 * worst.structured / start.max(1e-12)
        )
    }
}

/// Chosen effects that a combination does without.
fn instead_of(chosen: &[&'static str], set: &[&'static str]) -> Vec<&'static str> {
    chosen.iter().filter(|id| !set.contains(id)).copied().collect()
}

fn beside(chosen: &[&'static str]) -> String {
    if chosen.is_empty() { String::new() } else { format!("beside {} ", chosen.join(" and ")) }
}

fn held_out(less: &Fit, full: &Fit) -> String {
    match (less.nrmse(Role::Holdout), full.nrmse(Role::Holdout)) {
        (Some(from), Some(to)) if from > 0.0 => {
            format!(
                ", and the error on the held-out logs falls from {:.2} % to {:.2} %",
                100.0 * from,
                100.0 * to
            )
        }
        _ => String::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::super::synthetic::{Wave, Waves, wave};
    use super::*;

    fn why(judged: &Judged, id: &str) -> String {
        let rejected = judged.rejected.iter().find(|rejected| rejected.id == id);
        rejected.unwrap_or_else(|| panic!("{id} is not among the rejected")).why.clone()
    }

    #[test]
    fn noise_has_no_cause() {
        let judged = Waves::new(vec![wave("disc_angle", 0.0), wave("wear_drift", 0.0)]).judged();
        assert_eq!(judged.verdict, Verdict::None);
        assert!(judged.causes.is_empty() && judged.indistinguishable.is_empty());
        let why = why(&judged, "wear_drift");
        assert!(why.contains("short of the price of its parameters") && !why.contains(" -"), "{why}");
    }

    #[test]
    fn a_cause_that_explains_the_residual_is_named_and_the_others_are_not() {
        let judged = Waves::new(vec![wave("disc_angle", 2.5), wave("wear_drift", 0.0)]).judged();
        assert_eq!(judged.verdict, Verdict::Named);
        let ids: Vec<&str> = judged.causes.iter().map(|cause| cause.id).collect();
        assert_eq!(ids, ["disc_angle"]);
        assert!(judged.causes[0].probability > 0.99);
        // 2.5²/2 of noise's 1 + 2.5²/2 are 76 % of the mean square; the loss counts large residuals for less.
        let takes = judged.causes[0].evidence.iter().find(|sentence| sentence.contains("% off")).unwrap();
        let share: f64 = takes.split(' ').nth(2).unwrap().parse().unwrap();
        assert!((72.0..77.0).contains(&share), "{takes}");
        assert_eq!(judged.result().unwrap().effects, ["disc_angle"]);
    }

    #[test]
    fn a_fast_swing_that_hides_from_the_tests_is_named_where_it_is_half_of_the_residual() {
        // 40 rad/s at 100 Hz: the correlation over the lags looked at cancels. 1.5²/2 of 1 + 1.5²/2 are 53 %.
        let swinging = |size: f64| Waves {
            spread_rad_s: 40.0,
            ..Waves::new(vec![wave("wear_drift", 0.0), wave("disc_angle", size)])
        };
        let judged = swinging(1.5).judged();
        assert!(!judged.before[0].is_material());
        assert_eq!((judged.verdict, judged.causes[0].id), (Verdict::Named, "disc_angle"));
        // 0.9²/2 of 1 + 0.9²/2 are 29 %: it is chosen, and may be imperfection.
        let faint = swinging(0.9).judged();
        assert_eq!(faint.selection.chosen, ["disc_angle"]);
        assert_eq!(faint.verdict, Verdict::None);
    }

    #[test]
    fn a_residual_that_nothing_explains_is_unknown_and_the_nearest_name_is_not_given() {
        let strange = Waves { unexplained: 2.5, ..Waves::new(vec![wave("disc_angle", 0.0)]) };
        let judged = strange.judged();
        assert_eq!(judged.verdict, Verdict::Unknown);
        assert!(judged.causes.is_empty());

        let half = Waves { unexplained: 2.5, ..Waves::new(vec![wave("disc_angle", 2.5)]) };
        let judged = half.judged();
        assert_eq!(judged.verdict, Verdict::Unknown);
        assert_eq!(judged.selection.chosen, ["disc_angle"]);
        assert!(judged.causes.is_empty(), "half of the structured residual is left");
        assert!(judged.result().unwrap().effects.is_empty());
        let why = why(&judged, "disc_angle");
        assert!(why.starts_with("the nearest that the library has (disc_angle), but "), "{why}");
    }

    #[test]
    fn two_causes_of_the_same_shape_are_told_to_be_indistinguishable() {
        // Waves of one frequency are one effect under two names: the second has no column of its own to add.
        let judged = Waves {
            twins: Some(("disc_angle", "wear_drift")),
            ..Waves::new(vec![wave("disc_angle", 2.5), wave("wear_drift", 0.0)])
        }
        .judged();
        assert_eq!(judged.verdict, Verdict::Named);
        assert_eq!(judged.indistinguishable.len(), 1, "{:?}", judged.indistinguishable);
        assert!(judged.causes[0].probability < 0.51);
    }

    #[test]
    fn the_reason_against_a_rival_that_scores_better_is_the_one_that_it_was_turned_down_for() {
        let faint = Waves::new(vec![wave("disc_angle", 2.5), wave("viscous_film", 0.15)]).judged();
        let faint = why(&faint, "viscous_film");
        assert!(faint.starts_with("beside disc_angle it explains "), "{faint}");
        // 0.15²/2 of noise's variance.
        let only = " beyond the price of its parameters, but it takes only ";
        assert!(faint.contains(&format!("{only}0.9")) || faint.contains(&format!("{only}1.")), "{faint}");

        let only_trained = Wave { id: "wear_drift", trained: 0.9, held_out: 0.0 };
        let judged = Waves::new(vec![wave("disc_angle", 2.5), only_trained]).judged();
        let untrue = why(&judged, "wear_drift");
        let (trained, held_out) = untrue.split_once(" in log-likelihood on the training logs, but ").unwrap();
        let number = |text: &str| text.split(' ').find_map(|word| word.parse::<f64>().ok()).unwrap();
        // 0.9²/2 of noise's variance: ½ 8000 ln 1.4. Where it is not, the fit brings it in: a wave, worth few values.
        assert!((number(trained) - 1350.0).abs() < 150.0 && number(held_out) < -5.0, "{untrue}");
        assert!(untrue.contains(", where the error goes from "), "{untrue}");

        let names = ["disc_angle", "wear_drift", "viscous_film", "bell_curve"];
        let mut fourth = Waves::new(names.into_iter().map(|id| wave(id, 2.5)).collect()).judged();
        fourth.selection.fits.insert(
            super::super::selection::sorted(&names),
            Arc::new(fourth.analysis.fit(&names, None).unwrap()),
        );
        fourth.rejected.clear();
        fourth.reject();
        let left = names.iter().find(|id| !fourth.selection.chosen.contains(id)).unwrap();
        let left = why(&fourth, left);
        assert!(
            left.ends_with("but 3 effects of one subsystem are the most that logs can tell apart"),
            "{left}"
        );
        for judged in [&fourth, &judged] {
            assert!(judged.rejected.iter().all(|r| (0.0..=0.5).contains(&r.probability)));
        }
    }
}
