//! The control core: what the firmware runs 10 000 times a second, and the PC runs bit for bit alike.
//!
//! [`tick::step`] is a pure function of (configuration, state, samples). Settings in physical units
//! ([`settings::ControlSettings`]) are checked and prepared once by `build`. No allocation, no `f64` in the loop,
//! no division by constants, no logging: what happened goes into a small queue of events ([`event`]).

pub mod command;
pub mod config;
pub mod event;
pub mod fault;
pub mod limit;
mod numbered;
pub mod outputs;
pub mod samples;
pub mod sequencer;
pub mod settings;
pub mod supervisor;
pub mod tick;

pub use command::{Command, Refusal, Refused};
pub use config::ControlConfig;
pub use event::{Event, EventKind, Reason};
pub use fault::{Fault, FaultSet};
pub use limit::{Limit, LimitSet};
pub use outputs::{DAC_MAX, DAC_ZERO, Leds, Outputs, Record};
pub use samples::{AdcScan, Samples};
pub use sequencer::{Experiment, M1Mode, M2Mode, PreparedExperiment, Segment, SequencerState, Shape};
pub use settings::ControlSettings;
pub use supervisor::{Mode, Restart};
pub use tick::{ControlState, apply, step};
