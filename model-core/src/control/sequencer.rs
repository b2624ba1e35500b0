//! The experiment as data: for each motor a list of segments, each with a start, a mode and a shape.
//!
//! [`Experiment::prepare`] checks it against the limits of a configuration (`experiment_error.rs` has the reasons of
//! refusal) and turns it into courses per tick. The sequencer then only counts ticks: what it asks for at tick n depends
//! on n alone, so a run is repeated exactly.
//!
//! Left out: reactions to measurements. An experiment is open loop in its references; stopping early is the
//! supervisor's.

use super::config::ControlConfig;
use super::experiment_error::{ExperimentError, Motor};
use super::reference::Course;
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

/// Longest experiment: an hour at 10 kHz.
pub const MAX_DURATION_TICKS: u32 = 36_000_000;

/// Fastest sine, rad/s: above this the drives' lag leaves nothing of it.
const MAX_ANGULAR_FREQUENCY_RAD_S: f32 = 2000.0;

/// An experiment that was checked against the limits, ready to run.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct PreparedExperiment {
    m1: Vec<Stretch<M1Mode>, MAX_SEGMENTS>,
    m2: Vec<Stretch<M2Mode>, MAX_SEGMENTS>,
    duration_ticks: u32,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Stretch<M> {
    start_tick: u32,
    mode: M,
    course: Course,
}

/// What a reference may be.
struct Range {
    name: &'static str,
    low: f32,
    high: f32,
}

impl Experiment {
    /// Checks the experiment against the limits of `config` and prepares its courses.
    ///
    /// # Errors
    /// The first thing that is not allowed, with motor, segment and range.
    pub fn prepare(&self, config: &ControlConfig) -> Result<PreparedExperiment, ExperimentError> {
        if self.duration_ticks == 0 || self.duration_ticks > MAX_DURATION_TICKS {
            return Err(ExperimentError::Duration { ticks: self.duration_ticks });
        }
        let tick_s = config.settings.tick_s;
        let m1_torque = Range { name: "torque_nm", low: 0.0, high: config.m1.torque_limit_nm() };
        let m2_torque = config.m2.torque_limit_nm();
        let m2_torque = Range { name: "torque_nm", low: -m2_torque, high: m2_torque };
        let m2_speed = config.settings.limits.speed_rad_s;
        let m2_speed = Range { name: "speed_rad_s", low: -m2_speed, high: m2_speed };
        Ok(PreparedExperiment {
            m1: prepare(Motor::M1, &self.m1, self.duration_ticks, tick_s, |M1Mode::Torque| &m1_torque)?,
            m2: prepare(Motor::M2, &self.m2, self.duration_ticks, tick_s, |mode| match mode {
                M2Mode::Speed => &m2_speed,
                M2Mode::Torque => &m2_torque,
            })?,
            duration_ticks: self.duration_ticks,
        })
    }
}

fn prepare<'a, M: Copy>(
    motor: Motor,
    segments: &[Segment<M>],
    duration_ticks: u32,
    tick_s: f32,
    range: impl Fn(M) -> &'a Range,
) -> Result<Vec<Stretch<M>, MAX_SEGMENTS>, ExperimentError> {
    let mut stretches = Vec::new();
    let mut last_start = None;
    for (index, segment) in segments.iter().enumerate() {
        let start_tick = segment.start_tick;
        match last_start {
            None if start_tick != 0 => return Err(ExperimentError::FirstStart { motor, start_tick }),
            Some(last) if start_tick <= last => {
                return Err(ExperimentError::NotRising { motor, index, start_tick });
            }
            _ if start_tick >= duration_ticks => {
                return Err(ExperimentError::AfterEnd { motor, index, start_tick, duration_ticks });
            }
            _ => last_start = Some(start_tick),
        }
        check(motor, index, &segment.shape, range(segment.mode))?;
        let stretch = Stretch { start_tick, mode: segment.mode, course: Course::new(&segment.shape, tick_s) };
        // Both lists have the same capacity, so there is always room.
        if stretches.push(stretch).is_err() {
            break;
        }
    }
    if stretches.is_empty() { Err(ExperimentError::Empty { motor }) } else { Ok(stretches) }
}

