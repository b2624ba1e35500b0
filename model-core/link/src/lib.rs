//! The wire protocol between the firmware and the host tool, and the schema of the rig's settings.
//!
//! | module | what |
//! |---|---|
//! | [`frame`] | COBS frames with a CRC-32, and the receiver that finds them in a stream of bytes |
//! | [`message`] | requests, answers and what the rig says by itself, in postcard |
//! | [`telemetry`] | the row that becomes a line of the log, and the health counters |
//! | [`program`] | the upload of an experiment |
//! | [`model`] | the upload of the observer's model |
//! | [`settings`] | key, name and unit of each setting |
//! | [`inputs`] | raw readings of one tick, for commissioning |
//! | [`capture`] | rows of the triggered capture |
#![no_std]
#![forbid(unsafe_code)]

pub mod capture;
mod convert;
pub mod frame;
pub mod inputs;
pub mod message;
pub mod model;
pub mod program;
pub mod settings;
pub mod telemetry;

/// Baud rate of the link: 8N1 on USART3, an exact divisor of its 120 MHz clock.
pub const BAUD: u32 = 2_000_000;
