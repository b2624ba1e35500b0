//! What the simulation gets wrong, why, and how much better it is with the cause in it.
//!
//! The rig is taken apart into subsystems ([`analysis::Analysis`]): each has a baseline and a list of
//! effects that can be added to it, and can fit any combination of them to the training logs. What is
//! compared is the same for all of them: [`selection`] chooses effects, [`structure`] says whether what is left is
//! noise, [`verdict`] draws the conclusion, [`results`] and [`page`] tell it. [`run`] does it all.

pub mod analysis;
pub mod contact;
pub mod coordinates;
pub mod drive;
pub mod effects;
pub mod events;
pub mod extended_model;
pub mod lines;
pub mod next_experiment;
pub mod noise;
pub mod page;
pub mod pooled;
pub mod pressure;
pub mod record;
pub mod results;
pub mod run;
pub mod saturation;
pub mod score;
pub mod screening;
pub mod search;
pub mod selection;
pub mod shadows;
pub mod smooth;
mod stepwise;
pub mod structure;
#[cfg(test)]
mod synthetic;
pub mod uncertainty;
pub mod verdict;
