//! Erasing that a power cut does not leave half done.
//!
//! A sector whose erasing was cut short holds anything: cells are first programmed and then erased, so its words may read
//! as zeros, as they were, or as erased. The store marks a page as closed by a word of zeros at either end, so such a
//! sector can pass for a page full of records, and the good one that was made of it for one begun and not finished. So an
//! erasing is written down first, in a journal in a sector of its own, and that it is done afterwards; one that was begun
//! and not ended is done again before anything else is read.
//!
//! The journal's words alternate, sector and done, and carry their number and a checksum. A word that is torn ends it:
//! of the first kind, and nothing was erased yet; of the second, and all was. A journal that is full, torn or itself half
//! erased is erased when nothing is pending. Should a half-erased one pass for a whole one that ends with a begun erasing,
//! that is not believed unless the other sector holds a page.

use embedded_storage_async::nor_flash::{ErrorType, NorFlash, ReadNorFlash};
use rig_link::frame::checksum;

/// Bytes of a word of the journal: at least a word of the flash.
const WORD: usize = 32;
const MAGIC: u32 = 0x4A52_4E4C;
/// In place of a sector: it is done.
const DONE: u32 = u32::MAX;

/// Flash whose sectors are erased wholly or not at all, as far as its reader can tell.
#[derive(Debug)]
pub struct Whole<F> {
    flash: F,
    /// Offset of the journal's sector.
    journal: u32,
    /// Words written.
    words: u32,
}

/// What the journal says.
#[derive(Debug, Clone, Copy, Default)]
struct Journal {
    words: u32,
    /// Offset of the sector whose erasing was begun last and not ended.
    pending: Option<u32>,
    /// All words are as they must be, and all behind them are erased.
    sound: bool,
}

fn word(number: u32, what: u32) -> [u8; WORD] {
    let mut bytes = [0x5A; WORD];
    let fields = [MAGIC, number, what];
    for (place, field) in bytes.chunks_exact_mut(4).zip(fields) {
        place.copy_from_slice(&field.to_le_bytes());
    }
    let crc = checksum(bytes.get(..12).unwrap_or_default());
    if let Some(place) = bytes.get_mut(12..16) {
        place.copy_from_slice(&crc.to_le_bytes());
    }
    bytes
}

/// What a word says, if it is the journal's word of this number.
fn said(bytes: &[u8; WORD], number: u32) -> Option<u32> {
    let (_, rest) = bytes.split_at_checked(8)?;
    let what = u32::from_le_bytes(*rest.first_chunk()?);
    (*bytes == word(number, what) && (what == DONE) == (number % 2 == 1)).then_some(what)
}

impl<F: NorFlash> Whole<F> {
    const WORDS: u32 = (F::ERASE_SIZE / WORD) as u32;

    /// Ends what a power cut left half done among the sectors `pages`.
    ///
    /// # Errors
    /// The flash's.
    pub async fn open(flash: F, journal: u32, pages: [u32; 2]) -> Result<Self, F::Error> {
        let mut whole = Self { flash, journal, words: 0 };
        let found = whole.read_journal().await?;
        whole.words = found.words;
        if let Some(sector) = found.pending
            && let Some(other) = pages.iter().find(|other| **other != sector && pages.contains(&sector))
            && whole.is_begun(*other).await?
        {
            whole.flash.erase(sector, sector + F::ERASE_SIZE as u32).await?;
            whole.note(DONE).await?;
        }
        if !found.sound || whole.words + 2 > Self::WORDS {
            whole.clear_journal().await?;
        }
        Ok(whole)
    }

    /// The flash.
    pub fn flash(&self) -> &F {
        &self.flash
    }

    /// The flash, for another who reads it.
    pub fn into_flash(self) -> F {
        self.flash
    }

    async fn read_journal(&mut self) -> Result<Journal, F::Error> {
        let mut found = Journal { sound: true, ..Journal::default() };
        let mut ended = false;
        for number in 0..Self::WORDS {
            let mut bytes = [0; WORD];
            self.flash.read(self.journal + number * WORD as u32, &mut bytes).await?;
            let erased = bytes.iter().all(|byte| *byte == 0xFF);
            ended |= erased;
            if erased {
                continue;
            }
            match said(&bytes, number) {
                Some(what) if !ended => {
                    found.words = number + 1;
                    found.pending = Some(what).filter(|what| *what != DONE);
                }
                _ => {
                    // Nothing is pending at a torn word, nor in a journal that is half erased.
                    return Ok(Journal { words: found.words, pending: None, sound: false });
                }
            }
        }
        Ok(found)
    }

    /// Whether a page was begun in this sector.
    async fn is_begun(&mut self, sector: u32) -> Result<bool, F::Error> {
        let mut bytes = [0; WORD];
        self.flash.read(sector, &mut bytes).await?;
        Ok(bytes.iter().any(|byte| *byte != 0xFF))
    }

    async fn note(&mut self, what: u32) -> Result<(), F::Error> {
        let number = self.words;
        self.words += 1;
        self.flash.write(self.journal + number * WORD as u32, &word(number, what)).await
    }

    async fn clear_journal(&mut self) -> Result<(), F::Error> {
        self.flash.erase(self.journal, self.journal + F::ERASE_SIZE as u32).await?;
        self.words = 0;
        Ok(())
    }
}

impl<F: NorFlash> ErrorType for Whole<F> {
    type Error = F::Error;
}

impl<F: NorFlash> ReadNorFlash for Whole<F> {
    const READ_SIZE: usize = F::READ_SIZE;

    async fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), F::Error> {
        self.flash.read(offset, bytes).await
    }

    fn capacity(&self) -> usize {
        self.flash.capacity()
    }
}

impl<F: NorFlash> NorFlash for Whole<F> {
    const WRITE_SIZE: usize = F::WRITE_SIZE;
    const ERASE_SIZE: usize = F::ERASE_SIZE;

    async fn erase(&mut self, from: u32, to: u32) -> Result<(), F::Error> {
        for sector in (from..to).step_by(F::ERASE_SIZE) {
            if self.words + 2 > Self::WORDS {
                self.clear_journal().await?;
            }
            self.note(sector).await?;
            self.flash.erase(sector, sector + F::ERASE_SIZE as u32).await?;
            self.note(DONE).await?;
        }
        Ok(())
    }

    async fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), F::Error> {
        self.flash.write(offset, bytes).await
    }
}
