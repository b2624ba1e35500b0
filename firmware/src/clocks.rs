//! Clock tree, and where the clock comes from.
//!
//! | clock | rate | why |
//! |---|---|---|
//! | HSE | 8 MHz | from the ST-LINK (PINS.md): speeds and times are derived from it |
//! | PLL1 P | 8 / 2 · 240 / 2 = 480 MHz | the core's highest rate, in voltage scale 0 |
//! | AHB | 240 MHz | its highest rate |
//! | APB1 to APB4 | 120 MHz | their highest rate; timers run at twice that |
//! | TIM6 | 240 MHz / 24 000 | exactly 10 kHz |
//! | PLL2 P | 8 / 2 · 100 / 8 = 50 MHz | ADC kernel, halved in the converter: 25 MHz, limit at 16 bit is 36 |
//! | USART3 | 120 MHz / 60 | exactly 2 Mbaud |
//!
//! Without the 8 MHz the internal oscillator takes their place (64 / 16 · 240 / 2), off by some 1 % with temperature
//! (DS12110 rev 11, table 134): the rig then still answers, and says so. When the 8 MHz fail later, the clock security
//! system traps, and the trap makes safe. That they are there says nothing of what they are worth: they are the
//! ST-LINK's, by its crystal or by its RC oscillator. `clock_check.rs` measures it on the board, `rig commission` by the
//! computer's clock.

use cortex_m::peripheral::NVIC;
use embassy_stm32::interrupt::{self, Interrupt, InterruptExt, Priority};
use embassy_stm32::rcc::{
    self, AHBPrescaler, APBPrescaler, Hse, HseMode, LsConfig, Pll, PllDiv, PllMul, PllPreDiv, PllSource,
    Sysclk, VoltageScale, mux,
};
use embassy_stm32::time::Hertz;
use embassy_stm32::{Config, Peripherals, pac};

/// Rate of the core and of its cycle counter.
pub const CORE_HZ: u32 = 480_000_000;
/// Reads of the ready flag before the 8 MHz count as missing: some 20 ms at the 64 MHz of the start.
const PATIENCE: u32 = 200_000;

/// Whether the 8 MHz from the ST-LINK are there. To be asked before the clock tree is set up.
#[must_use]
pub fn crystal_present() -> bool {
    let control = pac::RCC.cr();
    control.modify(|w| w.set_hsebyp(true));
    control.modify(|w| w.set_hseon(true));
    let ready = (0..PATIENCE).any(|_| control.read().hserdy());
    control.modify(|w| w.set_hseon(false));
    while ready && control.read().hserdy() {}
    ready
}

/// Sets up the clock tree, and starts the executor's clock.
///
/// That clock (embassy-stm32, `time_driver/gp16.rs`) counts half turns of TIM3's counter in an interrupt, and takes a count
/// whose lowest bit is not the counter's highest for one whose interrupt is still to come. Its start generates an update
/// (UG), which sets the counter to 0 while CCR1 is 0 too: a match (CC1IF, RM0433 rev 9, 39.4.5), counted as a half turn as
/// soon as interrupts are on. From then on the count is one ahead, and a look at the time just after a half turn, before
/// its interrupt, is 65.5 ms early: a task may then sleep a whole turn too long. So the flag goes before it can interrupt.
/// Whether this chip sets it at UG is not known here; the bench's timer does.
#[must_use]
pub fn start(crystal: bool) -> Peripherals {
    cortex_m::interrupt::free(|_| {
        let peripherals = embassy_stm32::init(config(crystal));
        // Flags are cleared by zeros, and the write has landed when it is read back: only then is the request gone.
        pac::TIM3.sr().write(|w| w.0 = 0);
        let _ = pac::TIM3.sr().read();
        NVIC::unpend(Interrupt::TIM3);
        peripherals
    })
}

/// The clock tree of the table above.
fn config(crystal: bool) -> Config {
    let mut config = Config::default();
    let (source, prediv) = if crystal {
        config.rcc.hse = Some(Hse { freq: Hertz(8_000_000), mode: HseMode::Bypass });
        (PllSource::HSE, PllPreDiv::DIV2)
    } else {
        (PllSource::HSI, PllPreDiv::DIV16)
    };
    let pll =
        |mul, divp| Some(Pll { source, prediv, mul, fracn: None, divp: Some(divp), divq: None, divr: None });
    config.rcc.hsi = Some(rcc::HSIPrescaler::DIV1);
    config.rcc.hsi48 = None;
    config.rcc.pll1 = pll(PllMul::MUL240, PllDiv::DIV2);
    config.rcc.pll2 = pll(PllMul::MUL100, PllDiv::DIV8);
    // PLL3 runs for nothing: the driver leaves a PLL off by rewriting the dividers of those that run.
    config.rcc.pll3 = pll(PllMul::MUL100, PllDiv::DIV8);
    config.rcc.sys = Sysclk::PLL1_P;
    config.rcc.ahb_pre = AHBPrescaler::DIV2;
    config.rcc.apb1_pre = APBPrescaler::DIV2;
    config.rcc.apb2_pre = APBPrescaler::DIV2;
    config.rcc.apb3_pre = APBPrescaler::DIV2;
    config.rcc.apb4_pre = APBPrescaler::DIV2;
    config.rcc.voltage_scale = VoltageScale::Scale0;
    config.rcc.mux.adcsel = mux::Adcsel::PLL2_P;
    config.rcc.ls = LsConfig::off();
    // The control tick is at P1; every driver's DMA comes after it, and `yield_to_the_tick` does the rest.
    config.dma_interrupt_priority = Priority::P6;
    config.bdma_interrupt_priority = Priority::P6;
    config.mdma_interrupt_priority = Priority::P6;
    config
}

/// Whether the core runs from the 8 MHz of the ST-LINK.
#[must_use]
pub fn crystal_is_used() -> bool {
    pac::RCC.pllckselr().read().pllsrc() == PllSource::HSE
}

/// Puts every driver's interrupt behind the control tick. Out of reset all have the highest priority.
pub fn yield_to_the_tick() {
    for line in [interrupt::TIM3, interrupt::USART3, interrupt::FLASH] {
        line.set_priority(Priority::P6);
    }
}

/// Turns the clock security system on: 8 MHz that fail trap (NMI) instead of slowing the loop.
pub fn watch_crystal() {
    pac::RCC.cr().modify(|w| w.set_hsecsson(true));
}
