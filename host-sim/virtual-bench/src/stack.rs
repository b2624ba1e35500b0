//! How deep the stack goes at worst: the threads' mark in the painted stack, and above it every interrupt at once.
//!
//! The firmware paints its stack before it starts. The first byte that lost its paint is the deepest that a thread came,
//! with whatever interrupts happened to come then. Interrupts of one priority do not interrupt each other, so at worst one of
//! each priority stands on the deepest thread, each on a frame of the core's. How deep each goes the bench measures with code
//! round its handler (`probe.rs`).
//!
//! On top of them the firmware may crash, and writes a message then: by the supply's interrupt, which outranks the tick, by a
//! trap in that, and by the clock's failure, which interrupts a trap. These three are counted on top of each other.

use crate::bench;
use crate::elf::Firmware;
use crate::endpoint::Endpoint;
use crate::error::BenchError;
use crate::experiment::{Request, boot};
use crate::outside::{Action, Crash};
use crate::probe::{CRASH_PAINTED, FOUND, MEASURED, OF_THE_TICK};
use serde::{Deserialize, Serialize};
use std::fmt;

/// The stack (firmware/memory.x).
pub const STACK: std::ops::Range<u64> = 0x2000_0000..0x2000_E000;
/// What the start paints it with.
const PAINT: u8 = 0xCC;
/// What the core stacks at an exception with the floating-point registers, and to align it (ARMv7-M B1.5.7).
const FRAME: u64 = 104 + 4;

/// What was measured, in bytes.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Depth {
    /// The mark: the deepest thread, with what interrupted it then.
    pub mark: u64,
    /// The deepest handler of the control tick's priority.
    pub tick: u64,
    /// The deepest handler of the drivers' priority.
    pub drivers: u64,
    /// The crashes by supply, trap and clock, with their frames, added up.
    pub crash: u64,
}

impl Depth {
    /// Both interrupts on the deepest thread, and every crash on them.
    #[must_use]
    pub const fn worst(&self) -> u64 {
        self.mark + self.tick + self.drivers + 2 * FRAME + self.crash
    }

    /// What is left then; none where it is too small.
    #[must_use]
    pub fn left(&self) -> Option<u64> {
        (STACK.end - STACK.start).checked_sub(self.worst())
    }
}

impl fmt::Display for Depth {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let kib = |bytes: u64| bytes as f64 / 1024.0;
        write!(
            f,
            "stack: threads {:.1} KiB, drivers' interrupts {:.1}, control tick {:.1}, crashes {:.1}, with two frames at worst {:.1} \
             of {:.0}",
            kib(self.mark),
            kib(self.drivers),
            kib(self.tick),
            kib(self.crash),
            kib(self.worst()),
            kib(STACK.end - STACK.start)
        )?;
        match self.left() {
            Some(left) => write!(f, ", {:.1} left", kib(left)),
            None => write!(f, ": too much"),
        }
    }
}

/// The stack's mark so far, in bytes.
///
/// # Errors
/// The run ended.
pub fn mark(endpoint: &mut Endpoint) -> Result<u64, BenchError> {
    let stack = endpoint.memory(STACK.start, STACK.end - STACK.start)?;
    let painted = stack.iter().take_while(|byte| **byte == PAINT).count() as u64;
    Ok(STACK.end - STACK.start - painted)
}

/// Begins to measure the interrupts' handlers. The mark is none any more from here on.
///
/// # Errors
/// The run ended.
pub fn measure_interrupts(endpoint: &mut Endpoint) -> Result<(), BenchError> {
    endpoint.act(Action::MeasureStack)
}

/// The deepest handler of the tick's priority and of the drivers', in bytes, since they are measured.
///
/// # Errors
/// The run ended; a handler was deeper than was painted for it; the control tick did not come.
pub fn interrupts(endpoint: &mut Endpoint) -> Result<(u64, u64), BenchError> {
    let words = endpoint.memory(FOUND, 4 * MEASURED.len().next_multiple_of(2) as u64)?;
    let mut depths = Vec::new();
    for ((_, painted, name), word) in MEASURED.iter().zip(words.as_chunks::<4>().0) {
        let depth = u64::from(u32::from_le_bytes(*word));
        if depth >= *painted {
            return Err(BenchError::Check(format!(
                "{name} takes more than the {painted} bytes painted for it"
            )));
        }
        depths.push(depth);
    }
    let (tick, drivers) = depths.split_at(OF_THE_TICK);
    let most = |depths: &[u64]| depths.iter().copied().max().unwrap_or_default();
    if depths[0] == 0 || most(drivers) == 0 {
        return Err(BenchError::Check(format!("no interrupt was measured: {depths:?}")));
    }
    Ok((most(tick), most(drivers)))
}

/// How deep the crashes go, added up, in bytes.
///
/// # Errors
/// The bench failed, or a crash came near to what was painted for it.
pub fn crashes(firmware: &Firmware) -> Result<u64, BenchError> {
    let plant = Request::assumed("fig20")?.plant()?;
    let outcome = bench::run(firmware, Box::new(plant), |endpoint| {
        boot(endpoint)?;
        for crash in Crash::ALL {
            endpoint.act(Action::MeasureCrash(crash))?;
            endpoint.wait_until(endpoint.now_ns() + 300_000_000)?;
        }
        Ok(())
    })?;
    let depths = outcome.record.crash_depths;
    if depths.len() != Crash::ALL.len() || depths.iter().any(|depth| !(1..CRASH_PAINTED / 2).contains(depth))
    {
        return Err(BenchError::Check(format!(
            "crashes took {depths:?} bytes of the stack; {CRASH_PAINTED} are painted for each of {:?}",
            Crash::ALL
        )));
    }
    Ok(depths.iter().sum())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn at_worst_one_interrupt_of_each_priority_stands_on_the_deepest_thread() {
        let depth = Depth { mark: 40_000, tick: 5_000, drivers: 500, crash: 2_000 };
        assert_eq!(depth.worst(), 47_716);
        assert_eq!(depth.left(), Some(9_628));
        assert!(depth.to_string().ends_with("at worst 46.6 of 56, 9.4 left"), "{depth}");
        assert_eq!(Depth { mark: 56_000, ..depth }.left(), None);
    }
}
