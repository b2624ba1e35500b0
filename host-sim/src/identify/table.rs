//! One table over what the balances found: the hypotheses with their evidence, and which effects could be the model's form.

use super::rest::Contribution;

/// A hypothesis has at most so many causes: more are no explanation but a fit, and what they would explain is left as it is.
pub(super) const MOST_CAUSES: usize = 3;
/// ln of the prior probability that an effect of the library acts: one in fifty.
pub const LOG_PRIOR: f64 = -3.9;
/// Width of the step in ln(size over the model's form) between effects that could be the model's form and real ones.
const SIZE_WIDTH: f64 = 0.25 / 1.7;

/// Which balance.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Part {
    /// Friction torque.
    Friction,
    /// Torque of M2, or the force of a stage.
    Drive,
    /// Torque of M1.
    Pressure,
}

impl Part {
    /// Its name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Friction => "friction",
            Self::Drive => "drive",
            Self::Pressure => "pressure",
        }
    }

    /// What it balances, without its unit.
    pub fn quantity(self) -> &'static str {
        match self {
            Self::Friction => "friction torque",
            Self::Drive => "effort of the drive",
            Self::Pressure => "torque of M1",
        }
    }
}

/// A set of effects in one balance.
#[derive(Debug, Clone)]
pub struct Candidate {
    /// Effects, in alphabetical order.
    pub effects: Vec<&'static str>,
    /// ln evidence, the likelihood with its share.
    pub log_evidence: f64,
    /// Place in the balance's own list.
    pub place: usize,
    /// What each effect does here, in the order of `effects`.
    pub contributions: Vec<Contribution>,
    /// Share of its size that each effect's form here may be wrong by, in the order of `effects`.
    pub forms: Vec<f64>,
    /// Effects that are here what another balance says that they are.
    pub told: Vec<&'static str>,
    /// What this set tells each other balance of its effects.
    pub tells: Vec<(Part, Vec<&'static str>)>,
}

impl Candidate {
    /// From what stands at a place in a balance's list: each effect with the share of its size that its form may be wrong by, and
    /// what it does.
    pub fn new(
        place: usize,
        log_evidence: f64,
        effects: impl Iterator<Item = (&'static str, f64, Contribution)>,
    ) -> Self {
        let mut effects: Vec<(&'static str, f64, Contribution)> = effects.collect();
        effects.sort_by_key(|e| e.0);
        Self {
            effects: effects.iter().map(|e| e.0).collect(),
            log_evidence,
            place,
            contributions: effects.iter().map(|e| e.2).collect(),
            forms: effects.iter().map(|e| e.1).collect(),
            told: Vec::new(),
            tells: Vec::new(),
        }
    }

    /// Whether what a set of another balance hears is what this one tells it.
    fn is_heard_by(&self, part: Part, other: &Self) -> bool {
        let told = self.tells.iter().find(|(to, _)| *to == part).map_or(&[][..], |(_, told)| told);
        told == other.told
    }
}

/// A hypothesis in the table.
#[derive(Debug, Clone)]
pub struct Hypothesis {
    /// Effects, in alphabetical order.
    pub effects: Vec<&'static str>,
    /// ln evidence over all balances, with the prior.
    pub log_weight: f64,
    /// Place of the candidate in each part.
    pub places: Vec<(Part, usize)>,
    /// Largest change of a prediction by each effect, relative to the signal.
    pub sizes: Vec<f64>,
    /// The same over what a change has to exceed.
    pub over_floor: Vec<f64>,
    /// Posterior probability.
    pub probability: f64,
}

impl Hypothesis {
    /// Place of its candidate in a part's own list.
    pub fn place(&self, part: Part) -> Option<usize> {
        self.places.iter().find(|(own, _)| *own == part).map(|(_, place)| *place)
    }

    /// Place of the cause in whose place the other hypothesis has another one, where that is all that they differ in.
    pub fn in_place_of(&self, other: &Self) -> Option<usize> {
        let own = |effect: &&&'static str| !other.effects.contains(effect);
        let mut only = self.effects.iter().filter(own);
        let (first, more) = (only.next()?, only.next());
        let place = self.effects.iter().position(|effect| effect == first);
        place.filter(|_| more.is_none() && self.effects.len() == other.effects.len())
    }

    /// ln evidence over all balances, without the prior of its causes.
    pub fn log_evidence(&self) -> f64 {
        self.log_weight - LOG_PRIOR * self.effects.len() as f64
    }
}

/// An effect that changes less than it would have to.
#[derive(Debug, Clone, Copy)]
pub struct TooSmall {
    /// Its id.
    pub effect: &'static str,
    /// What it changes, relative to the signal.
    pub size: f64,
    /// What it would have to exceed: the form of the model and of a larger cause beside it.
    pub floor: f64,
}

/// Probability that an effect is real that is so many times as large as the form of the model and what is left.
pub fn real(over_floor: f64) -> f64 {
    1.0 / (1.0 + (-over_floor.max(1e-9).ln() / SIZE_WIDTH).exp())
}

fn sorted(mut names: Vec<&'static str>) -> Vec<&'static str> {
    names.sort_unstable();
    names.dedup();
    names
}

/// The best candidates that have no effect but these, one of each part: what the contact says of a channel that another part
/// hears of is so there.
fn within<'c>(parts: &'c [(Part, Vec<Candidate>)], effects: &[&str]) -> Option<Vec<(Part, &'c Candidate)>> {
    let allowed = |c: &&Candidate| c.effects.iter().all(|e| effects.contains(e));
    let ((first, own), others) = parts.split_first()?;
    let mut best: Option<(f64, Vec<(Part, &Candidate)>)> = None;
    for candidate in own.iter().filter(allowed) {
        let mut chosen = vec![(*first, candidate)];
        for (part, candidates) in others {
            let heard = candidates.iter().filter(allowed).filter(|c| candidate.is_heard_by(*part, c));
            let best = heard.max_by(|a, b| a.log_evidence.total_cmp(&b.log_evidence));
            chosen.extend(best.map(|c| (*part, c)));
        }
        let log_evidence = chosen.iter().map(|(_, c)| c.log_evidence).sum();
        if chosen.len() == parts.len() && best.as_ref().is_none_or(|(least, _)| log_evidence > *least) {
            best = Some((log_evidence, chosen));
        }
    }
    best.map(|(_, chosen)| chosen)
}

/// The table of the balances' candidates, the best hypothesis first, and the effects that are too small for it.
pub fn table(parts: &[(Part, Vec<Candidate>)]) -> (Vec<Hypothesis>, Vec<TooSmall>) {
    // Sets: one candidate of each part, put together.
    let mut sets: Vec<Vec<&'static str>> = vec![Vec::new()];
    for (_, candidates) in parts {
        let mut next = Vec::new();
        for set in &sets {
            for candidate in candidates {
                let joined = sorted(set.iter().chain(&candidate.effects).copied().collect());
                if joined.len() <= MOST_CAUSES && !next.contains(&joined) {
                    next.push(joined);
                }
            }
        }
        sets = next;
    }
    let mut all: Vec<Hypothesis> = sets
        .into_iter()
        .filter_map(|effects| {
            let mut log_weight = LOG_PRIOR * effects.len() as f64;
            let mut sizes = vec![0.0f64; effects.len()];
            let mut over_floor = vec![0.0f64; effects.len()];
            let mut places = Vec::new();
            for (part, best) in within(parts, &effects)? {
                log_weight += best.log_evidence;
                places.push((part, best.place));
                for (own, (effect, what)) in best.effects.iter().zip(&best.contributions).enumerate() {
                    let at = effects.iter().position(|e| e == effect)?;
                    let others = best
                        .contributions
                        .iter()
                        .zip(&best.forms)
                        .enumerate()
                        .filter(|(other, _)| *other != own);
                    let wrong_by = others.map(|(_, (other, form))| other.size * form).fold(0.0, f64::max);
                    sizes[at] = sizes[at].max(what.size);
                    // What a second cause adds may be the first one's form.
                    let over = what.over_form(wrong_by);
                    over_floor[at] = over_floor[at].max(over);
                }
            }
            Some(Hypothesis { effects, log_weight, places, sizes, over_floor, probability: 0.0 })
        })
        .collect();
    all.sort_by(|a, b| b.log_weight.total_cmp(&a.log_weight));
    // A hypothesis with an effect below what is known is taken out of the table: beside another cause the effect may be told.
    let mut too_small: Vec<TooSmall> = Vec::new();
    while let Some((at, over)) = all.first().and_then(|best| {
        let below = best.over_floor.iter().copied().enumerate().filter(|(_, over)| *over < 1.0);
        below.min_by(|a, b| a.1.total_cmp(&b.1))
    }) {
        let best = all.remove(0);
        let (effect, size) = (best.effects[at], best.sizes[at]);
        if too_small.iter().all(|known| known.effect != effect) {
            too_small.push(TooSmall { effect, size, floor: size / over.max(1e-12) });
        }
    }
    too_small.retain(|known| all.first().is_none_or(|best| !best.effects.contains(&known.effect)));
    let top = all.first().map_or(0.0, |h| h.log_weight);
    all.iter_mut().for_each(|h| h.probability = (h.log_weight - top).exp());
    hand_down(&mut all);
    let mass: f64 = all.iter().map(|h| h.probability).sum();
    all.iter_mut().for_each(|h| h.probability /= mass);
    (all, too_small)
}

/// As far as an effect of a set may be the model's form, the set without it has its probability, and where that one was taken out
/// none has it: the largest sets first.
fn hand_down(all: &mut [Hypothesis]) {
    for size in (1..=MOST_CAUSES).rev() {
        for at in (0..all.len()).filter(|at| all[*at].effects.len() == size).collect::<Vec<_>>() {
            let doubted = all[at].over_floor.iter().map(|over| 1.0 - real(*over)).enumerate();
            let Some((effect, doubt)) = doubted.max_by(|a, b| a.1.total_cmp(&b.1)) else { continue };
            let mut left = all[at].effects.clone();
            left.remove(effect);
            let handed = doubt * all[at].probability;
            all[at].probability -= handed;
            if let Some(without) = all.iter().position(|h| h.effects == left) {
                all[without].probability += handed;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::identify::contact::noise::MODEL_FORM;
    use crate::identify::law_form::LAW_FORM;

    #[test]
    fn a_small_cause_that_leaves_more_than_it_explains_is_a_form() {
        // Two sets in one balance; the evidence of the second cause is sure.
        let told = |size: f64, over_rest: f64| {
            let candidate = |effects: &[&'static str], log_evidence: f64, place: usize| Candidate {
                effects: effects.to_vec(),
                log_evidence,
                place,
                contributions: [
                    Contribution { size: 0.1, over_rest: 9.0, known: MODEL_FORM },
                    Contribution { size, over_rest, known: MODEL_FORM },
                ][..effects.len()]
                    .to_vec(),
                forms: vec![LAW_FORM; effects.len()],
                told: Vec::new(),
                tells: Vec::new(),
            };
            let candidates = vec![candidate(&["a", "b"], 50.0, 0), candidate(&["a"], 0.0, 1)];
            table(&[(Part::Friction, candidates)]).0[0].clone()
        };
        assert_eq!(told(0.02, 3.0).effects, ["a", "b"]);
        assert!(told(0.02, 3.0).probability > 0.98);
        // One that leaves nearly twice what it explains: hardly better than even odds.
        assert!((0.5..0.7).contains(&told(0.02, 0.55).probability));
        assert_eq!(told(0.02, 0.4).effects, ["a"]);
        // One that explains all that the larger cause leaves has a shape of its own, though it is smaller than a law may be wrong.
        assert_eq!(told(0.005, 9.0).effects, ["a", "b"]);
        assert_eq!(told(0.005, 1.0).effects, ["a"]);
        // But nothing is smaller than what the form of the model is known to.
        assert_eq!(told(0.0035, 99.0).effects, ["a"]);
        // A large one is none, whatever another cause leaves beside it.
        assert_eq!(told(0.05, 0.1).effects, ["a", "b"]);
    }

    #[test]
    fn a_cause_that_is_none_alone_may_be_one_beside_another() {
        let candidate = |place, log_evidence: f64, effects: &[(&'static str, f64)]| {
            let of = |(effect, over_rest): &(&'static str, f64)| {
                (*effect, LAW_FORM, Contribution { size: 0.01, over_rest: *over_rest, known: MODEL_FORM })
            };
            Candidate::new(place, log_evidence, effects.iter().map(of))
        };
        // Alone it leaves more than it explains: what the other cause does.
        let found = |beside: f64| {
            let pair = [("large", 2.0), ("small", beside)];
            let candidates = vec![
                candidate(0, 0.0, &[]),
                candidate(1, 100.0, &[("small", 0.3)]),
                candidate(2, 101.0, &pair),
                // Nor is it one beside a trace of a third one, and what that set has is no other's.
                candidate(3, 101.0, &[("small", 0.3), ("trace", 0.1)]),
            ];
            let (all, too_small) = table(&[(Part::Friction, candidates)]);
            let too_small: Vec<&str> = too_small.iter().map(|small| small.effect).collect();
            (all[0].effects.clone(), all[0].probability, too_small)
        };
        let (effects, probability, too_small) = found(1.0);
        assert_eq!((effects, too_small), (vec!["large", "small"], vec![]));
        // Both sets have the same evidence: each counts as far as it is real, 2.5 and 0.83 times what a form may be.
        let expected = real(2.5) / (real(2.5) + real(0.01 / (3.0 * MODEL_FORM)));
        assert!((probability - expected).abs() < 1e-9 && expected > 0.8, "{probability} for {expected}");
        let (effects, _, too_small) = found(0.3);
        assert_eq!((effects, too_small), (vec![], vec!["small"]));
    }

    #[test]
    fn what_the_contact_says_of_its_channel_is_so_in_the_balance_that_hears_of_it() {
        // Two causes explain the contact as well as each other; one of them is an error of the channel that M1 bears.
        let candidate = |place, effects: &[&'static str], log_evidence: f64, told: &[&'static str]| {
            let large = Contribution { size: 0.1, over_rest: 9.0, known: MODEL_FORM };
            let named = effects.iter().map(|effect| (*effect, LAW_FORM, large));
            Candidate { told: told.to_vec(), ..Candidate::new(place, log_evidence, named) }
        };
        let found = |with_error: f64| {
            let contact = vec![
                Candidate {
                    tells: vec![(Part::Drive, Vec::new()), (Part::Pressure, vec!["channel"])],
                    ..candidate(0, &["channel"], 501.0, &[])
                },
                candidate(1, &["law"], 500.0, &[]),
                candidate(2, &[], 0.0, &[]),
            ];
            let heard = |with_error: f64| {
                vec![candidate(0, &[], 0.0, &[]), candidate(1, &["channel"], with_error, &["channel"])]
            };
            // The drive has heard of the same effect as an error of its own channel: that is another one.
            let parts =
                [(Part::Friction, contact), (Part::Drive, heard(900.0)), (Part::Pressure, heard(with_error))];
            let best = table(&parts).0[0].clone();
            (best.effects, best.places[1].1, best.places[2].1)
        };
        // M1 says which of the two it is, and what is named stands in it.
        assert_eq!(found(-300.0), (vec!["law"], 0, 0));
        assert_eq!(found(300.0), (vec!["channel"], 0, 1));
    }

    #[test]
    fn what_may_be_a_form_is_the_set_without_it() {
        let set = |effects: &[&'static str], over_floor: &[f64], probability: f64| Hypothesis {
            effects: effects.to_vec(),
            log_weight: 0.0,
            places: Vec::new(),
            sizes: vec![0.1; effects.len()],
            over_floor: over_floor.to_vec(),
            probability,
        };
        // The second cause is as large as the first one's form may be wrong by: even odds, however sure its evidence is.
        let mut all = [set(&["a", "b"], &[50.0, 1.0], 1.0), set(&["a"], &[50.0], 0.0), set(&[], &[], 0.0)];
        hand_down(&mut all);
        let found = all.each_ref().map(|h| h.probability);
        assert!(
            (found[0] - 0.5).abs() < 1e-9 && (found[1] - 0.5).abs() < 1e-9 && found[2] < 1e-9,
            "{found:?}"
        );
    }
}
