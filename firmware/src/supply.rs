//! The chip's own 3.3 V: when they fall, the rig is made safe while the chip still works.
//!
//! | falls below | what happens |
//! |---|---|
//! | 2.76 V (DS12110 rev 11 table 116, `PLS` level 6, falling, typical) | the voltage detector's interrupt: outputs safe, crash record, restart with the fault latched |
//! | 2.7 V, with the option bytes as `PINS.md` asks | brown-out reset: enables off |
//! | 1.6 V, with the option bytes as they come | the same by the power-on reset, and between the two the core runs beyond its limits |
//!
//! References, torque monitors and bridges are all taken against the same 3.3 V, so that a supply 16 % low is seen in none of
//! the readings: the detector is what knows. It needs no peripheral of the loop, and its interrupt outranks the tick.

use crate::restart;
use embassy_stm32::interrupt;
use embassy_stm32::interrupt::{InterruptExt, Priority};
use embassy_stm32::pac::{EXTI, PWR};

/// The highest level of the detector.
const LEVEL: u8 = 6;
/// Line of the detector at the EXTI (RM0433, EXTI event inputs), which takes its rising output: the supply falls.
const LINE: usize = 16;

/// From now on a supply that falls makes safe. One that is low already does not: it would restart for ever.
pub fn watch() {
    PWR.cr1().modify(|w| {
        w.set_pls(LEVEL);
        w.set_pvde(true);
    });
    EXTI.rtsr(0).modify(|w| w.set_line(LINE, true));
    EXTI.pr(0).write(|w| w.set_line(LINE, true));
    EXTI.imr(0).modify(|w| w.set_line(LINE, true));
    interrupt::PVD_AVD.set_priority(Priority::P0);
    interrupt::PVD_AVD.unpend();
    // SAFETY: the handler is below and needs nothing but what every crash needs.
    unsafe { interrupt::PVD_AVD.enable() };
}

#[interrupt]
fn PVD_AVD() {
    restart::supply_fell()
}
