//! One run of one fault: done, watched, judged, put right, and the rig armed again.

use super::PROMISED_NS;
use super::faults::{Expect, FaultCase, Host, unwanted, watch_ns};
use super::listening_host::ListeningHost;
use super::states::State;
use crate::defmt_log;
use crate::endpoint::Endpoint;
use crate::error::BenchError;
use crate::outside::{Action, Motion};
use crate::record::Record;
use crate::sighting::Seen;
use defmt_decoder::Table;
use model_core::control::{ControlSettings, Fault, Mode, Refusal};
use rig_link::message::{Answer, Command, EventKind};
use serde::{Deserialize, Serialize};

/// What became of it.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// When the fault was first seen after it was made, ns, and by what access; none if nothing saw it.
    pub seen: Option<(u64, String)>,
    /// What the firmware said it was.
    pub said: String,
    /// From the access that saw it to outputs that stay safe, ns; none where the rig goes on.
    pub safe_ns: Option<u64>,
    /// Largest torques of M1 and M2 from then until the outputs are safe, N·m.
    pub torque_nm: [f64; 2],
    /// The disc's travel in that time, rad.
    pub travel_rad: f64,
    /// How the rig came back.
    pub back: String,
    /// Everything that was not as it must be.
    pub problems: Vec<String>,
}

/// What is in all memory from the begin of the bench on, for all branches.
pub(super) struct Common<'a> {
    pub(super) table: &'a Table,
    /// The same time undisturbed: what the outputs did, and what was heard.
    pub(super) twin: Option<(u64, u64)>,
}

/// Turns the arm switch off and on, each for long enough.
const SWITCH_NS: u64 = 8_000_000;
/// What a repaired line takes to permit again, and what a frozen input takes to count as moving: two windows of 25 ms.
const REPAIRED_NS: u64 = 15_000_000;
const MOVING_NS: u64 = 55_000_000;
/// Time of the twin that is compared.
const COMPARED_NS: u64 = 50_000_000;

/// Bytes of requests that the line takes in a period, and periods that it is flooded.
const FLOOD_BYTES: usize = 20;
const FLOOD_PERIODS: u64 = 300;

/// What the operator saw until it began to put the fault right.
struct Watched {
    at_ns: u64,
    until_ns: u64,
    listener: ListeningHost,
    seen: Option<Seen>,
    record: Record,
}

/// Runs the case; an error of the bench is a problem of the row.
pub(super) fn run(endpoint: &mut Endpoint, case: &FaultCase, state: State, common: &Common<'_>) -> Row {
    let mut row = Row::default();
    if let Err(error) = attempt(endpoint, case, state, common, &mut row) {
        row.problems.push(format!("the bench: {error}"));
    }
    row
}

/// The same time with nothing done: a hash over the outputs, and one over what was heard.
pub(super) fn twin(endpoint: &mut Endpoint) -> Option<(u64, u64)> {
    let mut listener = ListeningHost::new();
    let until = endpoint.now_ns() + COMPARED_NS;
    // What the outputs did before is no part of it.
    endpoint.record().ok()?;
    listener.listen(endpoint, until).ok()?;
    let record = endpoint.record().ok()?;
    Some((hash_of_outputs(&record, until), listener.heard.0))
}

fn hash_of_outputs(record: &Record, until_ns: u64) -> u64 {
    let mut hash = super::listening_host::Heard::default();
    for (at, outputs) in record.outputs.iter().filter(|(at, _)| *at < until_ns) {
        hash.add(format!("{at}{outputs:?}").as_bytes());
    }
    hash.0
}

