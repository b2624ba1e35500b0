//! The firmware's log has every change of state, and nothing of it is dropped.
//!
//! Three redundant sources beside the log: the mode in every telemetry row, the events over the link, the drive enables at the
//! pins.

use super::runs::{FIGURES, run};
use model_core::control::Mode;
use rig_link::message::EventKind;
use virtual_bench::experiment::Done;

/// Time between two control ticks, ns.
const TICK_NS: u64 = virtual_bench::PERIOD;

/// A change of mode as the log has it.
#[derive(Debug, Clone)]
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
        assert_eq!(contradictions(&done, &changes(&done)), Vec::<String>::new(), "{name}");
    }
}

#[test]
fn a_log_without_one_of_its_changes_is_contradicted() {
    let done = run("fig18");
    let all = changes(&done);
    assert!(all.len() >= 6, "booted, armed, started, stopped, at rest, disarmed: {all:?}");
    for missing in 0..all.len() {
        let mut rest = all.clone();
        rest.remove(missing);
        assert!(!contradictions(&done, &rest).is_empty(), "without {:?}", all[missing]);
    }
}

/// What the other sources say against these changes.
fn contradictions(done: &Done, changes: &[Change]) -> Vec<String> {
    let mut found = Vec::new();
    if changes.first().map(|change| change.from) != Some(Mode::Boot) {
        found.push("it does not begin with the boot".to_owned());
    }
    if changes.last().map(|change| change.to) != Some(Mode::Disabled) {
        found.push("it does not end disabled".to_owned());
    }
    let gaps = changes.windows(2).filter(|pair| pair[0].to != pair[1].from);
    found.extend(gaps.map(|pair| format!("a change is missing between {pair:?}")));

    let other = done.run.rows.iter().find(|row| row.mode != mode_at(changes, row.tick).number());
    found.extend(other.map(|row| format!("telemetry shows mode {} at tick {}", row.mode, row.tick)));

    let mut reported = 0;
    for event in &done.run.events {
        if let EventKind::Mode { from, to, .. } = event.kind {
            reported += 1;
            let same = |change: &Change| {
                (change.tick, change.from.number(), change.to.number()) == (event.tick, from, to)
            };
            if !changes.iter().any(same) {
                found.push(format!("the link reported {event:?}"));
            }
        }
    }
    if reported < 4 {
        found
            .push(format!("the link reported {reported} changes; armed, started, stopped, at rest are four"));
    }
    found.extend(pins_against(done, changes));
    found
}

/// Each change at the enable pins is a change of mode in the log, within the tick, and the other way round.
fn pins_against(done: &Done, changes: &[Change]) -> Option<String> {
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
    // Tick 0 began at the same instant by every change.
    let starts = pins.iter().zip(&logged).map(|((at, _), (tick, _))| at.wrapping_sub(tick * TICK_NS));
    let (first, last) = (starts.clone().min()?, starts.max()?);
    let agree = pins.len() == logged.len()
        && last.wrapping_sub(first) < TICK_NS
        && pins.iter().zip(&logged).all(|((_, pin), (_, log))| pin == log);
    (!agree).then(|| format!("the enable pins changed at {pins:?} ns, the log says {logged:?}"))
}
