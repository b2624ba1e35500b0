//! Reads the firmware's log out of its memory, as a debug probe does: the RTT control block and its first
//! up-channel (SEGGER's layout: sixteen bytes of name, two counts, then per channel name, buffer, size, write
//! and read offset, flags).
//!
//! It only moves the read offset, so the firmware runs as with a probe attached. After a reset the firmware
//! writes the block anew, word by word; [`Rtt::restarted`] makes both offsets zero beforehand, as they will be,
//! so that a look in the middle of that finds nothing instead of old bytes.

use rigless::emulator::Host;
use rigless::soc::Width;

const BUFFER: u64 = 28;
const SIZE: u64 = 32;
const WRITE: u64 = 36;
const READ: u64 = 40;
/// No channel is larger: what claims to be is memory not initialised yet.
const LARGEST: u64 = 1 << 16;

/// The up-channel.
#[derive(Debug, Clone)]
pub struct Rtt {
    block: u64,
    /// Buffer and size, once the firmware has set the block up.
    channel: Option<(u64, u64)>,
}

impl Rtt {
    /// The channel of the control block at `block`.
    #[must_use]
    pub fn new(block: u64) -> Self {
        Self { block, channel: None }
    }

    /// The firmware is about to start anew.
    pub fn restarted(&mut self, host: &mut dyn Host) {
        self.channel = None;
        for offset in [WRITE, READ] {
            // The block is in RAM; were it not, the first look would find no channel.
            let _ = host.write(self.block + offset, Width::W32, 0);
        }
    }

    /// What was written since the last call.
    pub fn drain(&mut self, host: &mut dyn Host) -> Vec<u8> {
        let mut bytes = Vec::new();
        let Some((buffer, size)) = self.channel(host) else { return bytes };
        let (write, mut read) = (word(host, self.block + WRITE), word(host, self.block + READ));
        if write == read || write >= size || read >= size {
            return bytes;
        }
        while read != write {
            let Ok(byte) = host.read(buffer + read, Width::W8) else { break };
            bytes.push(byte.to_le_bytes()[0]);
            read = (read + 1) % size;
        }
        // The block is in the RAM it was just read from.
        let _ = host.write(self.block + READ, Width::W32, read);
        bytes
    }

    fn channel(&mut self, host: &mut dyn Host) -> Option<(u64, u64)> {
        if self.channel.is_none() {
            // The name goes in last, so a block that has it is complete.
            let name: Vec<u8> = (0..10)
                .map_while(|offset| host.read(self.block + offset, Width::W8).ok())
                .map(|byte| byte.to_le_bytes()[0])
                .collect();
            let (buffer, size) = (word(host, self.block + BUFFER), word(host, self.block + SIZE));
            if name == b"SEGGER RTT" && size > 0 && size <= LARGEST && buffer != 0 {
                self.channel = Some((buffer, size));
            }
        }
        self.channel
    }
}

fn word(host: &mut dyn Host, address: u64) -> u64 {
    host.read(address, Width::W32).unwrap_or(0)
}
