//! What is around the chip and what can be done to it: switches, drives, wires, supply, and the plant.

use crate::part::Motor;
use crate::part::encoder_timer::{Edge, Line};
use rigless::time::VirtualNanos;
use serde::{Deserialize, Serialize};

/// What reaches the plant in one control period.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct DriveInputs {
    /// Torque references as DAC codes; `None` while the chip leaves the pin floating.
    pub dac: [Option<u16>; 2],
    /// Drive enables.
    pub enabled: [bool; 2],
}

impl DriveInputs {
    /// Drives off, and no reference other than zero torque: what every fault must end in. While the chip is in
    /// reset its pins float, and the drives that are off do not mind.
    #[must_use]
    pub fn is_safe(&self) -> bool {
        self.enabled == [false; 2] && self.dac.iter().all(|code| matches!(code, None | Some(2048)))
    }
}

/// Something a person does to the rig by hand.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Hand {
    /// Turns the disc by so many turns.
    TurnDisc(f64),
    /// Presses on M1's shaft with this torque, N·m; 0 lets go.
    PressM1(f64),
    /// Hangs a known torque on the friction bridge, N·m.
    LoadFriction(f64),
    /// Hangs a known force on the normal force bridge, N.
    LoadNormal(f64),
}

/// What the plant shows at the end of a control period.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Sensors {
    /// Voltages at the analogue inputs in the order of the scan, µV: friction, normal, M1, M2, supply.
    pub microvolt: [u32; 5],
}

/// How the plant truly moves, whatever its sensors show.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Motion {
    /// Torques of M1 and M2, N·m.
    pub torque_nm: [f64; 2],
    /// Angle of the disc, rad.
    pub disc_angle_rad: f64,
    /// Speed of the disc, rad/s.
    pub disc_speed_rad_s: f64,
    /// Normal force, N.
    pub normal_force_n: f64,
}

/// The plant behind the chip's pins, one control period at a time.
pub trait PlantSide: Send + Sync {
    /// What it shows before anything moved.
    fn sensors(&mut self) -> Sensors;
    /// One control period with these inputs, from `at` on; `edge` takes each encoder's edges in the order of time.
    fn step(&mut self, at: VirtualNanos, inputs: &DriveInputs, edge: &mut dyn FnMut(Motor, Edge)) -> Sensors;
    /// Does something to it by hand. A plant without hands feels nothing.
    fn touch(&mut self, hand: Hand) {
        let _ = hand;
    }
    /// How it moves, truly.
    fn motion(&self) -> Motion;
    /// The same plant in the same state.
    fn duplicate(&self) -> Box<dyn PlantSide>;
}

/// Bytes of a word of the chip's flash, which is programmed whole.
pub const FLASH_WORD: usize = 32;

/// Something done to the rig, at the start of a control period.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Action {
    /// The arm switch is turned.
    ArmSwitch(bool),
    /// The emergency stop is pressed (true) or released.
    EmergencyStop(bool),
    /// A drive reports healthy or not.
    DriveHealthy(Motor, bool),
    /// A line of an encoder sticks at a level, or is free again.
    EncoderLine(Motor, Line, Option<bool>),
    /// A and B of an encoder are swapped, or right again.
    EncoderSwapped(Motor, bool),
    /// The plugs of the two encoders are exchanged, or right again.
    EncodersExchanged(bool),
    /// The plugs of the two bridges are exchanged, or right again.
    BridgesExchanged(bool),
    /// The signal wires of a bridge, friction (0) or normal force (1), are exchanged, or right again.
    BridgeReversed(usize, bool),
    /// The motor turns the other way than its drive believes, or right again: two of its phases are exchanged.
    MotorReversed(Motor, bool),
    /// The arm switch opens where it should close, or is right again.
    ArmSwitchInverted(bool),
    /// The emergency stop's contact is bridged: it reads released whatever is pressed; or whole again.
    StopBridged(bool),
    /// Somebody does something by hand.
    Hand(Hand),
    /// Pulses of this width, in ns, are coupled into both lines of an encoder.
    EncoderDisturbed(Motor, u64),
    /// The wire of a torque reference between amplifier and drive.
    Reference(Motor, ReferenceWire),
    /// An analogue input is held at a voltage in µV whatever the plant says, or is free again.
    AnalogueInput(usize, Option<u32>),
    /// An analogue input stays at the voltage it has now.
    AnalogueFrozen(usize),
    /// The wire to an analogue input has a loose contact: by chance it is open in every second scan, or whole again.
    AnalogueLoose(usize, bool),
    /// An encoder counts so many on within a few microseconds, and goes on from there.
    EncoderJump(Motor, u32),
    /// The converter starts no more scans, or does again.
    AdcStalled(bool),
    /// The next scan ends before its last channel.
    AdcScanCut,
    /// The serial port's DMA streams lock up where the errata sheet's condition for it holds.
    SerialStreamsLockUp,
    /// The serial port's receiving stream serves no request any more, whatever locked it up, or does again.
    ReceiverLocked(bool),
    /// The next so many times the link's interrupt comes, all interrupts are masked.
    MaskInterrupts {
        /// How often.
        times: u32,
        /// From here in the control period, ns.
        from_ns: u64,
        /// For so long, ns.
        for_ns: u64,
    },
    /// The serial line is cut, or whole again.
    LinkSilent(bool),
    /// So many bytes in a million reach the chip with a framing error and flipped bits.
    LinkGarbled(u32),
    /// The board's 32 kHz crystal has this frequency, Hz; 0: it does not start.
    LowSpeedCrystal(u64),
    /// The 3.3 V, of which every analogue code is a share, are these, in mV.
    AnalogSupply(u32),
    /// The chip's supply is cut or comes back. Memory other than flash is lost.
    Power(bool),
    /// A flash word is found so after a power cut: at this address, these bytes.
    FlashWord(u64, [u8; FLASH_WORD]),
    /// The reset pin is pulled.
    ResetPin,
    /// The control tick's handler becomes an endless loop, until the next reset.
    HangTick,
    /// The control tick's handler begins with an undefined instruction, until the next reset.
    TrapTick,
    /// The handler of the link's DMA becomes an endless loop, until the next reset: threads starve, the tick goes on.
    HangThreads,
    /// The same with all interrupts masked.
    HangMasked,
    /// The control tick begins with a read of an address where nothing answers, until the next reset.
    BusError,
    /// The control tick begins with a read of this address.
    StrayRead(u64),
    /// The control tick begins with a write to this address.
    StrayWrite(u64),
    /// The next control tick copies the memory protection unit's registers to memory (`probe.rs`).
    ReadMap,
    /// From now on the stack below each interrupt's handler is painted and measured (`probe.rs`).
    MeasureStack,
    /// The stack below the control tick is painted, and the chip crashes there: how deep that goes is read before it starts
    /// again (`probe.rs`).
    MeasureCrash(Crash),
    /// The 8 MHz stop, and the clock security system notices.
    ClockFails,
    /// The chip's supply falls, and the voltage detector notices.
    SupplyFalls,
    /// A bit of memory turns over.
    FlipBit {
        /// Address of the byte.
        address: u64,
        /// The bit.
        bit: u8,
    },
}

