//! The serial port: the ST-LINK's virtual port of a board, or a pseudo-terminal.

use std::io::ErrorKind;
use std::path::PathBuf;
use std::time::Duration;

use serial2::SerialPort;

use super::procedure::Transport;
use super::share::Broadcast;
use crate::input_error::{InputError, Kind};

/// Longest wait for bytes: how coarse the procedures' time is.
const WAIT: Duration = Duration::from_millis(5);
/// Longest wait for room to send: a port that takes nothing for so long is gone.
const SEND_WAIT: Duration = Duration::from_secs(1);

/// An open port.
#[derive(Debug)]
pub struct Serial {
    name: String,
    port: SerialPort,
    others: Broadcast,
}

impl Serial {
    /// Opens a port at the rig's rate.
    ///
    /// # Errors
    /// There is no such port, or it cannot be opened; the message lists the ports there are.
    pub fn open(name: &str) -> Result<Self, InputError> {
        let port = SerialPort::open(name, rig_link::BAUD).map_err(|error| {
            let reason = match error.kind() {
                ErrorKind::NotFound => "no such port".to_owned(),
                ErrorKind::PermissionDenied => "permission denied".to_owned(),
                _ => error.to_string(),
            };
            InputError::new(format!("cannot open the port: {reason}")).file(name).allowed(ports())
        })?;
        Self::from_port(name, port)
    }

    /// Uses a port that is open already.
    ///
    /// # Errors
    /// It takes no time limit, or another `rig` uses it: two readers of one port would each get half of what comes.
    pub fn from_port(name: &str, mut port: SerialPort) -> Result<Self, InputError> {
        port.set_read_timeout(WAIT)
            .and_then(|()| port.set_write_timeout(SEND_WAIT))
            .map_err(|error| InputError::new(format!("cannot set the port up: {error}")).file(name))?;
        if !take(&port) {
            return Err(InputError::new("another rig command uses this port")
                .file(name)
                .of_kind(Kind::Rig)
                .allowed("one at a time"));
        }
        Ok(Self { name: name.to_owned(), port, others: Broadcast::of(name) })
    }
}

/// Takes the port for this process, until it is closed; says whether it was free.
#[cfg(unix)]
fn take(port: &SerialPort) -> bool {
    use rustix::fs::{FlockOperation, flock};
    flock(port, FlockOperation::NonBlockingLockExclusive) != Err(rustix::io::Errno::WOULDBLOCK)
}

/// The system itself gives a port to one process only.
#[cfg(not(unix))]
fn take(_port: &SerialPort) -> bool {
    true
}

fn ports() -> String {
    let found: Vec<PathBuf> = SerialPort::available_ports().unwrap_or_default();
    if found.is_empty() {
        return "a serial port; none was found on this computer".into();
    }
    let names: Vec<String> = found.iter().map(|path| path.display().to_string()).collect();
    format!("a serial port, such as {}", names.join(", "))
}

impl Transport for Serial {
    fn name(&self) -> String {
        self.name.clone()
    }

    fn receive(&mut self, bytes: &mut Vec<u8>) -> std::io::Result<()> {
        let mut buffer = [0; 4096];
        match self.port.read(&mut buffer) {
            // A port that was unplugged is at its end at once.
            Ok(0) => return Err(ErrorKind::UnexpectedEof.into()),
            Ok(count) => {
                let new = buffer.get(..count).unwrap_or_default();
                self.others.pass(new);
                bytes.extend_from_slice(new);
            }
            Err(error) if matches!(error.kind(), ErrorKind::TimedOut | ErrorKind::Interrupted) => {}
            Err(error) => return Err(error),
        }
        Ok(())
    }

    fn send(&mut self, bytes: &[u8]) -> std::io::Result<()> {
        self.port.write_all(bytes)
    }
}
