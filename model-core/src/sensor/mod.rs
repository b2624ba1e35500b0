//! A strain-gauge sensor, from the part that gives way to the number that is stored: its order, and the second-order system
//! that its mode and its low-pass are.
//!
//! The order is written once, in [`SensorChain`], and the way back beside it, in [`SensorUndo`]. The plant, the prediction, the
//! diagnosis and the observer on the chip say what each stage does to what they pass through it: a sample, or a whole series.

mod chain;
mod range;
mod second_order;

pub use chain::{SensorChain, SensorUndo};
pub use range::{DAMPING_RATIO, DELAY_S, LEAST_GAIN, MODE_HZ, Range};
pub use second_order::{SecondOrder, SecondOrderState};
