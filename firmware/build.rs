//! Puts the memory map where the linker finds it, asks the linker for what the firmware needs, and computes
//! on this computer what the chip's self-check must give bit for bit.
use std::path::PathBuf;

/// Steps of the self-check that the on-target test repeats.
const STEPS: u32 = 2_000;

fn main() -> std::io::Result<()> {
    let out = PathBuf::from(std::env::var_os("OUT_DIR").ok_or(std::io::ErrorKind::NotFound)?);
    std::fs::copy("memory.x", out.join("memory.x"))?;
    let digests = model_core::selfcheck::run(STEPS);
    std::fs::write(
        out.join("host_digests.rs"),
        format!(
            "/// Steps of the self-check.\npub const STEPS: u32 = {STEPS};\n\
             /// What the same code gives on the computer that built this.\n\
             pub const DIGESTS: [u64; {}] = {digests:?};\n",
            digests.len()
        ),
    )?;
    println!("cargo:rustc-link-search={}", out.display());
    println!("cargo:rerun-if-changed=memory.x");
    println!("cargo:rerun-if-changed=build.rs");
    // A build id made of the ELF's contents: the host can tell whether it has the ELF that runs.
    for argument in ["--nmagic", "-Tlink.x", "-Tdefmt.x", "--build-id=sha1"] {
        println!("cargo:rustc-link-arg={argument}");
    }
    println!("cargo:rustc-check-cfg=cfg(rust_analyzer)"); // used inside the tests' macro
    println!("cargo:rustc-link-arg-tests=-Tembedded-test.x");
    Ok(())
}
