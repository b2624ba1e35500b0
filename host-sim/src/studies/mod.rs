//! Studies that need no motors, and the models that are compared.

pub mod contenders;
pub mod patch_crossing;
pub mod speed_sweep;
