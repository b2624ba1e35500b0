//! The encoders: TIM4 (M1, 16 bit) and TIM2 (M2, 32 bit) as quadrature counters, latched at the begin of each period.
//!
//! Encoder mode 3, both inputs on both edges: 4 counts a line, 480 000 a revolution. The counters run
//! freely over their whole range; the control core takes differences, so a wrap is no event.
//! embassy's `Qei` is not used: it limits TIM2 to 16 bits.
//!
//! **Latch.** The speed is the difference of two readings, so the instant of a reading counts: at 4.6 million counts/s
//! (60 rad/s) a reading 1.25 µs late is six counts wrong. The interrupt does not read the counters. TIM6's update, the
//! instant that starts the scan, also requests DMA1 stream 6, which copies TIM2's counter to memory, and TIM7, which
//! runs in step with TIM6, requests stream 5 for TIM4's. (One request may not be routed to two streams, RM0433
//! 17.4.4.) What is left of the uncertainty is the DMA's arbitration, some ten cycles of AHB: 0.1 µs, half a count.
//! TIM7 is started a few bus cycles after TIM6, always the same: its readings are those of an instant some 50 ns later.
//!
//! Stream 6 fills a ring, so its counter counts periods by itself: the tick learns how many have begun since the tick
//! before, whatever was masked meanwhile.
//!
//! **Filter.** Eight samples at half of the timers' 240 MHz: a level counts when it has stood for 67 ns (RM0433,
//! `TIMx_CCMR1`, `ICxF` = 0101). At 4.8 million counts/s (10 rev/s) each line has an edge every 417 ns and the two
//! lines' edges are 208 ns apart, 104 ns with a phase error of 45°, so that the signal itself passes.

use crate::memory::{M1_LATCH, M2_LATCH, M2_LATCHES};
use core::sync::atomic::Ordering::Relaxed;
use embassy_stm32::pac::dma::vals::{Dir, Pl, Size};
use embassy_stm32::pac::timer::vals::{CcmrInputCcs, FilterValue, Sms};
use embassy_stm32::pac::{DMA1, DMAMUX1, RCC, TIM2, TIM4};
use embassy_stm32::{peripherals, rcc};

/// DMA1 streams, and channels of DMAMUX1, of M1's and M2's counters.
const STREAMS: [usize; 2] = [5, 6];
/// DMAMUX1 requests of TIM7's and TIM6's update (RM0433 rev 9, table 124).
const UPDATE_REQUESTS: [u8; 2] = [70, 69];

/// Starts both counters at 0, and what latches them. The latching begins with the control period.
pub fn start() {
    rcc::enable_and_reset::<peripherals::TIM2>();
    TIM2.arr().write_value(u32::MAX);
    TIM2.ccmr_input(0).modify(|w| {
        for channel in 0..2 {
            w.set_ccs(channel, CcmrInputCcs::TI4); // own input: the register's value 1, TI1 for channel 1
            w.set_icf(channel, FilterValue::FDTS_DIV2_N8);
        }
    });
    TIM2.smcr().modify(|w| w.set_sms(Sms::ENCODER_MODE_3));
    TIM2.cr1().modify(|w| w.set_cen(true));

    rcc::enable_and_reset::<peripherals::TIM4>();
    TIM4.arr().modify(|w| w.set_arr(u16::MAX));
    TIM4.ccmr_input(0).modify(|w| {
        for channel in 0..2 {
            w.set_ccs(channel, CcmrInputCcs::TI4);
            w.set_icf(channel, FilterValue::FDTS_DIV2_N8);
        }
    });
    TIM4.smcr().modify(|w| w.set_sms(Sms::ENCODER_MODE_3));
    TIM4.cr1().modify(|w| w.set_cen(true));

    RCC.ahb1enr().modify(|w| w.set_dma1en(true));
    latch(0, TIM4.cnt().as_ptr() as u32, M1_LATCH.as_ptr() as u32, 1);
    latch(1, TIM2.cnt().as_ptr() as u32, M2_LATCH.as_ptr() as u32, M2_LATCHES as u16);
}

/// Lets a stream copy a counter to a ring of words at each request.
fn latch(which: usize, counter: u32, ring: u32, words: u16) {
    let (Some(stream), Some(request)) = (STREAMS.get(which), UPDATE_REQUESTS.get(which)) else { return };
    DMAMUX1.ccr(*stream).write(|w| w.set_dmareq_id(*request));
    let stream = DMA1.st(*stream);
    stream.par().write_value(counter);
    stream.m0ar().write_value(ring);
    stream.ndtr().write(|w| w.set_ndt(words));
    stream.cr().write(|w| {
        w.set_dir(Dir::PERIPHERAL_TO_MEMORY);
        w.set_minc(true);
        w.set_circ(true);
        w.set_psize(Size::BITS32);
        w.set_msize(Size::BITS32);
        w.set_pl(Pl::VERY_HIGH);
        w.set_en(true);
    });
}

/// Both counters as they were when the period began.
#[derive(Clone, Copy)]
pub struct Latched {
    /// Of M1; wraps at 16 bits.
    pub m1_count: u32,
    /// Of M2; wraps at 32 bits.
    pub m2_count: u32,
    /// Number of the period, modulo [`M2_LATCHES`], counted by the DMA.
    pub period: u32,
}

/// What was latched last.
#[must_use]
#[inline(always)]
pub fn latched() -> Latched {
    // The stream's counter goes from the ring's length down to 1 and begins again.
    let left = u32::from(DMA1.st(STREAMS[1]).ndtr().read().ndt());
    let period = (M2_LATCHES as u32).wrapping_sub(left) % M2_LATCHES as u32;
    let newest = period.wrapping_sub(1) as usize % M2_LATCHES;
    Latched {
        m1_count: M1_LATCH[0].load(Relaxed),
        m2_count: M2_LATCH.get(newest).map_or(0, |count| count.load(Relaxed)),
        period,
    }
}

/// M1's counter now; wraps at 16 bits.
#[must_use]
pub fn m1_count() -> u32 {
    u32::from(TIM4.cnt().read().cnt())
}

/// M2's counter now; wraps at 32 bits.
#[must_use]
pub fn m2_count() -> u32 {
    TIM2.cnt().read()
}
