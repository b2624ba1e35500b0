//! What one control tick gives: codes for the hardware, and a record in SI units for log and link.

use super::fault::{Fault, FaultSet};
use super::limit::LimitSet;
use super::sequencer::SequencerState;
use super::supervisor::Mode;
use fixed::types::I32F32;

/// DAC code of zero torque: mid-scale of 12 bits.
pub const DAC_ZERO: u16 = 2048;
/// The largest DAC code.
pub const DAC_MAX: u16 = 4095;

/// Everything one tick puts out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Outputs {
    /// Torque references of M1 and M2 as 12 bit codes around [`DAC_ZERO`]; 2048 codes are the rated torque.
    pub dac: [u16; 2],
    /// Drive enables of M1 and M2.
    pub drive_enable: [bool; 2],
    /// The three lamps.
    pub leds: Leds,
    /// All signals in SI units.
    pub record: Record,
}

impl Outputs {
    /// Zero torque on both motors and both drives off.
    #[must_use]
    pub fn is_safe(&self) -> bool {
        self.dac == [DAC_ZERO; 2] && self.drive_enable == [false; 2]
    }
}

/// Lamps: steady or blinking with the tick counter.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Leds {
    /// Green: nothing stands in the way of arming, or the rig is armed.
    pub ready: bool,
    /// Yellow: the drives are enabled (steady: armed; blinking: torque on). Keep clear.
    pub live: bool,
    /// Red: a fault is latched (steady), or the cause of one is there while disabled (blinking).
    pub fault: bool,
}

/// All signals of one tick in SI units. Measurements belong to the sampling instant of this tick; the torque
/// references are computed in it and reach the drives one period later.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Record {
    /// Ticks since the start of the controller.
    pub tick: u64,
    /// Torque M1 is asked for, before the correction from its monitor.
    pub m1_torque_ref_nm: f32,
    /// Torque of M1 by its monitor.
    pub m1_torque_nm: f32,
    /// Angle of M1 since the start; `m1_count` is exact.
    pub m1_angle_rad: f32,
    /// Position of M1 in counts since the start.
    pub m1_count: i64,
    /// Torque M2 is asked for: by the experiment in torque mode, by the speed loop else.
    pub m2_torque_ref_nm: f32,
    /// Torque of M2 by its monitor.
    pub m2_torque_nm: f32,
    /// Angle of M2 since the start, rounded to what `f32` holds; `m2_count` is exact.
    pub m2_angle_rad: f32,
    /// Position of M2 in counts since the start.
    pub m2_count: i64,
    /// Angle of M2 in turns since the start, to 2⁻³² of a turn however far it went; its fractional part is the place
    /// on the disc.
    pub m2_turns: I32F32,
    /// Speed the loop of M2 follows, after its slew limit; 0 in torque mode.
    pub m2_speed_ref_rad_s: f32,
    /// Estimated speed of M2.
    pub m2_speed_rad_s: f32,
    /// Normal force, tared, not filtered.
    pub normal_force_n: f32,
    /// Friction torque, tared, not filtered.
    pub friction_torque_nm: f32,
    /// Friction torque the observer's model predicts.
    pub predicted_friction_torque_nm: f32,
    /// Measured less predicted friction torque.
    pub residual_nm: f32,
    /// Running mean square of the residual.
    pub residual_mean_square_nm2: f32,
    /// Supply voltage.
    pub supply_v: f32,
    /// Mode of the supervisor.
    pub mode: Mode,
    /// The fault latched first, which is the one to look for.
    pub fault: Option<Fault>,
    /// All latched faults.
    pub faults: FaultSet,
    /// Causes of faults that are there now; while disabled they only stand in the way of arming.
    pub causes: FaultSet,
    /// Limits that act in this tick.
    pub limits: LimitSet,
    /// State of the sequencer.
    pub sequencer: SequencerState,
    /// Ticks since the start of the experiment.
    pub experiment_tick: u32,
    /// Ticks that ended late since the start of the controller.
    pub deadline_misses: u32,
}

impl Record {
    /// Root of the residual's running mean square.
    #[must_use]
    pub fn residual_rms_nm(&self) -> f32 {
        libm::sqrtf(self.residual_mean_square_nm2)
    }
}
