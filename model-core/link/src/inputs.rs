//! What the chip reads and puts out in one tick, before any setting is applied: to find out how the rig is wired.

use serde::{Deserialize, Serialize};

/// Names of the analogue channels, in the order of [`Inputs::codes`].
pub const CHANNELS: [&str; 5] =
    ["friction bridge", "normal force bridge", "M1 torque monitor", "M2 torque monitor", "supply"];

/// Raw readings of one tick.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Inputs {
    /// Control tick.
    pub tick: u64,
    /// Codes of the analogue channels, 16 bit; see [`CHANNELS`].
    pub codes: [u16; 5],
    /// Low 16 bits of the encoders' counters, M1 and M2.
    pub counts: [u16; 2],
    /// Codes of the torque references of M1 and M2, 12 bit around 2048, as put out in the tick before.
    pub dac: [u16; 2],
    /// The emergency stop is pressed or its circuit is open.
    pub emergency_stop: bool,
    /// The arm switch is on.
    pub arm_switch: bool,
    /// The drives of M1 and M2 report a fault, or their wires are open.
    pub drive_fault: [bool; 2],
    /// The drives are enabled.
    pub enabled: bool,
}
