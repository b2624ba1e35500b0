//! The control core: what the firmware runs 10 000 times a second, and the PC runs bit for bit alike.
//!
//! [`tick::step`] is a pure function of (configuration, state, samples). Settings in physical units
//! ([`settings::ControlSettings`]) are checked and prepared once by `build`. No allocation, no `f64` in the loop,
//! no division by constants, no logging: what happened goes into a small queue of events ([`event`]).

mod bridge;
pub mod caps;
#[cfg(test)]
mod closed_loop_tests;
pub mod command;
pub mod config;
mod encoder;
mod encoder_watch;
pub mod event;
pub mod experiment_error;
pub mod fault;
#[cfg(test)]
mod fault_tests;
mod frozen;
mod guard;
mod inputs;
pub mod limit;
mod m1;
mod m2;
mod numbered;
pub mod observer;
pub mod outputs;
mod pi;
#[cfg(test)]
mod random_tests;
mod reference;
pub mod samples;
pub mod sequencer;
#[cfg(test)]
mod sequencer_tests;
pub mod settings;
mod speed;
pub mod supervisor;
#[cfg(test)]
mod supervisor_tests;
#[cfg(test)]
mod testbench;
pub mod tick;
mod torque_loop;
mod torque_watch;
pub mod validate;
#[cfg(test)]
mod validate_tests;

pub use caps::RawCaps;
pub use command::{Command, Refusal, Refused};
pub use config::ControlConfig;
pub use event::{Event, EventKind, Reason};
pub use experiment_error::{ExperimentError, Motor};
pub use fault::{Fault, FaultSet};
pub use limit::{Limit, LimitSet};
pub use observer::{ModelParameters, N_ELEMENTS, ObserverModel};
pub use outputs::{DAC_MAX, DAC_ZERO, Leds, Outputs, Record};
pub use samples::{AdcScan, Samples};
pub use sequencer::{Experiment, M1Mode, M2Mode, PreparedExperiment, Segment, SequencerState, Shape};
pub use settings::ControlSettings;
pub use supervisor::{Mode, Restart};
pub use tick::{ControlState, apply, step};
