//! The contact: friction torque given measured motion and load, with the channels that measure it.

pub mod baseline;
pub mod bins;
pub mod model;
pub mod plan;
pub mod problem;
pub mod witness;
