#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| rig_fuzz::readers::csv(bytes));
