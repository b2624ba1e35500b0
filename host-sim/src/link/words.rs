//! What the rig says, in words. Numbers this tool does not know are shown as numbers.

use std::ops::RangeInclusive;

use model_core::control::{Fault, Limit, Mode, Reason, Refusal};
use model_core::extension::Extension;
use model_core::friction::ModelKind;
use rig_link::message::{
    Answer, Command, CrashKind, CrashRecord, EventKind, EventMessage, Hello, Rejection, ResetCause,
};
use rig_link::model::ModelRecord;
use rig_link::settings;

use crate::input_error::{InputError, Kind};

fn or_number(sentence: Option<&str>, what: &str, number: u8) -> String {
    sentence.map_or_else(|| format!("{what} {number}"), str::to_owned)
}

/// A fault by its number.
#[must_use]
pub fn fault(number: u8) -> String {
    format!("fault {number}: {}", or_number(Fault::from_number(number).map(Fault::sentence), "fault", number))
}

/// The limits that act, by their set.
#[must_use]
pub fn limits(set: u16) -> String {
    let sentences: Vec<String> = (0..16)
        .filter(|number| set & (1 << number) != 0)
        .map(|number| or_number(Limit::from_number(number).map(Limit::sentence), "limit", number))
        .collect();
    sentences.join(" ")
}

/// A mode by its number.
#[must_use]
pub fn mode(number: u8) -> String {
    Mode::from_number(number)
        .map_or_else(|| format!("mode {number}"), |mode| format!("{mode:?}").to_lowercase())
}

/// An event, with its time since the start of the firmware.
#[must_use]
pub fn event(event: &EventMessage, tick_hz: u32) -> String {
    #[allow(clippy::cast_precision_loss)]
    let time_s = event.tick as f64 / f64::from(tick_hz.max(1));
    let what = match event.kind {
        EventKind::Mode { from, to, reason } => {
            let reason = or_number(Reason::from_number(reason).map(Reason::sentence), "reason", reason);
            format!("{} -> {}: {reason}", mode(from), mode(to))
        }
        EventKind::FaultLatched(number) => fault(number),
        EventKind::FaultCleared(number) => format!("cleared {}", fault(number)),
        EventKind::Limit(number) => {
            format!("limit: {}", or_number(Limit::from_number(number).map(Limit::sentence), "limit", number))
        }
        EventKind::Refused { reason, fault } => refused(reason, fault),
        EventKind::ProgramLoaded { duration_ticks } => format!("experiment of {duration_ticks} ticks loaded"),
        EventKind::ConfigChanged => "new settings in force".into(),
        EventKind::ModelChanged => "new model in the observer".into(),
        EventKind::Tared { friction_zero_code, normal_zero_code } => {
            format!("tared: friction bridge {friction_zero_code}, normal force bridge {normal_zero_code}")
        }
        EventKind::TareRefused { friction_nm, normal_n } => {
            format!("not tared: too far from zero, {friction_nm} N m and {normal_n} N")
        }
        EventKind::Other => "an event this tool has no words for".into(),
    };
    format!("{time_s:.4} s  {what}")
}

fn refused(reason: u8, in_the_way: Option<u8>) -> String {
    let reason = or_number(Refusal::from_number(reason).map(Refusal::sentence), "refusal", reason);
    let behind = in_the_way.map_or(String::new(), |number| format!(" ({})", fault(number)));
    format!("refused: {reason}{behind}")
}

/// VREF+ as the chip may find it, mV: its regulator is good to 2 %, and the chip's reference drifts by up to 15 mV of 1.216 V
/// over temperature (DS12110 rev 11, table 117), 1.2 %; both together 3 %.
pub const REFERENCE_MV: RangeInclusive<u16> = 3_201..=3_399;

/// Millivolts as volts, with the unit.
#[must_use]
pub fn in_volts(millivolts: u16) -> String {
    format!("{:.3} V", f64::from(millivolts) / 1000.0)
}

/// Who answered.
#[must_use]
pub fn hello(hello: &Hello) -> String {
    let build: String = hello.build_id.iter().take(6).map(|byte| format!("{byte:02x}")).collect();
    let reset = match hello.reset {
        ResetCause::PowerOn => "power-on",
        ResetCause::Pin => "the reset pin",
        ResetCause::Software => "its own request",
        ResetCause::Watchdog => "the watchdog",
        ResetCause::Other => "an unknown reset",
    };
    let clock = if hello.crystal {
        ""
    } else {
        "; without the 8 MHz of the ST-LINK: times and speeds may be off by 1 %"
    };
    let reference = if REFERENCE_MV.contains(&hello.reference_mv) {
        String::new()
    } else {
        format!("; its 3.3 V are {}: analogue readings are off by as much", in_volts(hello.reference_mv))
    };
    format!("firmware {} build {build}, started by {reset}{clock}{reference}", hello.version)
}

/// The crash record from before its last restart.
#[must_use]
pub fn crash_record(message: &CrashRecord, tick_hz: u32) -> String {
    let kind = match message.kind {
        CrashKind::Panic => "stopped itself",
        CrashKind::HardFault => "trapped",
        CrashKind::Exception => "met an interrupt nobody handles",
    };
    #[allow(clippy::cast_precision_loss)]
    let time_s = message.tick as f64 / f64::from(tick_hz.max(1));
    format!("before its last restart the firmware {kind} after {time_s:.4} s: {}", message.text)
}

