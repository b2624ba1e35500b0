//! Telemetry rows to a log.
//!
//! Time is the tick counter over the tick rate, from the start of the experiment or of the recording. Angles
//! come from exact counts. Single-precision values stand in the log as the shortest decimal that names them.

use rig_link::telemetry::{CHANNELS, TelemetryRow};

use crate::files::log::Log;
use crate::files::number;
use crate::files::signal::Signal;

/// What a log needs to know about the rig.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Scale {
    /// Control ticks per second.
    pub tick_hz: u32,
    /// Encoder counts per revolution of M1.
    pub m1_counts_per_rev: u32,
    /// Encoder counts per revolution of M2.
    pub m2_counts_per_rev: u32,
}

/// Where time 0 is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Zero {
    /// The start of the experiment; every row belongs to it.
    Experiment,
    /// The first row.
    FirstRow,
}

/// The log of these rows.
#[must_use]
pub fn log(rows: &[TelemetryRow], scale: &Scale, zero: Zero) -> Log {
    log_from(rows, scale, zero, rows.first().map_or(0, |row| row.tick))
}

/// The log of some rows of a recording whose first row came at this tick.
#[must_use]
pub fn log_from(rows: &[TelemetryRow], scale: &Scale, zero: Zero, first_tick: u64) -> Log {
    let time_s = |row: &TelemetryRow| {
        let ticks = match zero {
            Zero::Experiment => u64::from(row.experiment_tick.saturating_sub(1)),
            Zero::FirstRow => row.tick.saturating_sub(first_tick),
        };
        seconds(ticks, scale.tick_hz)
    };
    let single = |value: fn(&TelemetryRow) -> f32| {
        rows.iter().map(|row| number::widen(value(row))).collect::<Vec<_>>()
    };
    let mut log = Log::default();
    log.set_signal(Signal::Time, rows.iter().map(time_s).collect());
    log.set_signal(Signal::M1TorqueRef, single(|row| row.m1_torque_ref_nm));
    log.set_signal(Signal::M1Torque, single(|row| row.m1_torque_nm));
    log.set_signal(Signal::M1Angle, angles(rows, |row| row.m1_count, scale.m1_counts_per_rev));
    log.set_signal(Signal::M2TorqueRef, single(|row| row.m2_torque_ref_nm));
    log.set_signal(Signal::M2Torque, single(|row| row.m2_torque_nm));
    log.set_signal(Signal::M2Angle, angles(rows, |row| row.m2_count, scale.m2_counts_per_rev));
    log.set_signal(Signal::M2Speed, single(|row| row.m2_speed_rad_s));
    log.set_signal(Signal::NormalForce, single(|row| row.normal_force_n));
    log.set_signal(Signal::FrictionTorque, single(|row| row.friction_torque_nm));
    for channel in CHANNELS {
        log.set_numbers(channel.column, single(channel.of_row));
    }
    log
}

fn angles(rows: &[TelemetryRow], count: fn(&TelemetryRow) -> i64, counts_per_rev: u32) -> Vec<f64> {
    rows.iter().map(|row| number::angle_rad(count(row), counts_per_rev)).collect()
}

/// Ticks in seconds: the nearest number to the decimal time.
#[allow(clippy::cast_precision_loss)]
pub(super) fn seconds(ticks: u64, tick_hz: u32) -> f64 {
    ticks as f64 / f64::from(tick_hz.max(1))
}

/// How many rows are missing between the first and the last.
#[must_use]
pub fn missing(rows: &[TelemetryRow]) -> u64 {
    let gap = |pair: &[TelemetryRow]| match pair {
        [a, b] => u64::from(b.sequence.wrapping_sub(a.sequence).saturating_sub(1)),
        _ => 0,
    };
    rows.windows(2).map(gap).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    const SCALE: Scale = Scale { tick_hz: 10_000, m1_counts_per_rev: 480_000, m2_counts_per_rev: 480_000 };

    fn rows(sequences: &[u32]) -> Vec<TelemetryRow> {
        let row = |sequence: u32| TelemetryRow {
            sequence,
            tick: 500 + 10 * u64::from(sequence),
            experiment_tick: 10 * sequence + 1,
            m2_count: 100_000,
            friction_torque_nm: 0.1,
            ..TelemetryRow::default()
        };
        sequences.iter().map(|sequence| row(*sequence)).collect()
    }

    #[test]
    fn a_row_becomes_a_line_with_time_from_its_tick_and_angle_from_its_count() {
        let log = log(&rows(&[3, 4]), &SCALE, Zero::Experiment);
        assert_eq!(log.time_s(), [0.003, 0.004]);
        assert_eq!(log.signal(Signal::M2Angle).unwrap()[0], 1.308_996_939);
        assert_eq!(log.signal(Signal::FrictionTorque).unwrap()[1], 0.1);
        let log = super::log(&rows(&[3, 4]), &SCALE, Zero::FirstRow);
        assert_eq!(log.time_s(), [0.0, 0.001]);
    }

    #[test]
    fn missing_rows_are_counted_from_their_numbers() {
        assert_eq!(missing(&rows(&[0, 1, 2])), 0);
        assert_eq!(missing(&rows(&[0, 1, 5, 6, 8])), 4);
        assert_eq!(missing(&[]), 0);
    }
}
