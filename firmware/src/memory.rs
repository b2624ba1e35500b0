//! Memory regions, cache policy and DMA policy. The regions themselves are in `memory.x`.
//!
//! | region | holds | why there |
//! |---|---|---|
//! | flash bank 1 | program | the settings are in bank 2, so erasing them does not stall fetches |
//! | flash bank 2, sectors 0 and 1 | settings | two sectors: one is erased while the other is valid |
//! | flash bank 2, sector 2 | journal of their erasing | a sector half erased at a power cut is known as such |
//! | ITCM | vectors, the control tick and what it calls | no wait states, whatever ran before (`itcm.rs`) |
//! | DTCM, first 56 KB | stack | at its lower end memory ends: an overflow traps instead of overwriting |
//! | DTCM, the rest | `.data`, `.bss`: state of the loop | no wait states, no cache: the tick's time is steady |
//! | AXI SRAM, 480 KB | rows of the capture | largest memory; written by the tick, read by the link |
//! | AXI SRAM, 32 KB | DMA buffers | DMA1 and DMA2 do not reach the DTCM |
//! | SRAM4 | crash record, kept over a reset | nothing clears it at reset or start |
//!
//! **Caches.** The instruction cache is on: at 480 MHz flash answers after several wait states. The data cache is on for flash
//! bank 1 alone: state and stack are in DTCM, which needs none, and memory that a DMA writes is not cached (`mpu.rs`).
//!
//! **Uninitialised regions.** `.capture`, `.dma` and `.crash` are not written at start. What lies there is
//! either made of atomics, for which any bits are a value, or cleared here before it is given away.

use core::cell::UnsafeCell;
use core::sync::atomic::{AtomicBool, AtomicU8, AtomicU16, AtomicU32, Ordering};
use rig_link::capture::CaptureRow;

/// Channels of one scan of the analogue inputs.
pub const SCAN: usize = 5;
/// Words of one row of the capture.
pub const ROW_WORDS: usize = CaptureRow::BYTES / 4;
/// Rows of the capture: 2.048 s at 10 kHz.
pub const CAPTURE_ROWS: usize = 20_480;

/// The last scan, written by DMA1 stream 7.
#[unsafe(link_section = ".dma.scan")]
pub static SCAN_CODES: [AtomicU16; SCAN] = [const { AtomicU16::new(0) }; SCAN];

/// M1's encoder counter at the begin of the period, written by DMA1 stream 5.
#[unsafe(link_section = ".dma.m1_latch")]
pub static M1_LATCH: [AtomicU32; 1] = [const { AtomicU32::new(0) }; 1];

/// Periods that the ring of M2's counter holds.
pub const M2_LATCHES: usize = 16;

/// M2's encoder counter at the begin of the last periods, a ring, written by DMA1 stream 6.
#[unsafe(link_section = ".dma.m2_latch")]
pub static M2_LATCH: [AtomicU32; M2_LATCHES] = [const { AtomicU32::new(0) }; M2_LATCHES];

/// Rows of the capture, a ring.
#[unsafe(link_section = ".capture.rows")]
pub static CAPTURE_WORDS: [AtomicU32; CAPTURE_ROWS * ROW_WORDS] =
    [const { AtomicU32::new(0) }; CAPTURE_ROWS * ROW_WORDS];

/// Words that survive a reset; `crash_record.rs` says what they mean.
#[unsafe(link_section = ".crash.words")]
pub static CRASH_WORDS: [AtomicU32; 64] = [const { AtomicU32::new(0) }; 64];

/// Size of the ring for received bytes: 20 ms at full rate.
pub const RECEIVED_BYTES: usize = 4096;

/// Received bytes, a ring, written by DMA1 stream 1.
#[unsafe(link_section = ".dma.received")]
pub static RECEIVED: [AtomicU8; RECEIVED_BYTES] = [const { AtomicU8::new(0) }; RECEIVED_BYTES];

/// Buffers of the serial link.
#[repr(C, align(32))]
pub struct LinkBuffers {
    /// What the DMA sends.
    pub sending: [u8; 2048],
}

#[repr(transparent)]
struct LinkMemory(UnsafeCell<LinkBuffers>);

// SAFETY: the only access is in `take_link_buffers`, which gives the buffers to one caller.
unsafe impl Sync for LinkMemory {}

#[unsafe(link_section = ".dma.link")]
static LINK_MEMORY: LinkMemory = LinkMemory(UnsafeCell::new(LinkBuffers { sending: [0; 2048] }));

/// The buffers of the serial link, cleared; none from the second call on.
#[must_use]
pub fn take_link_buffers() -> Option<&'static mut LinkBuffers> {
    static TAKEN: AtomicBool = AtomicBool::new(false);
    if TAKEN.swap(true, Ordering::AcqRel) {
        return None;
    }
    let buffers = LINK_MEMORY.0.get();
    // SAFETY: `TAKEN` lets one caller pass, so this is the only reference. All-zero bytes are a value of
    // `LinkBuffers`, and the region is mapped RAM of its size, aligned by the linker.
    unsafe {
        buffers.write_bytes(0, 1);
        Some(&mut *buffers)
    }
}

/// Bytes of the stack that were ever used, and its size: what lost the paint that the start put on all of it
/// (`cortex-m-rt`, `paint-stack`). Reads what is left of the paint, some ten thousand words: for a thread, now and then.
#[must_use]
pub fn stack_used() -> (u32, u32) {
    unsafe extern "C" {
        static _stack_end: u32;
        static _stack_start: u32;
    }
    let (end, begin) = (&raw const _stack_end, &raw const _stack_start);
    let size = begin as usize - end as usize;
    let painted = (0..size / 4)
        // SAFETY: both symbols bound the stack's memory, aligned to words (`memory.x`); words are only read, and whole.
        .take_while(|word| unsafe { end.add(*word).read_volatile() } == cortex_m_rt::STACK_PAINT_VALUE)
        .count();
    ((size - 4 * painted) as u32, size as u32)
}

/// The build id the linker made of the contents of the ELF; zeros if there is none.
#[must_use]
pub fn build_id() -> [u8; 20] {
    unsafe extern "C" {
        static __build_id: [u8; 36];
    }
    // SAFETY: the linker script defines the symbol in flash at a note of 16 bytes of header and 20 of id
    // (`--build-id=sha1`); it is only read.
    let note = unsafe { (&raw const __build_id).read() };
    let mut id = [0; 20];
    id.copy_from_slice(&note[16..36]);
    id
}
