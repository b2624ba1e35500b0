//! What the simulation gets wrong, why, and how much better it is with the cause in it.
//!
//! The rig is taken apart into subsystems ([`analysis::Analysis`]): each has a baseline and a list of
//! effects that can be added to it, and can fit any combination of them to the training logs. What is
//! compared is the same for all of them.

pub mod analysis;
pub mod contact;
pub mod drive;
pub mod effects;
pub mod noise;
pub mod record;
pub mod saturation;
pub mod search;
pub mod smooth;
