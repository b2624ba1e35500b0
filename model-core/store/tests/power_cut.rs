//! The supply goes while settings and a model are stored, forgotten, erased, and while a full sector is given up for the
//! other: at every flash word that is programmed and every sector that is erased, in each of the ways in which either can
//! be left. After each cut the store must open undamaged, every key must read its old value or its new one, and it must
//! take another value.
#![allow(clippy::unwrap_used)]

use embedded_storage_async::nor_flash::{
    ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash,
};
use model_core::control::{ControlSettings, RawCaps};
use rig_link::model::ModelRecord;
use rig_link::settings::{ALL, by_key};
use rig_store::{Board, Place, Settings};
use std::num::NonZeroUsize;
use std::pin::pin;
use std::task::{Context, Poll, Waker};
use std::thread::available_parallelism;

const WORD: usize = 32;
const SECTOR: usize = 128 * 1024;
/// Two of records, and the journal's.
const SECTORS: usize = 3;

/// How the word or the sector is left at which the supply goes.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Left {
    /// As it was.
    Untouched,
    /// With a checksum that no correction fits: such a word reads as zeros (firmware/src/flash.rs). Of a sector that was
    /// being erased, every third word.
    Torn,
    /// Every second bit that was to change has; and its checksum fits by chance. Of a sector, the first half is erased.
    Half,
    /// Done, but nobody heard of it.
    Done,
}

const WAYS: [Left; 4] = [Left::Untouched, Left::Torn, Left::Half, Left::Done];

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Gone {
    Power,
    /// A word that is not erased was to be programmed: the chip's flash has no second write.
    NotErased,
}

impl NorFlashError for Gone {
    fn kind(&self) -> NorFlashErrorKind {
        NorFlashErrorKind::Other
    }
}

/// Flash whose supply goes at the n-th word programmed or sector erased.
#[derive(Debug, Clone)]
struct Flash {
    bytes: Vec<u8>,
    /// Words programmed and sectors erased so far.
    done: u32,
    erased: u32,
    cut: Option<(u32, Left)>,
}

impl Flash {
    fn blank() -> Self {
        Self { bytes: vec![0xFF; SECTORS * SECTOR], done: 0, erased: 0, cut: None }
    }

    /// What is left of a step with this number.
    fn left(&mut self) -> Option<Left> {
        let now = self.done;
        self.done += 1;
        self.cut.filter(|(at, _)| now >= *at).map(|(at, left)| if now == at { left } else { Left::Untouched })
    }
}

impl ErrorType for Flash {
    type Error = Gone;
}

impl ReadNorFlash for Flash {
    const READ_SIZE: usize = 1;

    async fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Gone> {
        let start = offset as usize;
        bytes.copy_from_slice(&self.bytes[start..start + bytes.len()]);
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.bytes.len()
    }
}

impl NorFlash for Flash {
    const WRITE_SIZE: usize = WORD;
    const ERASE_SIZE: usize = SECTOR;

    async fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Gone> {
        for (nth, word) in bytes.chunks(WORD).enumerate() {
            let start = offset as usize + nth * WORD;
            let left = self.left();
            let place = &mut self.bytes[start..start + WORD];
            if place.iter().any(|byte| *byte != 0xFF) {
                return Err(Gone::NotErased);
            }
            match left {
                None | Some(Left::Done) => place.copy_from_slice(word),
                Some(Left::Untouched) => {}
                Some(Left::Torn) => place.fill(0),
                Some(Left::Half) => place.iter_mut().zip(word).for_each(|(to, from)| *to = from | 0x55),
            }
            if left.is_some() {
                return Err(Gone::Power);
            }
        }
        Ok(())
    }

    async fn erase(&mut self, from: u32, to: u32) -> Result<(), Gone> {
        for start in (from as usize..to as usize).step_by(SECTOR) {
            let left = self.left();
            self.erased += 1;
            let sector = &mut self.bytes[start..start + SECTOR];
            match left {
                None | Some(Left::Done) => sector.fill(0xFF),
                Some(Left::Untouched) => {}
                Some(Left::Torn) => {
                    for (nth, word) in sector.chunks_mut(WORD).enumerate() {
                        word.fill(if nth % 3 == 0 { 0 } else { 0xFF });
                    }
                }
                Some(Left::Half) => sector[..SECTOR / 2].fill(0xFF),
            }
            if left.is_some() {
                return Err(Gone::Power);
            }
        }
        Ok(())
    }
}

