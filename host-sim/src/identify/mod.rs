//! Identification and diagnosis: one likelihood for each balance of the rig, one table of causes.

pub mod balance;
pub mod contact;
pub mod drive;
pub mod effects;
pub mod filters;
pub mod grid;
pub mod judge;
pub mod linear;
pub mod noise;
pub mod press;
pub mod rest;
pub mod term;
pub mod two_mass;
