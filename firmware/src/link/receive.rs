//! Bytes to requests, requests to the operator, answers to the outgoing queue.

use super::ring::Ring;
use super::{FRAMES_REJECTED, OUTGOING, Operator};
use crate::tick;
use crate::watchdog::{self, Thread};
use core::pin::pin;
use core::sync::atomic::Ordering::Relaxed;
use embassy_futures::select::{Either, select};
use embassy_time::{Duration, Timer};
use rig_link::frame::Receiver;
use rig_link::message::{Message, Request};

/// Time between two signs of life of a request that takes its time, and how many there are: storing a model may erase a
/// sector of flash, and the flash gives up after 6 s (`flash.rs`). After that the watchdog ends it.
const SIGN: Duration = Duration::from_millis(100);
const SIGNS: u32 = 80;

/// Waits, and stays alive for the watchdog meanwhile.
async fn patiently<F: Future>(waited_for: F) -> F::Output {
    let mut waited_for = pin!(waited_for);
    for _ in 0..SIGNS {
        if let Either::First(done) = select(waited_for.as_mut(), Timer::after(SIGN)).await {
            return done;
        }
        watchdog::alive(Thread::Receiver);
    }
    waited_for.await
}

/// Receives for ever.
#[embassy_executor::task]
pub async fn receive(mut port: Ring, mut operator: Operator) {
    let mut receiver = Receiver::new();
    let mut bytes = [0; 256];
    loop {
        let count = port.read(&mut bytes).await;
        for byte in bytes.iter().take(count) {
            let Some(received) = receiver.push::<Request>(*byte) else { continue };
            match received {
                Ok(Request { id, command }) => {
                    if command.is_sign_of_life() {
                        tick::link_heard();
                    }
                    let answer = patiently(operator.carry_out(command)).await;
                    patiently(OUTGOING.send(Message::Answer { id, answer })).await;
                }
                Err(error) => {
                    FRAMES_REJECTED.store(receiver.rejected(), Relaxed);
                    defmt::warn!("link: frame thrown away: {}", error);
                }
            }
        }
    }
}
