//! The switches and the drives' fault lines, in the sense of the control core.

use crate::board::{ARM_SWITCH, M1_HEALTHY, M2_HEALTHY, STOP_RELEASED};
use model_core::control::Samples;

/// Reads all four lines into `samples`. Low always means unsafe: see `PINS.md`.
#[inline(always)]
pub fn read_into(samples: &mut Samples) {
    samples.emergency_stop = !STOP_RELEASED.is_high();
    samples.arm_switch = ARM_SWITCH.is_high();
    samples.m1_drive_fault = !M1_HEALTHY.is_high();
    samples.m2_drive_fault = !M2_HEALTHY.is_high();
}
