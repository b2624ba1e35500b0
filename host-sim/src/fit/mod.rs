//! Identification: parameters from logs, with what is known about their uncertainty.

pub mod bounds;
pub mod covariance;
pub mod drive;
pub mod error;
pub mod identifiability;
pub mod least_squares;
