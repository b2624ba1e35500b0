//! Trials of a diagnosis: cases are hidden, diagnosed as a user would have it, and counted.
//!
//! [`campaign`] lists the cases, [`run`] makes one and has it diagnosed, [`answer`] reads the answer, [`record`] is
//! what is kept of a case, [`table`] counts records. [`coverage`] asks the same of a fit's intervals.

pub mod answer;
pub mod campaign;
pub mod coverage;
pub mod progress;
pub mod record;
pub mod run;
pub mod statistics;
pub mod table;

pub use answer::{Answer, Right};

use serde::{Deserialize, Serialize};

use crate::effect::Effect;

/// What a trial hides.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    /// One effect of the list.
    Single,
    /// Two of them, or more.
    Pair,
    /// One that is not on the list.
    Outside,
    /// None.
    Nothing,
}

impl Kind {
    /// Every kind, in the order of the table.
    pub const ALL: [Self; 4] = [Self::Single, Self::Pair, Self::Outside, Self::Nothing];

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
