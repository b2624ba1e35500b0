//! Start of the firmware: safe first, then clock, pins, settings, control tick, link.
//!
//! The order matters: drive enables are driven low before anything else is set up, the DAC starts at zero
//! torque, and the tick runs before the link can ask it for anything. Nothing here enables a drive.
#![no_std]
#![no_main]

use core::panic::PanicInfo;
use cortex_m_rt::{ExceptionFrame, exception};
use defmt_rtt as _;
use embassy_executor::{SpawnError, SpawnToken, Spawner};
use model_core::control::ControlState;
use rig_firmware::flash::SettingsFlash;
use rig_firmware::link::{self, Identity, Operator};
use rig_firmware::settings::Settings;
use rig_firmware::{adc_scan, board, clocks, encoders, kept, log, memory, outputs, restart, tick, watchdog};

#[embassy_executor::main]
async fn main(spawner: Spawner) {
    let reset = restart::reset_cause();
    let kept = kept::take();
    let crystal = clocks::crystal_present();
    let board = board::configure(embassy_stm32::init(clocks::config(crystal)));
    outputs::start();
    clocks::yield_to_the_tick();
    enable_core_features();
    if crystal {
        clocks::watch_crystal();
    } else {
        defmt::warn!("no 8 MHz from the ST-LINK: times and speeds may be off by 1 %");
    }
    defmt::info!("start after {}", reset);
    if let Some(kept) = &kept {
        defmt::error!("kept from tick {=u64}: {}: {=str}", kept.tick, kept.kind, kept.text.as_str());
    }
    let settings = Settings::load(SettingsFlash::new(board.flash)).await;
    let config = match settings.config() {
        Ok(config) => config,
        Err(error) => panic!("the default settings are out of range: {error}"),
    };
    encoders::start();
    adc_scan::start(board.adc);
    let state = ControlState::after(&config, restart::restart_kind(reset, kept.as_ref()), settings.intact());
    let ends = tick::start(config, state);
    watchdog::start();

    let Some(buffers) = memory::take_link_buffers() else { panic!("the link's buffers are taken") };
    let (tx, rx) = match link::open(board.link) {
        Ok(port) => port,
        Err(error) => panic!("the link's rate is not possible: {error:?}"),
    };
    let identity = Identity { reset, crystal, kept };
    let operator = Operator::new(identity, settings, config, ends.orders, ends.answers);
    start_task(spawner, log::log(ends.events));
    start_task(spawner, link::send(tx, &mut buffers.sending, ends.rows, ends.health));
    start_task(spawner, link::receive(rx, operator));
    core::future::pending::<()>().await;
}

fn start_task<S>(spawner: Spawner, task: Result<SpawnToken<S>, SpawnError>) {
    match task {
        Ok(task) => spawner.spawn(task),
        Err(_) => panic!("a task was started twice"),
    }
}

/// Instruction cache and cycle counter; the data cache stays off (`memory.rs`).
fn enable_core_features() {
    // SAFETY: nothing else uses the core peripherals; this runs once, before any interrupt of ours.
    let mut core = unsafe { cortex_m::Peripherals::steal() };
    core.SCB.enable_icache();
    core.DCB.enable_trace();
    core.DWT.enable_cycle_counter();
}

#[panic_handler]
fn panic(info: &PanicInfo<'_>) -> ! {
    restart::panicked(info)
}

#[exception]
unsafe fn HardFault(frame: &ExceptionFrame) -> ! {
    restart::trapped(frame)
}

#[exception]
unsafe fn DefaultHandler(number: i16) -> ! {
    restart::unexpected(number)
}
