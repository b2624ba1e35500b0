#![no_main]

use std::path::PathBuf;
use std::sync::LazyLock;

/// In memory where there is such a place.
static FILE: LazyLock<PathBuf> = LazyLock::new(|| {
    let memory = PathBuf::from("/dev/shm");
    let folder = if memory.is_dir() { memory } else { std::env::temp_dir() };
    folder.join(format!("rig-fuzz-{}.parquet", std::process::id()))
});

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| rig_fuzz::readers::parquet(bytes, &FILE));
