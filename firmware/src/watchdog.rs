//! The independent watchdog: 2 ms, fed by the control tick while the threads are alive too.
//!
//! It runs from its own oscillator (LSI, 32 kHz, some −8 … +6 %), and once started only a reset stops it.
//! 4 / 32 kHz · 16 = 2 ms is 20 control periods: a tick that hangs is ended by a reset, in which the
//! enables are off. While a debugger holds the core the count is held too.

use core::sync::atomic::{AtomicU32, Ordering::Relaxed};
use embassy_stm32::pac::iwdg::vals::{Key, Pr};
use embassy_stm32::pac::{DBGMCU, IWDG1};

/// Ticks without a sign of life from the threads after which the watchdog is starved: 0.5 s.
const THREADS_SILENT_TICKS: u32 = 5_000;

static THREADS: AtomicU32 = AtomicU32::new(0);

/// Starts the watchdog; it cannot be stopped.
pub fn start() {
    DBGMCU.apb4fzr1().modify(|w| w.set_iwdg1(true));
    IWDG1.kr().write(|w| w.set_key(Key::START));
    IWDG1.kr().write(|w| w.set_key(Key::ENABLE));
    IWDG1.pr().write(|w| w.set_pr(Pr::DIVIDE_BY4));
    IWDG1.rlr().write(|w| w.set_rl(16 - 1));
    // The two values above cross into the watchdog's clock domain; until then feeding is ignored.
    for _ in 0..100_000 {
        let status = IWDG1.sr().read();
        if !status.pvu() && !status.rvu() {
            break;
        }
    }
    IWDG1.kr().write(|w| w.set_key(Key::RESET));
}

/// A sign of life from the threads.
pub fn threads_alive() {
    THREADS.store(THREADS.load(Relaxed).wrapping_add(1), Relaxed);
}

/// The control tick's side of the watchdog.
#[derive(Default)]
pub struct Feeder {
    seen: u32,
    silent_ticks: u32,
}

impl Feeder {
    /// To be called once a tick: feeds the watchdog unless the threads hang.
    #[inline(always)]
    pub fn feed(&mut self) {
        let now = THREADS.load(Relaxed);
        if now == self.seen {
            self.silent_ticks = self.silent_ticks.saturating_add(1);
        } else {
            self.seen = now;
            self.silent_ticks = 0;
        }
        if self.silent_ticks < THREADS_SILENT_TICKS {
            IWDG1.kr().write(|w| w.set_key(Key::RESET));
        }
    }
}
