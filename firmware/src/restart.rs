//! What happens when the firmware cannot go on, and why it started.
//!
//! A panic, a trap or an interrupt nobody handles: interrupts off, outputs safe, crash record written, reset. The
//! start after it finds the message and the reset flags, and the control core latches the fault from them:
//! the rig stays down until a person has cleared it.

use crate::{crash_record, outputs, tick};
use core::panic::PanicInfo;
use cortex_m::peripheral::SCB;
use cortex_m_rt::ExceptionFrame;
use embassy_stm32::pac::RCC;
use model_core::control::Restart;
use rig_link::message::{CrashKind, CrashRecord, ResetCause};

/// Ends the firmware after a panic.
pub fn panicked(info: &PanicInfo<'_>) -> ! {
    stop(CrashKind::Panic, format_args!("{info}"))
}

/// Ends the firmware after a hard fault.
pub fn trapped(frame: &ExceptionFrame) -> ! {
    // SAFETY: the system control block is memory-mapped at its architectural address and only read here.
    let scb = unsafe { &*SCB::PTR };
    let (cfsr, hfsr) = (scb.cfsr.read(), scb.hfsr.read());
    let (bfar, mmfar) = (scb.bfar.read(), scb.mmfar.read());
    stop(
        CrashKind::HardFault,
        format_args!(
            "pc {:#010x} lr {:#010x} cfsr {cfsr:#010x} hfsr {hfsr:#010x} bfar {bfar:#010x} mmfar {mmfar:#010x}",
            frame.pc(),
            frame.lr()
        ),
    )
}

/// Ends the firmware after an exception or interrupt nobody handles; the clock's failure is one (NMI, −14).
pub fn unexpected(number: i16) -> ! {
    stop(CrashKind::Exception, format_args!("unexpected exception {number}"))
}

/// Ends the firmware when the chip's supply falls.
pub fn supply_fell() -> ! {
    stop(CrashKind::Exception, format_args!("the chip's supply fell below 2.8 V"))
}

fn stop(kind: CrashKind, message: core::fmt::Arguments<'_>) -> ! {
    cortex_m::interrupt::disable();
    outputs::make_safe();
    crash_record::keep(kind, tick::now(), message);
    SCB::sys_reset()
}

/// Restarts by command; the outputs are made safe first.
pub fn by_command() -> ! {
    cortex_m::interrupt::disable();
    outputs::make_safe();
    SCB::sys_reset()
}

/// Why the chip started; clears the flags for the next time.
pub fn reset_cause() -> ResetCause {
    let flags = RCC.rsr().read();
    let cause = if flags.iwdg1rstf() {
        ResetCause::Watchdog
    } else if flags.sftrstf() {
        ResetCause::Software
    } else if flags.porrstf() || flags.borrstf() {
        ResetCause::PowerOn
    } else if flags.pinrstf() {
        ResetCause::Pin
    } else {
        ResetCause::Other
    };
    RCC.rsr().modify(|w| w.set_rmvf(true));
    cause
}

/// What the control core learns about the start.
#[must_use]
pub fn restart_kind(cause: ResetCause, record: Option<&CrashRecord>) -> Restart {
    match (record.map(|record| record.kind), cause) {
        (Some(CrashKind::Panic), _) => Restart::Panic,
        (Some(CrashKind::HardFault | CrashKind::Exception), _) => Restart::HardFault,
        (None, ResetCause::Watchdog) => Restart::Watchdog,
        (None, _) => Restart::Ordinary,
    }
}