/// A request, for messages about it.
#[must_use]
pub fn command(command: &Command) -> &'static str {
    match command {
        Command::Hello => "the greeting",
        Command::KeepAlive => "a sign of life",
        Command::Arm => "arm",
        Command::Disarm => "disarm",
        Command::Start => "start",
        Command::Stop => "stop",
        Command::ClearFault => "clear fault",
        Command::Tare => "tare",
        Command::ProgramBegin(_) | Command::ProgramSegment(_) | Command::ProgramCommit => {
            "the upload of the experiment"
        }
        Command::SettingGet { .. } => "the question for a setting",
        Command::SettingSet { .. } => "the change of a setting",
        Command::SettingForget { .. } => "forgetting a setting",
        Command::SettingsErase => "erasing the settings",
        Command::ModelGet => "the question for the model",
        Command::ModelSet(_) => "the upload of the model",
        Command::ModelForget => "forgetting the model",
        Command::Telemetry { .. } => "the rate of telemetry",
        Command::CaptureArm(_) => "arming the capture",
        Command::CaptureTrigger => "triggering the capture",
        Command::CaptureStatus => "the question for the capture",
        Command::CaptureRead { .. } => "reading the capture",
        Command::CrashRecord => "the question for the crash record",
        Command::SelfCheck { .. } => "the self-check",
        Command::Restart => "restart",
        Command::Inputs => "the question for the raw readings",
    }
}

/// The error an answer stands for, if it is one.
///
/// # Errors
/// What the rig refused, in words.
pub fn accepted(answer: &Answer) -> Result<(), InputError> {
    match answer {
        Answer::Refused { reason, fault } => {
            Err(InputError::new(refused(*reason, *fault)).of_kind(Kind::Run))
        }
        Answer::Rejected(rejection) => Err(rejected(rejection)),
        _ => Ok(()),
    }
}

fn rejected(rejection: &Rejection) -> InputError {
    let plain = |text: &str| InputError::new(text).of_kind(Kind::Run);
    match rejection {
        Rejection::UnknownSetting => plain("the firmware does not know this setting"),
        Rejection::OutOfRange { name, value, allowed } => {
            InputError::new("refused by the rig").key(name.as_str()).value(value).allowed(allowed.as_str())
        }
        Rejection::IncompleteProgram => plain("the experiment did not arrive whole"),
        Rejection::ImpossibleProgram { why } => {
            InputError::new(format!("the rig cannot run this experiment: {why}"))
        }
        Rejection::NotDisabled => plain("possible only while the rig is disabled"),
        Rejection::Storage => {
            plain("the rig could not store it; if its settings are damaged, erase them first")
        }
        Rejection::NoCapture => plain("there is no complete capture"),
        Rejection::UnknownCase => plain("the firmware has no such self-check"),
        Rejection::NoTick => plain("the rig's control tick did not answer"),
    }
}

/// An answer of the wrong kind.
#[must_use]
pub fn unexpected(answer: &Answer) -> InputError {
    let odd = || InputError::new("the rig gave an answer of another kind").of_kind(Kind::Rig);
    accepted(answer).err().unwrap_or_else(odd)
}

/// The observer's model as a model file; without one in store the firmware's default.
#[must_use]
pub fn model(stored: Option<&ModelRecord>) -> String {
    let (model, default) = match stored {
        Some(model) => (model.clone(), ""),
        None => (ModelRecord::default(), "# nothing is stored: the firmware's default\n"),
    };
    let mut text = default.to_owned();
    let friction = &model.friction;
    text += &format!("kind = \"{}\"\n\n[parameters]\n", friction.kind);
    match ModelKind::with_name(&friction.kind) {
        Some(kind) => {
            for (spec, value) in kind.parameters().iter().zip(&friction.values) {
                text += &format!("{} = {value:?}\n", spec.name);
            }
        }
        // The patch of the observer, or a model of a later firmware.
        None => text += &format!("# a kind that no model file has; its values: {:?}\n", friction.values),
    }
    for effect in &model.effects {
        text += &format!("\n[[extension]]\nid = \"{}\"\n", effect.id);
        let names = Extension::with_id(&effect.id).map(Extension::names).unwrap_or_default();
        for (name, value) in names.iter().zip(&effect.values) {
            text += &format!("{name} = {value:?}\n");
        }
    }
    text.trim_end().to_owned()
}

/// A setting with its name, values and unit, as a line of a list.
#[must_use]
pub fn setting(state: &settings::SettingState) -> String {
    let info = settings::by_key(state.key);
    let name = info.map_or_else(|| format!("setting {}", state.key), |info| info.name.to_owned());
    let unit = info.map_or("", |info| info.unit);
    let stored = state.stored.map_or_else(|| "-".to_owned(), |value| value.to_string());
    format!("{name:40} {:>14} {stored:>14} {:>14}  {unit}", state.active, state.default)
}
