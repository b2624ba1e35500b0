//! The message that survives a reset: written by a panic or a trap, read once at the next start.
//!
//! Words in SRAM4, which neither reset nor start-up code clears: magic, kind, tick (2), length, text, CRC-32
//! over all before it. Whole 32 bit words only: the memory has an ECC per word, and a narrower write still
//! in its buffer is lost at a reset. After power-on the words are random, and magic and CRC do not fit.

use crate::memory::CRASH_WORDS;
use core::fmt::Write;
use core::sync::atomic::Ordering::Relaxed;
use heapless::String;
use rig_link::frame::checksum;
use rig_link::message::{CRASH_TEXT, CrashKind, CrashRecord};

const MAGIC: u32 = 0x5249_474B;
const TEXT_AT: usize = 5;
const TEXT_WORDS: usize = CRASH_TEXT / 4;
const CRC_AT: usize = TEXT_AT + TEXT_WORDS;

/// Text that is cut off where it gets too long, so that writing never fails.
#[derive(Default)]
struct Text {
    bytes: String<CRASH_TEXT>,
}

impl Write for Text {
    fn write_str(&mut self, text: &str) -> core::fmt::Result {
        for character in text.chars() {
            if self.bytes.push(character).is_err() {
                break;
            }
        }
        Ok(())
    }
}

/// Keeps a message. The caller has made the outputs safe.
pub fn keep(kind: CrashKind, tick: u64, message: core::fmt::Arguments<'_>) {
    let mut text = Text::default();
    let _ = text.write_fmt(message);
    let mut words = [0u32; CRC_AT + 1];
    words[0] = MAGIC;
    words[1] = kind as u32;
    words[2] = tick as u32;
    words[3] = (tick >> 32) as u32;
    words[4] = text.bytes.len() as u32;
    for (word, bytes) in words[TEXT_AT..CRC_AT].iter_mut().zip(text.bytes.as_bytes().chunks(4)) {
        let mut four = [0; 4];
        four[..bytes.len()].copy_from_slice(bytes);
        *word = u32::from_le_bytes(four);
    }
    words[CRC_AT] = crc(&words);
    for (place, word) in CRASH_WORDS.iter().zip(words) {
        place.store(word, Relaxed);
    }
    cortex_m::asm::dsb();
}

/// Takes the message kept before the last reset, if there is one; the next start finds none.
pub fn take() -> Option<CrashRecord> {
    let mut words = [0u32; CRC_AT + 1];
    for (word, place) in words.iter_mut().zip(&CRASH_WORDS) {
        *word = place.load(Relaxed);
    }
    if words[0] != MAGIC || words[CRC_AT] != crc(&words) {
        return None;
    }
    CRASH_WORDS[0].store(0, Relaxed);
    let kind = match words[1] {
        0 => CrashKind::Panic,
        1 => CrashKind::HardFault,
        _ => CrashKind::Exception,
    };
    let mut bytes = [0; CRASH_TEXT];
    for (four, word) in bytes.chunks_exact_mut(4).zip(&words[TEXT_AT..CRC_AT]) {
        four.copy_from_slice(&word.to_le_bytes());
    }
    let length = usize::try_from(words[4]).unwrap_or(0).min(CRASH_TEXT);
    let text = core::str::from_utf8(&bytes[..length]).ok().and_then(|text| String::try_from(text).ok());
    Some(CrashRecord {
        kind,
        tick: u64::from(words[2]) | u64::from(words[3]) << 32,
        text: text.unwrap_or_default(),
    })
}

fn crc(words: &[u32; CRC_AT + 1]) -> u32 {
    let mut bytes = [0; 4 * CRC_AT];
    for (four, word) in bytes.chunks_exact_mut(4).zip(words) {
        four.copy_from_slice(&word.to_le_bytes());
    }
    checksum(&bytes)
}
