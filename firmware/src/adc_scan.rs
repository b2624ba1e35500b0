//! The scan of the analogue inputs: TIM6 starts it, DMA1 stream 7 stores it, its end starts the tick.
//!
//! Five channels, 16 bit, 16.5 + 8.5 cycles of 25 MHz each: 5.0 µs from the trigger to the last code. The
//! DMA's end of transfer, not the converter's end of sequence, is the tick's interrupt: only then is the
//! last code in memory. A scan that was cut short leaves the DMA between two ranks; this is checked every
//! tick, and the scan started anew.
//!
//! Writes to peripherals are posted: the core goes on while they are on their way. So a flag that holds an interrupt's
//! line is read back after it was cleared, before the handler returns; else the core takes the same interrupt again.

use crate::board::{SCAN_CHANNELS, TICK_HZ, TICK_TIMER_HZ};
use crate::memory::{SCAN, SCAN_CODES};
use core::sync::atomic::Ordering::Relaxed;
use cortex_m::peripheral::NVIC;
use embassy_stm32::adc::Adc;
use embassy_stm32::pac::adc::vals::{Adstp, Dmngt, Exten, Ovrmod, Pcsel, Res, SampleTime};
use embassy_stm32::pac::dma::vals::{Dir, Pl, Size};
use embassy_stm32::pac::timer::vals::Mms;
use embassy_stm32::pac::{ADC1, DMA1, DMAMUX1, Interrupt, RCC, TIM6, TIM7};
use embassy_stm32::{Peri, peripherals, rcc};
use model_core::control::AdcScan;

/// DMA1 stream, and channel of DMAMUX1.
const STREAM: usize = 7;
/// DMAMUX1 request of ADC1 (RM0433 rev 9, table 124).
const ADC1_REQUEST: u8 = 9;
/// Trigger input of ADC1 that TIM6's trigger output is wired to (RM0433, ADC external triggers).
const TIM6_TRIGGER: u8 = 13;
const ITEMS: u16 = SCAN as u16;
/// Periods of the tick timer that a scan takes: 16.5 + 8.5 cycles of 25 MHz, 1 µs, for each channel.
pub const PERIODS: u16 = (TICK_TIMER_HZ / 1_000_000) as u16 * ITEMS;

/// Powers and calibrates the converter, and sets scan and DMA up. No scan runs before [`start_timer`].
pub fn start(adc: Peri<'static, peripherals::ADC1>) {
    // The driver does power-up, calibration and enabling; the scan itself is ours.
    let _ = Adc::new(adc);
    set_up();
}

/// Sets scan and DMA up on a converter that is on: once at the start, and again after [`convert_once`].
pub fn set_up() {
    stop_converter();
    ADC1.sqr1().modify(|w| w.set_l(SCAN as u8 - 1));
    for (rank, channel) in SCAN_CHANNELS.into_iter().enumerate() {
        match rank {
            0..4 => ADC1.sqr1().modify(|w| w.set_sq(rank, channel)),
            _ => ADC1.sqr2().modify(|w| w.set_sq(rank - 4, channel)),
        }
        let channel = usize::from(channel);
        ADC1.pcsel().modify(|w| w.set_pcsel(channel, Pcsel::PRESELECTED));
        let (register, place) = if channel < 10 { (0, channel) } else { (1, channel - 10) };
        ADC1.smpr(register).modify(|w| w.set_smp(place, SampleTime::CYCLES16_5));
    }
    ADC1.cfgr().modify(|w| {
        w.set_res(Res::BITS16);
        w.set_cont(false);
        w.set_ovrmod(Ovrmod::PRESERVE);
        w.set_dmngt(Dmngt::DMA_CIRCULAR);
        w.set_extsel(TIM6_TRIGGER);
        w.set_exten(Exten::RISING_EDGE);
    });
    RCC.ahb1enr().modify(|w| w.set_dma1en(true));
    DMAMUX1.ccr(STREAM).write(|w| w.set_dmareq_id(ADC1_REQUEST));
    DMA1.st(STREAM).par().write_value(ADC1.dr().as_ptr() as u32);
    DMA1.st(STREAM).m0ar().write_value(SCAN_CODES.as_ptr() as u32);
    arm();
}

