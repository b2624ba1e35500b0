//! The plant behind the control core, and the bench engineer's tool.
#![forbid(unsafe_code)]

pub mod cli;
pub mod commission;
pub mod demo;
pub mod design;
pub mod files;
pub mod fit;
pub mod identify;
pub mod input_error;
mod least_squares;
pub mod link;
pub mod lockstep;
pub mod notices;
pub mod plant;
pub mod predict;
pub mod provenance;
pub mod report;
pub mod studies;
pub mod summary;
