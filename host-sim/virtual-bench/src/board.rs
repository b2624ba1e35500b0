//! The board as the emulator sees it: one STM32H743 and what its core is made of.
//!
//! Figures of the core are those of PM0253 (Cortex-M7 of this family) and RM0433; addresses of its
//! implementation-defined registers from PM0253 table 104. The emulator retires instructions at a constant
//! rate. [`INSTRUCTIONS_PER_SECOND`] is half the core clock: two cycles an instruction is more than the
//! dual-issue core needs from its instruction cache and DTCM, so a tick that meets its deadline here has
//! time to spare on the chip. It is an assumption, not a measurement of time.

use crate::part::Part;
use crate::serial;
use rigless::cpu;
use rigless::machine::{Board, Target, armv7m};
use rigless::mcu::{Mcu, Operate};
use rigless::soc::Error;
use rigless::store;
use std::num::{NonZeroU32, NonZeroU64};

/// The core clock the firmware sets up.
const CORE_HZ: NonZeroU64 = NonZeroU64::new(480_000_000).unwrap();
/// Instructions the emulated core retires in a second.
pub const INSTRUCTIONS_PER_SECOND: NonZeroU64 = NonZeroU64::new(CORE_HZ.get() / 2).unwrap();
/// Where the core finds its vectors: BOOT0 low, `BOOT_ADD0` as the factory sets it.
const VECTOR_TABLE: u32 = 0x0800_0000;
/// Cortex-M7 r1p1.
const CPUID: u32 = 0x411F_C271;
/// 16 KB of instruction and of data cache.
const CACHES: armv7m::Caches =
    armv7m::Caches { clidr: 0x0900_0003, ctr: 0x8303_C003, ccsidr: &[0xF00F_E019, 0xF01F_E009] };
const SYSTICK_DIVIDER: NonZeroU32 = NonZeroU32::new(8).unwrap();

/// (offset, reset value, writable bits): ITCMCR, DTCMCR, AHBPCR, CACR, AHBSCR, ABFSR. The TCMs' sizes are
/// in their control registers: 64 KB and 128 KB.
const ACCESS_CONTROL: [(u64, u32, u32); 6] = [
    (0xF90, 0x38, 0x7),
    (0xF94, 0x40, 0x7),
    (0xF98, 0, 0x1),
    (0xF9C, 0, 0x7),
    (0xFA0, 0x800, 0xFFFF),
    (0xFA8, 0, 0),
];

/// The board.
#[derive(Debug)]
pub struct RigBoard {
    /// The chip.
    pub part: Part,
}

store!(RigBoard { values: [], parts: [part], built: [] });

impl RigBoard {
    /// The board with power on and the serial line plugged in.
    ///
    /// # Errors
    /// The emulator cannot assemble the part.
    pub fn new() -> Result<Self, Error> {
        let mut part = Part::new()?;
        serial::connect(&mut part);
        Ok(Self { part })
    }
}

impl Board for RigBoard {
    fn name(&self) -> &'static str {
        "rig"
    }

    fn target_names(&self) -> Vec<&'static str> {
        vec!["stm32h743"]
    }

    fn mcu(&mut self, target: usize) -> Option<&mut dyn Mcu> {
        (target == 0).then_some(&mut self.part as &mut dyn Mcu)
    }

    fn targets(&mut self) -> Vec<Target<'_>> {
        let lines = u32::from(Operate::cpu(&self.part).interrupt_lines);
        let core = armv7m::Core {
            variant: armv7m::Variant::M7,
            clock_hz: CORE_HZ,
            interrupt_lines: NonZeroU32::new(lines).unwrap_or(NonZeroU32::MIN),
            priority_bits: 4,
            refclk_divider: SYSTICK_DIVIDER,
            instructions_per_second: INSTRUCTIONS_PER_SECOND,
            boot: "flash",
        };
        let mut config = armv7m::Config::new(core, &cpu::armv7m::windows(Mcu::bus(&self.part)));
        config.fpu = armv7m::Fpu::FpV5Dp;
        config.mpu_regions = armv7m::MpuRegions::Sixteen;
        config.cpuid = CPUID;
        config.caches = Some(CACHES);
        config.branch_prediction = armv7m::BranchPrediction::Always;
        config.implementation_registers = ACCESS_CONTROL
            .iter()
            .map(|&(offset, reset, writable)| armv7m::ImplementationRegister { offset, reset, writable })
            .collect();
        config.vector_table = Some(VECTOR_TABLE);
        vec![Target::new("stm32h743", &mut self.part, config.spec())]
    }
}