fn check(motor: Motor, index: usize, shape: &Shape, range: &Range) -> Result<(), ExperimentError> {
    let within = |name: &'static str, value: f32, low: f32, high: f32| {
        if (low..=high).contains(&value) {
            Ok(())
        } else {
            Err(ExperimentError::Value { motor, index, name, value, low, high })
        }
    };
    let reference = |value: f32| within(range.name, value, range.low, range.high);
    match *shape {
        Shape::Constant { value } => reference(value),
        Shape::Ramp { from, to, .. } => reference(from).and_then(|()| reference(to)),
        Shape::Sine { offset, amplitude, angular_frequency_rad_s, phase_rad } => {
            within("angular_frequency_rad_s", angular_frequency_rad_s, 0.0, MAX_ANGULAR_FREQUENCY_RAD_S)?;
            within("phase_rad", phase_rad, -1000.0, 1000.0)?;
            within("amplitude", amplitude, 0.0, range.high - range.low)?;
            reference(offset - amplitude).and_then(|()| reference(offset + amplitude))
        }
    }
}

impl PreparedExperiment {
    /// Its length.
    #[must_use]
    pub fn duration_ticks(&self) -> u32 {
        self.duration_ticks
    }
}

/// What the motors are asked for in one tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Demand {
    pub(crate) m1_torque_nm: f32,
    pub(crate) m2_mode: M2Mode,
    pub(crate) m2: f32,
}

/// The loaded experiment and where in it the run is.
#[derive(Debug, Clone, Default)]
pub(crate) struct Sequencer {
    experiment: PreparedExperiment,
    state: SequencerState,
    elapsed: u32,
    m1_index: usize,
    m2_index: usize,
}

/// The stretch that holds `elapsed`, from `index` on, and its value. One step of the search a tick is enough, because
/// starts rise by at least one tick.
fn value_at<M: Copy>(stretches: &[Stretch<M>], index: &mut usize, elapsed: u32) -> Option<(M, f32)> {
    if stretches.get(*index + 1).is_some_and(|next| elapsed >= next.start_tick) {
        *index += 1;
    }
    let stretch = stretches.get(*index)?;
    Some((stretch.mode, stretch.course.at(elapsed.wrapping_sub(stretch.start_tick))))
}

impl Sequencer {
    pub(crate) fn load(&mut self, experiment: &PreparedExperiment) {
        // Segment by segment: a clone would move the whole capacity, several kilobytes, within one tick.
        let own = &mut self.experiment;
        own.m1.clear();
        own.m2.clear();
        // Both have the capacity of what they take.
        let _ = own.m1.extend_from_slice(&experiment.m1);
        let _ = own.m2.extend_from_slice(&experiment.m2);
        own.duration_ticks = experiment.duration_ticks;
        self.state = SequencerState::Loaded;
        self.elapsed = 0;
    }

    /// Forgets what was loaded.
    pub(crate) fn unload(&mut self) {
        self.state = SequencerState::Empty;
        self.elapsed = 0;
    }

    /// Begins at the beginning; false where nothing is loaded.
    pub(crate) fn start(&mut self) -> bool {
        if self.state == SequencerState::Empty {
            return false;
        }
        (self.state, self.elapsed, self.m1_index, self.m2_index) = (SequencerState::Running, 0, 0, 0);
        true
    }

    /// Ends the run, if there is one.
    pub(crate) fn stop(&mut self) {
        if self.state == SequencerState::Running {
            self.state = SequencerState::Finished;
        }
    }

    /// What is asked for in this tick; nothing where no experiment runs (any more).
    pub(crate) fn step(&mut self) -> Option<Demand> {
        if self.state != SequencerState::Running {
            return None;
        }
        if self.elapsed >= self.experiment.duration_ticks {
            self.state = SequencerState::Finished;
            return None;
        }
        let m1 = value_at(&self.experiment.m1, &mut self.m1_index, self.elapsed);
        let m2 = value_at(&self.experiment.m2, &mut self.m2_index, self.elapsed);
        self.elapsed += 1;
        let ((_, m1_torque_nm), (m2_mode, m2)) = (m1?, m2?);
        Some(Demand { m1_torque_nm, m2_mode, m2 })
    }

    pub(crate) fn state(&self) -> SequencerState {
        self.state
    }

    /// Ticks since the start of the experiment.
    pub(crate) fn elapsed(&self) -> u32 {
        self.elapsed
    }
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
