//! Something that is done over a link, step by step, and the loop that does it on a transport.
//!
//! A procedure is given the time and a [`Client`] with what came in; it queues requests and says when it
//! is done. On a serial port [`perform`] calls it; the virtual bench calls it once a control period, with
//! the emulated chip's time.

use std::time::{Duration, Instant};

use super::client::Client;
use crate::input_error::{InputError, Kind};

/// Something done over a link.
pub trait Procedure {
    /// What comes of it.
    type Outcome;

    /// Looks at what came in, queues what is to go out. `now_s` only rises.
    ///
    /// # Errors
    /// Why it cannot go on.
    fn step(&mut self, now_s: f64, client: &mut Client) -> Result<(), InputError>;

    /// What came of it, once; `None` while it is not done.
    fn outcome(&mut self) -> Option<Self::Outcome>;

    /// What a person should read now.
    fn notes(&mut self) -> Vec<String> {
        Vec::new()
    }
}

/// Bytes to and from a rig.
pub trait Transport {
    /// Its name for messages.
    fn name(&self) -> String;

    /// Appends what has come in to `bytes`; waits a little if there is nothing.
    ///
    /// # Errors
    /// The transport is gone.
    fn receive(&mut self, bytes: &mut Vec<u8>) -> std::io::Result<()>;

    /// Sends all bytes.
    ///
    /// # Errors
    /// The transport is gone.
    fn send(&mut self, bytes: &[u8]) -> std::io::Result<()>;
}

/// Does a procedure on a transport, to its end; `tell` gets its notes, `each` sees it after each of its steps.
///
/// # Errors
/// The transport failed, or the procedure cannot go on.
pub fn perform<P: Procedure>(
    transport: &mut dyn Transport,
    client: &mut Client,
    procedure: &mut P,
    mut tell: impl FnMut(&str),
    mut each: impl FnMut(&mut P),
) -> Result<P::Outcome, InputError> {
    let begun = Instant::now();
    let failed = |transport: &dyn Transport, doing: &str, error: &std::io::Error| {
        InputError::new(format!("the port is gone: cannot {doing}: {error}"))
            .file(transport.name())
            .of_kind(Kind::Rig)
    };
    let mut bytes = Vec::new();
    loop {
        procedure
            .step(begun.elapsed().as_secs_f64(), client)
            .map_err(|error| error.file(transport.name()))?;
        procedure.notes().iter().for_each(|note| tell(note));
        each(procedure);
        let outgoing = client.take_outgoing();
        if !outgoing.is_empty() {
            transport.send(&outgoing).map_err(|error| failed(transport, "write", &error))?;
        }
        if let Some(outcome) = procedure.outcome() {
            return Ok(outcome);
        }
        bytes.clear();
        transport.receive(&mut bytes).map_err(|error| failed(transport, "read", &error))?;
        client.receive(&bytes);
    }
}

/// Keeps the rig from thinking that the host is gone. Only the procedure that started a run has one: a look at the
/// rig must not keep a run alive whose host is gone.
#[derive(Debug, Default)]
pub(crate) struct KeepAlive {
    next_s: f64,
}

impl KeepAlive {
    /// The rig waits 0.5 s by default. Where one byte in fifty is damaged a fifth of the frames is lost: of five signs in a
    /// row all, once in some three thousand, which a noisy line made happen; of ten, once in ten million.
    const EVERY_S: f64 = 0.05;

    /// Sends a sign of life where one is due.
    pub(crate) fn step(&mut self, now_s: f64, client: &mut Client) {
        if now_s >= self.next_s {
            client.request(rig_link::message::Command::KeepAlive);
            self.next_s = now_s + Self::EVERY_S;
        }
    }
}

/// How long to wait for an answer.
pub(crate) fn patience(command: &rig_link::message::Command) -> Duration {
    use rig_link::message::Command;
    match command {
        // May erase a sector of flash: up to 4 s by the data sheet, twice for the store's own move.
        Command::SettingSet { .. }
        | Command::SettingForget { .. }
        | Command::SettingsErase
        | Command::ModelSet(_)
        | Command::ModelForget => Duration::from_secs(12),
        Command::SelfCheck { .. } => Duration::from_secs(5),
        // A served bench on a busy computer translates the code that answers first.
        _ => Duration::from_secs(3),
    }
}
