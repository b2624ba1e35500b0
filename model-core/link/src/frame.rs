//! Frames: COBS( body · CRC-32 ) · 0x00.
//!
//! The body is a postcard message. The CRC is CRC-32/ISO-HDLC over the body, sent low byte first. COBS
//! keeps 0x00 out of the frame, so that a receiver that lost its place is back in step at the next 0x00.
//! Left out: numbering and repetition. Requests carry an id, telemetry a sequence number; a host that
//! misses an answer asks again.

use crc::{CRC_32_ISO_HDLC, Crc};
use serde::{Serialize, de::DeserializeOwned};

const CRC: Crc<u32> = Crc::<u32>::new(&CRC_32_ISO_HDLC);
const CRC_BYTES: usize = 4;

/// The largest body, bytes. A chunk of a capture is the largest message.
pub const MAX_BODY: usize = 512;
/// The largest body with its CRC, before COBS.
const MAX_PLAIN: usize = MAX_BODY + CRC_BYTES;
/// The largest frame on the wire: one more byte for each 254, and the closing 0x00.
pub const MAX_FRAME: usize = MAX_PLAIN + MAX_PLAIN / 254 + 2;

/// Why a frame was not taken, or could not be made.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum FrameError {
    /// Longer than any frame of this protocol.
    TooLong,
    /// Not a COBS block: bytes are missing or were added.
    Cobs,
    /// Shorter than a CRC.
    TooShort,
    /// The CRC does not fit the body.
    Crc,
    /// The body is intact and is no message of this protocol.
    Message,
}

impl core::fmt::Display for FrameError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::TooLong => "the frame is longer than any frame of this protocol",
            Self::Cobs => "the frame is no COBS block",
            Self::TooShort => "the frame is shorter than its checksum",
            Self::Crc => "the frame's checksum is wrong",
            Self::Message => "the frame is intact and holds no known message",
        })
    }
}

impl core::error::Error for FrameError {}

/// The checksum of `bytes`, as used in frames, for capture files and for crash records.
#[must_use]
pub fn checksum(bytes: &[u8]) -> u32 {
    CRC.checksum(bytes)
}

/// Writes `message` as a frame into `out` and returns its length. `out` of [`MAX_FRAME`] bytes is
/// always long enough for a message whose body is not longer than [`MAX_BODY`].
pub fn encode<M: Serialize>(message: &M, out: &mut [u8]) -> Result<usize, FrameError> {
    let mut plain = [0; MAX_PLAIN];
    let length = {
        let (body, _) = plain.split_at_mut(MAX_BODY);
        postcard::to_slice(message, body).map_err(|_| FrameError::TooLong)?.len()
    };
    let crc = checksum(plain.get(..length).ok_or(FrameError::TooLong)?);
    let end = length + CRC_BYTES;
    plain.get_mut(length..end).ok_or(FrameError::TooLong)?.copy_from_slice(&crc.to_le_bytes());
    let plain = plain.get(..end).ok_or(FrameError::TooLong)?;
    if out.len() < cobs::max_encoding_length(end) + 1 {
        return Err(FrameError::TooLong);
    }
    let written = cobs::encode(plain, out);
    *out.get_mut(written).ok_or(FrameError::TooLong)? = 0;
    Ok(written + 1)
}

/// Takes a received frame apart, without its closing 0x00. `frame` is overwritten.
pub fn decode<M: DeserializeOwned>(frame: &mut [u8]) -> Result<M, FrameError> {
    let length = cobs::decode_in_place(frame).map_err(|_| FrameError::Cobs)?;
    let plain = frame.get(..length).ok_or(FrameError::Cobs)?;
    let (body, crc) = plain.split_last_chunk::<CRC_BYTES>().ok_or(FrameError::TooShort)?;
    if checksum(body) != u32::from_le_bytes(*crc) {
        return Err(FrameError::Crc);
    }
    let (message, rest) = postcard::take_from_bytes(body).map_err(|_| FrameError::Message)?;
    if rest.is_empty() { Ok(message) } else { Err(FrameError::Message) }
}

/// Collects received bytes into frames, and counts what it had to throw away.
#[derive(Debug, Clone)]
pub struct Receiver {
    buffer: [u8; MAX_FRAME],
    length: usize,
    overflowed: bool,
    rejected: u32,
}

impl Default for Receiver {
    fn default() -> Self {
        Self::new()
    }
}

impl Receiver {
    /// An empty receiver, in step.
    #[must_use]
    pub const fn new() -> Self {
        Self { buffer: [0; MAX_FRAME], length: 0, overflowed: false, rejected: 0 }
    }

    /// Takes one byte; at the end of a frame gives the message or why there is none. Two 0x00 in a row
    /// are no frame: a sender may send one first to end whatever noise came before.
    pub fn push<M: DeserializeOwned>(&mut self, byte: u8) -> Option<Result<M, FrameError>> {
        if byte != 0 {
            match self.buffer.get_mut(self.length) {
                Some(slot) => {
                    *slot = byte;
                    self.length += 1;
                }
                None => self.overflowed = true,
            }
            return None;
        }
        let length = core::mem::take(&mut self.length);
        let overflowed = core::mem::take(&mut self.overflowed);
        if length == 0 {
            return None;
        }
        let message = match self.buffer.get_mut(..length) {
            Some(frame) if !overflowed => decode(frame),
            _ => Err(FrameError::TooLong),
        };
        if message.is_err() {
            self.rejected = self.rejected.saturating_add(1);
        }
        Some(message)
    }

    /// Forgets a frame that was begun: the line reported an error, so bytes are missing from it.
    pub fn discard(&mut self) {
        if self.length > 0 {
            self.rejected = self.rejected.saturating_add(1);
        }
        self.length = 0;
        self.overflowed = false;
    }

    /// How many frames were thrown away.
    #[must_use]
    pub fn rejected(&self) -> u32 {
        self.rejected
    }
}