fn attempt(
    endpoint: &mut Endpoint,
    case: &FaultCase,
    state: State,
    common: &Common<'_>,
    row: &mut Row,
) -> Result<(), BenchError> {
    // The change of the outputs up to here is of no interest, but what they are now is.
    let outputs_now = endpoint.outputs()?;
    endpoint.record()?;
    let mut watched = watch(endpoint, case, state)?;
    let expect = case.expect(state);
    row.seen = match (&watched.seen, case.is_flip) {
        (Some(seen), _) => Some((seen.at_ns.saturating_sub(watched.at_ns), seen.what.clone())),
        // Reads of memory are not seen one by one: it acted if anything went otherwise than without it.
        (None, true) => {
            let compared = watched.at_ns + COMPARED_NS;
            let this = (hash_of_outputs(&watched.record, compared), watched.listener.heard.0);
            (common.twin != Some(this)).then(|| (0, "the run differs from the undisturbed one".to_owned()))
        }
        (None, false) => None,
    };
    // Only now: the twin has none of before either.
    watched.record.outputs.insert(0, (watched.at_ns, outputs_now));
    let seen_at = watched.at_ns + row.seen.as_ref().map_or(0, |(after, _)| *after);
    let Watched { at_ns, until_ns, ref listener, ref record, .. } = watched;
    let mut latched: Vec<u8> = listener
        .events
        .iter()
        .filter_map(|event| match event.kind {
            EventKind::FaultLatched(number) => Some(number),
            _ => None,
        })
        .collect();
    // What happened while the line was cut was not heard; the rows tell it later.
    if case.host == Host::Deaf && latched.is_empty() {
        latched.extend(listener.row.map(|row| row.fault).filter(|fault| *fault != 0));
    }
    let log = defmt_log::decode_with(common.table, &record.log);
    let safe_at = record.safe_from(at_ns, until_ns);
    row.safe_ns = safe_at.filter(|_| state.is_live()).map(|at| at.saturating_sub(seen_at));
    judge_motion(row, record, state, &expect, seen_at, safe_at.unwrap_or(until_ns));
    let mut say = |wrong: bool, what: String| {
        if wrong {
            row.problems.push(what);
        }
    };
    let restarts = record.restarts.len();
    let within = |limit: u64| safe_at.is_some_and(|at| at <= seen_at + limit + PROMISED_NS);
    match expect {
        Expect::Latches(faults, known) => {
            say(
                !within(known),
                format!(
                    "not safe within {} µs of the access that saw it: {safe_at:?}",
                    (known + PROMISED_NS) / 1000
                ),
            );
            say(restarts != 0, format!("it restarted: {:?}", record.restarts));
            right_reason(&latched, faults, &log, &mut say);
        }
        Expect::Restarts(_, _, known) => {
            say(
                !within(known),
                format!(
                    "not safe within {} µs of the access that saw it: {safe_at:?}",
                    (known + PROMISED_NS) / 1000
                ),
            );
            say(restarts == 0, "it did not restart".to_owned());
        }
        Expect::Hinders(_) | Expect::Bears => {
            say(restarts != 0, format!("it restarted: {:?}", record.restarts));
            say(!latched.is_empty(), format!("it latched {latched:?}"));
        }
        Expect::BearsOrLatches(faults) => {
            say(restarts != 0, format!("it restarted: {:?}", record.restarts));
            if !latched.is_empty() {
                right_reason(&latched, faults, &log, &mut say);
                say(safe_at.is_none(), "it is not safe for good".to_owned());
            }
        }
        Expect::Whatever => {}
    }
    say(
        !state.is_live() && safe_at != Some(at_ns),
        "an output changed though the drives were off".to_owned(),
    );
    say(log.malformed > 0, format!("{} frames of the log could not be decoded", log.malformed));
    row.said = latched.first().map_or_else(String::new, |number| name(*number));
    let first = latched.first().copied();
    let mut listener = watched.listener;
    come_back(endpoint, &mut listener, case, state, &expect, first, row)
}

/// One of the faults was latched first, and the log says so.
fn right_reason(
    latched: &[u8],
    faults: &[Fault],
    log: &defmt_log::DefmtLog,
    say: &mut dyn FnMut(bool, String),
) {
    let Some(first) = latched.first() else {
        say(true, format!("the link tells of none of {faults:?}"));
        return;
    };
    match faults.iter().find(|fault| fault.number() == *first) {
        Some(fault) => {
            let logged =
                log.lines.iter().any(|line| line.contains("error") && line.contains(fault.sentence()));
            say(!logged, format!("the log does not say: {}", fault.sentence()));
        }
        None => say(true, format!("it latched {} first, none of {faults:?}", name(*first))),
    }
}

fn name(number: u8) -> String {
    Fault::from_number(number).map_or_else(|| format!("fault {number}"), |fault| format!("{fault:?}"))
}

