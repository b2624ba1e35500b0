//! From the control core's types to what travels: enumerations become their stable numbers.

use crate::message::{Answer, EventKind, EventMessage};
use crate::telemetry::TelemetryRow;
use model_core::control::{self, Fault, Record, Refused};

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

impl TelemetryRow {
    /// The row of one tick; `sequence` and `cycles` are the sender's.
    #[must_use]
    #[inline]
    pub fn new(record: &Record, sequence: u32, cycles: u32) -> Self {
        Self {
            sequence,
            tick: record.tick,
            m1_torque_ref_nm: record.m1_torque_ref_nm,
            m1_torque_nm: record.m1_torque_nm,
            m1_count: record.m1_count,
            m2_torque_ref_nm: record.m2_torque_ref_nm,
            m2_torque_nm: record.m2_torque_nm,
            m2_count: record.m2_count,
            m2_speed_ref_rad_s: record.m2_speed_ref_rad_s,
            m2_speed_rad_s: record.m2_speed_rad_s,
            normal_force_n: record.normal_force_n,
            friction_torque_nm: record.friction_torque_nm,
            predicted_friction_torque_nm: record.predicted_friction_torque_nm,
            supply_v: record.supply_v,
            mode: record.mode.number(),
            fault: record.fault.map_or(0, Fault::number),
            limits: record.limits.0,
            sequencer: record.sequencer as u8,
            experiment_tick: record.experiment_tick,
            cycles,
        }
    }
}
