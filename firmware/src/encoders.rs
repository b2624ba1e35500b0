//! The encoders: TIM4 (M1, 16 bit) and TIM2 (M2, 32 bit) as quadrature counters.
//!
//! Encoder mode 3, both inputs on both edges: 4 counts a line, 480 000 a revolution. The counters run
//! freely over their whole range; the control core takes differences, so a wrap is no event.
//! No input filter: line receivers give clean edges, and at 4.8 million counts/s (10 rev/s) an edge comes
//! every 208 ns. embassy's `Qei` is not used: it limits TIM2 to 16 bits.

use embassy_stm32::pac::timer::vals::{CcmrInputCcs, Sms};
use embassy_stm32::pac::{TIM2, TIM4};
use embassy_stm32::{peripherals, rcc};

/// Starts both counters at 0.
pub fn start() {
    rcc::enable_and_reset::<peripherals::TIM2>();
    TIM2.arr().write_value(u32::MAX);
    TIM2.ccmr_input(0).modify(|w| {
        w.set_ccs(0, CcmrInputCcs::TI4); // own input: the register's value 1, TI1 for channel 1
        w.set_ccs(1, CcmrInputCcs::TI4);
    });
    TIM2.smcr().modify(|w| w.set_sms(Sms::ENCODER_MODE_3));
    TIM2.cr1().modify(|w| w.set_cen(true));

    rcc::enable_and_reset::<peripherals::TIM4>();
    TIM4.arr().modify(|w| w.set_arr(u16::MAX));
    TIM4.ccmr_input(0).modify(|w| {
        w.set_ccs(0, CcmrInputCcs::TI4);
        w.set_ccs(1, CcmrInputCcs::TI4);
    });
    TIM4.smcr().modify(|w| w.set_sms(Sms::ENCODER_MODE_3));
    TIM4.cr1().modify(|w| w.set_cen(true));
}

/// Counter of M1's encoder; wraps at 16 bits.
#[must_use]
#[inline(always)]
pub fn m1_count() -> u32 {
    u32::from(TIM4.cnt().read().cnt())
}

/// Counter of M2's encoder; wraps at 32 bits.
#[must_use]
#[inline(always)]
pub fn m2_count() -> u32 {
    TIM2.cnt().read()
}
