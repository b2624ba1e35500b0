//! Direction and counts of both encoders, with the drives off and a hand on the shaft.

use rig_link::telemetry::TelemetryRow;

use super::rig::seconds;
use super::{Commissioning, Stop};

/// How exactly a hand turns the disc by one turn to a mark.
const HAND: f64 = 0.02;
/// Least motion of M1 that counts as pressing: 16 counts are 0.2 mrad of 480 000 a turn.
const LEAST_M1_COUNTS: i64 = 16;
/// A shaft that has gone so far was turned, one that goes no further for so long is held: 15° and 0.04° of 480 000 a turn.
const MOVED_COUNTS: i64 = 20_000;
const STILL_COUNTS: i64 = 50;
const REST_S: f64 = 1.0;

pub(super) fn step(c: &mut Commissioning<'_, '_>) -> Result<(), Stop> {
    let counts_per_rev = f64::from(c.rig.settings.m2_encoder.counts_per_rev);
    let before = c.rig.row;
    let mut rest = Rest { from: [before.m1_count, before.m2_count], ..Rest::default() };
    let ask = "lift the elements off, and turn the disc by hand, one turn forward to the mark in one go";
    let turned = c.rig.until(ask, |_, rig| rest.after_a_motion(&rig.row))?;
    c.rig.wait(0.05)?;
    let (m1, m2) = (c.rig.row.m1_count - before.m1_count, c.rig.row.m2_count - before.m2_count);
    #[allow(clippy::cast_precision_loss)]
    let (m1_turns, m2_turns) = (m1 as f64 / counts_per_rev, m2 as f64 / counts_per_rev);
    let advice = if !turned {
        "neither encoder counts: look at the supply of M2's and at PA15 and PB3"
    } else if m1_turns.abs() > 0.5 && m2_turns.abs() < 0.5 {
        "M1's encoder counted: the plugs of the two encoders are exchanged"
    } else if (m2_turns + 1.0).abs() <= HAND {
        "A and B are exchanged: exchange them, or rig settings set m2_encoder.reversed=1 (0 if it was 1)"
    } else if m2_turns.abs() < 0.01 {
        "it does not count: look at its supply and at PA15 and PB3"
    } else {
        "m2_encoder.counts_per_rev is not this encoder's, or a line is missing"
    };
    c.check(
        "disc, one turn by hand",
        format!("{m2_turns:+.4} turns, {m2} counts"),
        &format!("+1 turn ± {} %", 100.0 * HAND),
        turned && (m2_turns - 1.0).abs() <= HAND,
        advice,
    );
    c.settle()?;
    press(c)
}

/// Tells when a shaft that was turned is at rest again.
#[derive(Debug, Default)]
struct Rest {
    from: [i64; 2],
    last: [i64; 2],
    moved_at: u64,
}

impl Rest {
    fn after_a_motion(&mut self, row: &TelemetryRow) -> bool {
        let now = [row.m1_count, row.m2_count];
        let far =
            |from: [i64; 2], least: i64| from.iter().zip(now).any(|(from, now)| (now - from).abs() > least);
        if far(self.last, STILL_COUNTS) {
            (self.last, self.moved_at) = (now, row.tick);
        }
        far(self.from, MOVED_COUNTS) && seconds(row.tick - self.moved_at) > REST_S
    }
}

fn press(c: &mut Commissioning<'_, '_>) -> Result<(), Stop> {
    let before = c.rig.row;
    let moved = |row: &TelemetryRow| row.m1_count - before.m1_count;
    let seen = c.rig.until("press M1's lever by hand towards the disc, and hold it", |_, rig| {
        moved(&rig.row).abs() > 4 * LEAST_M1_COUNTS
    })?;
    c.rig.wait(0.1)?;
    let (count, force) = (moved(&c.rig.row), c.rig.row.normal_force_n - before.normal_force_n);
    let advice = if !seen {
        "it does not count: look at its supply and at PD12 and PD13"
    } else {
        "A and B are exchanged: exchange them, or rig settings set m1_encoder.reversed=1 (0 if it was 1)"
    };
    c.check(
        "M1, pressed by hand",
        format!("{count:+} counts"),
        &format!("more than +{LEAST_M1_COUNTS}"),
        count > LEAST_M1_COUNTS,
        advice,
    );
    let _ = c.rig.until("let M1's lever go", |_, rig| moved(&rig.row).abs() <= 4 * LEAST_M1_COUNTS)?;
    c.settle()?;
    c.check(
        "normal force meanwhile",
        format!("{force:+.2} N"),
        "more than +1 N",
        force > 1.0,
        "the force falls when M1 presses: the bridge's signal wires are exchanged, or unit_per_code has the wrong sign",
    );
    c.settle()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_turn_is_over_a_second_after_its_last_motion() {
        let mut rest = Rest { from: [0, 5], ..Rest::default() };
        let row = |tick: u64, m2_count: i64| TelemetryRow { tick, m2_count, ..TelemetryRow::default() };
        assert!(!rest.after_a_motion(&row(30_000, 5)), "nothing has moved");
        assert!(!rest.after_a_motion(&row(31_000, 300_000)));
        assert!(!rest.after_a_motion(&row(36_000, 480_000)));
        assert!(!rest.after_a_motion(&row(45_000, 480_010)), "at rest, and not for a second");
        assert!(rest.after_a_motion(&row(46_100, 480_010)));
    }
}
