//! The serial port: the ST-LINK's virtual port of a board, or a pseudo-terminal.

use std::io::ErrorKind;
use std::path::PathBuf;
use std::time::Duration;

use serial2::SerialPort;

use super::procedure::Transport;
use crate::input_error::InputError;

/// Longest wait for bytes: how coarse the procedures' time is.
const WAIT: Duration = Duration::from_millis(5);

/// An open port.
#[derive(Debug)]
pub struct Serial {
    name: String,
    port: SerialPort,
}

impl Serial {
    /// Opens a port at the rig's rate.
    ///
    /// # Errors
    /// There is no such port, or it cannot be opened; the message lists the ports there are.
    pub fn open(name: &str) -> Result<Self, InputError> {
        let mut port = SerialPort::open(name, rig_link::BAUD).map_err(|error| {
            let reason = match error.kind() {
                ErrorKind::NotFound => "no such port".to_owned(),
                ErrorKind::PermissionDenied => "permission denied".to_owned(),
                _ => error.to_string(),
            };
            InputError::new(format!("cannot open the port: {reason}")).file(name).allowed(ports())
        })?;
        port.set_read_timeout(WAIT)
            .map_err(|error| InputError::new(format!("cannot set the port up: {error}")).file(name))?;
        Ok(Self { name: name.to_owned(), port })
    }

    /// Uses a port that is open already.
    ///
    /// # Errors
    /// It takes no time limit.
    pub fn from_port(name: &str, mut port: SerialPort) -> Result<Self, InputError> {
        port.set_read_timeout(WAIT)
            .map_err(|error| InputError::new(format!("cannot set the port up: {error}")).file(name))?;
        Ok(Self { name: name.to_owned(), port })
    }
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
            Ok(count) => bytes.extend_from_slice(buffer.get(..count).unwrap_or_default()),
            Err(error) if matches!(error.kind(), ErrorKind::TimedOut | ErrorKind::Interrupted) => {}
            Err(error) => return Err(error),
        }
        Ok(())
    }

    fn send(&mut self, bytes: &[u8]) -> std::io::Result<()> {
        self.port.write_all(bytes)
    }
}
