//! Studies that need no motors, and the models that are compared.

pub mod bristle_damping;
pub mod candidate_models;
pub mod patch_crossing;
pub mod quarter_car;
pub mod readings;
pub mod rivals;
pub mod speed_sweep;
pub mod two_motors;
