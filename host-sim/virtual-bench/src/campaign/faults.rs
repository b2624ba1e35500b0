//! Faults of the rig, its wires, its chip: one entry each.

use super::listening_host::ListeningHost;
use super::{PROMISED_NS, Verdict};
use crate::bench;
use crate::defmt_log;
use crate::driver::PERIOD;
use crate::elf::Firmware;
use crate::endpoint::Endpoint;
use crate::error::BenchError;
use crate::outside::Action;
use crate::part::Motor;
use crate::part::encoder_timer::Line;
use crate::record::Saved;
use host_sim::link::words;
use model_core::control::{ControlSettings, Fault};
use rig_link::message::{Answer, Command, CrashRecord, ResetCause};
use std::path::Path;

/// The watchdog's count: 16 counts of 4 LSI cycles (firmware/src/watchdog.rs), and one LSI cycle of phase.
const WATCHDOG_NS: u64 = 2_000_000 + 31_250;
/// The tick feeds the watchdog as long as the threads were heard within this time (firmware/src/watchdog.rs).
const THREADS_NS: u64 = 500_000_000;
/// A voltage the amplifier of a bridge clips to (99 % of the range), and what a broken or shorted wire is pulled to.
const CLIPPED_MICROVOLT: u32 = 3_267_500;
const OPEN_MICROVOLT: u32 = 3_299_000;
const SHORT_MICROVOLT: u32 = 1_000;
/// Time to watch after the outputs became safe, and after a restart.
const AFTERWARDS_NS: u64 = 300_000_000;

/// What is expected to be reported.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Expected {
    /// The supervisor latches it and says so.
    Latched(Fault),
    /// One of these: which one comes first depends on the phase of the motion.
    OneOf(&'static [Fault]),
    /// The chip restarts for this cause, and latches this fault then.
    Restart(ResetCause, Option<Fault>),
}

/// One fault.
#[derive(Debug, Clone)]
pub(super) struct Case {
    name: &'static str,
    actions: Vec<Action>,
    /// Done so long after the fault, e.g. the supply coming back.
    later: Vec<(u64, Action)>,
    known_ns: u64,
    expected: Expected,
    /// The host goes silent with the fault.
    silent: bool,
    /// And hears nothing.
    deaf: bool,
}

fn case(name: &'static str, actions: &[Action], known_ns: u64, expected: Expected) -> Case {
    Case {
        name,
        actions: actions.to_vec(),
        later: Vec::new(),
        known_ns,
        expected,
        silent: false,
        deaf: false,
    }
}

