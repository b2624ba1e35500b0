//! The start that every program for this board shares: safe first, then clock, pins, outputs, core.
//!
//! The order matters: the memory map comes first and traps what goes wrong from then on, drive enables are driven low before
//! anything else is set up, and the DAC starts at zero torque.
//! Nothing here enables a drive. The firmware and the tests on the board begin with the same call, so that what is
//! tested is what is flashed.

use crate::board::{self, Board};
use crate::{clocks, crash_record, itcm, mpu, outputs, reference, restart, supply};
use rig_link::message::{CrashRecord, ResetCause};

/// What the start found.
pub struct Started {
    /// Why the chip started.
    pub reset: ResetCause,
    /// The crash record from before the restart.
    pub crash_record: Option<CrashRecord>,
    /// The clock comes from the 8 MHz of the ST-LINK.
    pub crystal: bool,
    /// What the 3.3 V that every analogue code is a share of are worth, mV.
    pub reference_mv: u16,
    /// Peripherals that drivers still need.
    pub board: Board,
}

/// Starts the board. To be called once, before anything else.
#[must_use]
pub fn start() -> Started {
    prepare_core();
    let reset = restart::reset_cause();
    let crash_record = crash_record::take();
    let crystal = clocks::crystal_present();
    let mut board = board::configure(clocks::start(crystal));
    outputs::start();
    let reference_mv = reference::measure(board.reference_adc.reborrow());
    clocks::yield_to_the_tick();
    supply::watch();
    if crystal {
        clocks::watch_crystal();
    } else {
        defmt::warn!("no 8 MHz from the ST-LINK: times and speeds may be off by 1 %");
    }
    Started { reset, crash_record, crystal, reference_mv, board }
}

/// Vectors, memory map, caches, cycle counter: first, as they trap what goes wrong from here on.
fn prepare_core() {
    // SAFETY: nothing else uses the core peripherals; this runs once, before any interrupt of ours.
    let mut core = unsafe { cortex_m::Peripherals::steal() };
    itcm::use_vectors(&mut core.SCB);
    mpu::start(&mut core.MPU, &mut core.SCB, &mut core.CPUID);
    core.SCB.enable_icache();
    core.DCB.enable_trace();
    core.DWT.enable_cycle_counter();
}
