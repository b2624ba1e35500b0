//! Friction models and the control core of the rubber-asphalt rig.
#![no_std]
#![forbid(unsafe_code)]

#[cfg(test)]
extern crate std;

pub mod control;
pub mod error;
pub mod exponential;
pub mod extension;
pub mod friction;
pub mod real;
pub mod selfcheck;
pub mod sensor;
