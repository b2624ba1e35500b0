//! Torque references and drive enables, at register level, so that a panic or a trap can make them safe.
//!
//! The DAC's channels are enabled with mid-scale already in their registers: they never show the 0 V that
//! would mean full negative torque.
//!
//! The output buffers are off: buffered, the outputs end 0.2 V before either rail (DS12110, DAC characteristics), at
//! 88 % of the rated torque. Without them the output resistance is that of the converter's network, 10.3 to 16 kΩ (RO, buffer
//! off, same table), so the amplifier behind must draw next to nothing (`PINS.md`).

use crate::board::{M1_ENABLE, M2_ENABLE};
use embassy_stm32::pac::dac::vals::Mode;
use embassy_stm32::pac::{DAC1, RCC};
use embassy_stm32::{peripherals, rcc};
use model_core::control::DAC_ZERO;

/// Starts the DAC at zero torque. The enables are low already (`board::configure`).
pub fn start() {
    rcc::enable_and_reset::<peripherals::DAC1>();
    // Only while a channel is off (RM0433, `DAC_MCR`).
    DAC1.mcr().modify(|w| {
        w.set_mode(0, Mode::NORMAL_EXT_BUFDIS);
        w.set_mode(1, Mode::NORMAL_EXT_BUFDIS);
    });
    write_references([DAC_ZERO; 2]);
    DAC1.cr().modify(|w| {
        w.set_en(0, true);
        w.set_en(1, true);
    });
    // Without a trigger the data register passes on one bus clock after the write.
    write_references([DAC_ZERO; 2]);
}

/// Both torque references in one write.
#[inline(always)]
pub fn write_references(codes: [u16; 2]) {
    DAC1.dhr12rd().write(|w| w.0 = u32::from(codes[0]) | u32::from(codes[1]) << 16);
}

/// Both drive enables in one write.
#[inline(always)]
pub fn write_enables(enable: [bool; 2]) {
    let change = M1_ENABLE.change(enable[0]) | M2_ENABLE.change(enable[1]);
    M1_ENABLE.port.bsrr().write(|w| w.0 = change);
}

/// What the outputs show: DAC codes and enables.
#[must_use]
pub fn shown() -> ([u16; 2], [bool; 2]) {
    let codes = [DAC1.dor(0).read().dor(), DAC1.dor(1).read().dor()];
    let enabled = M1_ENABLE.port.odr().read().0;
    (codes, [M1_ENABLE.pin, M2_ENABLE.pin].map(|pin| enabled >> pin & 1 != 0))
}

/// Drives off, zero torque; from any context, any number of times. The caller has stopped the control
/// tick (interrupts masked) if this is to last.
pub fn make_safe() {
    // Before their clocks are on these blocks do not answer, and the pins are still off from reset.
    if RCC.ahb4enr().read().gpioden() {
        write_enables([false; 2]);
    }
    if RCC.apb1lenr().read().dac12en() {
        write_references([DAC_ZERO; 2]);
    }
}
