//! Which memory may be read, written, run and cached: the memory protection unit, and the data cache behind it.
//!
//! | region | access | kind |
//! |---|---|---|
//! | flash bank 1: program | read, run | normal, write-through: **the only cached memory** |
//! | flash bank 2: settings | read, write | device: what programs a flash word must arrive as it was written, and a torn word must not be read ahead |
//! | system memory: calibration | read | device |
//! | ITCM: tick, vectors | read, run | normal, not cached (the cache never holds TCM) |
//! | ITCM, first 4 KB | none | a null pointer traps, with any offset below 4 KB |
//! | DTCM: stack, variables | read, write | normal, not cached |
//! | AXI SRAM: capture, DMA buffers | read, write | normal, not cached |
//! | SRAM4: crash record | read, write | normal, not cached: a record must not be lost with the cache at the reset |
//! | peripherals | read, write | device |
//!
//! Everything else has no region and traps, for speculative reads too: below the stack there is nothing, so an overflow
//! ends there. No region that is written is run, and none that is run is written.
//!
//! **Coherency.** DMA1 and DMA2 reach AXI SRAM and not the TCMs (RM0433 2.1, bus matrix). What they write the cache would
//! not know of (AN4839, cache maintenance), so all of AXI SRAM is left out of it, and nothing has to be cleaned or
//! invalidated, ever. As the one cached region is never written, the cache never holds anything that memory does not: the
//! core's errata on write-through stores have nothing to act on either. What it is good for: constants, and the code of
//! threads that reads them.
//!
//! `HFNMIENA` is set: flash words that may be torn are read with faults masked (`flash.rs`), where without it the default
//! map would hold, in which all flash is cached (ARMv7-M B3.1, B3.5.6).
//!
//! Attributes: ARMv7-M B3.5.9, PM0253 (memory protection unit), AN4838. The virtual bench enforces the map, and looks
//! that every address a DMA stream is given lies in memory that is not cached and that it reaches.

use cortex_m::peripheral::{CPUID, MPU, SCB};

/// What may be done, the field `AP` and the bit `XN` of `RASR`: there is no unprivileged code, so both levels get the same.
#[derive(Clone, Copy)]
enum Access {
    None,
    Read,
    Run,
    Write,
}

impl Access {
    const fn bits(self) -> u32 {
        const EXECUTE_NEVER: u32 = 1 << 28;
        match self {
            Self::None => EXECUTE_NEVER,
            Self::Read => 0b110 << 24 | EXECUTE_NEVER,
            Self::Run => 0b110 << 24,
            Self::Write => 0b011 << 24 | EXECUTE_NEVER,
        }
    }
}

/// `TEX`, `S`, `C` and `B` of `RASR`.
#[derive(Clone, Copy)]
enum Kind {
    WriteThrough,
    NotCached,
    Device,
}

impl Kind {
    const fn bits(self) -> u32 {
        match self {
            Self::WriteThrough => 1 << 17,
            Self::NotCached => 1 << 19 | 1 << 18,
            Self::Device => 1 << 18 | 1 << 16,
        }
    }
}

/// A region: begin, size as a power of two, access, kind. Where two overlap the later one counts.
struct Region(u32, u32, Access, Kind);

const REGIONS: [Region; 9] = [
    Region(0x0800_0000, 20, Access::Run, Kind::WriteThrough),
    Region(0x0810_0000, 20, Access::Write, Kind::Device),
    Region(0x1FF0_0000, 17, Access::Read, Kind::Device),
    Region(0x0000_0000, 16, Access::Run, Kind::NotCached),
    Region(0x0000_0000, 12, Access::None, Kind::NotCached),
    Region(0x2000_0000, 17, Access::Write, Kind::NotCached),
    Region(0x2400_0000, 19, Access::Write, Kind::NotCached),
    Region(0x3800_0000, 16, Access::Write, Kind::NotCached),
    Region(0x4000_0000, 29, Access::Write, Kind::Device),
];

const ENABLE: u32 = 1 << 0;
const HFNMIENA: u32 = 1 << 1;

/// Puts the map in force, and after it the data cache. To be called once, before anything is given to a DMA.
pub fn start(mpu: &mut MPU, scb: &mut SCB, cpuid: &mut CPUID) {
    for (number, Region(begin, bits, access, kind)) in (0_u32..).zip(&REGIONS) {
        // SAFETY: the unit is off, so nothing changes yet. Each base is a multiple of its region's size.
        unsafe {
            mpu.rnr.write(number);
            mpu.rbar.write(*begin);
            mpu.rasr.write(access.bits() | kind.bits() | (bits - 1) << 1 | ENABLE);
        }
    }
    // SAFETY: the regions hold all that this firmware runs, reads and writes (`memory.x`), with at least the access it needs.
    unsafe { mpu.ctrl.write(HFNMIENA | ENABLE) };
    cortex_m::asm::dsb();
    cortex_m::asm::isb();
    // Only now: what is cached is decided.
    scb.enable_dcache(cpuid);
}
