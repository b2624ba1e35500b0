//! An experiment on its way to the rig: a header, then one message a segment, then the commit.
//!
//! Segments travel one by one so that a frame stays small; the firmware collects them in order and
//! checks the whole at the commit.

use model_core::control::{Experiment, M1Mode, M2Mode, Segment, Shape};
use serde::{Deserialize, Serialize};

/// What is going to be uploaded.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct ProgramHeader {
    /// Length of the experiment.
    pub duration_ticks: u32,
    /// Number of M1's segments.
    pub m1_segments: u8,
    /// Number of M2's segments.
    pub m2_segments: u8,
}

/// One segment of one motor.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ProgramSegment {
    /// Tick of the experiment at which it starts.
    pub start_tick: u32,
    /// Which motor, and what is controlled.
    pub mode: ProgramMode,
    /// Course of the reference, in the unit of the mode.
    pub shape: ProgramShape,
}

/// Motor and controlled quantity.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum ProgramMode {
    /// Torque of M1, N·m.
    M1Torque,
    /// Speed of M2, rad/s.
    M2Speed,
    /// Torque of M2, N·m.
    M2Torque,
}

/// Course of a reference, as in `model_core::control::Shape`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum ProgramShape {
    /// The same value throughout.
    Constant {
        /// The value.
        value: f32,
    },
    /// A straight line.
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
        /// Phase at the start.
        phase_rad: f32,
    },
}

impl From<Shape> for ProgramShape {
    fn from(shape: Shape) -> Self {
        match shape {
            Shape::Constant { value } => Self::Constant { value },
            Shape::Ramp { from, to, ticks } => Self::Ramp { from, to, ticks },
            Shape::Sine { offset, amplitude, angular_frequency_rad_s, phase_rad } => {
                Self::Sine { offset, amplitude, angular_frequency_rad_s, phase_rad }
            }
        }
    }
}

impl From<ProgramShape> for Shape {
    fn from(shape: ProgramShape) -> Self {
        match shape {
            ProgramShape::Constant { value } => Self::Constant { value },
            ProgramShape::Ramp { from, to, ticks } => Self::Ramp { from, to, ticks },
            ProgramShape::Sine { offset, amplitude, angular_frequency_rad_s, phase_rad } => {
                Self::Sine { offset, amplitude, angular_frequency_rad_s, phase_rad }
            }
        }
    }
}

/// The header of `experiment`.
#[must_use]
#[allow(clippy::cast_possible_truncation)] // at most MAX_SEGMENTS = 64 a motor
pub fn header(experiment: &Experiment) -> ProgramHeader {
    ProgramHeader {
        duration_ticks: experiment.duration_ticks,
        m1_segments: experiment.m1.len() as u8,
        m2_segments: experiment.m2.len() as u8,
    }
}

/// The segments of `experiment` in the order in which they are sent.
pub fn segments(experiment: &Experiment) -> impl Iterator<Item = ProgramSegment> {
    let m1 = experiment.m1.iter().map(|segment| ProgramSegment {
        start_tick: segment.start_tick,
        mode: match segment.mode {
            M1Mode::Torque => ProgramMode::M1Torque,
        },
        shape: segment.shape.into(),
    });
    let m2 = experiment.m2.iter().map(|segment| ProgramSegment {
        start_tick: segment.start_tick,
        mode: match segment.mode {
            M2Mode::Speed => ProgramMode::M2Speed,
            M2Mode::Torque => ProgramMode::M2Torque,
        },
        shape: segment.shape.into(),
    });
    m1.chain(m2)
}

/// Collects an upload.
#[derive(Debug, Clone, Default)]
pub struct Upload {
    header: Option<ProgramHeader>,
    experiment: Experiment,
}

/// The upload is not what its header said: too many, too few, or out of order.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Incomplete;

impl Upload {
    /// Forgets what there was and waits for the segments of `header`.
    pub fn begin(&mut self, header: ProgramHeader) {
        self.header = Some(header);
        self.experiment.m1.clear();
        self.experiment.m2.clear();
        self.experiment.duration_ticks = header.duration_ticks;
    }

    /// Takes the next segment.
    ///
    /// # Errors
    /// The segment was not announced, or M1's came after M2's. The upload must be begun again.
    pub fn push(&mut self, segment: &ProgramSegment) -> Result<(), Incomplete> {
        let taken = self.try_push(segment);
        if taken.is_err() {
            self.header = None;
        }
        taken
    }

    fn try_push(&mut self, segment: &ProgramSegment) -> Result<(), Incomplete> {
        let header = self.header.ok_or(Incomplete)?;
        let ProgramSegment { start_tick, mode, shape } = *segment;
        let shape = shape.into();
        let (m1, m2) = (&mut self.experiment.m1, &mut self.experiment.m2);
        let m2_mode = match mode {
            ProgramMode::M1Torque => {
                if m1.len() >= usize::from(header.m1_segments) || !m2.is_empty() {
                    return Err(Incomplete);
                }
                let mode = M1Mode::Torque;
                return m1.push(Segment { start_tick, mode, shape }).map_err(|_| Incomplete);
            }
            ProgramMode::M2Speed => M2Mode::Speed,
            ProgramMode::M2Torque => M2Mode::Torque,
        };
        let announced =
            m1.len() == usize::from(header.m1_segments) && m2.len() < usize::from(header.m2_segments);
        if !announced {
            return Err(Incomplete);
        }
        m2.push(Segment { start_tick, mode: m2_mode, shape }).map_err(|_| Incomplete)
    }

    /// The experiment, once all of it is there.
    ///
    /// # Errors
    /// Segments are missing.
    pub fn complete(&self) -> Result<&Experiment, Incomplete> {
        let header = self.header.ok_or(Incomplete)?;
        if crate::program::header(&self.experiment) == header {
            Ok(&self.experiment)
        } else {
            Err(Incomplete)
        }
    }
}
