//! Flash bank 2 as the settings' store needs it: reads that survive a torn word, writes that give up.
//!
//! A power cut while a word is programmed leaves it with an ECC no correction fits, and reading it is a bus
//! error. The read here holds that back (FAULTMASK with BFHFNMIGN) and gives zeros for the word, which the
//! store's own CRC then refuses. Programming and erasing wait in the background: the program runs from
//! bank 1, and the control tick goes on.
//!
//! Sources: RM0433 4.3.9, 4.7.7; ARMv7-M B1.5.11 (BFHFNMIGN). embassy's driver does the writing; it does not
//! clear the error flags, which stand in a register of their own on this chip, so that is done here.

use embassy_stm32::flash::{self, Async, Flash, InterruptHandler};
use embassy_stm32::{Peri, bind_interrupts, pac, peripherals};
use embassy_time::{Duration, with_timeout};
use embedded_storage_async::nor_flash::{
    ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash,
};

bind_interrupts!(struct Irqs {
    FLASH => InterruptHandler;
});

/// Bytes of a flash word: the least that is programmed at once.
const WORD: usize = flash::WRITE_SIZE;
/// Bytes of a sector of this chip.
const SECTOR: usize = 128 * 1024;
/// Offset of the settings from the start of flash: sectors 0 and 1 of bank 2, and in 2 the journal of their erasing.
pub const SETTINGS: core::ops::Range<u32> = 0x10_0000..0x16_0000;
/// Address of offset 0.
const BASE: usize = 0x0800_0000;
/// Longest time for one word (0.4 ms by the data sheet) or one sector (4 s).
const PATIENCE: Duration = Duration::from_secs(6);

/// Why flash did not do what was asked.
#[derive(Debug, Clone, Copy, PartialEq, Eq, defmt::Format)]
pub enum Error {
    /// The flash reported an error.
    Refused,
    /// It did not finish.
    Timeout,
    /// Beyond the settings, or not at a whole word or sector.
    Place,
}

impl NorFlashError for Error {
    fn kind(&self) -> NorFlashErrorKind {
        match self {
            Self::Place => NorFlashErrorKind::OutOfBounds,
            Self::Refused | Self::Timeout => NorFlashErrorKind::Other,
        }
    }
}

/// The settings' sectors.
pub struct SettingsFlash {
    flash: Flash<'static, Async>,
}

impl SettingsFlash {
    /// Takes the flash.
    #[must_use]
    pub fn new(flash: Peri<'static, peripherals::FLASH>) -> Self {
        Self { flash: Flash::new(flash, Irqs) }
    }
}

fn inside(from: u32, length: usize) -> Result<(), Error> {
    let end = from.checked_add(length as u32).ok_or(Error::Place)?;
    if from >= SETTINGS.start && end <= SETTINGS.end { Ok(()) } else { Err(Error::Place) }
}

fn clear_errors() {
    pac::FLASH.bank(1).ccr().write(|w| {
        w.set_clr_wrperr(true);
        w.set_clr_pgserr(true);
        w.set_clr_strberr(true);
        w.set_clr_incerr(true);
        w.set_clr_operr(true);
        w.set_clr_rdperr(true);
        w.set_clr_rdserr(true);
        w.set_clr_sneccerr(true);
        w.set_clr_dbeccerr(true);
    });
}

/// Copies bytes that lie within one flash word; zeros if the word is torn.
fn read_word(address: usize, out: &mut [u8]) {
    // SAFETY: the system control block is memory-mapped; the only field changed is a bit of CCR, and the
    // only other code that changes it runs before the first call.
    let scb = unsafe { &*cortex_m::peripheral::SCB::PTR };
    const IGNORE_BUS_FAULT: u32 = 1 << 8;
    // SAFETY: `cpsid f` masks all exceptions but NMI until `cpsie f` below; nothing in between can end early.
    unsafe { core::arch::asm!("cpsid f", options(nomem, nostack, preserves_flags)) };
    // SAFETY: a read-modify-write with exceptions masked; the bit only affects bus faults while they are masked.
    unsafe { scb.ccr.modify(|ccr| ccr | IGNORE_BUS_FAULT) };
    cortex_m::asm::dsb();
    for (i, byte) in out.iter_mut().enumerate() {
        // SAFETY: the caller checked that the address lies in the settings' sectors, which are mapped flash.
        *byte = unsafe { core::ptr::read_volatile((address + i) as *const u8) };
    }
    cortex_m::asm::dsb();
    // SAFETY: as above; puts the bit back.
    unsafe { scb.ccr.modify(|ccr| ccr & !IGNORE_BUS_FAULT) };
    // SAFETY: ends the masking begun above.
    unsafe { core::arch::asm!("cpsie f", options(nomem, nostack, preserves_flags)) };
    if pac::FLASH.bank(1).sr().read().dbeccerr() {
        out.fill(0);
        clear_errors();
    }
}

impl ErrorType for SettingsFlash {
    type Error = Error;
}

impl ReadNorFlash for SettingsFlash {
    const READ_SIZE: usize = 1;

    async fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Error> {
        inside(offset, bytes.len())?;
        let mut address = BASE + offset as usize;
        let mut rest = bytes;
        while !rest.is_empty() {
            let length = rest.len().min(WORD - address % WORD);
            let (now, later) = rest.split_at_mut(length);
            read_word(address, now);
            address += length;
            rest = later;
        }
        Ok(())
    }

    fn capacity(&self) -> usize {
        flash::FLASH_SIZE
    }
}

impl NorFlash for SettingsFlash {
    const WRITE_SIZE: usize = WORD;
    const ERASE_SIZE: usize = SECTOR;

    async fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Error> {
        inside(offset, bytes.len())?;
        clear_errors();
        match with_timeout(PATIENCE, self.flash.write(offset, bytes)).await {
            Ok(done) => done.map_err(|_| Error::Refused),
            Err(_) => Err(Error::Timeout),
        }
    }

    async fn erase(&mut self, from: u32, to: u32) -> Result<(), Error> {
        inside(from, to.saturating_sub(from) as usize)?;
        clear_errors();
        match with_timeout(PATIENCE, self.flash.erase(from, to)).await {
            Ok(done) => done.map_err(|_| Error::Refused),
            Err(_) => Err(Error::Timeout),
        }
    }
}
