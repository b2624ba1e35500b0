//! Start of the firmware: the board (`start.rs`), then settings, control tick, link.
//!
//! The tick runs before the link can ask it for anything. Nothing here enables a drive.
#![no_std]
#![no_main]

use core::panic::PanicInfo;
use cortex_m_rt::{ExceptionFrame, exception};
use defmt_rtt as _;
use embassy_executor::{SpawnError, SpawnToken, Spawner};
use model_core::control::ControlState;
use rig_firmware::flash::SettingsFlash;
use rig_firmware::link::{self, Identity, Operator};
use rig_firmware::start::{self, Started};
use rig_firmware::{adc_scan, encoders, log, memory, restart, tick, watchdog};

#[embassy_executor::main]
async fn main(spawner: Spawner) {
    let Started { reset, crash_record, crystal, reference_mv, board } = start::start();
    defmt::info!("start after {}, VREF+ {=u16} mV", reset, reference_mv);
    if let Some(record) = &crash_record {
        defmt::error!(
            "crash record of tick {=u64}: {}: {=str}",
            record.tick,
            record.kind,
            record.text.as_str()
        );
    }
    let settings = match rig_firmware::settings::load(SettingsFlash::new(board.flash)).await {
        Ok(settings) => settings,
        Err(error) => panic!("the settings' flash does not work: {error:?}"),
    };
    let config = match settings.config() {
        Ok(config) => config,
        Err(error) => panic!("the default settings are out of range: {error}"),
    };
    encoders::start();
    adc_scan::start(board.adc);
    let state =
        ControlState::after(&config, restart::restart_kind(reset, crash_record.as_ref()), settings.intact());
    let ends = tick::start(config, state);
    watchdog::start();

    let Some(buffers) = memory::take_link_buffers() else { panic!("the link's buffers are taken") };
    let (tx, rx) = match link::open(board.link) {
        Ok(port) => port,
        Err(error) => panic!("the link's rate is not possible: {error:?}"),
    };
    let identity = Identity { reset, crystal, reference_mv, crash_record };
    let operator = Operator::new(identity, settings, config, ends.orders, ends.answers, ends.inputs);
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
