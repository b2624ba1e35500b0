//! A trial of a diagnosis: what was hidden, what was answered, whether that is right.
//!
//! The answer is read from the text of `diagnosis.json`: nothing of the product is known here.

use std::collections::BTreeMap;

use serde::Deserialize;

use crate::effect::Effect;

/// What a trial hides.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// One effect of the list.
    Single,
    /// Two of them.
    Pair,
    /// One that is not on the list.
    Outside,
    /// None.
    Nothing,
}

impl Kind {
    /// The kind of a case with these effects.
    #[must_use]
    pub fn of(effects: &[Effect]) -> Self {
        match effects {
            [] => Self::Nothing,
            [one] if one.is_known() => Self::Single,
            many if many.iter().all(|effect| effect.is_known()) => Self::Pair,
            _ => Self::Outside,
        }
    }

    /// Heading in the table.
    #[must_use]
    pub fn heading(self) -> &'static str {
        match self {
            Self::Single => "one effect",
            Self::Pair => "two effects",
            Self::Outside => "outside the library",
            Self::Nothing => "no effect",
        }
    }
}

#[derive(Debug, Deserialize)]
struct Cause {
    id: String,
}

#[derive(Debug, Deserialize)]
struct Extended {
    holdout_nrmse: Option<f64>,
    noise_floor_nrmse: Option<f64>,
}

#[derive(Debug, Deserialize)]
struct Diagnosis {
    verdict: String,
    causes: Vec<Cause>,
    indistinguishable: Vec<Vec<String>>,
    extended: Extended,
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
}

impl Answer {
    /// Reads `diagnosis.json`.
    ///
    /// # Errors
    /// Where the text is no diagnosis.
    pub fn parse(text: &str) -> serde_json::Result<Self> {
        let read: Diagnosis = serde_json::from_str(text)?;
        let floor = read.extended.noise_floor_nrmse.filter(|floor| *floor > 0.0);
        Ok(Self {
            verdict: read.verdict,
            causes: read.causes.into_iter().map(|cause| cause.id).collect(),
            indistinguishable: read.indistinguishable,
            over_noise: read.extended.holdout_nrmse.zip(floor).map(|(error, floor)| error / floor),
        })
    }

    /// Whether it is right: the effects and nothing else; `unknown` for what is outside; `none` for nothing.
    #[must_use]
    pub fn is_right(&self, effects: &[Effect]) -> bool {
        match Kind::of(effects) {
            Kind::Nothing => self.verdict == "none",
            Kind::Outside => self.verdict == "unknown",
            Kind::Single | Kind::Pair => {
                let mut named: Vec<&str> = self.causes.iter().map(String::as_str).collect();
                let mut hidden: Vec<&str> = effects.iter().map(|effect| effect.id()).collect();
                named.sort_unstable();
                hidden.sort_unstable();
                self.verdict == "named" && named == hidden
            }
        }
    }

    /// In a word or two.
    #[must_use]
    pub fn words(&self) -> String {
        if self.verdict == "named" { self.causes.join("+") } else { self.verdict.clone() }
    }
}

/// Counts of answers for each thing hidden.
#[derive(Debug, Default)]
pub struct Confusion {
    rows: Vec<Row>,
}

#[derive(Debug)]
struct Row {
    kind: Kind,
    hidden: String,
    right: usize,
    count: usize,
    answers: BTreeMap<String, usize>,
    wall_s: f64,
    near_noise: usize,
}

impl Confusion {
    /// Adds a trial; `None` where there was no answer.
    pub fn add(&mut self, effects: &[Effect], answer: Option<&Answer>, wall_s: f64) {
        let kind = Kind::of(effects);
        let hidden = match effects {
            [] => "none".to_string(),
            some => some.iter().map(|effect| effect.id()).collect::<Vec<_>>().join("+"),
        };
        let at = self.rows.iter().position(|row| row.hidden == hidden).unwrap_or_else(|| {
            let answers = BTreeMap::new();
            self.rows.push(Row { kind, hidden, right: 0, count: 0, answers, wall_s: 0.0, near_noise: 0 });
            self.rows.len() - 1
        });
        let row = &mut self.rows[at];
        let right = answer.is_some_and(|answer| answer.is_right(effects));
        row.count += 1;
        row.right += usize::from(right);
        row.wall_s = row.wall_s.max(wall_s);
        row.near_noise += usize::from(right && answer.and_then(|a| a.over_noise).is_some_and(|x| x <= 1.2));
        let words = answer.map_or("no answer".to_string(), Answer::words);
        *row.answers.entry(words).or_insert(0) += 1;
    }

    /// The table as text: what was hidden, how often the answer was right, the answers, the longest time; sums by kind.
    #[must_use]
    pub fn table(&self) -> String {
        let mut text = String::new();
        for kind in [Kind::Single, Kind::Pair, Kind::Outside, Kind::Nothing] {
            let rows: Vec<&Row> = self.rows.iter().filter(|row| row.kind == kind).collect();
            if rows.is_empty() {
                continue;
            }
            let sum = |pick: fn(&Row) -> usize| rows.iter().map(|row| pick(row)).sum::<usize>();
            let (right, count) = (sum(|row| row.right), sum(|row| row.count));
            let percent = 100.0 * right as f64 / count.max(1) as f64;
            text += &format!("\n{}: {right} of {count} right ({percent:.0} %)", kind.heading());
            if matches!(kind, Kind::Single | Kind::Pair) {
                text += &format!(", {} of these within 1.2 times the noise", sum(|row| row.near_noise));
            }
            text.push('\n');
            for row in rows {
                let mut answers: Vec<(&String, &usize)> = row.answers.iter().collect();
                answers.sort_by(|a, b| b.1.cmp(a.1));
                let answers: Vec<String> = answers.iter().map(|(words, n)| format!("{words} {n}")).collect();
                text += &format!(
                    "  {:34} {:>3}/{:<3} {:5.1} s  {}\n",
                    row.hidden,
                    row.right,
                    row.count,
                    row.wall_s,
                    answers.join(", ")
                );
            }
        }
        text
    }
}
