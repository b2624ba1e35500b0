//! Faults that reach into the chip: masked interrupts, locked DMA streams, handlers that hang or trap.
//!
//! Each is done over the bus or by code put beside the firmware's, so the firmware meets it as it would on silicon.

use crate::part::Part;
use rigless::emulator::Host;
use rigless::mcu::Operate;
use rigless::soc::Width;
use rigless::soc::stm32h743::generated::{DMA1, DMAMUX1, TIM6};
use rigless::time::VirtualNanos;

/// `DMAREQ_ID` of USART3's receiver and transmitter, RM0433 rev 9, table 124.
const USART3_REQUESTS: [u64; 2] = [45, 46];
/// `TRBUFF` of `DMA_SxCR`, RM0433 section 15.5.5.
const TRBUFF: u64 = 1 << 20;
/// `SxCR` of stream 0, and the distance of two streams.
const FIRST_CONTROL: u64 = 0x10;
const STREAM_STRIDE: u64 = 0x18;

/// Where the code put in a handler's way lies: the end of the ITCM, which the firmware leaves alone and lets run.
pub(crate) const STUB: u64 = 0xFF00;
/// Where interrupts are masked in the code of [`masking_stub`].
pub(crate) const MASKED_AT: u64 = STUB + 2 * 12;
/// `TIMx_CNT`.
const COUNTER: u64 = 0x24;
/// Rounds of the stub's loop, two instructions each, in this time.
const fn rounds(ns: u64) -> u64 {
    ns * crate::board::INSTRUCTIONS_PER_SECOND.get() / 2_000_000_000
}

/// A word that code in ITCM may write, as the firmware does not: `S3M1AR` of DMA1, whose stream 3 it leaves alone.
const SPARE_REGISTER: u64 = DMA1.base + 0x68;

/// An address where nothing answers.
pub(crate) const NOTHING: u64 = 0xA000_0000;
/// `ICSR` of the core, and the bit that pends the non-maskable interrupt (ARMv7-M B3.2.4).
pub(crate) const ICSR: u64 = 0xE000_ED04;
pub(crate) const NMI_PENDS: u64 = 1 << 31;

/// Pends another exception, and goes on to the handler:
/// ldr r0, register; ldr r1, pends; str r1, [r0]; dsb; ldr r0, original; bx r0; nop
const PEND: [u16; 8] = [0x4803, 0x4904, 0x6001, 0xF3BF, 0x8F4F, 0x4803, 0x4700, 0xBF00];
/// `NVIC_ISPR0`, and the bit of the voltage detector (ARMv7-M B3.4.5, RM0433 table 147).
pub(crate) const ISPR0: u64 = 0xE000_E200;
pub(crate) const PVD_PENDS: u64 = 1 << 1;

/// What stands before a handler in place of [`masking_stub`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Obstacle {
    /// All interrupts masked, and an endless loop.
    HangMasked,
    /// A read of this address.
    Reads(u64),
    /// A write to this address.
    Writes(u64),
    /// The non-maskable interrupt, as the clock security system asks for it; the emulator's clock controller leaves that
    /// line out (RM0433 8.5.3).
    ClockFailure,
    /// The voltage detector's interrupt: the emulator's has no line to the interrupts' controller.
    SupplyFalls,
}

/// Puts code in front of the handler `original`, and gives the word for the interrupt's vector.
pub(crate) fn obstacle(host: &mut dyn Host, original: u64, what: Obstacle) -> u64 {
    let (code, words): (&[u16], Vec<u64>) = match what {
        Obstacle::HangMasked => (&[0xB672, 0xE7FE], vec![]), // cpsid i; b .
        // ldr r0, nothing; ldr r0, [r0]
        Obstacle::Reads(address) => (&[0x4800, 0x6800], vec![address]),
        Obstacle::Writes(address) => (&[0x4800, 0x6000], vec![address]), // the same with str r0, [r0]
        Obstacle::ClockFailure => (&PEND, vec![ICSR, NMI_PENDS, original | 1]),
        Obstacle::SupplyFalls => (&PEND, vec![ISPR0, PVD_PENDS, original | 1]),
    };
    put(host, STUB, code, &words)
}

