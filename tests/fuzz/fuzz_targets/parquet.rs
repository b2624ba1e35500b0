#![no_main]

use std::path::PathBuf;
use std::sync::LazyLock;

/// In the path of every source file of the library.
const LIBRARY: &str = "/parquet-";

/// In memory where there is such a place.
static FILE: LazyLock<PathBuf> = LazyLock::new(|| {
    let memory = PathBuf::from("/dev/shm");
    let folder = if memory.is_dir() { memory } else { std::env::temp_dir() };
    folder.join(format!("rig-fuzz-{}.parquet", std::process::id()))
});

/// The fuzzer ends the process at any panic; the library's own, which the reader has to catch, must reach it.
fn let_the_library_panic() {
    let report = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |panic| {
        if !panic.location().is_some_and(|place| place.file().contains(LIBRARY)) {
            report(panic);
        }
    }));
}

libfuzzer_sys::fuzz_target!(
    init: let_the_library_panic(),
    |bytes: &[u8]| rig_fuzz::readers::parquet(bytes, &FILE)
);