/// The faults, and after what time each can be known by the settings the firmware has.
pub(super) fn all() -> Vec<Case> {
    let settings = ControlSettings::default();
    let ticks = |ticks: u32| u64::from(ticks) * PERIOD;
    let seconds = |seconds: f32| (f64::from(seconds) * 1e9) as u64;
    // The first sample after the fault is one, so n in a row are there n − 1 periods later.
    let bridge = ticks(settings.friction_bridge.persistence_ticks - 1);
    let held = |index: usize, microvolt: u32| [Action::AnalogueInput(index, Some(microvolt))];
    let stop = Action::EmergencyStop(true);
    let mut all = vec![
        case("emergency stop pressed", &[stop], 0, Expected::Latched(Fault::EmergencyStop)),
        Case {
            later: vec![(5_000_000, Action::EmergencyStop(false))],
            ..case("emergency stop tapped for 5 ms", &[stop], 0, Expected::Latched(Fault::EmergencyStop))
        },
        case(
            "M1 drive fault",
            &[Action::DriveHealthy(Motor::M1, false)],
            0,
            Expected::Latched(Fault::M1DriveFault),
        ),
        case(
            "M2 drive fault",
            &[Action::DriveHealthy(Motor::M2, false)],
            0,
            Expected::Latched(Fault::M2DriveFault),
        ),
    ];
    for (line, level, name) in [
        (Line::A, false, "M2 encoder line A stuck low"),
        (Line::A, true, "M2 encoder line A stuck high"),
        (Line::B, false, "M2 encoder line B stuck low"),
        (Line::B, true, "M2 encoder line B stuck high"),
    ] {
        // At speed a dead line is a jump of the speed, seen in the first whole period without counts.
        let expected = Expected::OneOf(&[Fault::M2EncoderJump, Fault::M2EncoderNoTorque]);
        all.push(case(name, &[Action::EncoderLine(Motor::M2, line, Some(level))], PERIOD, expected));
    }
    for (index, microvolt, name, fault) in [
        (0, CLIPPED_MICROVOLT, "friction bridge saturated", Fault::FrictionBridgeSaturated),
        (0, OPEN_MICROVOLT, "friction bridge open", Fault::FrictionBridgeOpen),
        (0, SHORT_MICROVOLT, "friction bridge shorted", Fault::FrictionBridgeShort),
        (1, OPEN_MICROVOLT, "normal-force bridge open", Fault::NormalBridgeOpen),
    ] {
        all.push(case(name, &held(index, microvolt), bridge, Expected::Latched(fault)));
    }
    // A normal force near the bridge's end is an over-force too, and both need two samples.
    let clipped = Expected::OneOf(&[Fault::NormalBridgeSaturated, Fault::OverForce]);
    all.push(case("normal-force bridge saturated", &held(1, CLIPPED_MICROVOLT), bridge, clipped));
    let supply_low = seconds(settings.supply.persistence_s);
    all.push(case(
        "supply down to 18 V",
        &held(4, 1_636_000),
        supply_low,
        Expected::Latched(Fault::SupplyLow),
    ));
    // A scan that does not come is missed at the end of its period.
    let stalled = ticks(settings.timing.adc_stall_ticks);
    all.push(case(
        "ADC starts no more scans",
        &[Action::AdcStalled(true)],
        stalled,
        Expected::Latched(Fault::AdcStalled),
    ));
    let silence = seconds(settings.timing.link_timeout_s);
    all.push(Case { silent: true, ..case("host silent", &[], silence, Expected::Latched(Fault::LinkLost)) });
    all.push(Case {
        silent: true,
        deaf: true,
        // The line is whole again so that the reason can be reported.
        later: vec![(silence + 100_000_000, Action::LinkSilent(false))],
        ..case("serial line cut", &[Action::LinkSilent(true)], silence, Expected::Latched(Fault::LinkLost))
    });
    all.push(case(
        "control tick hangs",
        &[Action::HangTick],
        WATCHDOG_NS,
        Expected::Restart(ResetCause::Watchdog, Some(Fault::WatchdogReset)),
    ));
    all.push(case(
        "control tick traps",
        &[Action::TrapTick],
        0,
        Expected::Restart(ResetCause::Software, Some(Fault::HardFault)),
    ));
    all.push(case(
        "threads hang, the tick goes on",
        &[Action::HangThreads],
        THREADS_NS + WATCHDOG_NS,
        Expected::Restart(ResetCause::Watchdog, Some(Fault::WatchdogReset)),
    ));
    all.push(case("reset pin pulled", &[Action::ResetPin], 0, Expected::Restart(ResetCause::Pin, None)));
    all.push(Case {
        later: vec![(50_000_000, Action::Power(true))],
        ..case(
            "power cut for 50 ms",
            &[Action::Power(false)],
            0,
            Expected::Restart(ResetCause::PowerOn, None),
        )
    });
    all
}

/// What the operator saw.
struct Seen {
    at_ns: u64,
    listener: ListeningHost,
    hello: Answer,
    crash_record: Option<CrashRecord>,
}

fn operate(endpoint: &mut Endpoint, case: &Case) -> Result<Seen, BenchError> {
    let mut listener = ListeningHost::new();
    // A few periods of company first: the host of before is gone.
    listener.listen(endpoint, endpoint.now_ns() + 5_000_000)?;
    listener.lively = !case.silent;
    let at_ns = endpoint.now_ns();
    for action in &case.actions {
        endpoint.act(*action)?;
    }
    for (after_ns, action) in &case.later {
        listener.listen(endpoint, at_ns + after_ns)?;
        endpoint.act(*action)?;
    }
    listener.listen(endpoint, at_ns + case.known_ns + PROMISED_NS + AFTERWARDS_NS)?;
    listener.lively = true;
    let hello = listener.ask(endpoint, &Command::Hello)?;
    // Nobody at the rig, the arm switch still on: nothing may move by itself. A health record comes each 0.1 s.
    listener.listen(endpoint, endpoint.now_ns() + AFTERWARDS_NS)?;
    let crash_record = match listener.ask(endpoint, &Command::CrashRecord)? {
        Answer::CrashRecord(crash_record) => crash_record,
        _ => None,
    };
    Ok(Seen { at_ns, listener, hello, crash_record })
}

