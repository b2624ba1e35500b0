//! From the control core's types to what travels: enumerations become their stable numbers.

use crate::message::{Answer, EventKind, EventMessage};
use model_core::control::{self, Fault, Refused};

impl From<Refused> for Answer {
    fn from(refused: Refused) -> Self {
        Self::Refused { reason: refused.reason.number(), fault: refused.fault.map(Fault::number) }
    }
}

impl From<control::Event> for EventMessage {
    fn from(event: control::Event) -> Self {
        let kind = match event.kind {
            control::EventKind::ModeChanged { from, to, reason } => {
                EventKind::Mode { from: from.number(), to: to.number(), reason: reason.number() }
            }
            control::EventKind::FaultLatched(fault) => EventKind::FaultLatched(fault.number()),
            control::EventKind::FaultCleared(fault) => EventKind::FaultCleared(fault.number()),
            control::EventKind::LimitReached(limit) => EventKind::Limit(limit.number()),
            control::EventKind::CommandRefused(refused) => EventKind::Refused {
                reason: refused.reason.number(),
                fault: refused.fault.map(Fault::number),
            },
            control::EventKind::ExperimentLoaded { duration_ticks } => {
                EventKind::ProgramLoaded { duration_ticks }
            }
            control::EventKind::ConfigChanged => EventKind::ConfigChanged,
            control::EventKind::ModelChanged => EventKind::ModelChanged,
            control::EventKind::TareDone { friction_zero_code, normal_zero_code } => {
                EventKind::Tared { friction_zero_code, normal_zero_code }
            }
            control::EventKind::TareRefused { friction_nm, normal_n } => {
                EventKind::TareRefused { friction_nm, normal_n }
            }
            _ => EventKind::Other,
        };
        Self { tick: event.tick, kind }
    }
}
