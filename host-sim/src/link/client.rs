//! Frames in, frames out; requests get numbers, and answers are matched to them.
//!
//! Nothing here reads a port or a clock: whoever has bytes gives them in, and sends what comes out. So a
//! serial port and an emulated chip run the same code.

use std::collections::VecDeque;

use rig_link::frame::{MAX_FRAME, Receiver, encode};
use rig_link::message::{Command, Message, Request};

/// One end of the link.
#[derive(Debug, Default)]
pub struct Client {
    receiver: Receiver,
    incoming: VecDeque<Message>,
    outgoing: Vec<u8>,
    next_id: u16,
}

impl Client {
    /// A client that has said and heard nothing. Its first bytes end whatever frame the rig was receiving.
    #[must_use]
    pub fn new() -> Self {
        Self { outgoing: vec![0], ..Self::default() }
    }

    /// Takes bytes from the rig.
    pub fn receive(&mut self, bytes: &[u8]) {
        for byte in bytes {
            if let Some(Ok(message)) = self.receiver.push(*byte) {
                self.incoming.push_back(message);
            }
        }
    }

    /// The next message from the rig.
    pub fn next_message(&mut self) -> Option<Message> {
        self.incoming.pop_front()
    }

    /// Queues a request and returns its number.
    pub fn request(&mut self, command: Command) -> u16 {
        let id = self.next_id;
        self.next_id = self.next_id.wrapping_add(1);
        let mut frame = [0; MAX_FRAME];
        // Every request fits a frame: the longest is a model, and rig-link has a test for it.
        if let Ok(length) = encode(&Request { id, command }, &mut frame) {
            self.outgoing.extend_from_slice(frame.get(..length).unwrap_or_default());
        }
        id
    }

    /// The bytes to send, taken out.
    pub fn take_outgoing(&mut self) -> Vec<u8> {
        std::mem::take(&mut self.outgoing)
    }

    /// Frames that came in damaged.
    #[must_use]
    pub fn frames_rejected(&self) -> u32 {
        self.receiver.rejected()
    }
}
