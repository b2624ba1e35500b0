//! The virtual bench: the release ELF, unmodified, on an emulated STM32H743 in closed loop with the plant.

pub mod part;