/// Runs what never waits.
fn now<T>(future: impl Future<Output = T>) -> T {
    match pin!(future).poll(&mut Context::from_waker(Waker::noop())) {
        Poll::Ready(done) => done,
        Poll::Pending => unreachable!("this flash never waits"),
    }
}

fn open(flash: Flash) -> Result<Settings<Flash>, String> {
    let board = Board { defaults: ControlSettings::default(), caps: RawCaps::FULL_SCALE };
    match now(Settings::load(flash, const { Place::new(0) }, board)) {
        Ok((settings, None)) => Ok(settings),
        Ok((_, Some(damage))) => Err(format!("damaged: {damage:?}")),
        Err(error) => Err(format!("{error:?}")),
    }
}

/// Something that changes the store.
#[derive(Debug, Clone, PartialEq)]
enum Step {
    Set(u16, f32),
    Forget(u16),
    Model(bool),
    Erase,
}

impl Step {
    fn take(&self, settings: &mut Settings<Flash>) -> Result<(), String> {
        let words = |error: rig_store::Refused<Gone>| format!("{error:?}");
        let keep = |settings: &mut Settings<Flash>, key: u16, value: Option<f32>| {
            let info = by_key(key).unwrap();
            let (stored, _) = settings.with_value(info, value).map_err(|error| format!("{error:?}"))?;
            now(settings.keep_value(info, value, stored)).map_err(words)
        };
        match *self {
            Self::Set(key, value) => keep(settings, key, Some(value)),
            Self::Forget(key) => keep(settings, key, None),
            Self::Model(there) => now(settings.keep_model(there.then(ModelRecord::default))).map_err(words),
            Self::Erase => now(settings.erase()).map_err(words),
        }
    }
}

/// Everything a store says.
#[derive(Debug, Clone, PartialEq)]
struct Said {
    values: Vec<Option<f32>>,
    model: Option<ModelRecord>,
}

fn said(settings: &Settings<Flash>) -> Said {
    Said {
        values: ALL.iter().map(|info| settings.state(info).stored).collect(),
        model: settings.model().cloned(),
    }
}

/// Each key by itself is as in one of the two.
fn is_old_or_new(after: &Said, old: &Said, new: &Said) -> bool {
    let values = after.values.iter().zip(&old.values).zip(&new.values);
    values.into_iter().all(|((after, old), new)| after == old || after == new)
        && (after.model == old.model || after.model == new.model)
}

/// Cuts the supply at every word and sector of a step, in each way, and counts.
fn cut_everywhere(flash: &Flash, step: &Step, count: &mut [u32; 2]) {
    let before = Flash { done: 0, erased: 0, cut: None, ..flash.clone() };
    let old = said(&open(before.clone()).unwrap());
    let mut undisturbed = open(before.clone()).unwrap();
    step.take(&mut undisturbed).unwrap();
    let new = said(&undisturbed);
    let whole = undisturbed.into_flash();
    assert!(whole.done > 0, "{step:?} changes nothing");
    count[1] += whole.erased;
    let cuts: Vec<(u32, Left)> = (0..whole.done).flat_map(|at| WAYS.map(|left| (at, left))).collect();
    count[0] += cuts.len() as u32;
    // No cut knows of another: they share the cores.
    let share = cuts.len().div_ceil(available_parallelism().map_or(1, NonZeroUsize::get));
    let share_of = |cuts: &[(u32, Left)]| cuts.iter().for_each(|one| cut(&before, step, *one, [&old, &new]));
    std::thread::scope(|threads| {
        for cuts in cuts.chunks(share) {
            threads.spawn(move || share_of(cuts));
        }
    });
}

