//! What the subcommands share that talk to the firmware.

use rig_link::message::Hello;

use crate::files::log::Log;
use crate::input_error::InputError;
use crate::link::ask::Ask;
use crate::link::client::Client;
use crate::link::procedure::{Procedure, Transport, perform};
use crate::link::serial::Serial;
use crate::link::share::Listener;
use crate::link::usb;
use rig_link::message::{Answer, Command};

/// `--port`
#[derive(clap::Args, Debug)]
pub(super) struct PortArgs {
    /// Serial port of the firmware: the ST-LINK's, e.g. /dev/ttyACM0 or COM5; where left out, the one ST-LINK that
    /// is plugged in
    #[arg(long, value_name = "PORT", global = true)]
    port: Option<String>,
}

/// An open link.
pub(super) struct Port {
    serial: Box<dyn Transport>,
    client: Client,
}

impl PortArgs {
    /// Opens the port.
    pub(super) fn open(&self) -> Result<Port, InputError> {
        let name = match &self.port {
            Some(name) => name.clone(),
            None => usb::only_probe()?,
        };
        Ok(Port { serial: Box::new(Serial::open(&name)?), client: Client::new() })
    }

    /// Opens the port, or listens to the command that holds it; says whether it only listens.
    pub(super) fn open_or_listen(&self) -> Result<(Port, bool), InputError> {
        let name = match &self.port {
            Some(name) => name.clone(),
            None => usb::only_probe()?,
        };
        match Serial::open(&name) {
            Ok(serial) => Ok((Port { serial: Box::new(serial), client: Client::new() }, false)),
            Err(error) => match Listener::to(&name) {
                Some(listener) => Ok((Port { serial: Box::new(listener), client: Client::new() }, true)),
                None => Err(error),
            },
        }
    }
}

impl Port {
    /// Does a procedure; its notes go to stderr.
    pub(super) fn perform<P: Procedure>(&mut self, procedure: &mut P) -> Result<P::Outcome, InputError> {
        self.perform_with(procedure, |_| {})
    }

    /// The same; `each` sees it after each of its steps.
    pub(super) fn perform_with<P: Procedure>(
        &mut self,
        procedure: &mut P,
        each: impl FnMut(&mut P),
    ) -> Result<P::Outcome, InputError> {
        perform(self.serial.as_mut(), &mut self.client, procedure, |note| eprintln!("rig: {note}"), each)
    }

    /// The same without a word on stderr: the procedure shows its notes itself.
    #[cfg(feature = "screen")]
    pub(super) fn perform_quietly<P: Procedure>(
        &mut self,
        procedure: &mut P,
        each: impl FnMut(&mut P),
    ) -> Result<P::Outcome, InputError> {
        perform(self.serial.as_mut(), &mut self.client, procedure, |_| {}, each)
    }

    /// The port alone, for what keeps its own time.
    pub(super) fn transport(&mut self) -> &mut dyn Transport {
        self.serial.as_mut()
    }

    /// The port's name.
    #[cfg(feature = "screen")]
    pub(super) fn name(&self) -> String {
        self.serial.name()
    }

    /// Sends a request whose answer nobody waits for, to a rig that may be gone.
    pub(super) fn send_last(&mut self, command: Command) {
        self.client.request(command);
        let bytes = self.client.take_outgoing();
        // A rig that cannot be reached stops by itself.
        let _ = self.serial.send(&bytes);
    }

    /// Asks one thing.
    pub(super) fn ask(&mut self, command: Command) -> Result<Answer, InputError> {
        let mut answers = self.perform(&mut Ask::new([command]))?;
        answers.pop().ok_or_else(|| InputError::new("the rig gave no answer"))
    }
}

/// Notes in the log which firmware recorded it.
pub(super) fn sign_firmware(log: &mut Log, hello: &Hello) {
    let build: String = hello.build_id.iter().map(|byte| format!("{byte:02x}")).collect();
    log.metadata.push(("firmware".into(), hello.version.as_str().into()));
    log.metadata.push(("build_id".into(), build));
}

/// Notes in the log who recorded it.
pub(super) fn sign(log: &mut Log, hello: &Hello, rows_missing: u64) {
    sign_firmware(log, hello);
    log.metadata.push(("rows_missing".into(), rows_missing.to_string()));
}

/// Ticks between two rows at a rate.
pub(super) fn every_ticks(rate_hz: u32) -> Result<u16, InputError> {
    const TICK_HZ: u32 = 10_000;
    let refuse = || {
        InputError::new("is no whole part of the 10 kHz control rate, or more than the line carries")
            .file("--rate-hz")
            .value(rate_hz)
            .allowed("200, 250, 400, 500, 625, 1000, 1250")
    };
    if (200..=1250).contains(&rate_hz) && TICK_HZ.is_multiple_of(rate_hz) {
        u16::try_from(TICK_HZ / rate_hz).map_err(|_| refuse())
    } else {
        Err(refuse())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_rates_that_divide_the_control_rate_and_fit_the_line_are_taken() {
        let taken: Vec<u32> = (0..11_000).filter(|rate| every_ticks(*rate).is_ok()).collect();
        assert_eq!(taken, [200, 250, 400, 500, 625, 1000, 1250]);
        assert_eq!(every_ticks(1000).ok(), Some(10));
    }
}
