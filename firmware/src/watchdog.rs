//! The independent watchdog: 2 ms, fed by the control tick while each thread is alive too.
//!
//! It runs from its own oscillator (LSI, 32 kHz, some −8 … +6 %), and once started only a reset stops it.
//! 4 / 32 kHz · 16 = 2 ms is 20 control periods: a tick that hangs is ended by a reset, in which the
//! enables are off.
//!
//! A debugger that halts the core does not hold the count: the drives may be enabled at that moment, and with the core
//! halted nothing else would ever disable them. So halting this firmware restarts it (`README.md` says how to debug).

use core::sync::atomic::{AtomicU32, Ordering::Relaxed};
use embassy_stm32::pac::iwdg::vals::{Key, Pr};
use embassy_stm32::pac::{DBGMCU, IWDG1};

/// Ticks without a sign of life from one of the threads after which the watchdog is starved: 0.5 s.
const THREADS_SILENT_TICKS: u32 = 5_000;

/// The threads that must be alive: each gives signs of its own.
#[derive(Clone, Copy)]
pub enum Thread {
    /// Writes the log and sends events.
    Log = 1 << 0,
    /// Receives requests and carries them out.
    Receiver = 1 << 1,
    /// Sends.
    Sender = 1 << 2,
}

const EVERYBODY: u32 = Thread::Log as u32 | Thread::Receiver as u32 | Thread::Sender as u32;

static ALIVE: AtomicU32 = AtomicU32::new(0);

/// Starts the watchdog; it cannot be stopped.
pub fn start() {
    // Not frozen in debug, whatever a debugger left there: this register outlives a system reset (RM0433, DBGMCU_APB4FZ1).
    DBGMCU.apb4fzr1().modify(|w| w.set_iwdg1(false));
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

/// A sign of life from a thread.
pub fn alive(who: Thread) {
    ALIVE.fetch_or(who as u32, Relaxed);
}

/// The control tick's side of the watchdog.
#[derive(Default)]
pub struct Feeder {
    silent_ticks: u32,
}

impl Feeder {
    /// To be called once a tick: feeds the watchdog unless a thread hangs.
    #[inline(always)]
    pub fn feed(&mut self) {
        self.silent_ticks = self.silent_ticks.saturating_add(1);
        if ALIVE.load(Relaxed) == EVERYBODY {
            // No thread runs while this does, so no sign is lost between load and store.
            ALIVE.store(0, Relaxed);
            self.silent_ticks = 0;
        }
        if self.silent_ticks < THREADS_SILENT_TICKS {
            IWDG1.kr().write(|w| w.set_key(Key::RESET));
        }
    }
}
