//! Telemetry: a row of SI values for each n-th control tick, and slow counters of the rig's health.
//!
//! A row holds what a line of the log needs. Positions travel as counts, so that the host's angles do
//! not drift and lose no digit. Rows are numbered where the control tick offers them: a gap in the
//! numbers is a lost row, whoever lost it.
//!
//! A channel is declared here and nowhere else: its member of the row, where its value comes from in
//! [`TelemetryRow::new`], and its column of the log in [`CHANNELS`]. A new one goes to the end of the row, raises
//! [`crate::message::PROTOCOL_VERSION`] and changes the bytes in `tests/frames.rs`.

use model_core::control::{Fault, Record};
use model_core::real::Real;
use serde::{Deserialize, Serialize};

/// One row.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct TelemetryRow {
    /// Number of the row since telemetry was switched on.
    pub sequence: u32,
    /// Control tick since the start of the firmware.
    pub tick: u64,
    /// Torque M1 is asked for.
    pub m1_torque_ref_nm: f32,
    /// Torque of M1 by its monitor.
    pub m1_torque_nm: f32,
    /// Position of M1.
    pub m1_count: i64,
    /// Torque M2 is asked for.
    pub m2_torque_ref_nm: f32,
    /// Torque of M2 by its monitor.
    pub m2_torque_nm: f32,
    /// Position of M2.
    pub m2_count: i64,
    /// Speed M2 is asked for.
    pub m2_speed_ref_rad_s: f32,
    /// Estimated speed of M2.
    pub m2_speed_rad_s: f32,
    /// Normal force.
    pub normal_force_n: f32,
    /// Friction torque.
    pub friction_torque_nm: f32,
    /// Friction torque the observer's model predicts.
    pub predicted_friction_torque_nm: f32,
    /// Supply voltage.
    pub supply_v: f32,
    /// Number of the mode.
    pub mode: u8,
    /// Number of the fault latched first, 0 for none.
    pub fault: u8,
    /// Limits that act, as a set of numbers.
    pub limits: u16,
    /// State of the sequencer.
    pub sequencer: u8,
    /// Ticks of the experiment so far, this one included: 1 in its first.
    pub experiment_tick: u32,
    /// Processor cycles from entry to exit of the last tick.
    pub cycles: u32,
    /// What the observer's model leaves of the friction torque: running mean square. Its root is the host's work.
    pub residual_mean_square_nm2: f32,
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
            residual_mean_square_nm2: record.residual_mean_square_nm2,
        }
    }
}

/// A column of the log beside those that every log has.
#[derive(Debug, Clone, Copy)]
pub struct Channel {
    /// Its name, with the unit.
    pub column: &'static str,
    /// Its value in a row.
    pub of_row: fn(&TelemetryRow) -> f32,
    /// Its value in a tick of the core: for a simulation, which has no rows.
    pub of_record: fn(&Record) -> f32,
}

/// The columns of the log beside those that every log has, in their order.
pub const CHANNELS: &[Channel] = &[
    Channel {
        column: "m2_speed_ref_rad_s",
        of_row: |row| row.m2_speed_ref_rad_s,
        of_record: |record| record.m2_speed_ref_rad_s,
    },
    Channel {
        column: "predicted_friction_torque_nm",
        of_row: |row| row.predicted_friction_torque_nm,
        of_record: |record| record.predicted_friction_torque_nm,
    },
    Channel {
        column: "residual_rms_nm",
        of_row: |row| Real::sqrt(row.residual_mean_square_nm2),
        of_record: Record::residual_rms_nm,
    },
];

/// Bins of a histogram.
pub const BINS: usize = 16;

/// How often values of a range came, two ranges in each doubling: `0..b`, `b..1.5 b`, `1.5 b..2 b`, `2 b..3 b` and so on, the
/// last without an end. `b` is 2 to the power `B`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Histogram<const B: u32> {
    /// How often, by range.
    pub counts: [u32; BINS],
}

impl<const B: u32> Histogram<B> {
    /// Takes a value.
    #[inline(always)]
    pub fn add(&mut self, value: u32) {
        let bin = if value >> B == 0 {
            0
        } else {
            let top = 31 - value.leading_zeros();
            let half = value >> (top - 1) & 1;
            (1 + 2 * (top - B) + half) as usize
        };
        if let Some(count) = self.counts.get_mut(bin.min(BINS - 1)) {
            *count = count.saturating_add(1);
        }
    }

    /// Least value of a range.
    #[must_use]
    pub const fn begin(bin: usize) -> u32 {
        match bin {
            0 => 0,
            bin => (2 + (bin as u32 - 1) % 2) << (B + (bin as u32 - 1) / 2) >> 1,
        }
    }
}

/// Of cycles of a tick: below 1024, then up to 98 304 and more, twice a period.
pub type CycleHistogram = Histogram<10>;
/// Of ns from the end of the scan to the start of the tick: below 64 ns, then up to 6 µs and more.
pub type StartHistogram = Histogram<6>;

/// Counters and state, for a display and for a run's summary.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Health {
    /// Control tick since the start of the firmware.
    pub tick: u64,
    /// Number of the mode.
    pub mode: u8,
    /// Number of the fault latched first, 0 for none.
    pub fault: u8,
    /// All latched faults, as a set of numbers.
    pub faults: u64,
    /// Causes of faults that are there now.
    pub causes: u64,
    /// Ticks that ended late.
    pub deadline_misses: u32,
    /// Scans that came late or not at all.
    pub missed_scans: u32,
    /// Cycles of the last tick.
    pub cycles_last: u32,
    /// Most cycles of a tick so far.
    pub cycles_max: u32,
    /// Least time from the trigger of the scan to the start of the tick, ns.
    pub start_min_ns: u32,
    /// Most time from the trigger of the scan to the start of the tick, ns: the difference is jitter.
    pub start_max_ns: u32,
    /// Telemetry rows that found no room.
    pub telemetry_lost: u32,
    /// Events that found no room.
    pub events_lost: u32,
    /// Frames from the host that were thrown away.
    pub frames_rejected: u32,
    /// Errors of the serial line.
    pub line_errors: u32,
    /// Cycles of the ticks so far.
    pub cycles: CycleHistogram,
    /// Start of the ticks so far after the earliest instant at which the scan can have ended, ns.
    pub starts: StartHistogram,
    /// Bytes of the stack that were ever used, and its size.
    pub stack: (u32, u32),
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_is_counted_where_its_range_begins_and_ends() {
        for bin in 0..BINS {
            let begin = CycleHistogram::begin(bin);
            let end = if bin + 1 < BINS { CycleHistogram::begin(bin + 1) } else { u32::MAX };
            let mut histogram = CycleHistogram::default();
            histogram.add(begin);
            histogram.add(end - 1);
            assert_eq!(histogram.counts[bin], 2, "{begin}..{end}");
        }
        let begins = [0, 1, 2, 3, 4].map(CycleHistogram::begin);
        assert_eq!(begins, [0, 1024, 1536, 2048, 3072]);
        assert_eq!(StartHistogram::begin(1), 64);
    }
}
