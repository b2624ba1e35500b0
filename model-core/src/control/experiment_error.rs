//! Why an experiment was refused.

use super::sequencer::MAX_DURATION_TICKS;
use core::fmt;

/// A motor of the rig.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Motor {
    /// Presses the elements on the disc.
    M1,
    /// Turns the disc.
    M2,
}

/// What is not allowed in an experiment. Segments count from 0.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum ExperimentError {
    /// No length, or too long.
    Duration {
        /// What was given.
        ticks: u32,
    },
    /// A motor has no segment.
    Empty {
        /// Which motor.
        motor: Motor,
    },
    /// The first segment does not start at tick 0.
    FirstStart {
        /// Which motor.
        motor: Motor,
        /// Where it starts.
        start_tick: u32,
    },
    /// A segment does not start after the one before.
    NotRising {
        /// Which motor.
        motor: Motor,
        /// Which segment.
        index: usize,
        /// Where it starts.
        start_tick: u32,
    },
    /// A segment starts at or after the end.
    AfterEnd {
        /// Which motor.
        motor: Motor,
        /// Which segment.
        index: usize,
        /// Where it starts.
        start_tick: u32,
        /// Where the experiment ends.
        duration_ticks: u32,
    },
    /// A value is outside its range.
    Value {
        /// Which motor.
        motor: Motor,
        /// Which segment.
        index: usize,
        /// Name of the value, with its unit.
        name: &'static str,
        /// The value.
        value: f32,
        /// Smallest allowed.
        low: f32,
        /// Largest allowed.
        high: f32,
    },
}

impl fmt::Display for Motor {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::M1 => "m1",
            Self::M2 => "m2",
        })
    }
}

impl fmt::Display for ExperimentError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Duration { ticks } => {
                write!(f, "duration_ticks = {ticks} is not allowed; allowed: 1 … {MAX_DURATION_TICKS}")
            }
            Self::Empty { motor } => write!(f, "{motor} has no segment; allowed: at least one"),
            Self::FirstStart { motor, start_tick } => {
                write!(f, "{motor} segment 0: start_tick = {start_tick} is not allowed; allowed: 0")
            }
            Self::NotRising { motor, index, start_tick } => write!(
                f,
                "{motor} segment {index}: start_tick = {start_tick} is not allowed; allowed: later than the segment before"
            ),
            Self::AfterEnd { motor, index, start_tick, duration_ticks } => write!(
                f,
                "{motor} segment {index}: start_tick = {start_tick} is not allowed; allowed: below duration_ticks = {duration_ticks}"
            ),
            Self::Value { motor, index, name, value, low, high } => {
                write!(f, "{motor} segment {index}: {name} = {value} is not allowed; allowed: {low} … {high}")
            }
        }
    }
}

impl core::error::Error for ExperimentError {}
