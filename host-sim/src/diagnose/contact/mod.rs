//! The contact: friction torque given measured motion and load, with the channels that measure it.

pub mod analysis;
pub mod anchors;
pub mod baseline;
pub mod bins;
pub mod evidence;
pub mod model;
pub mod output;
pub mod plan;
pub mod problem;
pub mod restored;
pub mod ringdown;
pub mod ringing;
pub mod witness;

pub use analysis::ContactAnalysis;