/// Cuts the supply once, and looks at what the next start finds; it was `old` before the step and is `new` after it.
fn cut(before: &Flash, step: &Step, (at, left): (u32, Left), [old, new]: [&Said; 2]) {
    let what = || format!("{step:?} cut at {at}, left {left:?}");
    let mut settings = open(Flash { cut: Some((at, left)), ..before.clone() }).unwrap();
    let _ = step.take(&mut settings);
    let mut flash = settings.into_flash();
    assert!(flash.done > at, "{}: the cut did not come", what());
    (flash.cut, flash.done) = (None, 0);
    let mut settings = open(flash).unwrap_or_else(|damage| panic!("{}: {damage}", what()));
    let after = said(&settings);
    assert!(is_old_or_new(&after, old, new), "{}: {after:?}", what());
    // Another value goes in, and is there after the next start, with all the others.
    let next = Step::Set(143, 27.25);
    next.take(&mut settings).unwrap_or_else(|error| panic!("{}: then {error}", what()));
    let expected = said(&settings);
    let flash = settings.into_flash();
    let again = open(flash).unwrap_or_else(|damage| panic!("{}, and a value stored: {damage}", what()));
    assert_eq!(said(&again), expected, "{}", what());
}

/// The store as steps leave it.
fn after(mut flash: Flash, steps: impl IntoIterator<Item = Step>) -> Flash {
    for step in steps {
        let mut settings = open(flash).unwrap();
        step.take(&mut settings).unwrap();
        flash = settings.into_flash();
    }
    flash
}

/// Words not yet programmed in the sector that is being filled.
fn free_words(flash: &Flash) -> usize {
    flash
        .bytes
        .chunks(SECTOR)
        .take(2)
        .map(|sector| sector.chunks(WORD).filter(|word| word.iter().all(|byte| *byte == 0xFF)).count())
        .filter(|free| *free < SECTOR / WORD)
        .min()
        .unwrap_or_default()
}

#[test]
fn every_key_reads_old_or_new_after_a_cut_at_any_word() {
    let mut count = [0; 2];
    // The first record of all, with the schema's before it.
    cut_everywhere(&Flash::blank(), &Step::Set(143, 24.0), &mut count);
    let mut flash = after(Flash::blank(), [Step::Set(143, 24.0), Step::Set(321, 3.0)]);
    for step in [
        Step::Set(143, 26.0),
        Step::Forget(321),
        Step::Model(true),
        Step::Set(143, 25.0),
        Step::Model(false),
        Step::Model(true),
        Step::Erase,
        Step::Set(143, 26.0),
    ] {
        cut_everywhere(&flash, &step, &mut count);
        flash = after(flash, [step]);
    }
    println!("{} cuts, {} of sectors' erasures undisturbed", count[0], count[1]);
    assert!(count[0] > 100 && count[1] >= 1, "{count:?}");
}

/// Those that take long: `cargo verify` runs them, and `cargo test long:: -- --ignored`.
mod long {
    use super::*;

    #[test]
    #[ignore = "long: cargo verify runs it"]
    fn every_key_reads_old_or_new_after_a_cut_at_any_word_when_a_full_sector_is_given_up() {
        let mut count = [0; 2];
        // Twice round: as a sector fills up its records go to the other, and it is erased.
        let steps = [Step::Set(143, 26.0), Step::Model(true), Step::Set(321, 4.0)];
        let mut flash = after(Flash::blank(), steps);
        for round in 0..2 {
            let mut value = 20.0;
            // Up to the last few words at once, then store by store.
            let mut settings = open(flash).unwrap();
            while free_words(settings.flash()) > 14 {
                Step::Model(true).take(&mut settings).unwrap();
            }
            flash = settings.into_flash();
            let erased = count[1];
            while count[1] == erased {
                value += 0.125;
                cut_everywhere(&flash, &Step::Set(143, value), &mut count);
                flash = after(flash, [Step::Set(143, value)]);
                assert!(value < 30.0, "round {round}: the sector does not fill up");
            }
        }
        println!("{} cuts, {} of sectors' erasures undisturbed", count[0], count[1]);
        assert!(count[0] > 100 && count[1] >= 2, "{count:?}");
    }
}
