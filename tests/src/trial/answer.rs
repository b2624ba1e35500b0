//! What a diagnosis answered, read from the text of `diagnosis.json`: nothing of the product is known here.

use std::collections::BTreeMap;

use serde::Deserialize;

use crate::effect::Effect;
use crate::trial::Kind;

#[derive(Debug, Deserialize)]
struct Estimate {
    value: Option<f64>,
    std: Option<f64>,
}

#[derive(Debug, Deserialize)]
struct Cause {
    id: String,
    probability: Option<f64>,
    #[serde(default)]
    parameters: BTreeMap<String, Estimate>,
}

#[derive(Debug, Deserialize)]
struct Rejected {
    id: String,
    probability: Option<f64>,
}

#[derive(Debug, Deserialize)]
struct Extended {
    holdout_nrmse: Option<f64>,
    noise_floor_nrmse: Option<f64>,
}

#[derive(Debug, Deserialize)]
struct Remaining {
    times_noise: Option<f64>,
}

#[derive(Debug, Deserialize)]
struct Diagnosis {
    verdict: String,
    causes: Vec<Cause>,
    #[serde(default)]
    rejected: Vec<Rejected>,
    #[serde(default)]
    indistinguishable: Vec<Vec<String>>,
    extended: Extended,
    posterior: Option<BTreeMap<String, f64>>,
    remaining: Option<Remaining>,
}

/// What was answered.
#[derive(Debug, Clone, PartialEq)]
pub struct Answer {
    /// `none`, `named`, `unknown`.
    pub verdict: String,
    /// Named causes in their order.
    pub causes: Vec<String>,
    /// Groups that the logs do not tell apart.
    pub indistinguishable: Vec<Vec<String>>,
    /// Error of the extended model over that of noise alone, on the held-out log.
    pub over_noise: Option<f64>,
    /// Marginal probability of each effect spoken of, and of `none` and `unknown` where they are stated.
    pub marginals: BTreeMap<String, f64>,
    /// (value, standard deviation) of each parameter of each cause.
    pub parameters: BTreeMap<String, BTreeMap<String, (f64, Option<f64>)>>,
    /// What is left over the noise, as a ratio of mean squares.
    pub left_times_noise: Option<f64>,
}

/// How an answer is right.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Right {
    /// It is not.
    No,
    /// By what it names.
    ByName,
    /// By a group stated as indistinguishable in which the hidden effect stands beside the one named.
    ByGroup,
}

impl Answer {
    /// Reads `diagnosis.json`.
    ///
    /// # Errors
    /// Where the text is no diagnosis.
    pub fn parse(text: &str) -> serde_json::Result<Self> {
        let read: Diagnosis = serde_json::from_str(text)?;
        let floor = read.extended.noise_floor_nrmse.filter(|floor| *floor > 0.0);
        let mut marginals = BTreeMap::new();
        if let Some(posterior) = &read.posterior {
            for (hypothesis, probability) in posterior {
                for id in hypothesis.split('+') {
                    *marginals.entry(id.to_string()).or_insert(0.0) += probability;
                }
            }
        } else {
            // Before there was a posterior: what stands beside the causes and the rejected.
            let causes = read.causes.iter().map(|cause| (&cause.id, cause.probability));
            for (id, probability) in causes.chain(read.rejected.iter().map(|r| (&r.id, r.probability))) {
                marginals.extend(probability.map(|p| (id.clone(), p)));
            }
        }
        let estimates = |cause: &Cause| {
            let known = cause.parameters.iter();
            known.filter_map(|(name, e)| Some((name.clone(), (e.value?, e.std)))).collect()
        };
        Ok(Self {
            verdict: read.verdict,
            parameters: read.causes.iter().map(|cause| (cause.id.clone(), estimates(cause))).collect(),
            causes: read.causes.into_iter().map(|cause| cause.id).collect(),
            indistinguishable: read.indistinguishable,
            over_noise: read.extended.holdout_nrmse.zip(floor).map(|(error, floor)| error / floor),
            marginals,
            left_times_noise: read.remaining.and_then(|remaining| remaining.times_noise),
        })
    }

    /// Whether it is right: the effects and nothing else; `unknown` for what is outside; `none` for nothing.
    #[must_use]
    pub fn is_right(&self, effects: &[Effect]) -> bool {
        self.right(effects) != Right::No
    }

