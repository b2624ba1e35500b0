//! The experiment as data: for each motor a list of segments, each with a start, a mode and a shape.

use heapless::Vec;

/// The most segments one motor may have.
pub const MAX_SEGMENTS: usize = 64;

/// An experiment in physical units, as it comes from a file or over the link.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Experiment {
    /// Segments of M1; the first starts at tick 0.
    pub m1: Vec<Segment<M1Mode>, MAX_SEGMENTS>,
    /// Segments of M2; the first starts at tick 0.
    pub m2: Vec<Segment<M2Mode>, MAX_SEGMENTS>,
    /// Length of the whole.
    pub duration_ticks: u32,
}

/// A stretch of an experiment for one motor. It lasts until the next one starts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Segment<M> {
    /// Tick of the experiment at which it starts.
    pub start_tick: u32,
    /// What is controlled, which gives the shape its unit.
    pub mode: M,
    /// Course of the reference.
    pub shape: Shape,
}

/// What M1 can be asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum M1Mode {
    /// Torque, N·m.
    Torque,
}

/// What M2 can be asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum M2Mode {
    /// Speed, rad/s.
    Speed,
    /// Torque, N·m.
    Torque,
}

/// Course of a reference, in the unit of its mode. Time counts from the start of the segment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Shape {
    /// The same value throughout.
    Constant {
        /// The value.
        value: f32,
    },
    /// A straight line, which stays at its end value.
    Ramp {
        /// Value at the start.
        from: f32,
        /// Value at the end.
        to: f32,
        /// Time from start to end.
        ticks: u32,
    },
    /// offset + amplitude · sin(angular_frequency · time + phase)
    Sine {
        /// Mean value.
        offset: f32,
        /// Amplitude.
        amplitude: f32,
        /// Angular frequency.
        angular_frequency_rad_s: f32,
        /// Phase at the start of the segment.
        phase_rad: f32,
    },
}

/// An experiment that was checked against the limits, ready to run.
#[derive(Debug, Clone, PartialEq)]
pub struct PreparedExperiment {
    pub(crate) duration_ticks: u32,
}

/// Where the sequencer is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(u8)]
pub enum SequencerState {
    /// No experiment is loaded.
    #[default]
    Empty = 0,
    /// An experiment is loaded and waits for its start.
    Loaded = 1,
    /// The experiment runs.
    Running = 2,
    /// The experiment ran to its end or was stopped; it can be started again.
    Finished = 3,
}
