//! The release ELF on the bench. `cargo test --release --package virtual-bench --ignore-rust-version`
#![allow(clippy::unwrap_used)]

mod bits;
mod chain;
mod commission;
mod cost;
mod defmt;
mod faults;
mod figures;
mod interrupted;
mod memory;
mod runs;
mod serve;
mod silicon;
mod soak;
mod upload;

use std::sync::OnceLock;
use virtual_bench::elf::Firmware;
use virtual_bench::firmware_build;

/// The release ELF, built once; or the one that the environment names, to see a check red on a firmware that is broken
/// (firmware/README.md).
fn firmware() -> &'static Firmware {
    static FIRMWARE: OnceLock<Firmware> = OnceLock::new();
    FIRMWARE.get_or_init(|| {
        let elf = std::env::var_os("RIG_FIRMWARE_ELF")
            .map_or_else(|| firmware_build::release_elf().unwrap(), std::path::PathBuf::from);
        Firmware::read(&elf).unwrap()
    })
}
