//! The triggered capture: every control tick, all channels, kept in RAM and read out afterwards.
//!
//! Rows are raw codes, so that recording costs a few stores; the host scales them with the settings
//! it reads over the same link. Rows travel as bytes, little-endian, [`CaptureRow::BYTES`] each.

use serde::{Deserialize, Serialize};

/// What ends the wait.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum CaptureTrigger {
    /// A command.
    Command,
    /// The start of an experiment.
    Start,
    /// A fault.
    Fault,
    /// The friction torque's raw code rises above a level.
    FrictionAbove {
        /// The level.
        code: u16,
    },
    /// The normal force's raw code rises above a level.
    NormalAbove {
        /// The level.
        code: u16,
    },
}

/// Where the capture is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum CaptureState {
    /// Nothing is recorded.
    #[default]
    Idle,
    /// Recording; the trigger is not looked at before there are enough rows to put ahead of it.
    Filling,
    /// Recording, waiting for the trigger.
    Waiting,
    /// Triggered; recording what comes after.
    Finishing,
    /// Complete, ready to be read.
    Frozen,
}

/// State and size of the capture.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct CaptureInfo {
    /// Where it is.
    pub state: CaptureState,
    /// Rows recorded.
    pub rows: u32,
    /// Rows before the trigger.
    pub rows_before: u32,
    /// Control tick of the row at the trigger.
    pub trigger_tick: u64,
    /// Rows it holds when complete.
    pub capacity: u32,
}

/// One tick of the capture.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct CaptureRow {
    /// Friction bridge, code.
    pub friction_bridge: u16,
    /// Normal force bridge, code.
    pub normal_bridge: u16,
    /// Torque monitor of M1, code.
    pub m1_torque: u16,
    /// Torque monitor of M2, code.
    pub m2_torque: u16,
    /// Supply, code.
    pub supply: u16,
    /// Low 16 bits of M1's position.
    pub m1_count: u16,
    /// Low 16 bits of M2's position.
    pub m2_count: u16,
    /// DAC code for M1.
    pub m1_dac: u16,
    /// DAC code for M2.
    pub m2_dac: u16,
    /// Predicted friction torque, N·m · 1000, limited to what fits.
    pub predicted_mnm: i16,
    /// Speed M2 is asked for, rad/s · 100.
    pub m2_speed_ref_crad_s: i16,
    /// Mode (low 4 bits) and number of the first fault (shifted by 4).
    pub state: u16,
}

impl CaptureRow {
    /// Bytes of a row.
    pub const BYTES: usize = 24;

    /// The row as six words, as they lie in the rig's memory.
    #[must_use]
    pub const fn to_words(&self) -> [u32; 6] {
        const fn pair(low: u16, high: u16) -> u32 {
            low as u32 | (high as u32) << 16
        }
        [
            pair(self.friction_bridge, self.normal_bridge),
            pair(self.m1_torque, self.m2_torque),
            pair(self.supply, self.m1_count),
            pair(self.m2_count, self.m1_dac),
            pair(self.m2_dac, self.predicted_mnm.cast_unsigned()),
            pair(self.m2_speed_ref_crad_s.cast_unsigned(), self.state),
        ]
    }

    /// The row from its bytes.
    #[must_use]
    pub fn from_bytes(bytes: &[u8; Self::BYTES]) -> Self {
        let at = |i: usize| u16::from_le_bytes([bytes[2 * i], bytes[2 * i + 1]]);
        Self {
            friction_bridge: at(0),
            normal_bridge: at(1),
            m1_torque: at(2),
            m2_torque: at(3),
            supply: at(4),
            m1_count: at(5),
            m2_count: at(6),
            m1_dac: at(7),
            m2_dac: at(8),
            predicted_mnm: at(9).cast_signed(),
            m2_speed_ref_crad_s: at(10).cast_signed(),
            state: at(11),
        }
    }

    /// Number of the mode.
    #[must_use]
    pub const fn mode(&self) -> u8 {
        (self.state & 0xF) as u8
    }

    /// Number of the first fault, 0 for none.
    #[must_use]
    pub const fn fault(&self) -> u8 {
        (self.state >> 4) as u8
    }
}
