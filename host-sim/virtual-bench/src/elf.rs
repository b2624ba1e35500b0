//! The firmware's ELF: what the bench needs from it besides the bytes the emulator loads.

use crate::error::BenchError;
use object::{Object, ObjectSymbol};
use rigless::image::{self, Image};
use sha2::{Digest, Sha256};
use std::path::Path;

/// Handlers that run the control tick; the first one that is reached opens it.
const TICK_HANDLERS: [&str; 2] = ["DMA1_STREAM7", "TIM6_DAC"];
/// A handler between the threads and the control tick: that of the link's DMA.
const LOW_HANDLER: &str = "DMA1_STREAM0";

/// The control tick's static, as its symbol is mangled.
const CONTROL_STATE: &str = "4tick4TICK";

/// The ELF and what was found in it.
#[derive(Debug)]
pub struct Firmware {
    /// The whole file.
    pub bytes: Vec<u8>,
    /// SHA-256 of the file, in hexadecimal.
    pub sha256: String,
    /// For the emulator.
    pub images: Vec<Image>,
    /// Digest of the images, which ties a snapshot to them.
    pub digest: [u8; 32],
    /// Address of the RTT control block.
    pub rtt_block: u64,
    /// Addresses of the first instructions of the control tick's interrupt handlers.
    pub tick_handlers: [u64; 2],
    /// Address of the first instruction of a handler the control tick interrupts, and which interrupts the threads.
    pub low_handler: u64,
    /// Address and length of what the control tick remembers.
    pub control_state: (u64, u64),
}

impl Firmware {
    /// Reads the ELF at `path`.
    ///
    /// # Errors
    /// The file cannot be read, is no ELF, or lacks a symbol the bench needs.
    pub fn read(path: &Path) -> Result<Self, BenchError> {
        let bad = |why: String| BenchError::Firmware(format!("{}: {why}", path.display()));
        let bytes = std::fs::read(path).map_err(|error| bad(error.to_string()))?;
        let object = object::File::parse(bytes.as_slice()).map_err(|error| bad(error.to_string()))?;
        let address = |name: &str| {
            object
                .symbols()
                .find(|symbol| symbol.name() == Ok(name))
                .map(|symbol| symbol.address() & !1)
                .ok_or_else(|| bad(format!("it has no symbol `{name}`")))
        };
        let rtt_block = address("_SEGGER_RTT")?;
        let tick_handlers = [address(TICK_HANDLERS[0])?, address(TICK_HANDLERS[1])?];
        let low_handler = address(LOW_HANDLER)?;
        let control_state = object
            .symbols()
            .find(|symbol| symbol.name().is_ok_and(|name| name.contains(CONTROL_STATE)))
            .map(|symbol| (symbol.address(), symbol.size()))
            .ok_or_else(|| bad(format!("it has no symbol with `{CONTROL_STATE}`")))?;
        let images = vec![Image::new(path, bytes.clone(), None).map_err(|error| bad(error.to_string()))?];
        let digest = image::digest(&images, None);
        let sha256 = Sha256::digest(&bytes).iter().map(|byte| format!("{byte:02x}")).collect();
        Ok(Self { bytes, sha256, images, digest, rtt_block, tick_handlers, low_handler, control_state })
    }
}