/// Converts one channel once by software: for the loop-back test. The scan ends with it. None if the converter does not
/// stop or does not convert.
#[must_use]
pub fn convert_once(channel: u8) -> Option<u16> {
    // While ADSTART stands the registers below do not take a write (RM0433 25.6.4, 25.6.6, 25.6.8, 25.6.11).
    stop_converter();
    stop_stream();
    if ADC1.cr().read().adstart() {
        return None;
    }
    let index = usize::from(channel);
    ADC1.sqr1().write(|w| {
        w.set_l(0);
        w.set_sq(0, channel);
    });
    ADC1.pcsel().modify(|w| w.set_pcsel(index, Pcsel::PRESELECTED));
    let (register, place) = if channel < 10 { (0, index) } else { (1, index - 10) };
    // The DAC without its buffer drives the sampling capacitor more slowly than the rig's amplifiers do.
    ADC1.smpr(register).modify(|w| w.set_smp(place, SampleTime::CYCLES387_5));
    ADC1.cfgr().modify(|w| {
        w.set_res(Res::BITS16);
        w.set_dmngt(Dmngt::DR);
        w.set_exten(Exten::DISABLED);
    });
    ADC1.isr().write(|w| {
        w.set_eoc(true);
        w.set_eos(true);
        w.set_ovr(true);
    });
    ADC1.cr().modify(|w| w.set_adstart(true));
    // A conversion takes 16 µs.
    (0..100 * PATIENCE).any(|_| ADC1.isr().read().eoc()).then(|| ADC1.dr().read().0 as u16)
}

/// Starts the control period.
pub fn start_timer() {
    rcc::enable_and_reset::<peripherals::TIM6>();
    TIM6.psc().write_value(0);
    TIM6.arr().write(|w| w.set_arr((TICK_TIMER_HZ / TICK_HZ - 1) as u16));
    TIM6.cr2().modify(|w| w.set_mms(Mms::UPDATE));
    TIM6.dier().modify(|w| {
        w.set_uie(true);
        w.set_ude(true);
    });
    // TIM7 only requests the copy of M1's counter. Both run from one clock: what is between their starts stays.
    rcc::enable_and_reset::<peripherals::TIM7>();
    TIM7.psc().write_value(0);
    TIM7.arr().write(|w| w.set_arr((TICK_TIMER_HZ / TICK_HZ - 1) as u16));
    TIM7.dier().modify(|w| w.set_ude(true));
    TIM6.cr1().write(|w| w.set_cen(true));
    TIM7.cr1().write(|w| w.set_cen(true));
}

fn arm() {
    let stream = DMA1.st(STREAM);
    clear_transfer_flags();
    stream.ndtr().write(|w| w.set_ndt(ITEMS));
    stream.cr().write(|w| {
        w.set_dir(Dir::PERIPHERAL_TO_MEMORY);
        w.set_minc(true);
        w.set_circ(true);
        w.set_psize(Size::BITS16);
        w.set_msize(Size::BITS16);
        w.set_pl(Pl::VERY_HIGH);
        w.set_tcie(true);
        w.set_en(true);
    });
    ADC1.isr().write(|w| {
        w.set_eos(true);
        w.set_ovr(true);
    });
    if !ADC1.cr().read().adstart() {
        ADC1.cr().modify(|w| w.set_adstart(true));
    }
}

fn clear_transfer_flags() {
    let place = STREAM % 4;
    DMA1.ifcr(STREAM / 4).write(|w| {
        w.set_tcif(place, true);
        w.set_htif(place, true);
        w.set_teif(place, true);
        w.set_feif(place, true);
        w.set_dmeif(place, true);
    });
}

/// Reads of a register before what was asked of it counts as not done: some ten microseconds.
const PATIENCE: u32 = 1000;

