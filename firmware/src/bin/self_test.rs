//! All checks of the board in a row, with the shipped start: `cargo run --release --bin rig-self-test`.
//!
//! Drives unplugged, nothing wired. One line a check in the log; the last line has how many failed. The virtual bench
//! runs the same ELF.
#![no_std]
#![no_main]

use core::panic::PanicInfo;
use cortex_m_rt::entry;
use defmt_rtt as _;
use rig_firmware::self_test::{self, Checked};
use rig_firmware::start::{self, Started};
use rig_firmware::{adc_scan, outputs};

/// A check and its name.
type Check = (&'static str, fn() -> Checked);

#[entry]
fn main() -> ! {
    let Started { board, .. } = start::start();
    self_test::prepare(board);
    let checks: [Check; 8] = [
        ("8 MHz", self_test::crystal),
        ("clock", self_test::clock),
        ("models", self_test::models),
        ("inputs", self_test::inputs),
        ("making safe", self_test::making_safe),
        ("encoders", self_test::encoders),
        ("loop-back", self_test::loop_back),
        ("ticks", || {
            adc_scan::set_up();
            self_test::ticks()
        }),
    ];
    let mut failed = 0_u32;
    for (name, check) in checks {
        match check() {
            Ok(()) => defmt::info!("self-test: {=str}: ok", name),
            Err(why) => {
                failed += 1;
                defmt::error!("self-test: {=str}: FAILED: {}", name, why);
            }
        }
        outputs::make_safe();
    }
    defmt::info!("self-test: done, {=u32} failed", failed);
    loop {
        cortex_m::asm::wfi();
    }
}

#[panic_handler]
fn panic(info: &PanicInfo<'_>) -> ! {
    rig_firmware::restart::panicked(info)
}