    /// How it is right: as many causes as effects, each cause a hidden effect or in one group with it.
    #[must_use]
    pub fn right(&self, effects: &[Effect]) -> Right {
        let by_name = |right: bool| if right { Right::ByName } else { Right::No };
        match Kind::of(effects) {
            Kind::Nothing => by_name(self.verdict == "none"),
            Kind::Outside => by_name(self.verdict == "unknown"),
            Kind::Single | Kind::Pair => {
                if self.verdict != "named" || self.causes.len() != effects.len() {
                    return Right::No;
                }
                let hidden: Vec<&str> = effects.iter().map(|effect| effect.id()).collect();
                let missed: Vec<&str> =
                    hidden.iter().copied().filter(|id| !self.causes.iter().any(|c| c == id)).collect();
                let wrong: Vec<&String> =
                    self.causes.iter().filter(|cause| !hidden.contains(&cause.as_str())).collect();
                if missed.is_empty() {
                    return Right::ByName;
                }
                if self.each_grouped(&missed, &wrong) { Right::ByGroup } else { Right::No }
            }
        }
    }

    /// Whether the causes can be matched with the effects so that each two of a kind share a group.
    fn each_grouped(&self, missed: &[&str], wrong: &[&String]) -> bool {
        let Some((first, rest)) = missed.split_first() else { return true };
        (0..wrong.len()).any(|i| {
            let together =
                |group: &&Vec<String>| group.contains(wrong[i]) && group.iter().any(|id| id == first);
            let others: Vec<&String> =
                wrong.iter().enumerate().filter(|(j, _)| *j != i).map(|(_, cause)| *cause).collect();
            self.indistinguishable.iter().any(|group| together(&group)) && self.each_grouped(rest, &others)
        })
    }

    /// In a word or two.
    #[must_use]
    pub fn words(&self) -> String {
        if self.verdict == "named" { self.causes.join("+") } else { self.verdict.clone() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn answer(verdict: &str, causes: &[&str], groups: &[&[&str]]) -> Answer {
        let text = serde_json::json!({
            "verdict": verdict,
            "causes": causes.iter().map(|id| serde_json::json!({
                "id": id, "probability": 0.9, "parameters": {"delay_s": {"value": 0.004, "std": 1e-4}}
            })).collect::<Vec<_>>(),
            "rejected": [{"id": "wear_drift", "probability": 0.02, "why": ""}],
            "indistinguishable": groups,
            "extended": {"holdout_nrmse": 0.011, "gain": 0.5, "noise_floor_nrmse": 0.01},
        });
        Answer::parse(&text.to_string()).unwrap()
    }

    #[test]
    fn right_is_the_effects_and_nothing_else() {
        let one = [Effect::FrictionDelay];
        let two = [Effect::FrictionDelay, Effect::WearDrift];
        assert_eq!(answer("named", &["friction_delay"], &[]).right(&one), Right::ByName);
        assert_eq!(answer("named", &["wear_drift"], &[]).right(&one), Right::No);
        assert_eq!(answer("named", &["friction_delay", "wear_drift"], &[]).right(&one), Right::No);
        assert_eq!(answer("named", &["wear_drift", "friction_delay"], &[]).right(&two), Right::ByName);
        assert_eq!(answer("unknown", &["friction_delay"], &[]).right(&one), Right::No);
        assert!(answer("unknown", &[], &[]).is_right(&[Effect::MainsHum]));
        assert!(answer("none", &[], &[]).is_right(&[]));
    }

    #[test]
    fn a_group_counts_for_the_one_named_beside_the_hidden_effect_and_for_no_other() {
        let groups: &[&[&str]] = &[&["torque_offset", "bearing_asymmetry"]];
        let hidden = [Effect::BearingAsymmetry];
        assert_eq!(answer("named", &["torque_offset"], groups).right(&hidden), Right::ByGroup);
        assert_eq!(answer("named", &["torque_offset"], &[]).right(&hidden), Right::No);
        assert_eq!(answer("named", &["backlash"], groups).right(&hidden), Right::No);
        assert_eq!(answer("named", &["torque_offset", "backlash"], groups).right(&hidden), Right::No);
        let pair = [Effect::BearingAsymmetry, Effect::Backlash];
        assert_eq!(answer("named", &["torque_offset", "backlash"], groups).right(&pair), Right::ByGroup);
    }

    #[test]
    fn marginals_are_sums_over_the_hypotheses_that_hold_the_effect() {
        let text = r#"{"verdict": "named", "causes": [], "extended": {},
            "posterior": {"none": 0.1, "a": 0.5, "a+b": 0.3, "unknown": 0.1}}"#;
        let marginals = Answer::parse(text).unwrap().marginals;
        assert!((marginals["a"] - 0.8).abs() < 1e-12 && (marginals["b"] - 0.3).abs() < 1e-12);
        assert!((marginals["none"] - 0.1).abs() < 1e-12);
        // Without a posterior: causes and rejected.
        let marginals = answer("named", &["friction_delay"], &[]).marginals;
        assert!((marginals["friction_delay"] - 0.9).abs() < 1e-12);
        assert!((marginals["wear_drift"] - 0.02).abs() < 1e-12);
    }
}
