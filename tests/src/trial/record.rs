//! What is kept of a case: one line of JSON, enough to make the table from.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::effect::Effect;
use crate::trial::{Answer, Kind, Right};
use crate::truth::Truth;

/// Error over that of noise up to which a held-out log counts as predicted.
const NEAR_NOISE: f64 = 1.2;
/// Relative error up to which a parameter counts as recovered, whatever its standard deviation.
const NEAR_TRUTH: f64 = 0.1;
/// Standard deviations in half of a 95 % interval.
const HALF_95: f64 = 1.96;

/// A parameter that truth and answer call by the same name.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Recovered {
    /// effect.parameter
    pub name: String,
    /// True value.
    pub truth: f64,
    /// Value found.
    pub found: f64,
    /// Its standard deviation.
    pub std: Option<f64>,
}

impl Recovered {
    /// Whether the truth is within the 95 % interval, or the value within 10 % of it.
    #[must_use]
    pub fn holds(&self) -> bool {
        let miss = (self.found - self.truth).abs();
        miss <= NEAR_TRUTH * self.truth.abs() || self.std.is_some_and(|std| miss <= HALF_95 * std)
    }
}

/// What was answered, as far as the table needs it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Answered {
    /// `none`, `named`, `unknown`.
    pub verdict: String,
    /// Named causes.
    pub causes: Vec<String>,
    /// Whether it is right.
    pub right: bool,
    /// Whether it is right by a group of indistinguishable effects only.
    pub by_group: bool,
    /// Marginal probabilities stated.
    pub marginals: BTreeMap<String, f64>,
    /// Held-out error over that of noise.
    pub over_noise: Option<f64>,
    /// Mean square left over that of noise.
    pub left_times_noise: Option<f64>,
    /// Parameters that can be compared.
    pub recovered: Vec<Recovered>,
}

/// A case and its answer.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Record {
    /// Which campaign it belongs to: lines of different ones make no table together.
    pub campaign: String,
    /// Which case of the campaign, from 1.
    pub case: usize,
    /// How many the campaign has.
    pub of: usize,
    /// What is hidden.
    pub kind: Kind,
    /// Hidden effects.
    pub hidden: Vec<String>,
    /// Seed of the case.
    pub seed: u64,
    /// Law behind each effect.
    pub laws: BTreeMap<String, String>,
    /// Measured size of each hidden effect.
    pub sizes: BTreeMap<String, f64>,
    /// Whether the rig sticks and slips at 10 rpm; none where there is no contact.
    pub stick_slip: Option<bool>,
    /// Length of a log.
    pub duration_s: f64,
    /// The answer, or none where the command failed.
    pub answer: Option<Answered>,
    /// Why there is none.
    pub failure: Option<String>,
    /// Time of the diagnosis.
    pub wall_s: f64,
}

impl Record {
    /// Name of the case.
    #[must_use]
    pub fn name(&self) -> String {
        format!("{}-{}", self.hides(), self.seed)
    }

    /// What is hidden, in a word.
    #[must_use]
    pub fn hides(&self) -> String {
        if self.hidden.is_empty() { "none".into() } else { self.hidden.join("+") }
    }

    /// The answer in a word or two.
    #[must_use]
    pub fn words(&self) -> String {
        match &self.answer {
            None => "no answer".into(),
            Some(answer) if answer.verdict == "named" => answer.causes.join("+"),
            Some(answer) => answer.verdict.clone(),
        }
    }

    /// Whether the answer is right.
    #[must_use]
    pub fn right(&self) -> bool {
        self.answer.as_ref().is_some_and(|answer| answer.right)
    }

    /// Whether the answer says that there is something.
    #[must_use]
    pub fn detected(&self) -> bool {
        self.answer.as_ref().is_some_and(|answer| answer.verdict != "none")
    }

    /// Whether the held-out log is predicted to 1.2 times the noise; none where the answer does not say.
    #[must_use]
    pub fn near_noise(&self) -> Option<bool> {
        self.answer.as_ref()?.over_noise.map(|ratio| ratio <= NEAR_NOISE)
    }

    /// Mean probability stated for what is true: each hidden effect, `unknown`, or `none`; none where the answer
    /// states none of them.
    #[must_use]
    pub fn probability_of_truth(&self) -> Option<f64> {
        let marginals = &self.answer.as_ref()?.marginals;
        let of = |id: &str| marginals.get(id).copied();
        match self.kind {
            Kind::Nothing => of("none"),
            Kind::Outside => of("unknown"),
            Kind::Single | Kind::Pair => {
                // An effect that is not spoken of has none.
                let sum: f64 = self.hidden.iter().map(|id| of(id).unwrap_or(0.0)).sum();
                (!marginals.is_empty()).then(|| sum / self.hidden.len() as f64)
            }
        }
    }

    /// Every probability stated, with whether it was true.
    #[must_use]
    pub fn statements(&self) -> Vec<(f64, bool)> {
        let Some(answer) = &self.answer else { return Vec::new() };
        let is_true = |id: &String| match id.as_str() {
            "none" => self.kind == Kind::Nothing,
            "unknown" => self.kind == Kind::Outside,
            _ => self.hidden.contains(id),
        };
        answer.marginals.iter().map(|(id, p)| (*p, is_true(id))).collect()
    }
}

impl Answered {
    /// Judges an answer by the truth.
    #[must_use]
    pub fn new(answer: &Answer, effects: &[Effect], truth: &Truth) -> Self {
        let right = answer.right(effects);
        Self {
            verdict: answer.verdict.clone(),
            causes: answer.causes.clone(),
            right: right != Right::No,
            by_group: right == Right::ByGroup,
            marginals: answer.marginals.clone(),
            over_noise: answer.over_noise,
            left_times_noise: answer.left_times_noise,
            recovered: recovered(answer, effects, truth),
        }
    }
}

fn recovered(answer: &Answer, effects: &[Effect], truth: &Truth) -> Vec<Recovered> {
    let json = |value: serde_json::Result<serde_json::Value>| value.unwrap_or_default();
    let laws = json(serde_json::to_value(&truth.laws));
    let friction = json(serde_json::to_value(&truth.friction));
    let mut list = Vec::new();
    for effect in effects {
        let Some(found) = answer.parameters.get(effect.id()) else { continue };
        for (name, (value, std)) in found {
            // The numbers of a hidden block stand with the friction.
            let block = *effect == Effect::ElementCompliance;
            let place = if block { &friction } else { &laws[effect.id()] };
            if let Some(truth) = place.get(name).and_then(serde_json::Value::as_f64) {
                let name = format!("{}.{name}", effect.id());
                list.push(Recovered { name, truth, found: *value, std: *std });
            }
        }
    }
    list
}
