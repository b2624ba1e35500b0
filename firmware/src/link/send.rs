//! Messages to frames, frames to the DMA.

use super::{FRAMES_REJECTED, LINE_ERRORS, OUTGOING};
use crate::memory::stack_used;
use crate::watchdog::{self, Thread};
use core::sync::atomic::Ordering::Relaxed;
use embassy_futures::select::select;
use embassy_stm32::mode::Async;
use embassy_stm32::usart::UartTx;
use embassy_time::{Duration, Timer};
use heapless::spsc::Consumer;
use rig_link::frame::{MAX_FRAME, encode};
use rig_link::message::Message;
use rig_link::telemetry::{Health, TelemetryRow};

/// How long rows may wait for company.
const GATHER: Duration = Duration::from_micros(500);

/// Sends for ever.
#[embassy_executor::task]
pub async fn send(
    mut port: UartTx<'static, Async>,
    buffer: &'static mut [u8],
    mut rows: Consumer<'static, TelemetryRow>,
    mut health: Consumer<'static, Health>,
) {
    loop {
        watchdog::alive(Thread::Sender);
        let length = gather(buffer, &mut rows, &mut health);
        if length == 0 {
            select(Timer::after(GATHER), OUTGOING.ready_to_receive()).await;
        } else if let Some(frames) = buffer.get(..length)
            && let Err(error) = port.write(frames).await
        {
            LINE_ERRORS.store(LINE_ERRORS.load(Relaxed).saturating_add(1), Relaxed);
            defmt::warn!("link: {}", error);
        }
    }
}

/// Fills the buffer with frames as long as the largest one still fits.
fn gather(
    buffer: &mut [u8],
    rows: &mut Consumer<'_, TelemetryRow>,
    health: &mut Consumer<'_, Health>,
) -> usize {
    let mut length = 0;
    while let Some(free) = buffer.get_mut(length..)
        && free.len() >= MAX_FRAME
    {
        let message = if let Ok(message) = OUTGOING.try_receive() {
            message
        } else if let Some(row) = rows.dequeue() {
            Message::Telemetry(row)
        } else if let Some(health) = health.dequeue() {
            let (frames_rejected, line_errors) = (FRAMES_REJECTED.load(Relaxed), LINE_ERRORS.load(Relaxed));
            Message::Health(Health { frames_rejected, line_errors, stack: stack_used(), ..health })
        } else {
            break;
        };
        match encode(&message, free) {
            Ok(written) => length += written,
            Err(error) => defmt::error!("link: message too long: {}", error),
        }
    }
    length
}
