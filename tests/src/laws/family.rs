//! Which of the laws of an effect are drawn.
//!
//! Each effect has several laws from the literature. One of them is *reserved*: it is drawn only where it
//! is asked for, so that a published table can be measured on laws that nobody developed on.

use clap::ValueEnum;
use serde::Serialize;

use crate::random::Stream;

/// Laws to draw from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum LawFamily {
    /// The laws to develop on.
    #[default]
    Common,
    /// The law kept for the final table.
    Reserved,
}

impl LawFamily {
    /// One of the common laws, or the reserved one.
    pub fn pick<T: Copy>(self, s: &mut Stream, common: &[T], reserved: T) -> T {
        // The same number of draws either way, so that what follows does not depend on the family.
        let drawn = s.pick(common);
        match self {
            Self::Common => drawn,
            Self::Reserved => reserved,
        }
    }
}

/// Relative size of an effect: RMS of what it changes over RMS of the channel, as a target for the
/// amplitudes of the laws. What a log really shows is measured and stands in the truth.
pub fn size(s: &mut Stream) -> f64 {
    s.log_uniform(0.02, 0.15)
}
