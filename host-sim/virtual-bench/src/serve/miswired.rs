//! Benches that somebody wired wrongly, to see that commissioning finds it before anything moves.

use crate::outside::{Action, ReferenceWire};
use crate::part::Motor;
use clap::ValueEnum;

/// A mistake in the wiring.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Mistake {
    /// A and B of M1's encoder are exchanged
    M1EncoderSwapped,
    /// A and B of M2's encoder are exchanged
    M2EncoderSwapped,
    /// The plugs of the two encoders are exchanged
    EncodersExchanged,
    /// The friction bridge is not connected
    FrictionBridgeOpen,
    /// The signal wires of the friction bridge are exchanged
    FrictionBridgeReversed,
    /// The signal wires of the normal force bridge are exchanged
    NormalBridgeReversed,
    /// The plugs of the two bridges are exchanged
    BridgesExchanged,
    /// The two cores of M1's torque reference are exchanged
    M1ReferenceReversed,
    /// The torque reference of M2 is open
    M2ReferenceOpen,
    /// The two cores of M2's torque reference are exchanged
    M2ReferenceReversed,
    /// Two phases of M2 are exchanged: it turns the other way than its drive believes
    M2MotorReversed,
    /// The arm switch opens where it should close
    ArmSwitchInverted,
    /// The emergency stop's contact is bridged
    EmergencyStopBridged,
}

impl Mistake {
    /// What makes it so.
    #[must_use]
    pub fn action(self) -> Action {
        match self {
            Self::M1EncoderSwapped => Action::EncoderSwapped(Motor::M1, true),
            Self::M2EncoderSwapped => Action::EncoderSwapped(Motor::M2, true),
            Self::EncodersExchanged => Action::EncodersExchanged(true),
            // As the amplifier's input floats up.
            Self::FrictionBridgeOpen => Action::AnalogueInput(0, Some(OPEN_MICROVOLT)),
            Self::FrictionBridgeReversed => Action::BridgeReversed(0, true),
            Self::NormalBridgeReversed => Action::BridgeReversed(1, true),
            Self::BridgesExchanged => Action::BridgesExchanged(true),
            Self::M1ReferenceReversed => Action::Reference(Motor::M1, ReferenceWire::Reversed),
            Self::M2ReferenceOpen => Action::Reference(Motor::M2, ReferenceWire::Open),
            Self::M2ReferenceReversed => Action::Reference(Motor::M2, ReferenceWire::Reversed),
            Self::M2MotorReversed => Action::MotorReversed(Motor::M2, true),
            Self::ArmSwitchInverted => Action::ArmSwitchInverted(true),
            Self::EmergencyStopBridged => Action::StopBridged(true),
        }
    }
}

/// What the input of a bridge that is not there reads.
pub const OPEN_MICROVOLT: u32 = 3_300_000;
