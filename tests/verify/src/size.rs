//! Flash and RAM that the firmware's ELF takes, from its program headers and sections.

use std::fmt;
use std::path::Path;

use object::{Object, ObjectSection, ObjectSegment, SectionKind};

/// Bytes of each kind of memory.
pub(crate) struct Size {
    /// What is written to flash: code, constants and the initial values of variables.
    flash: u64,
    /// What is copied to the ITCM at start, of the 64 KiB there.
    itcm: u64,
    /// Variables in RAM, set or zeroed at start; the stack is not in it.
    ram: u64,
}

impl fmt::Display for Size {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let kib = |bytes: u64| bytes as f64 / 1024.0;
        write!(
            f,
            "flash {:.1} KiB of 2048, ITCM {:.1} KiB of 64, variables in RAM {:.1} KiB; the bench suite prints the stack",
            kib(self.flash),
            kib(self.itcm),
            kib(self.ram)
        )
    }
}

/// Flash of the STM32H743 begins here and is 2 MiB long.
const FLASH: std::ops::Range<u64> = 0x0800_0000..0x0820_0000;

/// Sizes of the ELF at `path`.
pub(crate) fn of(path: &Path) -> Result<Size, String> {
    let bytes = std::fs::read(path).map_err(|error| format!("{}: {error}", path.display()))?;
    let elf = object::File::parse(&*bytes).map_err(|error| format!("{}: {error}", path.display()))?;
    let flash = elf
        .segments()
        .filter(|segment| segment.file_range().1 > 0)
        .map(|segment| segment.file_range().1)
        .sum();
    let ram = elf
        .sections()
        .filter(|section| !FLASH.contains(&section.address()) && section.address() >= 0x1000_0000)
        .filter(|section| {
            matches!(section.kind(), SectionKind::Data | SectionKind::UninitializedData | SectionKind::Text)
        })
        .map(|section| section.size())
        .sum();
    let itcm = elf
        .sections()
        .filter(|section| matches!(section.name(), Ok(".itcm" | ".itcm_vectors")))
        .map(|section| section.size())
        .sum();
    Ok(Size { flash, itcm, ram })
}
