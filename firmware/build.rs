//! Puts the memory map where the linker finds it, and asks the linker for what the firmware needs.
use std::path::PathBuf;

fn main() -> std::io::Result<()> {
    let out = PathBuf::from(std::env::var_os("OUT_DIR").ok_or(std::io::ErrorKind::NotFound)?);
    std::fs::copy("memory.x", out.join("memory.x"))?;
    println!("cargo:rustc-link-search={}", out.display());
    println!("cargo:rerun-if-changed=memory.x");
    println!("cargo:rerun-if-changed=build.rs");
    // A build id made of the ELF's contents: the host can tell whether it has the ELF that runs.
    for argument in ["--nmagic", "-Tlink.x", "-Tdefmt.x", "--build-id=sha1"] {
        println!("cargo:rustc-link-arg={argument}");
    }
    Ok(())
}
