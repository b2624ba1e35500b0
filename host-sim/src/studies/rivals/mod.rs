//! Which friction model explains the overshoot, and could another one have made the same logs?
//!
//! Every candidate plays the rubber once; every other is fitted to its logs and then predicts logs it has not seen. A small
//! number off the diagonal means that the experiments cannot tell the two apart.

mod answer;
mod candidates;
mod courses;
mod search;
mod separate;
mod tournament;

pub use answer::{answer, separated};
pub use candidates::{Candidate, all};
pub use courses::{Course, Plan};
pub use separate::{Separation, separate};
pub use tournament::{Match, Tournament, play};
