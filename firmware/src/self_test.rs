//! What the on-target tests need: the chip tests itself, with nothing wired to it and the drives unplugged.
//!
//! Encoder inputs are moved by their own pull resistors: up and down in quadrature, some 40 kΩ against a few
//! pF of pin, which settle within a microsecond. A wired encoder drives the pins and wins, so the test then
//! fails, as it should.

use crate::adc_scan;
use crate::board::LOOP_BACK_CHANNELS;
use crate::outputs;
use cortex_m::asm::delay;
use embassy_stm32::pac::gpio::Gpio;
use embassy_stm32::pac::gpio::vals::Pupdr;
use embassy_stm32::pac::{GPIOA, GPIOB, GPIOD};

include!(concat!(env!("OUT_DIR"), "/host_digests.rs"));

/// Cycles until a pin has followed its pull: 10 µs at 480 MHz.
const SETTLE_CYCLES: u32 = 4_800;

/// Which encoder to move.
#[derive(Clone, Copy)]
pub enum Encoder {
    /// PD12 and PD13.
    M1,
    /// PA15 and PB3.
    M2,
}

impl Encoder {
    const fn pins(self) -> [(Gpio, usize); 2] {
        match self {
            Self::M1 => [(GPIOD, 12), (GPIOD, 13)],
            Self::M2 => [(GPIOA, 15), (GPIOB, 3)],
        }
    }

    /// Puts A and B at the levels of a phase: A leads B while the phase rises.
    fn show(self, phase: u32) {
        let levels = [matches!(phase & 3, 1 | 2), matches!(phase & 3, 2 | 3)];
        for ((port, pin), high) in self.pins().into_iter().zip(levels) {
            let pull = if high { Pupdr::PULL_UP } else { Pupdr::PULL_DOWN };
            port.pupdr().modify(|w| w.set_pupdr(pin, pull));
        }
        delay(SETTLE_CYCLES);
    }

    /// Moves the encoder by so many counts, from phase 0.
    pub fn turn(self, counts: i32) {
        let direction = if counts < 0 { u32::MAX } else { 1 };
        let mut phase = 0u32;
        for _ in 0..counts.unsigned_abs() {
            phase = phase.wrapping_add(direction);
            self.show(phase);
        }
        // Back to where it began, the short way: whole lines leave the phase at 0.
        debug_assert!(phase & 3 == 0);
    }
}

/// Puts codes on both DAC outputs and reads both back with the ADC, 16 bit.
#[must_use]
pub fn loop_back(codes: [u16; 2]) -> [u16; 2] {
    outputs::write_references(codes);
    // Settling of the DAC's buffer is 3 µs at most; the low-pass at the pin needs 10 time constants of 10 µs.
    delay(48_000);
    LOOP_BACK_CHANNELS.map(adc_scan::convert_once)
}
