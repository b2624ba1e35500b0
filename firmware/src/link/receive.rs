//! Bytes to requests, requests to the operator, answers to the outgoing queue.

use super::ring::Ring;
use super::{FRAMES_REJECTED, OUTGOING, Operator};
use crate::tick;
use core::sync::atomic::Ordering::Relaxed;
use rig_link::frame::Receiver;
use rig_link::message::{Message, Request};

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
                    let answer = operator.carry_out(command).await;
                    OUTGOING.send(Message::Answer { id, answer }).await;
                }
                Err(error) => {
                    FRAMES_REJECTED.store(receiver.rejected(), Relaxed);
                    defmt::warn!("link: frame thrown away: {}", error);
                }
            }
        }
    }
}
