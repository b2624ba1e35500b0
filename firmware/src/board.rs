//! Every pin, timer, converter channel and DMA stream of the board, in one place.
//!
//! `PINS.md` has the same table with connectors and wiring. NUCLEO-H743ZI2 (MB1364), STM32H743ZI.
//! No pin here is one of the board's Ethernet (PA1, PA2, PA7, PC1, PC4, PC5, PB13, PG11, PG13).
//!
//! | resource | use |
//! |---|---|
//! | TIM2 | encoder of M2, 32 bit |
//! | TIM3 | time of the executor |
//! | TIM4 | encoder of M1, 16 bit |
//! | TIM6 | control period; its trigger output starts the scan, its update latches M2's counter |
//! | TIM7 | in step with TIM6: its update latches M1's counter |
//! | TIM16 | in the board's self-test: times the 32.768 kHz crystal |
//! | ADC3 | the internal reference, once at the start |
//! | ADC1, DMA1 stream 7 | scan of five channels; the end of the transfer starts the tick |
//! | DMA1 streams 5 and 6 | the latched counters of M1 and M2 |
//! | DAC1 | torque references |
//! | USART3, DMA1 streams 0 and 1 | link |

use embassy_stm32::gpio::{AfType, Flex, Input, Level, Output, Pull, Speed};
use embassy_stm32::pac::gpio::Gpio;
use embassy_stm32::{Peri, Peripherals, pac, peripherals};
use model_core::control::RawCaps;

/// One digital line, addressed at register level where the tick and the panic handler need it.
#[derive(Clone, Copy)]
pub struct Line {
    /// Port.
    pub port: Gpio,
    /// Pin number.
    pub pin: u8,
}

impl Line {
    /// Whether the pin is high.
    #[must_use]
    #[inline(always)]
    pub fn is_high(self) -> bool {
        self.port.idr().read().0 >> self.pin & 1 != 0
    }

    /// Drives the pin.
    #[inline(always)]
    pub fn drive(self, high: bool) {
        self.port.bsrr().write(|w| w.0 = self.change(high));
    }

    /// The word for BSRR that drives the pin; words of one port may be combined.
    #[must_use]
    #[inline(always)]
    pub const fn change(self, high: bool) -> u32 {
        if high { 1 << self.pin } else { 1 << (self.pin + 16) }
    }
}

/// Enable of M1's drive, high enables; pulled down outside, so it is off in reset.
pub const M1_ENABLE: Line = Line { port: pac::GPIOD, pin: 14 };
/// Enable of M2's drive, on the same port, so that one write changes both.
pub const M2_ENABLE: Line = Line { port: pac::GPIOD, pin: 15 };
/// M1's drive is healthy while high; a broken wire reads low.
pub const M1_HEALTHY: Line = Line { port: pac::GPIOE, pin: 11 };
/// M2's drive is healthy while high.
pub const M2_HEALTHY: Line = Line { port: pac::GPIOE, pin: 9 };
/// The emergency stop is released while high: a normally closed contact to 3.3 V.
pub const STOP_RELEASED: Line = Line { port: pac::GPIOF, pin: 3 };
/// The arm switch is on while high.
pub const ARM_SWITCH: Line = Line { port: pac::GPIOG, pin: 12 };
/// Green lamp.
pub const LAMP_GREEN: Line = Line { port: pac::GPIOB, pin: 0 };
/// Yellow lamp.
pub const LAMP_YELLOW: Line = Line { port: pac::GPIOE, pin: 1 };
/// Red lamp, on the same port as the green one.
pub const LAMP_RED: Line = Line { port: pac::GPIOB, pin: 14 };
/// High from entry to exit of the control tick, for an oscilloscope or the emulator.
pub const TICK_PULSE: Line = Line { port: pac::GPIOE, pin: 13 };

/// ADC1 inputs by rank of the scan: friction (PC0), normal (PA3), M1 torque (PB1), M2 torque (PA6),
/// supply (PA0). In this order they lie in memory.
pub const SCAN_CHANNELS: [u8; crate::memory::SCAN] = [10, 15, 5, 3, 16];
/// DAC1 outputs seen by ADC1, PA4 and PA5: for the loop-back test.
pub const LOOP_BACK_CHANNELS: [u8; 2] = [18, 19];