/// What the drives and the disc did from the fault until the outputs were safe.
fn judge_motion(row: &mut Row, record: &Record, state: State, expect: &Expect, from: u64, until: u64) {
    let during: Vec<&Motion> = record
        .motion
        .iter()
        .filter(|(at, _)| *at >= from && *at <= until.max(from) + PROMISED_NS)
        .map(|(_, motion)| motion)
        .collect();
    let Some(first) = during.first() else { return };
    for motion in &during {
        for (worst, torque) in row.torque_nm.iter_mut().zip(motion.torque_nm) {
            *worst = worst.max(torque.abs());
        }
        row.travel_rad = row.travel_rad.max((motion.disc_angle_rad - first.disc_angle_rad).abs());
    }
    if !state.is_live() || matches!(expect, Expect::Latches(..) | Expect::Restarts(..)) {
        return;
    }
    let limits = ControlSettings::default().limits;
    let speed = during.iter().map(|motion| motion.disc_speed_rad_s.abs()).fold(0.0, f64::max);
    let force = during.iter().map(|motion| motion.normal_force_n).fold(0.0, f64::max);
    for (what, value, most) in [
        ("torque of M1, N·m", row.torque_nm[0], limits.over_torque_nm),
        ("torque of M2, N·m", row.torque_nm[1], limits.over_torque_nm),
        ("speed of the disc, rad/s", speed, limits.over_speed_rad_s),
        ("normal force, N", force, limits.over_force_n),
    ] {
        // A limit is noticed a tick after it is passed.
        if value > 1.02 * f64::from(most) {
            row.problems.push(format!("{what}: {value:.2}, limit {most}"));
        }
    }
}

fn watch(endpoint: &mut Endpoint, case: &FaultCase, state: State) -> Result<Watched, BenchError> {
    let mut listener = ListeningHost::new();
    let at_ns = endpoint.now_ns();
    endpoint.look_out(case.sighting)?;
    let until_ns = at_ns + watch_ns(case, state).max(if case.is_flip { COMPARED_NS } else { 0 });
    listener.lively = !matches!(case.host, Host::Silent | Host::Deaf);
    for action in &case.actions {
        endpoint.act(*action)?;
    }
    match case.host {
        Host::Floods => {
            for period in 0..FLOOD_PERIODS {
                let mut sent = 0;
                while sent < FLOOD_BYTES {
                    sent += listener.send(&unwanted(state, period as usize + sent));
                }
                listener.listen(endpoint, at_ns + (period + 1) * crate::driver::PERIOD)?;
            }
        }
        Host::Asks => {
            while endpoint.now_ns() < until_ns - 5_000_000 {
                listener.send(&Command::SettingGet { key: 143 });
                listener.listen(endpoint, endpoint.now_ns() + 1_000_000)?;
            }
        }
        Host::Lively | Host::Silent | Host::Deaf => {}
    }
    for (after, action) in &case.later {
        listener.listen(endpoint, at_ns + after)?;
        endpoint.act(*action)?;
    }
    if case.is_flip {
        listener.listen(endpoint, at_ns + COMPARED_NS)?;
    } else {
        listener.listen(endpoint, until_ns)?;
    }
    let until_ns = endpoint.now_ns();
    Ok(Watched { at_ns, until_ns, listener, seen: endpoint.seen()?, record: endpoint.record()? })
}

/// Puts the fault right and brings the rig back as an operator does, where that is asked for.
fn come_back(
    endpoint: &mut Endpoint,
    listener: &mut ListeningHost,
    case: &FaultCase,
    state: State,
    expect: &Expect,
    latched: Option<u8>,
    row: &mut Row,
) -> Result<(), BenchError> {
    listener.lively = true;
    match *expect {
        Expect::Hinders(faults) => {
            switch(endpoint, listener)?;
            match listener.ask(endpoint, &Command::Arm)? {
                Answer::Refused { reason, fault: Some(fault) }
                    if reason == Refusal::CausePresent.number()
                        && faults.iter().any(|wanted| wanted.number() == fault) =>
                {
                    row.said = format!("not armed: {}", name(fault));
                }
                other => row.problems.push(format!("asked to arm it says {other:?}")),
            }
            repair(endpoint, listener, case)?;
            arm(endpoint, listener, row, "armed when it was put right")
        }
        Expect::Latches(..) => {
            match listener.ask(endpoint, &Command::Arm)? {
                Answer::Refused { reason, .. } if reason == Refusal::FaultLatched.number() => {}
                other => row.problems.push(format!("asked to arm with a fault it says {other:?}")),
            }
            recover(endpoint, listener, case, row, "put right, cleared, armed")
        }
        Expect::BearsOrLatches(_) if latched.is_some() => {
            recover(endpoint, listener, case, row, "put right, cleared, armed")
        }
        Expect::Bears | Expect::BearsOrLatches(_) => {
            if row.said.is_empty() {
                row.said = "goes on".to_owned();
            }
            row.safe_ns = None;
            still(endpoint, listener, case, state, row)
        }
        Expect::Restarts(cause, fault, _) => {
            match listener.ask(endpoint, &Command::Hello)? {
                Answer::Hello(hello) if hello.reset == cause => {}
                other => row.problems.push(format!("it does not say that {cause:?} restarted it: {other:?}")),
            }
            trapped(endpoint, listener, fault, row)?;
            let before = listener.events.len();
            let cleared = listener.ask(endpoint, &Command::ClearFault)?;
            // The event comes with the next look of the log.
            listener.listen(endpoint, endpoint.now_ns() + 8_000_000)?;
            let reported = listener.events[before..].iter().find_map(|event| match event.kind {
                EventKind::FaultCleared(number) => Fault::from_number(number),
                _ => None,
            });
            let right = match fault {
                Some(_) => cleared == Answer::Done && reported == fault,
                None => {
                    matches!(cleared, Answer::Refused { reason, .. } if reason == Refusal::NoFault.number())
                }
            };
            if !right {
                row.problems
                    .push(format!("after the start: {cleared:?}, {reported:?} in place of {fault:?}"));
            }
            row.said = fault.map_or_else(|| format!("started by {cause:?}"), |fault| format!("{fault:?}"));
            switch(endpoint, listener)?;
            arm(endpoint, listener, row, "restarted, cleared, armed")
        }
        Expect::Whatever => {
            row.back = "–".to_owned();
            Ok(())
        }
    }
}

