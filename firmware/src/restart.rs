//! What happens when the firmware cannot go on, and why it started.
//!
//! A panic, a trap or an interrupt nobody handles: interrupts off, outputs safe, message kept, reset. The
//! start after it finds the message and the reset flags, and the control core latches the fault from them:
//! the rig stays down until a person has cleared it.

use crate::{kept, outputs, tick};
use core::panic::PanicInfo;
use cortex_m::peripheral::SCB;
use cortex_m_rt::ExceptionFrame;
use embassy_stm32::pac::RCC;
use model_core::control::Restart;
use rig_link::message::{KeptKind, KeptMessage, ResetCause};

/// Ends the firmware after a panic.
pub fn panicked(info: &PanicInfo<'_>) -> ! {
    stop(KeptKind::Panic, format_args!("{info}"))
}

/// Ends the firmware after a hard fault.
pub fn trapped(frame: &ExceptionFrame) -> ! {
    // SAFETY: the system control block is memory-mapped at its architectural address and only read here.
    let scb = unsafe { &*SCB::PTR };
    let (cfsr, hfsr) = (scb.cfsr.read(), scb.hfsr.read());
    let (bfar, mmfar) = (scb.bfar.read(), scb.mmfar.read());
    stop(
        KeptKind::HardFault,
        format_args!(
            "pc {:#010x} lr {:#010x} cfsr {cfsr:#010x} hfsr {hfsr:#010x} bfar {bfar:#010x} mmfar {mmfar:#010x}",
            frame.pc(),
            frame.lr()
        ),
    )
}

/// Ends the firmware after an exception or interrupt nobody handles; the clock's failure is one (NMI, −14).
pub fn unexpected(number: i16) -> ! {
    stop(KeptKind::Exception, format_args!("unexpected exception {number}"))
}

fn stop(kind: KeptKind, message: core::fmt::Arguments<'_>) -> ! {
    cortex_m::interrupt::disable();
    outputs::make_safe();
    kept::keep(kind, tick::now(), message);
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
pub fn restart_kind(cause: ResetCause, kept: Option<&KeptMessage>) -> Restart {
    match (kept.map(|message| message.kind), cause) {
        (Some(KeptKind::Panic), _) => Restart::Panic,
        (Some(KeptKind::HardFault | KeptKind::Exception), _) => Restart::HardFault,
        (None, ResetCause::Watchdog) => Restart::Watchdog,
        (None, _) => Restart::Ordinary,
    }
}
