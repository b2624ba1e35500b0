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
    /// Whoever opens a line on which the rig is sending hears the end of a frame first, which is not damaged: 1 where the
    /// first frame was one, 0 where it was whole; none before.
    tails: Option<u32>,
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
            let Some(frame) = self.receiver.push(*byte) else { continue };
            self.tails.get_or_insert(u32::from(frame.is_err()));
            self.incoming.extend(frame.ok());
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

    /// Frames that came in damaged, but for a first one of which only the end was heard.
    #[must_use]
    pub fn frames_rejected(&self) -> u32 {
        self.receiver.rejected() - self.tails.unwrap_or(0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rig_link::message::Answer;

    #[test]
    fn the_end_of_a_frame_that_began_before_the_port_was_open_is_not_damaged_and_later_damage_is_counted() {
        let mut buffer = [0; MAX_FRAME];
        let length = encode(&Message::Answer { id: 3, answer: Answer::Done }, &mut buffer).unwrap();
        let frame = &buffer[..length];
        for first in [&frame[2..], frame] {
            let mut client = Client::new();
            client.receive(first);
            assert_eq!(client.frames_rejected(), 0);
            client.receive(frame);
            assert!(client.next_message().is_some());
            client.receive(&frame[2..]);
            assert_eq!(client.frames_rejected(), 1);
        }
    }
}
