//! The last seconds of telemetry, and what was heard besides.

use std::collections::VecDeque;

use rig_link::telemetry::{Health, TelemetryRow};

/// Notes that are kept for the screen.
const NOTES: usize = 20;

/// What there is to show.
#[derive(Debug, Clone, Default)]
pub(super) struct History {
    /// Time shown, s.
    pub(super) span_s: f64,
    /// Rows, oldest first.
    pub(super) rows: VecDeque<TelemetryRow>,
    /// Rows that did not come.
    pub(super) rows_lost: u64,
    /// Frames that came in damaged.
    pub(super) frames_rejected: u32,
    /// The last health record.
    pub(super) health: Option<Health>,
    /// Control ticks per second.
    pub(super) tick_hz: u32,
    /// What was said, the newest last.
    pub(super) notes: VecDeque<String>,
    unread: Vec<String>,
}

impl History {
    pub(super) fn new(span_s: f64) -> Self {
        Self { span_s, tick_hz: 10_000, ..Self::default() }
    }

    /// Takes new rows; forgets what is too old to be shown.
    pub(super) fn take(&mut self, rows: &[TelemetryRow]) {
        for row in rows {
            if let Some(last) = self.rows.back() {
                self.rows_lost += u64::from(row.sequence.wrapping_sub(last.sequence).saturating_sub(1));
            }
            self.rows.push_back(*row);
        }
        let Some(newest) = self.rows.back().map(|row| row.tick) else { return };
        // The longest span that can be asked for, so that + shows what was there before.
        let oldest = newest.saturating_sub(u64::from(self.tick_hz) * 120);
        while self.rows.front().is_some_and(|row| row.tick < oldest) {
            self.rows.pop_front();
        }
    }

    pub(super) fn note(&mut self, note: String) {
        self.unread.push(note.clone());
        self.notes.push_back(note);
        if self.notes.len() > NOTES {
            self.notes.pop_front();
        }
    }

    pub(super) fn take_notes(&mut self) -> Vec<String> {
        std::mem::take(&mut self.unread)
    }

    /// Points of a quantity over time before now, in s: -span … 0.
    #[allow(clippy::cast_precision_loss)]
    pub(super) fn points(&self, value: impl Fn(&TelemetryRow) -> f32) -> Vec<(f64, f64)> {
        let Some(now) = self.rows.back().map(|row| row.tick) else { return Vec::new() };
        let age = |row: &TelemetryRow| (now.saturating_sub(row.tick)) as f64 / f64::from(self.tick_hz.max(1));
        self.rows
            .iter()
            .filter(|row| age(row) <= self.span_s)
            .map(|row| (-age(row), f64::from(value(row))))
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn old_rows_go_lost_ones_are_counted_and_points_end_now() {
        let mut history = History::new(1.0);
        let row = |sequence: u32| TelemetryRow {
            sequence,
            tick: u64::from(sequence) * 200,
            normal_force_n: 5.0,
            ..TelemetryRow::default()
        };
        let rows: Vec<TelemetryRow> = (0..10_000).filter(|n| n % 1000 != 7).map(row).collect();
        history.take(&rows);
        assert_eq!(history.rows_lost, 10);
        assert!(history.rows.len() <= 6001);
        let points = history.points(|row| row.normal_force_n);
        assert_eq!(points.last(), Some(&(0.0, 5.0)));
        assert!((points[0].0 + 1.0).abs() < 0.021, "{:?}", points[0]);
    }
}