/// Lets a fault happen, and judges.
pub(super) fn verdict(
    firmware: &Firmware,
    running: &Saved,
    scratch: &Path,
    case: &Case,
) -> Result<Verdict, BenchError> {
    let outcome = bench::run_on(firmware, running, scratch, |endpoint| operate(endpoint, case))?;
    let (seen, record) = (outcome.operator, outcome.record);
    let log = defmt_log::decode(&firmware.bytes, &record.log)?;
    let mut problems = Vec::new();
    let mut say = |wrong: bool, problem: String| {
        if wrong {
            problems.push(problem);
        }
    };
    say(
        record.outputs.first().is_none_or(|(_, outputs)| outputs.is_safe()),
        "the rig was not running".to_owned(),
    );
    // From power-up on the record holds only changes, so what is unsafe after this instant is unsafe for good.
    let safe_ns = record.safe_for_good_from(seen.at_ns).map(|at| at - seen.at_ns);
    let limit = case.known_ns + PROMISED_NS;
    say(safe_ns.is_none_or(|safe| safe > limit), format!("outputs are not safe within {} µs", limit / 1000));
    let health = seen.listener.health.unwrap_or_default();
    let mut said = health.fault;
    let faults: &[Fault] = match &case.expected {
        Expected::Latched(fault) | Expected::Restart(_, Some(fault)) => std::slice::from_ref(fault),
        Expected::OneOf(faults) => faults,
        Expected::Restart(_, None) => &[],
    };
    // What happens while the line is cut is not heard; health tells it later.
    let reported =
        |fault: &&Fault| seen.listener.heard_of(fault.number()) || case.deaf && said == fault.number();
    if let Some(fault) = faults.iter().find(reported) {
        said = fault.number();
        let logged = log.lines.iter().any(|line| line.contains("error") && line.contains(fault.sentence()));
        say(!logged, format!("the log does not say: {}", fault.sentence()));
        say(health.fault != fault.number(), format!("its health says {}", words::fault(health.fault)));
    } else if !faults.is_empty() {
        problems.push(format!("the link tells of none of {faults:?} but of {:?}", seen.listener.events));
    }
    let mut text = if said == 0 { "disabled".to_owned() } else { words::fault(said) };
    if let Expected::Restart(cause, _) = case.expected {
        match &seen.hello {
            Answer::Hello(hello) if hello.reset == cause => {
                text = format!("started by {cause:?}; {text}");
            }
            other => problems.push(format!("it does not say that {cause:?} restarted it: {other:?}")),
        }
        let logged = log.lines.iter().any(|line| line.contains(&format!("start after {cause:?}")));
        if !logged {
            problems.push(format!("the log does not say that {cause:?} restarted it"));
        }
    } else if !record.restarts.is_empty() {
        problems.push(format!("it restarted: {:?}", record.restarts));
    }
    // Only a trap leaves a message, which is in the log and over the link.
    let trapped = matches!(case.expected, Expected::Restart(_, Some(Fault::HardFault)));
    match &seen.crash_record {
        Some(crash_record) if trapped && crash_record.text.starts_with("pc ") => {
            if !log.lines.iter().any(|line| line.contains(crash_record.text.as_str())) {
                problems.push(format!("the log does not have the crash record: {}", crash_record.text));
            }
        }
        None if !trapped => {}
        other => problems.push(format!("crash record: {other:?}")),
    }
    if log.malformed > 0 {
        problems.push(format!("{} frames of the log could not be decoded", log.malformed));
    }
    Ok(Verdict { name: case.name, known_ns: case.known_ns, safe_ns, said: text, problems })
}
