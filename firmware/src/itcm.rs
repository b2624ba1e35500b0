//! The control tick in ITCM: copied there from flash at start, with the vectors.
//!
//! From ITCM an instruction comes in the cycle it is asked for (RM0433 2.3; PM0253, TCM interface). From flash it comes so
//! from the cache, and after several wait states where something else has taken its line meanwhile: a tick then takes longer
//! by what the threads happened to do before it. The vectors lie there too: the core reads one at each interrupt.
//!
//! `memory.x` names what lies there, function by function: the two handlers, the control core's step, the models' steps and
//! what these call out of line. In flash stay
//!
//! | what | why |
//! |---|---|
//! | `Tick::carry_out`, with `apply` and what that calls | a command, not a tick: once in seconds |
//! | `rem_pio2f` and soft floating point of its own | angles beyond 9π/4, which no law passes |
//! | panics | the last thing it does |
//! | constants | read through the data cache (`mpu.rs`) |
//!
//! The bench reads the calls that leave ITCM from the ELF and knows these: another one fails its test.

use cortex_m::peripheral::SCB;

core::arch::global_asm!(
    // Called by the reset handler before any code of ours. Nothing that lies in ITCM may be called before this has
    // run, `memcpy` among it: so it is written in instructions. r0 to r3 are free here.
    ".section .text.__pre_init, \"ax\"",
    ".global __pre_init",
    ".type __pre_init, %function",
    ".thumb_func",
    "__pre_init:",
    "ldr r0, =__sitcm_vectors",
    "ldr r1, =__eitcm_vectors",
    "ldr r2, =__vector_table",
    "0: cmp r0, r1",
    "bhs 1f",
    "ldr r3, [r2], #4",
    "str r3, [r0], #4",
    "b 0b",
    "1: ldr r0, =__sitcm",
    "ldr r1, =__eitcm",
    "ldr r2, =__siitcm",
    "2: cmp r0, r1",
    "bhs 3f",
    "ldr r3, [r2], #4",
    "str r3, [r0], #4",
    "b 2b",
    // What was written is code: it must be there before the core fetches it (ARMv7-M B2.2.9).
    "3: dsb",
    "isb",
    "bx lr",
    ".size __pre_init, . - __pre_init",
);

/// From now on interrupts find their vectors in ITCM.
pub fn use_vectors(scb: &mut SCB) {
    unsafe extern "C" {
        static __sitcm_vectors: u32;
    }
    let table = &raw const __sitcm_vectors as u32;
    // SAFETY: the table there is a copy of the one in flash, made before `main`, at a multiple of 1024 (`memory.x`), which is
    // more than its size, as VTOR asks for (ARMv7-M B3.2.5).
    unsafe { scb.vtor.write(table) };
    cortex_m::asm::dsb();
    cortex_m::asm::isb();
}