/// What ends the firmware with a crash record.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Crash {
    /// The voltage detector's interrupt.
    Supply,
    /// A trap.
    HardFault,
    /// The non-maskable interrupt: the clock fails.
    Nmi,
}

impl Crash {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Supply, Self::HardFault, Self::Nmi];
}

/// The ±10 V wire from the amplifier to a drive.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum ReferenceWire {
    /// What is asked for arrives.
    #[default]
    Whole,
    /// It is open, and the drive's input floats to one end.
    Open,
    /// The two cores are swapped.
    Reversed,
    /// So much of it arrives: amplifier or drive has another gain.
    Scaled(f64),
    /// The drive holds this code whatever is asked for.
    Held(u16),
}

impl ReferenceWire {
    /// What the drive gets of this code.
    #[must_use]
    pub fn pass(self, code: Option<u16>) -> Option<u16> {
        let scaled = |by: f64| {
            code.map(|code| {
                let centred = f64::from(code) - 2048.0;
                // The cast saturates, as the amplifier does.
                #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
                let passed = (2048.0 + by * centred).round() as u16;
                passed.min(4095)
            })
        };
        match self {
            Self::Whole => code,
            Self::Open => None,
            Self::Reversed => scaled(-1.0),
            Self::Scaled(by) => scaled(by),
            Self::Held(code) => Some(code),
        }
    }
}

/// Switches, faults in wires, and what the plant shows: everything of the outside that lasts.
#[derive(Debug, Clone)]
pub struct Outside {
    /// The arm switch is on.
    pub arm_switch: bool,
    /// The emergency stop is pressed.
    pub stop_pressed: bool,
    /// The drives are healthy.
    pub healthy: [bool; 2],
    /// Voltages that hide the plant's.
    pub held_microvolt: [Option<u32>; 5],
    /// Inputs whose wire has a loose contact.
    pub loose: [bool; 5],
    /// Wires of the torque references.
    pub references: [ReferenceWire; 2],
    /// What else is wired wrongly.
    pub wiring: Wiring,
}

/// Plugs and wires in the wrong place; all false: right.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Wiring {
    /// The plugs of the encoders.
    pub encoders_exchanged: bool,
    /// The plugs of the bridges.
    pub bridges_exchanged: bool,
    /// The signal wires of the bridges, friction and normal force.
    pub bridge_reversed: [bool; 2],
    /// Two phases of a motor.
    pub motor_reversed: [bool; 2],
    /// The arm switch opens where it should close.
    pub arm_switch_inverted: bool,
    /// The emergency stop reads released whatever is pressed.
    pub stop_bridged: bool,
}

impl Wiring {
    /// What arrives at the analogue inputs of what the plant shows, µV; a bridge's amplifier works about `middle`.
    #[must_use]
    pub fn arriving(&self, sensors: &Sensors, middle: u32) -> [u32; 5] {
        let mut microvolt = sensors.microvolt;
        for (bridge, reversed) in self.bridge_reversed.iter().enumerate() {
            if *reversed {
                microvolt[bridge] = (2 * middle).saturating_sub(microvolt[bridge]);
            }
        }
        for (motor, reversed) in self.motor_reversed.iter().enumerate() {
            // The drive's monitor is its own current: it shows the torque that the drive believes in.
            if *reversed {
                microvolt[2 + motor] = (2 * middle).saturating_sub(microvolt[2 + motor]);
            }
        }
        if self.bridges_exchanged {
            microvolt.swap(0, 1);
        }
        microvolt
    }

    /// The torque references as the motors follow them.
    #[must_use]
    pub fn followed(&self, mut dac: [Option<u16>; 2]) -> [Option<u16>; 2] {
        for (code, reversed) in dac.iter_mut().zip(self.motor_reversed) {
            if reversed {
                *code = ReferenceWire::Reversed.pass(*code);
            }
        }
        dac
    }
}

impl Default for Outside {
    fn default() -> Self {
        Self {
            arm_switch: false,
            stop_pressed: false,
            healthy: [true; 2],
            held_microvolt: [None; 5],
            loose: [false; 5],
            references: Default::default(),
            wiring: Wiring::default(),
        }
    }
}
