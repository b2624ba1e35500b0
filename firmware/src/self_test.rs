//! The chip tests itself, with nothing wired to it and the drives unplugged.
//!
//! The same checks run on the board one reset each (`tests/on_target.rs`) or all in a row (`src/bin/self_test.rs`), and
//! the latter on the virtual bench too, as far as it can show them.
//!
//! Encoder inputs are moved by their own pull resistors: up and down in quadrature, some 40 kΩ against a few
//! pF of pin, which settle within a microsecond. A wired encoder drives the pins and wins, so the test then
//! fails, as it should.

use crate::board::{self, Board, LOOP_BACK_CHANNELS};
use crate::{adc_scan, clock_check, clocks, encoders, inputs, outputs, tick};
use cortex_m::asm::delay;
use embassy_stm32::pac::gpio::Gpio;
use embassy_stm32::pac::gpio::vals::Pupdr;
use embassy_stm32::pac::{GPIOA, GPIOB, GPIOD};
use model_core::control::{AdcScan, ControlSettings, ControlState, DAC_ZERO, Samples};
use model_core::selfcheck;

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

/// What a check found.
#[derive(Clone, Copy, PartialEq, Eq, defmt::Format)]
pub struct Failed {
    /// What is not as it must be.
    pub what: &'static str,
    /// How it must be.
    pub expected: i64,
    /// How it is.
    pub found: i64,
}

/// What came of a check.
pub type Checked = Result<(), Failed>;

fn equal(what: &'static str, found: impl Into<i64>, expected: impl Into<i64>) -> Checked {
    let (found, expected) = (found.into(), expected.into());
    if found == expected { Ok(()) } else { Err(Failed { what, expected, found }) }
}

/// The core runs from the 8 MHz of the ST-LINK.
///
/// # Errors
/// It does not.
pub fn crystal() -> Checked {
    equal("the core runs from the 8 MHz", clocks::crystal_is_used(), true)
}

/// The clock is what it is taken for, by the board's 32.768 kHz crystal: within the 1 % that the limits allow for.
///
/// # Errors
/// It is not, or the crystal does not run.
pub fn clock() -> Checked {
    const MOST_PPM: u32 = 10_000;
    let ppm = clock_check::deviation_ppm().map_err(|what| Failed { what, expected: 0, found: 0 })?;
    defmt::info!("by the 32.768 kHz crystal the clock is {=i32} ppm fast", ppm);
    if ppm.unsigned_abs() <= MOST_PPM {
        return Ok(());
    }
    Err(Failed { what: "ppm that the clock is fast, 10 000 at most", expected: 0, found: ppm.into() })
}

/// Every model gives the bits it gave on the computer that built this.
///
/// # Errors
/// The first model that does not; its digest is cut to 63 bits.
pub fn models() -> Checked {
    for (model, (name, expected)) in selfcheck::NAMES.iter().zip(DIGESTS).enumerate() {
        let digest = selfcheck::run_model(model, STEPS);
        if digest != expected {
            let cut = |digest: u64| (digest >> 1) as i64;
            return Err(Failed { what: name, expected: cut(expected), found: cut(digest) });
        }
    }
    Ok(())
}

/// What goes out of the DAC comes back through the ADC. The scan is stopped by it.
///
/// # Errors
/// The first code that does not.
pub fn loop_back() -> Checked {
    // Offset and gain errors of DAC and ADC together stay within 1 % of the range by their data sheet.
    const MOST: i64 = 655;
    for codes in [[DAC_ZERO; 2], [1024, 3072], [3072, 1024], [0, 4095], [4095, 0]] {
        outputs::write_references(codes);
        // At most 16 kΩ of the DAC without its buffer (`outputs.rs`) into 10 nF, should somebody have put them at the pin:
        // ten time constants of 160 µs.
        delay(768_000);
        for (code, channel) in codes.into_iter().zip(LOOP_BACK_CHANNELS) {
            let sent = i64::from(code) * 16;
            let Some(read) = adc_scan::convert_once(channel) else {
                return Err(Failed { what: "the converter gives no code", expected: sent, found: 0 });
            };
            if (sent - i64::from(read)).abs() > MOST {
                outputs::write_references([DAC_ZERO; 2]);
                return Err(Failed {
                    what: "a code comes back as another",
                    expected: sent,
                    found: read.into(),
                });
            }
        }
    }
    outputs::write_references([DAC_ZERO; 2]);
    Ok(())
}

/// Both encoder counters, moved by the pull resistors of their inputs, count forth and back.
///
/// # Errors
/// The first count that is wrong.
pub fn encoders() -> Checked {
    let (m1, m2) = (encoders::m1_count(), encoders::m2_count());
    Encoder::M1.turn(400);
    Encoder::M2.turn(-200);
    equal("counts of M1", encoders::m1_count().wrapping_sub(m1) & 0xFFFF, 400_u32)?;
    equal("counts of M2", encoders::m2_count().wrapping_sub(m2) as i32, -200)?;
    Encoder::M1.turn(-404);
    equal("counts of M1, back", encoders::m1_count().wrapping_sub(m1) & 0xFFFF, 0xFFFC_u32)
}

/// Without wires every input reads unsafe.
///
/// # Errors
/// The first that does not.
pub fn inputs() -> Checked {
    let mut samples = Samples::default();
    inputs::read_into(&mut samples);
    equal("the emergency stop reads as pressed", samples.emergency_stop, true)?;
    equal("M1's drive reads as at fault", samples.m1_drive_fault, true)?;
    equal("M2's drive reads as at fault", samples.m2_drive_fault, true)?;
    equal("the arm switch reads as on", samples.arm_switch, false)
}

/// Making safe takes drives and torque away.
///
/// # Errors
/// What is left of them.
pub fn making_safe() -> Checked {
    outputs::write_references([4095, 0]);
    outputs::write_enables([true; 2]);
    outputs::make_safe();
    let (codes, enabled) = outputs::shown();
    for (code, enabled) in codes.into_iter().zip(enabled) {
        equal("DAC code", code, DAC_ZERO)?;
        equal("drive enabled", enabled, false)?;
    }
    Ok(())
}

/// Ten thousand control ticks take a second, and none is late. The tick runs on from then.
///
/// # Errors
/// What was not so.
pub fn ticks() -> Checked {
    let mut settings = ControlSettings::default();
    settings.m1_encoder.counter_bits = board::M1_COUNTER_BITS;
    let Ok(config) = settings.build_within(&board::CAPS) else {
        return Err(Failed { what: "the default settings are out of range", expected: 1, found: 0 });
    };
    let mut ends = tick::start(config, ControlState::new(&config));
    let mut seen = 0;
    let health = loop {
        if let Some(health) = ends.health.dequeue() {
            seen += 1;
            if seen == 10 {
                break health;
            }
        }
    };
    defmt::info!("most cycles of a tick: {=u32}", health.cycles_max);
    equal("number of the last tick", health.tick as u32, 9999_u32)?;
    equal("ticks that were late", health.deadline_misses, 0_u32)?;
    equal("scans that were missed", health.missed_scans, 0_u32)?;
    equal("a tick is longer than its period", health.cycles_max >= 48_000, false)?;
    equal("the scan fills its memory", adc_scan::codes() != AdcScan::default(), true)
}

/// What runs after the start and before the checks, as in the firmware.
pub fn prepare(board: Board) {
    encoders::start();
    adc_scan::start(board.adc);
}
