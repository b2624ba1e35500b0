//! What can go wrong on the rig, its wires and its chip, and what the firmware must make of it in each state.
//!
//! When a fault can be known follows from the firmware's own settings (how many samples in a row, which time-out), from the
//! derivation beside a check, or from the watchdog's; it counts from the access that saw the fault.

use super::states::State;
use crate::driver::PERIOD;
use crate::outside::{Action, ReferenceWire};
use crate::part::Motor;
use crate::part::encoder_timer::Line;
use crate::pins;
use crate::sighting::Sighting;
use model_core::control::Fault;
use rig_link::message::{Command, ResetCause};
use rigless::soc::stm32h743::generated::USART3;

/// The watchdog's count: 16 counts of 4 LSI cycles (firmware/src/watchdog.rs), and one LSI cycle of phase.
const WATCHDOG_NS: u64 = 2_000_000 + 31_250;
/// The tick feeds the watchdog as long as the threads were heard within this time (firmware/src/watchdog.rs).
const THREADS_NS: u64 = 500_000_000;
/// A voltage the amplifier of a bridge clips to (99 % of the range), and what a broken or shorted wire is pulled to.
const CLIPPED_MICROVOLT: u32 = 3_267_500;
const OPEN_MICROVOLT: u32 = 3_299_000;
const SHORT_MICROVOLT: u32 = 1_000;
/// A reference wire that fails gives a deviation D of at least 1.6 N·m at the torques of these states, of which at most
/// 0.4 + 0.1·4.8 N·m are tolerated: A/(D − b) + τ·D/(D − b) of model-core/src/control/torque_watch.rs, and two periods.
const WIRE_NS: u64 = 9_100_000;
/// Windows of the encoder watch (20 ms) until a dead encoder of a motor that moves or is pushed shows.
const ENCODER_NS: u64 = 40_000_000;
/// Scans until two in a row of a loose contact are open: the chance that there were none is 1e-9.
const LOOSE_SCANS: u64 = 100;

