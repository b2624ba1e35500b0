//! Identification and diagnosis: one likelihood for each balance of the rig, one table of causes.

pub mod balance;
pub mod command;
pub mod contact;
pub mod drive;
pub mod effects;
pub mod evidence;
pub mod extended_model;
pub mod filters;
pub mod fit_contact;
mod fit_interval;
pub mod fit_parameters;
mod fit_posterior;
mod fit_simulated;
pub mod grid;
pub mod holdout;
pub mod judge;
mod law_form;
pub mod linear;
pub mod noise;
pub mod normal_load;
pub mod page;
pub mod rest;
pub mod results;
mod same_amplitude;
pub mod spectrum;
pub mod term;
pub mod two_mass;