/// Counter width of M1's encoder timer.
pub const M1_COUNTER_BITS: u32 = 16;
/// Counter width of M2's encoder timer.
pub const M2_COUNTER_BITS: u32 = 32;

/// Caps in raw counts and codes: what the encoder, the converters and the amplifiers on these pins may show at most,
/// whatever the settings say a count or a code is worth. They are those of the assumed rig; another encoder, drive or
/// amplifier on a pin needs another number here.
pub const CAPS: RawCaps = RawCaps {
    // 36 rad/s of 480 000 counts a revolution at 10 kHz: 275.02.
    m2_counts_per_tick: 275.02,
    // M1: 215 N on the elements against 8 N of springs through 30 N/(N·m) are 7.43 of the 8 N·m at 2048 codes. M2: all.
    dac_codes: [1903, 2048],
    // 9.6 of the ±10 N·m that are ±32768 codes: what is above reads as clipped.
    monitor_codes: 31_457.0,
    // 0.3 N·m.
    monitor_zero_codes: 1_000.0,
    // 1 % and 99 % of the range: −17.6 N and 217.6 N.
    normal_low_code: 656,
    normal_high_code: 64_880,
};

/// Control ticks per second.
pub const TICK_HZ: u32 = 10_000;
/// Window in which each analogue input must move by its noise, 25 ms: 16 bit codes of 50 µV move with every sensor.
pub const FROZEN_TICKS: u32 = 250;
/// Clock of TIM6, which makes the control period.
pub const TICK_TIMER_HZ: u32 = 240_000_000;

/// Peripherals that drivers still need after the pins are set up.
pub struct Board {
    /// ADC of the scan.
    pub adc: Peri<'static, peripherals::ADC1>,
    /// ADC that reaches the internal reference.
    pub reference_adc: Peri<'static, peripherals::ADC3>,
    /// Serial port with pins and DMA streams.
    pub link: LinkPort,
    /// Flash.
    pub flash: Peri<'static, peripherals::FLASH>,
}

/// The serial port.
pub struct LinkPort {
    /// USART.
    pub usart: Peri<'static, peripherals::USART3>,
    /// Receives.
    pub rx: Peri<'static, peripherals::PD9>,
    /// Sends.
    pub tx: Peri<'static, peripherals::PD8>,
    /// DMA to the USART.
    pub tx_dma: Peri<'static, peripherals::DMA1_CH0>,
    /// DMA from the USART.
    pub rx_dma: Peri<'static, peripherals::DMA1_CH1>,
}

/// Sets every pin up, outputs first and off, and hands on what drivers need.
#[must_use]
pub fn configure(p: Peripherals) -> Board {
    // The enables come first, low. Dropping an `Output` would release the pin, so all are kept for good.
    core::mem::forget([
        Output::new(p.PD14, Level::Low, Speed::Low),
        Output::new(p.PD15, Level::Low, Speed::Low),
        Output::new(p.PB0, Level::Low, Speed::Low),
        Output::new(p.PE1, Level::Low, Speed::Low),
        Output::new(p.PB14, Level::Low, Speed::Low),
        Output::new(p.PE13, Level::Low, Speed::VeryHigh),
    ]);
    core::mem::forget([
        Input::new(p.PE11, Pull::Down),
        Input::new(p.PE9, Pull::Down),
        Input::new(p.PF3, Pull::Down),
        Input::new(p.PG12, Pull::Down),
    ]);
    // Quadrature inputs; the pull gives an unplugged encoder a level. AF1 is TIM2, AF2 is TIM4.
    alternate(Flex::new(p.PA15), 1);
    alternate(Flex::new(p.PB3), 1);
    alternate(Flex::new(p.PD12), 2);
    alternate(Flex::new(p.PD13), 2);
    // PC0, PA3, PB1, PA6, PA0 (ADC1) and PA4, PA5 (DAC1) are analogue out of reset and stay so.
    Board {
        adc: p.ADC1,
        reference_adc: p.ADC3,
        link: LinkPort { usart: p.USART3, rx: p.PD9, tx: p.PD8, tx_dma: p.DMA1_CH0, rx_dma: p.DMA1_CH1 },
        flash: p.FLASH,
    }
}

fn alternate(mut pin: Flex<'static>, function: u8) {
    pin.set_as_af_unchecked(function, AfType::input(Pull::Down));
    core::mem::forget(pin);
}