/// What the firmware must make of a fault.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Expect {
    /// It latches one of these, which one depends on the phase of the motion, and is safe two control periods after the
    /// fault can be known: so long after the access that saw it, ns.
    Latches(&'static [Fault], u64),
    /// Drives are off: it shows one of these as what stands in the way of arming.
    Hinders(&'static [Fault]),
    /// The chip restarts for this cause, safe so long after the access, and latches this fault then.
    Restarts(ResetCause, Option<Fault>, u64),
    /// It goes on, and the rig stays within its limits.
    Bears,
    /// It goes on within the rig's limits, or latches one of these once it shows: at rest a dead encoder shows nothing.
    BearsOrLatches(&'static [Fault]),
    /// A bit of memory: whatever comes of it, the rig stays within its limits, and no drive is enabled that was not.
    Whatever,
}

/// What the host does meanwhile.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Host {
    /// Gives signs of life.
    Lively,
    /// Is silent.
    Silent,
    /// Is silent and hears nothing.
    Deaf,
    /// Sends as much as the line takes: requests that this state must refuse.
    Floods,
    /// Asks now and then.
    Asks,
}

/// One fault.
#[derive(Debug, Clone)]
pub struct FaultCase {
    /// In words.
    pub name: String,
    /// What is done to the rig.
    pub actions: Vec<Action>,
    /// Done so long after the fault, ns.
    pub later: Vec<(u64, Action)>,
    /// What puts it right.
    pub repair: Vec<Action>,
    /// What shows that it acted.
    pub sighting: Sighting,
    /// The host meanwhile.
    pub host: Host,
    expect: fn(State) -> Expect,
    /// Its cause stands for so long after it was put right, ns.
    pub lasts_ns: u64,
    /// Stands for bits of memory, which are drawn.
    pub is_flip: bool,
}

impl FaultCase {
    /// What the firmware must make of it.
    #[must_use]
    pub fn expect(&self, state: State) -> Expect {
        (self.expect)(state)
    }

    fn repaired(mut self, repair: &[Action]) -> Self {
        self.repair = repair.to_vec();
        self
    }

    fn then(mut self, after_ns: u64, action: Action) -> Self {
        self.later.push((after_ns, action));
        self
    }

    fn host(mut self, host: Host) -> Self {
        self.host = host;
        self
    }
}

fn case(
    name: impl Into<String>,
    actions: &[Action],
    sighting: Sighting,
    expect: fn(State) -> Expect,
) -> FaultCase {
    FaultCase {
        name: name.into(),
        actions: actions.to_vec(),
        later: Vec::new(),
        repair: Vec::new(),
        sighting,
        host: Host::Lively,
        expect,
        lasts_ns: 0,
        is_flip: false,
    }
}

/// Latches in all states with the drives on, stands in the way of arming in the other.
macro_rules! latches {
    ($within:expr, $($fault:ident),+) => {
        |state| {
            const FAULTS: &[Fault] = &[$(Fault::$fault),+];
            if state.is_live() { Expect::Latches(FAULTS, $within) } else { Expect::Hinders(FAULTS) }
        }
    };
}

/// Shows or not by how the motor moves, while the drives are on.
macro_rules! may_show {
    ($($fault:ident),+) => {
        |state| {
            const FAULTS: &[Fault] = &[$(Fault::$fault),+];
            if state.is_live() { Expect::BearsOrLatches(FAULTS) } else { Expect::Bears }
        }
    };
}

/// Shows within a period at the speed of sliding, or not by how the disc moves elsewhere.
macro_rules! shows_sliding {
    ($($fault:ident),+) => {
        |state| {
            const FAULTS: &[Fault] = &[$(Fault::$fault),+];
            match state {
                State::Idle => Expect::Bears,
                State::Sliding => Expect::Latches(FAULTS, PERIOD),
                _ => Expect::BearsOrLatches(FAULTS),
            }
        }
    };
}

/// Latches within a period with the drives on, and is gone by the time anybody arms.
macro_rules! latches_while_live {
    ($fault:ident) => {
        |state| if state.is_live() { Expect::Latches(&[Fault::$fault], PERIOD) } else { Expect::Bears }
    };
}

/// Two samples in a row of a contact that is open by chance in every second scan.
macro_rules! loose {
    ($($fault:ident),+) => {
        |state| {
            const FAULTS: &[Fault] = &[$(Fault::$fault),+];
            // With the drives off it shows and is gone again.
            if state.is_live() { Expect::Latches(FAULTS, LOOSE_SCANS * PERIOD) } else { Expect::Bears }
        }
    };
}

const BRIDGE_NS: u64 = PERIOD;
const SUPPLY_NS: u64 = 10_000_000;

/// All of them.
#[must_use]
pub fn all() -> Vec<FaultCase> {
    let mut all = lines();
    all.extend(encoders());
    all.extend(analogue());
    all.extend(references());
    all.extend(link());
    all.extend(chip());
    all
}

/// Switches and fault lines.
fn lines() -> Vec<FaultCase> {
    let low = |place: pins::Place| Sighting::Bit {
        register: place.input_register(),
        bit: place.bit(),
        level: false,
    };
    let stop = low(pins::STOP_RELEASED);
    let [m1, m2] = pins::DRIVE_HEALTHY.map(low);
    vec![
        case("emergency stop pressed", &[Action::EmergencyStop(true)], stop, latches!(0, EmergencyStop))
            .repaired(&[Action::EmergencyStop(false)]),
        case("emergency stop tapped for 5 ms", &[Action::EmergencyStop(true)], stop, |state| {
            if state.is_live() { Expect::Latches(&[Fault::EmergencyStop], 0) } else { Expect::Bears }
        })
        .then(5_000_000, Action::EmergencyStop(false)),
        case("M1 drive fault", &[Action::DriveHealthy(Motor::M1, false)], m1, latches!(0, M1DriveFault))
            .repaired(&[Action::DriveHealthy(Motor::M1, true)]),
        case("M2 drive fault", &[Action::DriveHealthy(Motor::M2, false)], m2, latches!(0, M2DriveFault))
            .repaired(&[Action::DriveHealthy(Motor::M2, true)]),
    ]
}

fn encoders() -> Vec<FaultCase> {
    let mut all = Vec::new();
    for (line, level, what) in [
        (Line::A, false, "A stuck low"),
        (Line::A, true, "A stuck high"),
        (Line::B, false, "B stuck low"),
        (Line::B, true, "B stuck high"),
    ] {
        let stuck = |motor, level| [Action::EncoderLine(motor, line, level)];
        // At speed a dead line is a jump of the speed, seen in the first whole period without counts.
        all.push(
            case(
                format!("M2 encoder line {what}"),
                &stuck(Motor::M2, Some(level)),
                Sighting::Encoder(Motor::M2),
                shows_sliding!(M2EncoderJump, M2EncoderNoTorque, M2EncoderNoCounts),
            )
            .repaired(&stuck(Motor::M2, None)),
        );
        all.push(
            case(
                format!("M1 encoder line {what}"),
                &stuck(Motor::M1, Some(level)),
                Sighting::Encoder(Motor::M1),
                may_show!(M1EncoderJump, M1EncoderNoTorque, M1EncoderNoCounts),
            )
            .repaired(&stuck(Motor::M1, None)),
        );
    }
    for (motor, expect) in [
        (Motor::M1, may_show!(M1EncoderJump, M1EncoderNoTorque) as fn(State) -> Expect),
        (Motor::M2, shows_sliding!(M2EncoderJump, M2EncoderNoTorque, OverSpeed)),
    ] {
        let name = format!("{motor:?} encoder A and B swapped");
        let swapped = case(name, &[Action::EncoderSwapped(motor, true)], Sighting::Encoder(motor), expect);
        all.push(swapped.repaired(&[Action::EncoderSwapped(motor, false)]));
    }
    for (motor, expect) in [
        (Motor::M1, latches_while_live!(M1EncoderJump) as fn(State) -> Expect),
        (Motor::M2, latches_while_live!(M2EncoderJump)),
    ] {
        let name = format!("{motor:?} encoder jumps by 200 counts");
        all.push(case(name, &[Action::EncoderJump(motor, 200)], Sighting::Encoder(motor), expect));
        let name = format!("{motor:?} encoder disturbed by pulses of 20 ns");
        let pulses =
            case(name, &[Action::EncoderDisturbed(motor, 20)], Sighting::Encoder(motor), |_| Expect::Bears);
        all.push(
            (1..10).fold(pulses, |case, ms| case.then(ms * 1_000_000, Action::EncoderDisturbed(motor, 20))),
        );
    }
    all
}

/// The five analogue inputs: open, shorted, saturated, frozen, with a loose contact.
fn analogue() -> Vec<FaultCase> {
    type Rule = fn(State) -> Expect;
    let rules: [(&str, [Rule; 4]); 5] = [
        (
            "friction bridge",
            [
                latches!(BRIDGE_NS, FrictionBridgeOpen),
                latches!(BRIDGE_NS, FrictionBridgeShort),
                latches!(BRIDGE_NS, FrictionBridgeSaturated),
                loose!(FrictionBridgeOpen, FrictionBridgeSaturated, M2TorqueMismatch, M2EncoderNoTorque),
            ],
        ),
        (
            "normal-force bridge",
            [
                latches!(BRIDGE_NS, NormalBridgeOpen, OverForce),
                latches!(BRIDGE_NS, NormalBridgeShort),
                // A normal force near the bridge's end is an over-force too, and both need two samples.
                latches!(BRIDGE_NS, NormalBridgeSaturated, OverForce),
                loose!(NormalBridgeOpen, NormalBridgeSaturated, OverForce),
            ],
        ),
        (
            "M1 torque monitor",
            [
                latches!(BRIDGE_NS, M1OverTorque, M1TorqueMismatch),
                latches!(BRIDGE_NS, M1OverTorque, M1TorqueMismatch),
                latches!(BRIDGE_NS, M1OverTorque, M1TorqueMismatch),
                loose!(M1OverTorque, M1TorqueMismatch),
            ],
        ),
        (
            "M2 torque monitor",
            [
                latches!(BRIDGE_NS, M2OverTorque, M2TorqueMismatch),
                latches!(BRIDGE_NS, M2OverTorque, M2TorqueMismatch),
                latches!(BRIDGE_NS, M2OverTorque, M2TorqueMismatch),
                loose!(M2OverTorque, M2TorqueMismatch, M2EncoderNoTorque),
            ],
        ),
        (
            "supply check",
            [
                latches!(SUPPLY_NS, SupplyHigh),
                latches!(SUPPLY_NS, SupplyLow),
                latches!(SUPPLY_NS, SupplyHigh),
                // Every second scan is right, and it takes a hundred in a row: it only watches, and nothing is lost.
                |_| Expect::Bears,
            ],
        ),
    ];
    let mut all = Vec::new();
    for (index, (name, [open, short, saturated, loose])) in rules.into_iter().enumerate() {
        let seen = Sighting::Analogue;
        let whole = [Action::AnalogueInput(index, None)];
        for (what, microvolt, expect) in [
            ("open", OPEN_MICROVOLT, open),
            ("shorted", SHORT_MICROVOLT, short),
            ("saturated", CLIPPED_MICROVOLT, saturated),
        ] {
            let held = [Action::AnalogueInput(index, Some(microvolt))];
            all.push(case(format!("{name} {what}"), &held, seen, expect).repaired(&whole));
        }
        let frozen: Rule = latches!(FROZEN_NS, AnalogueFrozen);
        all.push(
            case(format!("{name} frozen"), &[Action::AnalogueFrozen(index)], seen, frozen).repaired(&whole),
        );
        let action = [Action::AnalogueLoose(index, true)];
        let name = format!("{name} noisy: a loose contact");
        all.push(case(name, &action, seen, loose).repaired(&[Action::AnalogueLoose(index, false)]));
    }
    let low = [Action::AnalogueInput(4, Some(1_636_000))];
    all.push(
        case("supply down to 18 V", &low, Sighting::Analogue, latches!(SUPPLY_NS, SupplyLow))
            .repaired(&[Action::AnalogueInput(4, None)]),
    );
    // A scan that does not come is missed at the end of its period.
    all.push(
        case(
            "ADC starts no more scans",
            &[Action::AdcStalled(true)],
            Sighting::Scan,
            latches!(STALLED_NS, AdcStalled),
        )
        .repaired(&[Action::AdcStalled(false)]),
    );
    all.push(case("ADC scan cut short", &[Action::AdcScanCut], Sighting::Scan, |_| Expect::Bears));
    all
}

/// 50 ms at one code: the settings' default.
const FROZEN_NS: u64 = 500 * PERIOD;
const STALLED_NS: u64 = 2 * PERIOD;

/// The wires of the torque references, and what a drive makes of them.
fn references() -> Vec<FaultCase> {
    let mut all = Vec::new();
    for (wire, what) in [
        (ReferenceWire::Open, "reference open"),
        (ReferenceWire::Reversed, "drive with reversed sign"),
        (ReferenceWire::Scaled(0.5), "drive with half the gain"),
        (ReferenceWire::Held(2048), "drive ignores its reference"),
    ] {
        for motor in Motor::ALL {
            let expect: fn(State) -> Expect = match (motor, wire) {
                (Motor::M1, ReferenceWire::Open) => |state| match state {
                    State::Idle => Expect::Bears,
                    _ => Expect::Latches(&[Fault::M1TorqueMismatch, Fault::OverForce], WIRE_NS),
                },
                (Motor::M1, _) => |state| match state {
                    State::Idle | State::Armed => Expect::Bears,
                    _ => Expect::Latches(&[Fault::M1TorqueMismatch], WIRE_NS),
                },
                (Motor::M2, ReferenceWire::Open) => |state| match state {
                    State::Idle => Expect::Bears,
                    _ => Expect::Latches(&[Fault::M2TorqueMismatch, Fault::M2EncoderJump], WIRE_NS),
                },
                (Motor::M2, _) => |state| match state {
                    State::Idle | State::Armed => Expect::Bears,
                    // 4.8 N·m are asked for. While the speed is held the loop asks for what it needs, at rest for next to
                    // nothing, and a disc driven the other way shows in its encoder too.
                    State::Torque => Expect::Latches(&[Fault::M2TorqueMismatch], WIRE_NS),
                    _ => Expect::BearsOrLatches(&[Fault::M2TorqueMismatch, Fault::M2EncoderNoTorque]),
                },
            };
            let actions = [Action::Reference(motor, wire)];
            let repair = [Action::Reference(motor, ReferenceWire::Whole)];
            all.push(
                case(format!("{motor:?} {what}"), &actions, Sighting::Analogue, expect).repaired(&repair),
            );
        }
    }
    all
}

fn link() -> Vec<FaultCase> {
    let silence = Sighting::Silence(LINK_NS / 2);
    let lost: fn(State) -> Expect = |state| match state {
        State::Idle => Expect::Bears,
        _ => Expect::Latches(&[Fault::LinkLost], LINK_NS / 2),
    };
    let damaged = Sighting::Bit { register: USART3.base + 0x1C, bit: 1, level: true };
    vec![
        case("host silent", &[], silence, lost).host(Host::Silent),
        // The line is whole again before the reason is asked for.
        case("serial line cut", &[Action::LinkSilent(true)], silence, lost)
            .host(Host::Deaf)
            .then(LINK_NS + 20_000_000, Action::LinkSilent(false)),
        // Nobody hears the host any more, and the host does not know it.
        case("receiver's stream locks up", &[Action::ReceiverLocked(true)], silence, lost)
            .then(LINK_NS + 20_000_000, Action::ReceiverLocked(false)),
        case("flood of valid frames in the wrong state", &[], Sighting::Bytes(1000), |_| Expect::Bears)
            .host(Host::Floods),
        case("5 % of the bytes to the chip damaged", &[Action::LinkGarbled(50_000)], damaged, |_| {
            Expect::Bears
        })
        .host(Host::Asks)
        .repaired(&[Action::LinkGarbled(0)]),
    ]
}

/// The time after which a silent host is a fault.
const LINK_NS: u64 = 500_000_000;

fn chip() -> Vec<FaultCase> {
    let watchdog: fn(State) -> Expect =
        |_| Expect::Restarts(ResetCause::Watchdog, Some(Fault::WatchdogReset), WATCHDOG_NS);
    let trap: fn(State) -> Expect = |_| Expect::Restarts(ResetCause::Software, Some(Fault::HardFault), 0);
    vec![
        case("control tick hangs", &[Action::HangTick], Sighting::Code, watchdog),
        case("hang with interrupts off", &[Action::HangMasked], Sighting::Code, watchdog),
        case("threads hang, the tick goes on", &[Action::HangThreads], Sighting::Code, |_| {
            Expect::Restarts(ResetCause::Watchdog, Some(Fault::WatchdogReset), THREADS_NS + WATCHDOG_NS)
        }),
        case("control tick traps", &[Action::TrapTick], Sighting::Code, trap),
        case("bus error in the control tick", &[Action::BusError], Sighting::Code, trap),
        case("the 8 MHz fail", &[Action::ClockFails], Sighting::Code, trap),
        case("the supply falls", &[Action::SupplyFalls], Sighting::Code, trap),
        case("interrupts masked over the end of a period", &[MASK], Sighting::Code, |_| Expect::Bears),
        FaultCase {
            lasts_ns: LEAK_NS,
            ..case(
                "ticks that are not a period apart",
                &[IRREGULAR],
                Sighting::Code,
                latches!(IRREGULAR_NS, TickIrregular),
            )
        },
        case("reset pin pulled", &[Action::ResetPin], Sighting::Restart, |_| {
            Expect::Restarts(ResetCause::Pin, None, 0)
        }),
        case("power cut for 5 ms", &[Action::Power(false)], Sighting::Restart, |_| {
            Expect::Restarts(ResetCause::PowerOn, None, 0)
        })
        .then(5_000_000, Action::Power(true)),
        FaultCase {
            is_flip: true,
            ..case("a bit of the control state turns over", &[], Sighting::Restart, |_| Expect::Whatever)
        },
    ]
}

const MASK: Action = Action::MaskInterrupts { times: 5, from_ns: 98_000, for_ns: 10_000 };

/// Each makes a tick 40 µs late: the distance to the tick before is too long and to the next too short. Five are forgiven.
const IRREGULAR: Action = Action::MaskInterrupts { times: 6, from_ns: 3_500, for_ns: 40_000 };
/// The third comes so long after the first, as the link's interrupt comes with each row of telemetry.
const IRREGULAR_NS: u64 = 3_000_000;
/// Of the ticks that were counted one is forgotten a second.
const LEAK_NS: u64 = 1_000_000_000;

/// A request that the rig must refuse, or that changes nothing, in this state.
#[must_use]
pub fn unwanted(state: State, nth: usize) -> Command {
    let off = [
        Command::Start,
        Command::Stop,
        Command::ClearFault,
        Command::ProgramCommit,
        Command::CaptureRead { offset: 3 },
    ];
    let armed = [Command::Arm, Command::Stop, Command::ModelForget, Command::SettingsErase, Command::Restart];
    let running = [
        Command::Arm,
        Command::Start,
        Command::Tare,
        Command::ModelForget,
        Command::SettingSet { key: 143, value: 20.0 },
        Command::SettingsErase,
        Command::Restart,
        Command::ClearFault,
    ];
    let commands: &[Command] = match state {
        State::Idle => &off,
        State::Armed => &armed,
        _ => &running,
    };
    commands[nth % commands.len()].clone()
}

/// How long the operator watches after the fault: until it can be known, what is promised, and what the reason takes to
/// come over the link.
#[must_use]
pub fn watch_ns(case: &FaultCase, state: State) -> u64 {
    const REASON_NS: u64 = 20_000_000;
    let known = match case.expect(state) {
        // From the fault itself, where silence has to last before it is seen.
        Expect::Latches(_, within) if matches!(case.sighting, Sighting::Silence(_)) => within + LINK_NS / 2,
        Expect::Latches(_, within) => within,
        // The start, with its self-check of 0.1 s, and what was latched then.
        Expect::Restarts(_, _, within) => within + 160_000_000,
        Expect::Hinders(_) => 55_000_000,
        Expect::BearsOrLatches(_) => ENCODER_NS,
        Expect::Bears if matches!(case.sighting, Sighting::Silence(_)) => LINK_NS + 20_000_000,
        Expect::Bears | Expect::Whatever => 30_000_000,
    };
    let later = case.later.iter().map(|(after, _)| *after).max().unwrap_or_default();
    known.max(later) + REASON_NS + LOOSE_SCANS * u64::from(is_loose(case)) * PERIOD
}

fn is_loose(case: &FaultCase) -> bool {
    case.actions.iter().any(|action| matches!(action, Action::AnalogueLoose(..)))
}
