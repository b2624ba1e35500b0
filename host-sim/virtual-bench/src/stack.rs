//! How deep the stack goes at worst: the threads' mark in the painted stack, and above it every interrupt at once.
//!
//! The firmware paints its stack before it starts. The first byte that lost its paint is the deepest that a thread came,
//! with whatever interrupts happened to come then. Interrupts of one priority do not interrupt each other, so at worst one of
//! each priority stands on the deepest thread, each on a frame of the core's. How deep each goes the bench measures with code
//! round its handler (`probe.rs`).

use crate::endpoint::Endpoint;
use crate::error::BenchError;
use crate::outside::Action;
use crate::probe::{FOUND, MEASURED, OF_THE_TICK};
use serde::Serialize;
use std::fmt;

/// The stack (firmware/memory.x).
pub const STACK: std::ops::Range<u64> = 0x2000_0000..0x2000_E000;
/// What the start paints it with.
const PAINT: u8 = 0xCC;
/// What the core stacks at an exception with the floating-point registers, and to align it (ARMv7-M B1.5.7).
const FRAME: u64 = 104 + 4;

/// What was measured, in bytes.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
pub struct Depth {
    /// The mark: the deepest thread, with what interrupted it then.
    pub mark: u64,
    /// The deepest handler of the control tick's priority.
    pub tick: u64,
    /// The deepest handler of the drivers' priority.
    pub drivers: u64,
}

impl Depth {
    /// Both interrupts on the deepest thread.
    #[must_use]
    pub const fn worst(&self) -> u64 {
        self.mark + self.tick + self.drivers + 2 * FRAME
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
            "stack: threads {:.1} KiB, drivers' interrupts {:.1}, control tick {:.1}, with two frames at worst {:.1} of {:.0}",
            kib(self.mark),
            kib(self.drivers),
            kib(self.tick),
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn at_worst_one_interrupt_of_each_priority_stands_on_the_deepest_thread() {
        let depth = Depth { mark: 40_000, tick: 5_000, drivers: 500 };
        assert_eq!(depth.worst(), 45_716);
        assert_eq!(depth.left(), Some(11_628));
        assert!(depth.to_string().ends_with("at worst 44.6 of 56, 11.4 left"), "{depth}");
        assert_eq!(Depth { mark: 56_000, ..depth }.left(), None);
    }
}
