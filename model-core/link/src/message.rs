//! Messages: what the host asks, and what the rig answers or says by itself.
//!
//! Numbered enumerations of the control core (mode, fault, limit, refusal, reason) travel as their
//! stable numbers, so that an older host still shows the number of what it does not know.
//! The order of members in these enumerations is the wire format: new members go to the end, and
//! [`PROTOCOL_VERSION`] rises when an old one changes.

use crate::capture::{CaptureInfo, CaptureTrigger};
use crate::inputs::Inputs;
use crate::model::ModelRecord;
use crate::program::{ProgramHeader, ProgramSegment};
use crate::settings::SettingState;
use crate::telemetry::{Health, TelemetryRow};
use heapless::{String, Vec};
use serde::{Deserialize, Serialize};

/// Rises whenever an old peer would misread a message.
pub const PROTOCOL_VERSION: u16 = 5;

/// The most bytes of a capture in one answer.
pub const CAPTURE_CHUNK: usize = 480;

/// The most characters of the text of a crash record.
pub const CRASH_TEXT: usize = 200;

/// From the host: a command, and the number its answer will carry.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Request {
    /// Chosen by the host; the answer repeats it.
    pub id: u16,
    /// What to do.
    pub command: Command,
}

/// What the host can ask for.
// The firmware has one of these at a time, and no allocator to box a model with.
#[allow(clippy::large_enum_variant)]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum Command {
    /// Who is there.
    Hello,
    /// The host that runs the experiment is still there.
    KeepAlive,
    /// Enable the drives at zero torque.
    Arm,
    /// Drives off at once.
    Disarm,
    /// Run the loaded experiment.
    Start,
    /// End the run, bring both motors to rest.
    Stop,
    /// Clear latched faults whose causes are gone.
    ClearFault,
    /// Take what the bridges read now as zero.
    Tare,
    /// Begin an upload; what was uploaded before and not committed is forgotten.
    ProgramBegin(ProgramHeader),
    /// The next segment of the upload, in order, M1's before M2's.
    ProgramSegment(ProgramSegment),
    /// Check what was uploaded and load it.
    ProgramCommit,
    /// One setting: default, stored and active value.
    SettingGet {
        /// Its key.
        key: u16,
    },
    /// Store a value and use it; only while disabled.
    SettingSet {
        /// Its key.
        key: u16,
        /// The value.
        value: f32,
    },
    /// Forget the stored value and use the default; only while disabled.
    SettingForget {
        /// Its key.
        key: u16,
    },
    /// Erase all settings and the model, and use defaults: the way out of damaged settings.
    SettingsErase,
    /// The observer's model.
    ModelGet,
    /// Store a model and use it in the observer from now on.
    ModelSet(ModelRecord),
    /// Forget the stored model and use the default.
    ModelForget,
    /// A telemetry row every `every_ticks` control ticks; 0 stops it.
    Telemetry {
        /// Distance of two rows.
        every_ticks: u16,
    },
    /// Record every tick, and freeze after the trigger.
    CaptureArm(CaptureTrigger),
    /// Trigger now.
    CaptureTrigger,
    /// Where the capture is.
    CaptureStatus,
    /// Bytes of the frozen capture from `offset` on, oldest row first.
    CaptureRead {
        /// First byte.
        offset: u32,
    },
    /// The crash record: what the firmware kept from before its last restart.
    CrashRecord,
    /// Run one case of the bit-identity check on the chip.
    SelfCheck {
        /// Number of the case in `model_core::selfcheck`.
        case: u8,
        /// Random steps.
        steps: u32,
    },
    /// Restart the firmware; only while disabled.
    Restart,
    /// Raw readings of this tick.
    Inputs,
}

impl Command {
    /// Whether the request shows that the host is there that runs the experiment. What others ask meanwhile, to
    /// look on, must not keep a run alive whose host is gone.
    #[must_use]
    pub const fn is_sign_of_life(&self) -> bool {
        matches!(self, Self::KeepAlive | Self::Start)
    }
}

/// From the rig.
// The rows are by far the most frequent messages; boxing them needs an allocator.
#[allow(clippy::large_enum_variant)]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum Message {
    /// The answer to the request of this number.
    Answer {
        /// Number of the request.
        id: u16,
        /// What came of it.
        answer: Answer,
    },
    /// A row of telemetry.
    Telemetry(TelemetryRow),
    /// State and counters, ten times a second.
    Health(Health),
    /// Something happened.
    Event(EventMessage),
}