/// Puts code and the words behind it into RAM that the firmware leaves alone, and gives the word for a vector.
pub(crate) fn put(host: &mut dyn Host, at: u64, code: &[u16], words: &[u64]) -> u64 {
    for (at, half) in (at..).step_by(2).zip(code) {
        let _ = host.write(at, Width::W16, (*half).into());
    }
    for (at, word) in (at + 2 * code.len() as u64..).step_by(4).zip(words) {
        let _ = host.write(at, Width::W32, *word);
    }
    at | 1
}

/// Locks the streams up that serve USART3 without `TRBUFF` (ES0392 rev 15, 2.20.4): their requests are no longer
/// served, `EN` stands and the counter stays. Says whether there was one.
pub(crate) fn lock_up_serial_streams(part: &mut Part, at: VirtualNanos) -> bool {
    let mut locked = false;
    for stream in 0..8 {
        let channel = DMAMUX1.base + 4 * stream;
        let request = read(part, at, channel) & 0x7F;
        let control = read(part, at, DMA1.base + FIRST_CONTROL + STREAM_STRIDE * stream);
        if USART3_REQUESTS.contains(&request) && control & TRBUFF == 0 {
            write(part, at, channel, 0);
            locked = true;
        }
    }
    locked
}

/// Takes the receiver's request from its stream or gives it back: `EN` stands and the counter stays, as in a lock-up.
pub(crate) fn lock_receiver(part: &mut Part, at: VirtualNanos, locked: bool) {
    // DMAMUX1's channel 1 is that of DMA1 stream 1 (firmware/src/link/ring.rs).
    write(part, at, DMAMUX1.base + 4, if locked { 0 } else { USART3_REQUESTS[0] });
}

/// A register; 0 where nothing answers.
pub(crate) fn read(part: &mut Part, at: VirtualNanos, address: u64) -> u64 {
    Operate::read(part, at, address, Width::W32).unwrap_or_default()
}

pub(crate) fn write(part: &mut Part, at: VirtualNanos, address: u64, value: u64) {
    // The controllers' clocks are on: the firmware uses them.
    let _ = Operate::write(part, at, address, Width::W32, value);
}

/// Where the vector of an interrupt lies: the firmware has its table in ITCM (firmware/memory.x).
pub(crate) const fn vector(line: u64) -> u64 {
    0x1000 + 4 * (16 + line)
}

/// Puts code in front of the handler `original` that waits until TIM6 is within a microsecond after `from_ns` of its
/// period and then masks all interrupts for `for_ns`, each time the interrupt comes as long as [`mask_times`] says so. Gives
/// the word for the interrupt's vector.
pub(crate) fn masking_stub(host: &mut dyn Host, original: u64, from_ns: u64, for_ns: u64) -> u64 {
    let code: [u16; 20] = [
        0x4B09, // ldr  r3, flag
        0x6818, // ldr  r0, [r3]
        0x2800, // cmp  r0, #0
        0xD00C, // beq  out
        0x3801, // subs r0, #1
        0x6018, // str  r0, [r3]
        0x4907, // ldr  r1, counter
        0x4A08, // ldr  r2, target
        0x6808, // wait: ldr r0, [r1]
        0x1A80, // subs r0, r0, r2
        0x28F0, // cmp  r0, #240
        0xD2FB, // bhs  wait
        0xB672, // cpsid i
        0x4806, // ldr  r0, rounds
        0x3801, // loop: subs r0, #1
        0xD1FD, // bne  loop
        0xB662, // cpsie i
        0x4805, // out: ldr r0, original
        0x4700, // bx   r0
        0xBF00, // nop
    ];
    let target = from_ns * 240 / 1000;
    let words = [SPARE_REGISTER, TIM6.base + COUNTER, target, rounds(for_ns).max(1), original | 1];
    put(host, STUB, &code, &words)
}

/// Lets the code of [`masking_stub`] mask interrupts so often.
pub(crate) fn mask_times(part: &mut Part, at: VirtualNanos, times: u32) {
    write(part, at, SPARE_REGISTER, times.into());
}
