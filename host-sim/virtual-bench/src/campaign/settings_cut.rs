//! Power cuts while a setting is stored.
//!
//! The supply goes at instants spread over the store, from the request to past its answer; and, as the emulator programs
//! a flash word whole or not at all, once for each word of the record with that word torn: a part of its bits
//! programmed. After each the firmware must start without a fault, with the old value or the new one, and take
//! another. What a torn word does on the chip beyond this, an ECC error on reading it, is not modelled.

use super::Verdict;
use super::listening_host::ListeningHost;
use crate::bench;
use crate::elf::Firmware;
use crate::endpoint::Endpoint;
use crate::error::BenchError;
use crate::experiment::{BOOT_NS, Request, boot};
use crate::outside::{Action, FLASH_WORD};
use crate::record::Saved;
use rig_link::message::{Answer, Command, ResetCause};
use std::path::Path;

/// The settings' two sectors (firmware/memory.x).
const SETTINGS: std::ops::Range<u64> = 0x0810_0000..0x0814_0000;
/// `speed_loop.bandwidth_hz` and values for it within its range.
const KEY: u16 = 143;
const FIRST: f32 = 24.0;
const NEW: f32 = 26.0;
const NEXT: f32 = 27.0;
const CUTS: u64 = 16;
const OFF_NS: u64 = 5_000_000;

/// What one store does to flash.
struct Stored {
    took_ns: u64,
    /// Words it changed, by rising address: before and after.
    words: Vec<(u64, [u8; FLASH_WORD], [u8; FLASH_WORD])>,
}

pub(super) fn verdict(firmware: &Firmware, scratch: &Path) -> Result<Verdict, BenchError> {
    let idle = idle(firmware)?;
    let stored = bench::run_on(firmware, &idle, scratch, store)?.operator;
    let mut problems = Vec::new();
    let mut olds = 0;
    let mut runs = 0;
    let mut judge = |what: String, seen: Result<f32, String>| {
        runs += 1;
        match seen {
            Ok(value) if value.to_bits() == FIRST.to_bits() => olds += 1,
            Ok(value) if value.to_bits() == NEW.to_bits() => {}
            Ok(value) => problems.push(format!("{what}: the setting is {value}, neither {FIRST} nor {NEW}")),
            Err(problem) => problems.push(format!("{what}: {problem}")),
        }
    };
    for cut in 0..CUTS {
        // The last ones come after the answer: then it must be the new value.
        let after_ns = stored.took_ns * cut * 5 / (CUTS * 4);
        let seen = bench::run_on(firmware, &idle, scratch, |endpoint| {
            let mut listener = ListeningHost::new();
            listener.send(&Command::SettingSet { key: KEY, value: NEW });
            listener.listen(endpoint, endpoint.now_ns() + after_ns)?;
            cut_and_look(endpoint, &[])
        })?;
        judge(format!("supply cut {} µs into the store", after_ns / 1000), seen.operator);
    }
    for (nth, (address, before, after)) in stored.words.iter().enumerate() {
        let mut words: Vec<Action> = stored.words[..nth]
            .iter()
            .map(|(address, _, after)| Action::FlashWord(*address, *after))
            .collect();
        words.push(Action::FlashWord(*address, torn(before, after)));
        let seen = bench::run_on(firmware, &idle, scratch, |endpoint| cut_and_look(endpoint, &words))?;
        judge(format!("word {nth} of the record torn"), seen.operator);
    }
    if stored.words.is_empty() {
        problems.push("storing a setting changed no flash".to_owned());
    }
    let said =
        format!("{runs} cuts: the old value {olds} times, else the new one; a new value taken each time");
    Ok(Verdict { name: "power cut while a setting is stored", said, problems })
}

/// The rig disabled, with one setting stored.
fn idle(firmware: &Firmware) -> Result<Saved, BenchError> {
    let outcome = bench::run(firmware, Box::new(Request::assumed("fig20")?.plant()?), |endpoint| {
        boot(endpoint)?;
        let mut listener = ListeningHost::new();
        set(endpoint, &mut listener, FIRST).map_err(BenchError::Rig)?;
        endpoint.snapshot()
    })?;
    outcome.record.saved.ok_or_else(|| BenchError::Emulator("nothing was kept".to_owned()))
}

fn set(endpoint: &mut Endpoint, listener: &mut ListeningHost, value: f32) -> Result<(), String> {
    match listener.ask(endpoint, &Command::SettingSet { key: KEY, value }) {
        Ok(Answer::Setting(state)) if state.stored.map(f32::to_bits) == Some(value.to_bits()) => Ok(()),
        Ok(other) => Err(format!("it does not store {value}: {other:?}")),
        Err(error) => Err(error.to_string()),
    }
}

/// Stores the new value undisturbed, and sees what that does to flash.
fn store(endpoint: &mut Endpoint) -> Result<Stored, BenchError> {
    let length = SETTINGS.end - SETTINGS.start;
    let before = endpoint.memory(SETTINGS.start, length)?;
    let started = endpoint.now_ns();
    set(endpoint, &mut ListeningHost::new(), NEW).map_err(BenchError::Rig)?;
    let took_ns = endpoint.now_ns() - started;
    let after = endpoint.memory(SETTINGS.start, length)?;
    let (before, _) = before.as_chunks::<FLASH_WORD>();
    let (after, _) = after.as_chunks::<FLASH_WORD>();
    let words = (SETTINGS.start..)
        .step_by(FLASH_WORD)
        .zip(before.iter().zip(after))
        .filter(|(_, (before, after))| before != after)
        .map(|(address, (before, after))| (address, *before, *after))
        .collect();
    Ok(Stored { took_ns, words })
}

/// Every other bit that was to be cleared still stands.
fn torn(before: &[u8; FLASH_WORD], after: &[u8; FLASH_WORD]) -> [u8; FLASH_WORD] {
    std::array::from_fn(|i| before[i] & (after[i] | 0x55))
}

/// Cuts the supply, puts words into flash meanwhile, and says what the setting is after the start.
fn cut_and_look(endpoint: &mut Endpoint, words: &[Action]) -> Result<Result<f32, String>, BenchError> {
    endpoint.act(Action::Power(false))?;
    endpoint.wait_until(endpoint.now_ns() + OFF_NS)?;
    for word in words {
        endpoint.act(*word)?;
    }
    endpoint.act(Action::Power(true))?;
    endpoint.wait_until(endpoint.now_ns() + BOOT_NS)?;
    let mut listener = ListeningHost::new();
    match listener.ask(endpoint, &Command::Hello)? {
        Answer::Hello(hello) if hello.reset == ResetCause::PowerOn => {}
        other => return Ok(Err(format!("it does not say that it was powered on: {other:?}"))),
    }
    // A health record comes each 0.1 s.
    listener.listen(endpoint, endpoint.now_ns() + 110_000_000)?;
    match listener.health {
        Some(health) if health.fault == 0 => {}
        other => return Ok(Err(format!("it is not free of faults: {other:?}"))),
    }
    let value = match listener.ask(endpoint, &Command::SettingGet { key: KEY })? {
        Answer::Setting(state) if state.stored.map(f32::to_bits) == Some(state.active.to_bits()) => {
            state.active
        }
        other => return Ok(Err(format!("the setting is not as stored: {other:?}"))),
    };
    Ok(set(endpoint, &mut listener, NEXT).map(|()| value))
}
