//! Code put beside the firmware's that looks into the core, where no debugger of the bench reaches.
//!
//! What it finds it leaves at the stack's far end, which nothing else comes near: so it is for runs that look at nothing
//! else there.

use crate::interference::{ICSR, ISPR0, NMI_PENDS, NOTHING, PVD_PENDS, put};
use crate::outside::Crash;
use rigless::emulator::Host;
use rigless::soc::Width;

/// Where it leaves what it finds: the stack's far end (firmware/memory.x).
pub const FOUND: u64 = 0x2000_0000;
/// Regions of the memory protection unit.
pub const REGIONS: u64 = 16;
/// Where the code lies: in the ITCM, behind what the firmware has there.
const CODE: u64 = 0xFA00;
/// From one copy of the code that measures to the next.
const STRIDE: u64 = 0x80;

/// Interrupts of the firmware that are measured, with the bytes of stack that are painted for each: twice what they took when
/// this was written, and less than would make the control tick late. TIM6's, which runs the same tick in the same frame when a
/// scan did not come, is left out: painting for both takes longer than a period.
pub const MEASURED: [(u64, u64, &str); 6] = [
    (47, 8192, "DMA1_STREAM7: the control tick"),
    (11, 1024, "DMA1_STREAM0: the link's sender"),
    (12, 1024, "DMA1_STREAM1: the link's receiver"),
    (29, 1024, "TIM3: the executor's time"),
    (39, 1024, "USART3: the link"),
    (4, 1024, "FLASH: the settings"),
];
/// The first so many of [`MEASURED`] have the priority of the tick, the others that of the drivers.
pub const OF_THE_TICK: usize = 1;

/// Puts code before the handler `original` that copies the memory protection unit's regions, base and attributes, its control
/// register and the core's CCR to [`FOUND`], and gives the word for the vector.
pub(crate) fn map_reader(host: &mut dyn Host, original: u64) -> u64 {
    const CODE_OF_IT: [u16; 20] = [
        0x4809, // ldr  r0, control
        0x490A, // ldr  r1, found
        0x2200, // movs r2, #0
        0x6042, // next: str r2, [r0, #4]: number
        0x6883, // ldr  r3, [r0, #8]: base
        0x600B, // str  r3, [r1]
        0x68C3, // ldr  r3, [r0, #12]: attributes
        0x604B, // str  r3, [r1, #4]
        0x3108, // adds r1, #8
        0x3201, // adds r2, #1
        0x2A10, // cmp  r2, #16
        0xD1F6, // bne  next
        0x6803, // ldr  r3, [r0]: control
        0x600B, // str  r3, [r1]
        0x4804, // ldr  r0, ccr
        0x6803, // ldr  r3, [r0]
        0x604B, // str  r3, [r1, #4]
        0x4804, // ldr  r0, original
        0x4700, // bx   r0
        0xBF00, // nop
    ];
    // MPU_CTRL and CCR (ARMv7-M B3.5.5, B3.2.8).
    put(host, CODE, &CODE_OF_IT, &[0xE000_ED94, FOUND, 0xE000_ED14, original | 1])
}

/// Puts code round the handler `original` that paints `painted` bytes of stack below it, runs it, and keeps in a word of
/// [`FOUND`] how far it came at most. Interrupts are masked meanwhile, so that no other handler counts with it; the frame the
/// core stacks does not count. Gives the word for the vector.
pub(crate) fn depth_meter(host: &mut dyn Host, which: u64, original: u64, painted: u64) -> u64 {
    const CODE_OF_IT: [u16; 30] = [
        0xB570, // push {r4, r5, r6, lr}
        0xF3EF, 0x8610, // mrs r6, primask
        0xB672, // cpsid i
        0x466D, // mov  r5, sp
        0x4C0C, // ldr  r4, painted
        0x1B2C, // subs r4, r5, r4
        0x490C, // ldr  r1, paint
        0x4620, // mov  r0, r4
        0x6001, // next: str r1, [r0]
        0x3004, // adds r0, #4
        0x42A8, // cmp  r0, r5
        0xD1FB, // bne  next
        0x480A, // ldr  r0, original
        0x4780, // blx  r0
        0x4908, // ldr  r1, paint
        0x6820, // look: ldr r0, [r4]
        0x3404, // adds r4, #4
        0x4288, // cmp  r0, r1
        0xD0FB, // beq  look
        0x3C04, // subs r4, #4
        0x1B2D, // subs r5, r5, r4
        0x4806, // ldr  r0, cell
        0x6801, // ldr  r1, [r0]
        0x428D, // cmp  r5, r1
        0xD900, // bls  out
        0x6005, // str  r5, [r0]
        0xF386, 0x8810, // out: msr primask, r6
        0xBD70, // pop {r4, r5, r6, pc}
    ];
    let cell = FOUND + 4 * which;
    let _ = host.write(cell, Width::W32, 0);
    put(host, CODE + STRIDE * which, &CODE_OF_IT, &[painted, 0xA5A5_A5A5, original | 1, cell])
}

/// Bytes that are painted below the control tick for a crash: a crash that comes near has too little.
pub const CRASH_PAINTED: u64 = 4096;
/// What they are painted with.
const CRASH_PAINT: u32 = 0xA5A5_A5A5;

/// Puts code before the tick's handler `original` that keeps the stack's pointer in [`FOUND`], paints [`CRASH_PAINTED`] bytes
/// below it, and crashes. Gives the word for the vector.
pub(crate) fn crash_meter(host: &mut dyn Host, crash: Crash, original: u64) -> u64 {
    const STORES: u16 = 0x6001; // str r1, [r0]
    const LOADS: u16 = 0x6800; // ldr r0, [r0]
    let (access, register, value) = match crash {
        Crash::Supply => (STORES, ISPR0, PVD_PENDS),
        Crash::HardFault => (LOADS, NOTHING, 0),
        Crash::Nmi => (STORES, ICSR, NMI_PENDS),
    };
    let code = [
        0x4808, // ldr  r0, found
        0x4669, // mov  r1, sp
        0x6001, // str  r1, [r0]
        0x4A08, // ldr  r2, painted
        0x1A8A, // subs r2, r1, r2
        0x4B08, // ldr  r3, paint
        0x6013, // next: str r3, [r2]
        0x3204, // adds r2, #4
        0x428A, // cmp  r2, r1
        0xD1FB, // bne  next
        0x4806, // ldr  r0, register
        0x4907, // ldr  r1, value
        access, 0xF3BF, 0x8F4F, // dsb
        0x4806, // ldr  r0, original
        0x4700, // bx   r0
        0xBF00, // nop
    ];
    let words = [FOUND, CRASH_PAINTED, CRASH_PAINT.into(), register, value, original | 1];
    put(host, CODE, &code, &words)
}

/// How deep the crash went that [`crash_meter`] made, with the frame that the core stacks, in bytes. To be asked before the
/// core runs again.
pub(crate) fn crash_depth(host: &mut dyn Host) -> u64 {
    let top = host.read(FOUND, Width::W32).unwrap_or_default();
    let painted = (top.saturating_sub(CRASH_PAINTED)..top)
        .step_by(4)
        .take_while(|at| host.read(*at, Width::W32).is_ok_and(|word| word == u64::from(CRASH_PAINT)))
        .count() as u64;
    CRASH_PAINTED - 4 * painted
}
