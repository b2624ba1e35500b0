//! Runs the firmware with an operator at the co-simulation endpoint.

use crate::board::RigBoard;
use crate::driver::{Addresses, BenchDriver, NothingMore, PERIOD};
use crate::elf::Firmware;
use crate::endpoint::{Endpoint, endpoint};
use crate::error::BenchError;
use crate::gaps;
use crate::outside::{Outside, PlantSide};
use crate::record::{Record, Saved};
use rigless::emulator::{self, Start, Watch};
use rigless::session::Session;
use rigless::snapshot::Snapshot;
use rigless::time::VirtualNanos;
use std::path::Path;

/// What a run gives: the operator's result, and the record.
#[derive(Debug)]
pub struct Outcome<T> {
    /// What the operator's code returned.
    pub operator: T,
    /// The record.
    pub record: Record,
}

/// Powers the board up with `plant` behind it and lets `operator` work at the endpoint until it returns.
///
/// # Errors
/// The operator's error; else the emulator's; else the gaps, if the firmware met any.
pub fn run<T: Send>(
    firmware: &Firmware,
    plant: Box<dyn PlantSide>,
    operator: impl FnOnce(&mut Endpoint) -> Result<T, BenchError> + Send,
) -> Result<Outcome<T>, BenchError> {
    let (endpoint, end) = endpoint();
    let driver = BenchDriver::new(Addresses::of(firmware), plant, Outside::default(), end);
    let mut board = RigBoard::new().map_err(emulator_error)?;
    driver.wire_up(&mut board.part);
    let mut session = Session::new(Box::new(board), 0, VirtualNanos(PERIOD)).map_err(emulator_error)?;
    for handler in &firmware.tick_handlers {
        session.watch(Watch::Instruction(*handler));
    }
    let start = Start::new(&firmware.images);
    work(session, &start, driver, endpoint, operator)
}

/// Goes on from `saved` with another operator. `scratch` is a directory for a temporary file.
///
/// # Errors
/// As [`run`]; or the state cannot be restored.
pub fn run_on<T: Send>(
    firmware: &Firmware,
    saved: &Saved,
    scratch: &Path,
    operator: impl FnOnce(&mut Endpoint) -> Result<T, BenchError> + Send,
) -> Result<Outcome<T>, BenchError> {
    let (endpoint, end) = endpoint();
    let driver = BenchDriver::resumed(Addresses::of(firmware), saved, end);
    let board = RigBoard::new().map_err(emulator_error)?;
    let mut session = Session::new(Box::new(board), 0, VirtualNanos(PERIOD)).map_err(emulator_error)?;
    let snapshot = read(saved, scratch)?;
    let resume =
        snapshot.restore(&mut session, &firmware.digest, &mut NothingMore).map_err(emulator_error)?;
    session.run_until(VirtualNanos(saved.next));
    let mut start = Start::new(&firmware.images);
    start.resume = Some(&resume);
    work(session, &start, driver, endpoint, operator)
}

/// The emulator reads a snapshot from a file only, and keeps what it read until the process ends: once for each.
fn read<'a>(saved: &'a Saved, scratch: &Path) -> Result<&'a Snapshot, BenchError> {
    let mut file = saved.file.lock().map_err(emulator_error)?;
    if let Some(snapshot) = saved.read.get() {
        return Ok(snapshot);
    }
    let path =
        scratch.join(format!("bench-{}-{:?}.snapshot", std::process::id(), std::thread::current().id()));
    std::fs::write(&path, &*file).map_err(emulator_error)?;
    let snapshot = Snapshot::read(&path).map_err(emulator_error);
    let _ = std::fs::remove_file(&path);
    let snapshot = snapshot?;
    *file = Vec::new();
    Ok(saved.read.get_or_init(|| snapshot))
}

fn work<T: Send>(
    session: Session<RigBoard>,
    start: &Start<'_>,
    driver: BenchDriver,
    mut endpoint: Endpoint,
    operator: impl FnOnce(&mut Endpoint) -> Result<T, BenchError> + Send,
) -> Result<Outcome<T>, BenchError> {
    let (done, finished) = std::thread::scope(|scope| {
        let operator = scope.spawn(move || {
            endpoint.connect()?;
            operator(&mut endpoint)
        });
        let finished = emulator::run(session, start, driver);
        // Without the emulator's end of the endpoint the operator does not wait for ever.
        let finished = finished.map(|finished| {
            let gaps = gaps::found(&finished.session);
            (gaps, finished.driver.into_record())
        });
        let done = operator
            .join()
            .unwrap_or_else(|_| Err(BenchError::Emulator("the operator's thread panicked".to_owned())));
        (done, finished)
    });
    let (gaps, record) = finished.map_err(emulator_error)?;
    if !gaps.is_empty() {
        return Err(BenchError::Gaps(gaps));
    }
    Ok(Outcome { operator: done?, record })
}

fn emulator_error(error: impl std::fmt::Display) -> BenchError {
    BenchError::Emulator(error.to_string())
}
