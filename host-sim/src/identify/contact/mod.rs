//! The contact: friction torque from motion and load, with the slip observed from the measured force.

pub mod baseline;
mod bristles;
pub mod change;
pub mod channel;
pub mod ends;
pub mod law;
pub mod log;
mod motion;
pub(in crate::identify) mod noise;
pub mod observer;
pub mod problem;
mod reset;
pub mod ringing;
pub mod search;
pub mod smoothing;
mod struck_mode;
