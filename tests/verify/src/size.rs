//! Flash and RAM that the firmware's ELF takes, from its program headers and sections, and its stack's worst case on record.

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
    /// The stack's worst case, measured on the bench, and its size.
    stack: (u64, u64),
}

impl fmt::Display for Size {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let kib = |bytes: u64| bytes as f64 / 1024.0;
        let (worst, size) = self.stack;
        write!(
            f,
            "flash {:.1} KiB of 2048, ITCM {:.1} KiB of 64, variables in RAM {:.1} KiB, stack at worst {:.1} KiB of {:.0}, \
             {:.1} left",
            kib(self.flash),
            kib(self.itcm),
            kib(self.ram),
            kib(worst),
            kib(size),
            kib(size.saturating_sub(worst))
        )
    }
}

/// Flash of the STM32H743 begins here and is 2 MiB long.
const FLASH: std::ops::Range<u64> = 0x0800_0000..0x0820_0000;

/// The stack's worst case and size in the bench's record, `budget.toml`, which the bench suite keeps the ELF to.
fn stack_on_record(record: &str) -> Option<(u64, u64)> {
    let table = record.split_once("\n[stack]\n")?.1;
    let table = table.split("\n[").next()?;
    let value = |key: &str| {
        let line = table.lines().find_map(|line| line.strip_prefix(key)?.trim().strip_prefix('='))?;
        line.trim().parse().ok()
    };
    Some((value("worst")?, value("size")?))
}

/// Sizes of the ELF at `path`, with the stack's record at `record`.
pub(crate) fn of(path: &Path, record: &Path) -> Result<Size, String> {
    let text = std::fs::read_to_string(record).map_err(|error| format!("{}: {error}", record.display()))?;
    let stack = stack_on_record(&text).ok_or_else(|| {
        format!("{}: no stack is on record: cargo virtual-bench --write-budget", record.display())
    })?;
    if stack.0 >= stack.1 {
        return Err(format!("the stack takes {} bytes at worst, and there are {}", stack.0, stack.1));
    }
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
    Ok(Size { flash, itcm, ram, stack })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_stack_is_read_from_the_record() {
        let record = "[experiments.fig18]\nmean = 1.0\n\n[stack]\nworst = 47716\nsize = 57344\n\n[stack.depth]\nworst = 1\n";
        assert_eq!(stack_on_record(record), Some((47_716, 57_344)));
        assert_eq!(stack_on_record("\n[stack]\nworst = 47716\n\n[other]\nsize = 3\n"), None);
        let size = Size { flash: 0, itcm: 0, ram: 0, stack: (47_716, 57_344) };
        assert!(size.to_string().ends_with("stack at worst 46.6 KiB of 56, 9.4 left"), "{size}");
    }
}