fn stop_converter() {
    if ADC1.cr().read().adstart() {
        ADC1.cr().modify(|w| w.set_adstp(Adstp::STOP));
        let _ = (0..PATIENCE).any(|_| !ADC1.cr().read().adstart());
    }
}

/// Stops the stream. That alone raises its end-of-transfer flag (RM0433 15.3.16), and with the interrupt of that flag on
/// the handler that stopped it would be entered again and again: so the enable goes first, then the stream, then the
/// flags, and last what is pending of them.
fn stop_stream() {
    let stream = DMA1.st(STREAM);
    stream.cr().modify(|w| w.set_tcie(false));
    stream.cr().modify(|w| w.set_en(false));
    let _ = (0..PATIENCE).any(|_| !stream.cr().read().en());
    clear_transfer_flags();
    let _ = DMA1.isr(STREAM / 4).read();
    cortex_m::asm::dsb();
    NVIC::unpend(Interrupt::DMA1_STREAM7);
}

/// Stops converter and stream wherever they are and starts them at rank 1. Takes some microseconds.
#[cold]
fn restart() {
    stop_converter();
    stop_stream();
    arm();
}

/// The period that is over had no scan: what was left of it goes. To be called at the begin of the next period, whose
/// scan converts its first channel for a microsecond before the stream is needed; if that is not time enough the scan
/// does not end in step, and [`take`] starts anew.
#[cold]
pub fn missed() {
    if DMA1.st(STREAM).ndtr().read().ndt() != ITEMS || ADC1.isr().read().ovr() {
        stop_stream();
        arm();
    } else {
        // Half a scan's end must not pass for the end of the next.
        ADC1.isr().write(|w| w.set_eos(true));
    }
}

/// What came of the scan.
#[derive(Clone, Copy)]
pub struct Scan {
    /// The codes.
    pub codes: AdcScan,
    /// Codes were lost, and the scan was started anew.
    pub overrun: bool,
}

/// Takes the scan that just ended and acknowledges it.
#[inline(always)]
pub fn take() -> Scan {
    let converter = ADC1.isr().read();
    let in_step = DMA1.st(STREAM).ndtr().read().ndt() == ITEMS;
    // It lands long before the tick ends, so this one needs no reading back.
    DMA1.ifcr(STREAM / 4).write(|w| w.set_tcif(STREAM % 4, true));
    let overrun = converter.ovr() || !converter.eos() || !in_step;
    if overrun {
        restart();
    } else {
        ADC1.isr().write(|w| w.set_eos(true));
    }
    Scan { codes: codes(), overrun }
}

/// The codes in memory, fresh or not.
#[must_use]
#[inline(always)]
pub fn codes() -> AdcScan {
    let [friction, normal, m1, m2, supply] = &SCAN_CODES;
    AdcScan {
        friction_bridge: friction.load(Relaxed),
        normal_bridge: normal.load(Relaxed),
        m1_torque: m1.load(Relaxed),
        m2_torque: m2.load(Relaxed),
        supply: supply.load(Relaxed),
    }
}

/// Time since the last trigger of the scan, in periods of the tick timer.
#[must_use]
#[inline(always)]
pub fn since_trigger() -> u16 {
    TIM6.cnt().read().cnt()
}

/// Whether a further period has begun and nobody has noticed.
#[must_use]
#[inline(always)]
pub fn period_over() -> bool {
    TIM6.sr().read().uif()
}

/// Whether a period has begun since the last call; acknowledges it. The flag is read back, so that the interrupt's line
/// is low when this returns (ARMv7-M B3.4.1: an interrupt whose line still stands at the return is taken again).
#[must_use]
#[inline(always)]
pub fn take_period() -> bool {
    let begun = TIM6.sr().read().uif();
    if begun {
        TIM6.sr().write(|w| w.set_uif(false));
        let _ = TIM6.sr().read();
        cortex_m::asm::dsb();
    }
    begun
}
