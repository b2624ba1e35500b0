//! Listens to what goes over the link, frame by frame: sees when the rig asks for its arm switch, and can lose
//! telemetry on purpose.

use model_core::control::Refusal;
use rig_link::frame::decode;
use rig_link::message::{Answer, Message};

/// The line from the chip to the host.
#[derive(Debug, Default)]
pub struct Traffic {
    frame: Vec<u8>,
    /// Every so many-th row of telemetry is lost; 0 for none.
    lose_every: u32,
    rows: u64,
    rows_lost: u64,
    asks_for_switch: bool,
}

impl Traffic {
    /// A line that loses every `lose_every`-th row of telemetry, none where this is 0.
    #[must_use]
    pub fn new(lose_every: u32) -> Self {
        Self { lose_every, ..Self::default() }
    }

    /// Takes bytes from the chip; gives those that go on to the host.
    pub fn pass(&mut self, bytes: &[u8]) -> Vec<u8> {
        let mut through = Vec::with_capacity(bytes.len());
        for byte in bytes {
            self.frame.push(*byte);
            if *byte == 0 {
                let frame = std::mem::take(&mut self.frame);
                if self.goes_on(&frame) {
                    through.extend(frame);
                }
            }
        }
        through
    }

    fn goes_on(&mut self, frame: &[u8]) -> bool {
        let mut plain = frame.strip_suffix(&[0]).unwrap_or(frame).to_vec();
        match decode::<Message>(&mut plain) {
            Ok(Message::Answer { answer: Answer::Refused { reason, .. }, .. }) => {
                let switch = [Refusal::ArmSwitchOff, Refusal::ArmSwitchNotReleased];
                self.asks_for_switch |= switch.iter().any(|refusal| refusal.number() == reason);
                true
            }
            Ok(Message::Telemetry(_)) if self.lose_every > 0 => {
                self.rows += 1;
                let lost = self.rows.is_multiple_of(u64::from(self.lose_every));
                self.rows_lost += u64::from(lost);
                !lost
            }
            _ => true,
        }
    }

    /// Whether the rig refused to arm because of its switch since the last call.
    pub fn asked_for_switch(&mut self) -> bool {
        std::mem::take(&mut self.asks_for_switch)
    }

    /// Rows lost on purpose.
    #[must_use]
    pub fn rows_lost(&self) -> u64 {
        self.rows_lost
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rig_link::frame::{MAX_FRAME, encode};
    use rig_link::telemetry::TelemetryRow;

    fn frame(message: &Message) -> Vec<u8> {
        let mut frame = [0; MAX_FRAME];
        let length = encode(message, &mut frame).unwrap();
        frame[..length].to_vec()
    }

    #[test]
    fn every_third_row_is_lost_and_nothing_else_however_the_bytes_are_cut() {
        let messages: Vec<Message> = (0..9)
            .flat_map(|sequence| {
                let row = Message::Telemetry(TelemetryRow { sequence, ..TelemetryRow::default() });
                [row, Message::Answer { id: 1, answer: Answer::Done }]
            })
            .collect();
        let bytes: Vec<u8> = messages.iter().flat_map(frame).collect();
        let mut traffic = Traffic::new(3);
        let through: Vec<u8> = bytes.chunks(7).flat_map(|chunk| traffic.pass(chunk)).collect();
        let expected: Vec<u8> = messages
            .iter()
            .filter(|m| !matches!(m, Message::Telemetry(row) if row.sequence % 3 == 2))
            .flat_map(frame)
            .collect();
        assert_eq!((through, traffic.rows_lost()), (expected, 3));
        assert_eq!(Traffic::new(0).pass(&bytes), bytes);
    }

    #[test]
    fn a_refusal_for_the_switch_is_seen_once_and_others_are_not() {
        let refused = |refusal: Refusal| {
            frame(&Message::Answer {
                id: 1,
                answer: Answer::Refused { reason: refusal.number(), fault: None },
            })
        };
        let mut traffic = Traffic::new(0);
        traffic.pass(&refused(Refusal::Starting));
        assert!(!traffic.asked_for_switch());
        traffic.pass(&refused(Refusal::ArmSwitchNotReleased));
        assert!(traffic.asked_for_switch() && !traffic.asked_for_switch());
    }
}
