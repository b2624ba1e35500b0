//! Events: one for each change of state, with its reason, for the log outside the control interrupt.

use super::command::Refused;
use super::fault::Fault;
use super::limit::Limit;
use super::numbered::numbered;
use super::supervisor::Mode;
use heapless::Deque;

/// How many events wait for the log at most.
pub const EVENT_CAPACITY: usize = 32;

/// Something that happened in one tick.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Event {
    /// The tick in which it happened.
    pub tick: u64,
    /// What happened.
    pub kind: EventKind,
}

/// What happened.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum EventKind {
    /// The supervisor changed its mode.
    ModeChanged {
        /// The mode left.
        from: Mode,
        /// The mode entered.
        to: Mode,
        /// Why.
        reason: Reason,
    },
    /// A fault was latched.
    FaultLatched(Fault),
    /// A latched fault was cleared.
    FaultCleared(Fault),
    /// A limit began to act, for the first time in this run.
    LimitReached(Limit),
    /// A command was refused.
    CommandRefused(Refused),
    /// An experiment was taken for the next start.
    ExperimentLoaded {
        /// Its length.
        duration_ticks: u32,
    },
    /// A new configuration is in force.
    ConfigChanged,
    /// The observer runs another model.
    ModelChanged,
    /// Both bridges have new zeros, in codes.
    TareDone {
        /// Zero of the friction bridge.
        friction_zero_code: f32,
        /// Zero of the normal force bridge.
        normal_zero_code: f32,
    },
    /// A tare was broken off because the rig began to move.
    TareAborted,
    /// The bridges read too far from zero to tare; nothing was changed.
    TareRefused {
        /// What the friction bridge read on average.
        friction_nm: f32,
        /// What the normal force bridge read on average.
        normal_n: f32,
    },
}

numbered! {
    /// Why the mode changed.
    pub enum Reason {
        SelfCheckDone = 1, "The self-check after the start is done.";
        ArmCommand = 2, "Armed by command, with the arm switch on.";
        DisarmCommand = 3, "Disarmed by command.";
        ArmSwitchOff = 4, "The arm switch was turned off.";
        StartCommand = 5, "Started by command.";
        StopCommand = 6, "Stopped by command.";
        ExperimentFinished = 7, "The experiment came to its end.";
        AtRest = 8, "Both motors are at rest.";
        StopTimeout = 9, "The disc did not come to rest in the allowed time.";
        FaultLatched = 10, "A fault was latched.";
        FaultCleared = 11, "All latched faults were cleared by command.";
    }
}

/// Events that wait for the log. When it is full new events are counted, not kept.
#[derive(Debug, Clone, Default)]
pub struct EventQueue {
    waiting: Deque<Event, EVENT_CAPACITY>,
    lost: u32,
}

impl EventQueue {
    pub(crate) fn push(&mut self, tick: u64, kind: EventKind) {
        if self.waiting.push_back(Event { tick, kind }).is_err() {
            self.lost = self.lost.saturating_add(1);
        }
    }
    /// The oldest event that waits.
    pub fn pop(&mut self) -> Option<Event> {
        self.waiting.pop_front()
    }
    /// How many events were lost because nobody took them.
    #[must_use]
    pub fn lost(&self) -> u32 {
        self.lost
    }
}