/// Only a trap leaves a message.
fn trapped(
    endpoint: &mut Endpoint,
    listener: &mut ListeningHost,
    fault: Option<Fault>,
    row: &mut Row,
) -> Result<(), BenchError> {
    let trapped = fault == Some(Fault::HardFault);
    match listener.ask(endpoint, &Command::CrashRecord)? {
        Answer::CrashRecord(record) if record.is_some() == trapped => Ok(()),
        other => {
            row.problems.push(format!("crash record: {other:?}"));
            Ok(())
        }
    }
}

/// The rig went on: as before, and with an ear for its host.
fn still(
    endpoint: &mut Endpoint,
    listener: &mut ListeningHost,
    case: &FaultCase,
    state: State,
    row: &mut Row,
) -> Result<(), BenchError> {
    let wanted = match state {
        State::Idle => Mode::Disabled,
        State::Armed => Mode::Armed,
        _ => Mode::Running,
    };
    match listener.row {
        Some(telemetry) if telemetry.mode == wanted.number() && telemetry.fault == 0 => {}
        other => row.problems.push(format!("its telemetry is not of a rig that goes on: {other:?}")),
    }
    for action in &case.repair {
        endpoint.act(*action)?;
    }
    match listener.ask(endpoint, &Command::SettingGet { key: 143 })? {
        Answer::Setting(_) => {}
        other => row.problems.push(format!("it does not answer as before: {other:?}")),
    }
    row.back = "went on".to_owned();
    Ok(())
}

fn repair(endpoint: &mut Endpoint, listener: &mut ListeningHost, case: &FaultCase) -> Result<(), BenchError> {
    for action in &case.repair {
        endpoint.act(*action)?;
    }
    let held = case
        .actions
        .iter()
        .any(|action| matches!(action, Action::AnalogueInput(..) | Action::AnalogueFrozen(_)));
    let settled = case.lasts_ns + if held { MOVING_NS } else { REPAIRED_NS };
    listener.listen(endpoint, endpoint.now_ns() + settled)
}

fn recover(
    endpoint: &mut Endpoint,
    listener: &mut ListeningHost,
    case: &FaultCase,
    row: &mut Row,
    how: &str,
) -> Result<(), BenchError> {
    repair(endpoint, listener, case)?;
    switch(endpoint, listener)?;
    match listener.ask(endpoint, &Command::ClearFault)? {
        Answer::Done => {}
        other => row.problems.push(format!("asked to clear the fault it says {other:?}")),
    }
    arm(endpoint, listener, row, how)
}

fn switch(endpoint: &mut Endpoint, listener: &mut ListeningHost) -> Result<(), BenchError> {
    for on in [false, true] {
        endpoint.act(Action::ArmSwitch(on))?;
        listener.listen(endpoint, endpoint.now_ns() + SWITCH_NS)?;
    }
    Ok(())
}

fn arm(
    endpoint: &mut Endpoint,
    listener: &mut ListeningHost,
    row: &mut Row,
    how: &str,
) -> Result<(), BenchError> {
    if endpoint.outputs()?.enabled != [false; 2] {
        row.problems.push("a drive is enabled before it was armed again".to_owned());
    }
    match listener.ask(endpoint, &Command::Arm)? {
        Answer::Done => {}
        other => row.problems.push(format!("asked to arm again it says {other:?}")),
    }
    listener.listen(endpoint, endpoint.now_ns() + 500_000)?;
    if endpoint.outputs()?.enabled == [true; 2] {
        row.back = how.to_owned();
    } else {
        row.problems.push("it does not come back".to_owned());
    }
    Ok(())
}
