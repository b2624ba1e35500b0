//! Generators of logs with a hidden effect; they share no code with the product.

pub mod driven_rig;
