//! The firmware's log has every change of state, and nothing of it is dropped.
//!
//! Three witnesses beside the log: the mode in every telemetry row, the events over the link, the drive enables at the
//! pins.

use super::runs::{FIGURES, run};
use model_core::control::Mode;
use rig_link::message::EventKind;
use virtual_bench::experiment::Done;

/// Time between two control ticks, ns.
const TICK_NS: u64 = virtual_bench::PERIOD;

/// A change of mode as the log has it.
#[derive(Debug)]
struct Change {
    tick: u64,
    from: Mode,
    to: Mode,
}

/// `<time> info #5 tick 4997: Armed -> Running: …`
fn changes(done: &Done) -> Vec<Change> {
    let mode = |word: &str| Mode::ALL.iter().copied().find(|mode| format!("{mode:?}") == word);
    let change = |line: &String| {
        let (head, tail) = line.split_once(": ")?;
        let (from, tail) = tail.split_once(" -> ")?;
        let (to, reason) = tail.split_once(": ")?;
        assert!(!reason.is_empty(), "{line}");
        let tick = head.rsplit_once(' ')?.1.parse().unwrap();
        Some(Change { tick, from: mode(from)?, to: mode(to)? })
    };
    done.log.lines.iter().filter_map(change).collect()
}

fn mode_at(changes: &[Change], tick: u64) -> Mode {
    changes.iter().rev().find(|change| change.tick <= tick).map_or(Mode::Boot, |change| change.to)
}

#[test]
fn every_change_of_state_is_in_the_log_and_none_is_dropped() {
    for name in FIGURES {
        let done = run(name);
        assert_eq!((done.log.malformed, done.log.missing_events()), (0, 0), "{name}");
        let changes = changes(&done);
        assert_eq!(changes.first().map(|change| change.from), Some(Mode::Boot), "{name}: {changes:?}");
        assert_eq!(changes.last().map(|change| change.to), Some(Mode::Disabled), "{name}: {changes:?}");
        for pair in changes.windows(2) {
            assert_eq!(pair[0].to, pair[1].from, "{name}: a change is missing between {pair:?}");
        }

        for row in &done.run.rows {
            assert_eq!(
                row.mode,
                mode_at(&changes, row.tick).number(),
                "{name}: telemetry at tick {}",
                row.tick
            );
        }

        let mut told = 0;
        for event in &done.run.events {
            if let EventKind::Mode { from, to, .. } = event.kind {
                let logged = changes.iter().any(|change| {
                    (change.tick, change.from.number(), change.to.number()) == (event.tick, from, to)
                });
                assert!(logged, "{name}: the link told of {event:?}");
                told += 1;
            }
        }
        assert!(told >= 4, "{name}: armed, started, stopped, at rest: {told}");

        enables_agree(name, &done, &changes);
    }
}

/// Each change at the enable pins is a change of mode in the log, within the tick, and the other way round.
fn enables_agree(name: &str, done: &Done, changes: &[Change]) {
    let mut live = false;
    let mut pins = Vec::new();
    for (at_ns, outputs) in &done.record.outputs {
        let now = outputs.enabled.iter().any(|enabled| *enabled);
        if now != live {
            live = now;
            pins.push((*at_ns, now));
        }
    }
    let logged: Vec<(u64, bool)> = changes
        .iter()
        .filter(|change| change.from.is_live() != change.to.is_live())
        .map(|change| (change.tick, change.to.is_live()))
        .collect();
    assert_eq!(pins.len(), logged.len(), "{name}: {pins:?} {logged:?}");
    // Tick 0 began at the same instant by every change.
    let starts: Vec<u64> = pins.iter().zip(&logged).map(|((at, _), (tick, _))| at - tick * TICK_NS).collect();
    let (first, last) = (starts.iter().min().unwrap(), starts.iter().max().unwrap());
    assert!(last - first < TICK_NS, "{name}: {pins:?} {logged:?}");
    assert!(pins.iter().zip(&logged).all(|((_, pin), (_, log))| pin == log), "{name}: {pins:?} {logged:?}");
}
