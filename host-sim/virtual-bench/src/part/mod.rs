//! The chip: the emulator's STM32H743 with models of our own where it has none or leaves out what the
//! firmware uses. One file a peripheral, each with the rules of the reference manual (RM0433 rev 9) it follows.

pub mod adc_trigger;
pub mod capture_timer;
pub mod dac;
pub mod encoder_timer;
pub mod iwdg;
pub mod trigger_timer;
mod whole;

#[cfg(test)]
mod testing;

pub use whole::{Motor, Part};
