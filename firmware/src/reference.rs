//! What the chip's 3.3 V are worth, measured once at the start against the reference inside it.
//!
//! Each code of the ADC and of the DAC is a share of VREF+, which on this board is the 3.3 V. ADC3 converts VREFINT, some
//! 1.216 V whatever the supply, and the code it gave at VREF+ = 3.3 V is written into each chip at its making (VREFIN_CAL):
//!
//! VREF+ = 3.3 V · VREFIN_CAL / code   (RM0433 rev 9, 25.4.35)
//!
//! It is told (Hello) and not corrected for: what is fed by the same 3.3 V, as a bridge mostly is, does not notice when they
//! are off, and a correction would put the error there (`PINS.md`).

use cortex_m::asm::delay;
use embassy_stm32::adc::{Adc, SampleTime, VrefInt};
use embassy_stm32::pac::ADC3;
use embassy_stm32::{Peri, peripherals, rcc};

/// VREFIN_CAL, in system memory, 16 bit (DS12110 rev 11, table 118).
const CALIBRATION_WORD: *const u16 = 0x1FF1_E860 as *const u16;
/// VREF+ when it was taken, mV.
const CALIBRATED_AT_MV: u32 = 3_300;
/// VREFINT where the word says nothing: typical, mV (DS12110 rev 11, table 117).
const TYPICAL_MV: u32 = 1_216;
/// VREFINT from its least to its most, mV (ibid.), as codes at 3.3 V: what is outside is no calibration.
const PLAUSIBLE: core::ops::RangeInclusive<u32> = code_of(1_180)..=code_of(1_255);
/// Its buffer and the sampling switch need some 4 µs each (ibid.): it gets 10 µs, and 387.5 cycles of 25 MHz, 15.5 µs.
const START_CYCLES: u32 = 4_800;
const SAMPLING: SampleTime = SampleTime::CYCLES387_5;
/// Conversions that are averaged: their noise is some 5 codes each, and 0.1 % are 24.
const CONVERSIONS: u32 = 16;

/// VREF+ in mV. The converter is off again when this returns.
#[must_use]
pub fn measure(adc: Peri<'_, peripherals::ADC3>) -> u16 {
    let code = average(Adc::new(adc)).max(1);
    // A converter out of reset is in deep power-down (RM0433 rev 9, 25.6.3).
    rcc::enable_and_reset::<peripherals::ADC3>();
    rcc::disable::<peripherals::ADC3>();
    // SAFETY: half a word of system memory that may be read (`mpu.rs`); nothing writes it.
    let word = u32::from(unsafe { CALIBRATION_WORD.read_volatile() });
    let calibration = if PLAUSIBLE.contains(&word) {
        word
    } else {
        defmt::warn!("no calibration of the internal reference ({=u32}): typical value, 3 %", word);
        code_of(TYPICAL_MV)
    };
    u16::try_from(CALIBRATED_AT_MV * calibration / code).unwrap_or(u16::MAX)
}

fn average(mut adc: Adc<'_, peripherals::ADC3>) -> u32 {
    let mut internal = connect(&adc);
    delay(START_CYCLES);
    let sum: u32 = (0..CONVERSIONS).map(|_| u32::from(adc.blocking_read(&mut internal, SAMPLING))).sum();
    sum / CONVERSIONS
}

/// The driver hands the converter over enabled, and the bit that connects VREFINT may be written only while it is not
/// (RM0433 rev 9, 25.4.10).
fn connect(adc: &Adc<'_, peripherals::ADC3>) -> VrefInt {
    ADC3.cr().modify(|w| w.set_addis(true));
    while ADC3.cr().read().aden() {}
    let internal = adc.enable_vrefint();
    ADC3.isr().write(|w| w.set_adrdy(true));
    ADC3.cr().modify(|w| w.set_aden(true));
    while !ADC3.isr().read().adrdy() {}
    internal
}

const fn code_of(mv: u32) -> u32 {
    mv * 65_535 / CALIBRATED_AT_MV
}
