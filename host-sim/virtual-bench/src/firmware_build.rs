//! Builds the release ELF, with the target's core library fetched where it is missing.

use crate::error::BenchError;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

const TARGET: &str = "thumbv7em-none-eabihf";
/// The firmware.
pub const FIRMWARE: &str = "rig-firmware";
/// All checks of the board in a row.
pub const SELF_TEST: &str = "rig-self-test";

/// The project's root: this package lies in host-sim/virtual-bench.
#[must_use]
pub fn root() -> PathBuf {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    here.ancestors().nth(2).unwrap_or(here).to_path_buf()
}

/// Builds the firmware as it is flashed, and says where the ELF is. What cargo has to say goes to stderr.
///
/// # Errors
/// The target's core library cannot be had, or the firmware does not build.
pub fn release_elf() -> Result<PathBuf, BenchError> {
    release_elf_of(FIRMWARE)
}

/// The same for one of the binaries.
///
/// # Errors
/// As [`release_elf`].
pub fn release_elf_of(binary: &str) -> Result<PathBuf, BenchError> {
    let folder = root().join("firmware");
    if !core_library_is_there(&folder) {
        eprintln!("virtual-bench: rustup target add {TARGET}");
        let added = Command::new("rustup")
            .args(["target", "add", TARGET])
            .current_dir(&folder)
            .stdout(Stdio::null())
            .status();
        if !added.is_ok_and(|status| status.success()) || !core_library_is_there(&folder) {
            return Err(BenchError::Firmware(format!(
                "the core library for {TARGET} is missing and could not be fetched; get it with: rustup target add {TARGET}"
            )));
        }
    }
    let mut build = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    build.args(["build", "--release", "--bin", binary, "--message-format", "json-render-diagnostics"]);
    build.current_dir(&folder).stderr(Stdio::inherit());
    let output =
        build.output().map_err(|error| BenchError::Firmware(format!("cargo does not start: {error}")))?;
    if !output.status.success() {
        return Err(BenchError::Firmware("it does not build; see above".to_owned()));
    }
    String::from_utf8_lossy(&output.stdout)
        .lines()
        .filter_map(|line| serde_json::from_str::<serde_json::Value>(line).ok())
        .filter(|message| message["target"]["name"] == binary)
        .find_map(|message| message["executable"].as_str().map(PathBuf::from))
        .ok_or_else(|| BenchError::Firmware("cargo built it and named no executable".to_owned()))
}

fn core_library_is_there(folder: &Path) -> bool {
    let libraries = Command::new("rustc")
        .args(["--print", "target-libdir", "--target", TARGET])
        .current_dir(folder)
        .output();
    libraries.is_ok_and(|output| {
        output.status.success() && Path::new(String::from_utf8_lossy(&output.stdout).trim()).is_dir()
    })
}
