//! The host on the other end of the link during a fault: keeps the rig company, and remembers what it hears.

use crate::endpoint::Endpoint;
use crate::error::BenchError;
use host_sim::link::client::Client;
use rig_link::message::{Answer, Command, EventKind, EventMessage, Message};
use rig_link::telemetry::{Health, TelemetryRow};

/// Time between two signs of life, that of the host tool.
const ALIVE_NS: u64 = 50_000_000;
/// Longest wait for an answer.
const PATIENCE_NS: u64 = 1_000_000_000;
/// The shortest request: its number, its kind, the checksum, and what frames them.
const LEAST_FRAME: usize = 8;

/// A hash over everything heard, FNV-1a.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Heard(pub u64);

impl Default for Heard {
    fn default() -> Self {
        Self(0xCBF2_9CE4_8422_2325)
    }
}

impl Heard {
    /// Takes bytes.
    pub fn add(&mut self, bytes: &[u8]) {
        for byte in bytes {
            self.0 = (self.0 ^ u64::from(*byte)).wrapping_mul(0x0000_0100_0000_01B3);
        }
    }
}

/// The host.
#[derive(Debug)]
pub struct ListeningHost {
    client: Client,
    /// Everything heard.
    pub heard: Heard,
    alive_at: u64,
    /// Sends signs of life.
    pub lively: bool,
    /// What happened, as the rig reported it.
    pub events: Vec<EventMessage>,
    /// The last health record.
    pub health: Option<Health>,
    /// The last row of telemetry.
    pub row: Option<TelemetryRow>,
    answers: Vec<(u16, Answer)>,
}

impl Default for ListeningHost {
    fn default() -> Self {
        Self::new()
    }
}

impl ListeningHost {
    /// A host that has heard nothing, and sends signs of life.
    #[must_use]
    pub fn new() -> Self {
        Self {
            client: Client::new(),
            heard: Heard::default(),
            alive_at: 0,
            lively: true,
            events: Vec::new(),
            health: None,
            row: None,
            answers: Vec::new(),
        }
    }

    /// Listens until an instant.
    ///
    /// # Errors
    /// The run ended.
    pub fn listen(&mut self, endpoint: &mut Endpoint, until_ns: u64) -> Result<(), BenchError> {
        while endpoint.now_ns() < until_ns {
            if self.lively && endpoint.now_ns() >= self.alive_at {
                self.alive_at = endpoint.now_ns() + ALIVE_NS;
                self.client.request(Command::KeepAlive);
            }
            let outgoing = self.client.take_outgoing();
            if !outgoing.is_empty() {
                endpoint.send(&outgoing)?;
            }
            let next = until_ns.min(if self.lively { self.alive_at } else { until_ns });
            let bytes = endpoint.receive(next)?;
            self.heard.add(&bytes);
            self.client.receive(&bytes);
            while let Some(message) = self.client.next_message() {
                match message {
                    Message::Event(event) => self.events.push(event),
                    Message::Health(health) => self.health = Some(health),
                    Message::Answer { id, answer } => self.answers.push((id, answer)),
                    Message::Telemetry(row) => self.row = Some(row),
                }
            }
        }
        Ok(())
    }

    /// Asks, and does not wait for the answer. Gives the bytes that takes at least.
    pub fn send(&mut self, command: &Command) -> usize {
        self.client.request(command.clone());
        LEAST_FRAME
    }

    /// Asks, and waits for the answer; asks again where there is none.
    ///
    /// # Errors
    /// The run ended, or there was no answer.
    pub fn ask(&mut self, endpoint: &mut Endpoint, command: &Command) -> Result<Answer, BenchError> {
        for _ in 0..3 {
            let id = self.client.request(command.clone());
            let until = endpoint.now_ns() + PATIENCE_NS;
            while endpoint.now_ns() < until {
                self.listen(endpoint, until.min(endpoint.now_ns() + 1_000_000))?;
                if let Some(place) = self.answers.iter().position(|(other, _)| *other == id) {
                    return Ok(self.answers.swap_remove(place).1);
                }
            }
        }
        Err(BenchError::Rig(format!("no answer to {command:?}")))
    }

    /// Whether the rig reported this fault.
    #[must_use]
    pub fn heard_of(&self, fault: u8) -> bool {
        self.events.iter().any(|event| event.kind == EventKind::FaultLatched(fault))
    }
}
