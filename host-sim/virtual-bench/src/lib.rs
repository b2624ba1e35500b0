//! The virtual bench: the release ELF, unmodified, on an emulated STM32H743 in closed loop with the plant.

pub mod bench;
pub mod board;
pub mod branch;
pub mod budget;
pub mod campaign;
pub mod cli;
pub mod defmt_log;
mod driver;
pub mod elf;
pub mod endpoint;
pub mod endpoint_link;
pub mod error;
pub mod experiment;
pub mod firmware_build;
mod full_rate;
pub mod gaps;
mod interference;
pub mod meter;
pub mod outside;
pub mod part;
pub mod pins;
pub mod plant_side;
pub mod probe;
pub mod record;
pub mod rtt;
pub mod serial;
pub mod serve;
pub mod sighting;
pub mod soak;
pub mod stack;

pub use driver::PERIOD;
