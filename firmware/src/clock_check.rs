//! What the chip's clock is worth, measured against the board's 32.768 kHz crystal: for the tests on the board.
//!
//! The 8 MHz that everything is derived from come from the ST-LINK, and may be its RC oscillator's (`clocks.rs`). The board
//! has one crystal at the chip itself, the LSE's (UM2407, LSE clock supply: X2, connected as the board comes), some 20 to
//! 100 ppm: far better than what is asked. TIM16's input can be switched to it inside the chip (RM0433, `TIM16_TISEL`,
//! `TI1SEL` = 2: LSE), so that nothing is wired: the timer runs at 240 MHz and captures every eighth rising edge.
//!
//! The firmware itself leaves the LSE off: it takes seconds to start, and a start must not wait for that.

use cortex_m::asm::delay;
use embassy_stm32::pac::rcc::vals::Lsedrv;
use embassy_stm32::pac::timer::vals::CcmrInputCcs;
use embassy_stm32::pac::{PWR, RCC, TIM16};
use embassy_stm32::{peripherals, rcc};
use embassy_time::{Duration, Instant};

/// Clock of TIM16: twice APB2's (`clocks.rs`).
const TIMER_HZ: i64 = 240_000_000;
const CRYSTAL_HZ: i64 = 32_768;
/// `TI1SEL`: the LSE (RM0433, `TIM16_TISEL`).
const LSE: u8 = 2;
/// `IC1PSC`: a capture every eighth edge (RM0433, `TIM16_CCMR1`). These are 58 594 periods of the timer, in whose 16 bits
/// the distance of two captures is told from the next turn up to a timer that is 11 % too fast.
const EVERY_EIGHTH: u8 = 0b11;
const EDGES: i64 = 8;
/// Captures that are added up: a quarter of a second of the crystal.
const CAPTURES: i64 = 1024;
/// The crystal starts within 2 s, typically (DS12110 rev 11, table 132): it gets twice that.
const START: Duration = Duration::from_secs(4);
/// A capture is due every 0.24 ms.
const CAPTURE: Duration = Duration::from_millis(10);
/// Cycles between two looks: 5 µs, and a capture must not be missed.
const LOOK_CYCLES: u32 = 2_400;

/// How much faster the timers run than they should, by the crystal, ppm.
///
/// # Errors
/// In words, what the crystal does not do. It is off again after that too, and nothing here waits without end.
pub fn deviation_ppm() -> Result<i32, &'static str> {
    let measured = start_crystal().and_then(|()| measure());
    rcc::disable::<peripherals::TIM16>();
    RCC.bdcr().modify(|w| w.set_lseon(false));
    let hz = measured? * CRYSTAL_HZ / (EDGES * CAPTURES);
    Ok(((hz - TIMER_HZ) * 1_000_000 / TIMER_HZ) as i32)
}

/// Waits until this holds; says whether it does.
fn comes(within: Duration, mut holds: impl FnMut() -> bool) -> bool {
    let until = Instant::now() + within;
    loop {
        if holds() {
            return true;
        }
        if Instant::now() > until {
            return false;
        }
        delay(LOOK_CYCLES);
    }
}

fn start_crystal() -> Result<(), &'static str> {
    // The backup domain takes writes only so (RM0433, `PWR_CR1`, `DBP`).
    PWR.cr1().modify(|w| w.set_dbp(true));
    if !comes(CAPTURE, || PWR.cr1().read().dbp()) {
        return Err("the backup domain stays locked");
    }
    // The strongest drive starts every crystal; the two in the middle are swapped in some revisions (ES0392 rev 15, 2.2.15).
    RCC.bdcr().modify(|w| w.set_lsedrv(Lsedrv::HIGH));
    RCC.bdcr().modify(|w| w.set_lseon(true));
    if comes(START, || RCC.bdcr().read().lserdy()) {
        Ok(())
    } else {
        Err("the 32.768 kHz crystal does not start")
    }
}

/// Periods of the timer in all captures.
fn measure() -> Result<i64, &'static str> {
    rcc::enable_and_reset::<peripherals::TIM16>();
    TIM16.psc().write_value(0);
    TIM16.arr().write(|w| w.set_arr(u16::MAX));
    TIM16.tisel().write(|w| w.set_tisel(0, LSE));
    TIM16.ccmr_input(0).write(|w| {
        w.set_ccs(0, CcmrInputCcs::TI4); // own input, as in encoders.rs
        w.set_icpsc(0, EVERY_EIGHTH);
    });
    TIM16.ccer().write(|w| w.set_cce(0, true));
    TIM16.cr1().write(|w| w.set_cen(true));
    let mut last = capture()?;
    let mut periods = 0;
    for _ in 0..CAPTURES {
        let this = capture()?;
        periods += i64::from(this.wrapping_sub(last));
        last = this;
    }
    Ok(periods)
}

/// The next capture. Reading it clears its flag (RM0433, `TIM16_SR`, `CC1IF`).
fn capture() -> Result<u16, &'static str> {
    if !comes(CAPTURE, || TIM16.sr().read().ccif(0)) {
        return Err("no edges come from the 32.768 kHz crystal");
    }
    if TIM16.sr().read().ccof(0) {
        return Err("an edge of the 32.768 kHz crystal was missed");
    }
    Ok(TIM16.ccr(0).read().ccr())
}