/// What came of a request.
#[allow(clippy::large_enum_variant)]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum Answer {
    /// Done.
    Done,
    /// Who is here.
    Hello(Hello),
    /// The supervisor refused.
    Refused {
        /// Number of the refusal, `model_core::control::command::Refusal`.
        reason: u8,
        /// Number of the fault in the way.
        fault: Option<u8>,
    },
    /// The request itself was at fault.
    Rejected(Rejection),
    /// A setting.
    Setting(SettingState),
    /// The observer's stored model; without one it runs `ModelRecord::default()`.
    Model(Option<ModelRecord>),
    /// The state of the capture.
    Capture(CaptureInfo),
    /// Bytes of the capture.
    CaptureBytes {
        /// Of the first byte.
        offset: u32,
        /// The bytes.
        bytes: Vec<u8, CAPTURE_CHUNK>,
    },
    /// The crash record from before the last restart.
    CrashRecord(Option<CrashRecord>),
    /// Digest of a self-check.
    SelfCheck {
        /// Digest over the bits of all results.
        digest: u64,
    },
    /// Raw readings.
    Inputs(Inputs),
}

/// Why a request was not carried out before it reached the supervisor.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum Rejection {
    /// No setting has this key.
    UnknownSetting,
    /// The value of a parameter is out of range.
    OutOfRange {
        /// Name of the parameter.
        name: String<40>,
        /// What was refused.
        value: f32,
        /// What is allowed.
        allowed: String<80>,
    },
    /// Segments came out of order, too many or too few.
    IncompleteProgram,
    /// The experiment asks for something the rig cannot do.
    ImpossibleProgram {
        /// Why, in words.
        why: String<120>,
    },
    /// Possible only while disabled.
    NotDisabled,
    /// The flash refused.
    Storage,
    /// The capture is not frozen, or the offset is beyond its end.
    NoCapture,
    /// There is no such self-check.
    UnknownCase,
    /// The control tick did not answer.
    NoTick,
}

/// Who is here.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Hello {
    /// [`PROTOCOL_VERSION`] of the firmware.
    pub protocol: u16,
    /// `settings::SCHEMA_VERSION` of the firmware.
    pub settings_schema: u16,
    /// Version of the firmware.
    pub version: String<24>,
    /// Build id the linker derived from the contents of the ELF.
    pub build_id: [u8; 20],
    /// Control ticks per second.
    pub tick_hz: u32,
    /// Encoder counts per revolution, as set.
    pub counts_per_rev: u32,
    /// Why the chip started.
    pub reset: ResetCause,
    /// The clock comes from the 8 MHz of the ST-LINK, not from the chip's own oscillator. What they are worth is another
    /// question: they may be an RC oscillator's too.
    pub crystal: bool,
    /// There is a crash record from before the last restart.
    pub crash_record: bool,
    /// VREF+, of which every analogue code is a share, as the chip measured it at its start, mV; 3300 is right.
    pub reference_mv: u16,
}

/// Why the chip started.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum ResetCause {
    /// Power came on or fell below the brown-out level.
    PowerOn,
    /// The reset pin or the debugger.
    Pin,
    /// The firmware asked for it.
    Software,
    /// The watchdog.
    Watchdog,
    /// Another cause.
    #[default]
    Other,
}

/// What the firmware kept in memory across its last restart, when it could not go on.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CrashRecord {
    /// What stopped it.
    pub kind: CrashKind,
    /// Control tick at that moment.
    pub tick: u64,
    /// The message: of a panic its words and place, of a trap the registers.
    pub text: String<CRASH_TEXT>,
}

/// What stopped the firmware.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum CrashKind {
    /// A panic.
    Panic,
    /// A hard fault.
    HardFault,
    /// An interrupt nobody handles, or the clock failed.
    Exception,
}

/// An event of the control core with its numbers.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct EventMessage {
    /// Control tick.
    pub tick: u64,
    /// What happened.
    pub kind: EventKind,
}

/// What happened, by numbers of the control core's enumerations.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum EventKind {
    /// The mode changed.
    Mode {
        /// Mode left.
        from: u8,
        /// Mode entered.
        to: u8,
        /// Why.
        reason: u8,
    },
    /// A fault was latched.
    FaultLatched(u8),
    /// A fault was cleared.
    FaultCleared(u8),
    /// A limit began to act.
    Limit(u8),
    /// A command was refused.
    Refused {
        /// Why.
        reason: u8,
        /// The fault in the way.
        fault: Option<u8>,
    },
    /// An experiment was loaded.
    ProgramLoaded {
        /// Its length.
        duration_ticks: u32,
    },
    /// New settings are in force.
    ConfigChanged,
    /// The observer runs another model.
    ModelChanged,
    /// New zeros of the bridges.
    Tared {
        /// Zero of the friction bridge, code.
        friction_zero_code: f32,
        /// Zero of the normal force bridge, code.
        normal_zero_code: f32,
    },
    /// The bridges were too far from zero.
    TareRefused {
        /// Friction torque read.
        friction_nm: f32,
        /// Normal force read.
        normal_n: f32,
    },
    /// An event this version has no words for.
    Other,
}
