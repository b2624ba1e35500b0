//! Identification: parameters from logs, with what is known about their uncertainty.

pub mod covariance;
pub mod drive;
pub mod error;
pub mod identifiability;
