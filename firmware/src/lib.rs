//! Firmware of the rubber-asphalt rig for the NUCLEO-H743ZI2.
//!
//! The control law is `model-core`; here are the pins, the clock, the tick that calls it, what makes the
//! outputs safe, the link to the host, and the settings in flash.
#![no_std]

pub mod adc_scan;
pub mod board;
pub mod capture;
pub mod clock_check;
pub mod clocks;
pub mod crash_record;
pub mod encoders;
pub mod flash;
pub mod handover;
pub mod inputs;
pub mod itcm;
pub mod link;
pub mod log;
pub mod memory;
pub mod mpu;
pub mod outputs;
pub mod reference;
pub mod restart;
pub mod self_test;
pub mod settings;
pub mod start;
pub mod supply;
pub mod tick;
pub mod watchdog;
