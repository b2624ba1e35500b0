//! Generators of logs with a hidden effect; they share no code with the product.
//!
//! [`generate::generate`] turns a [`scenario::Scenario`] into logs, rig file and baseline model file as
//! a user would have them, and the truth behind them. Same scenario, same bytes.

pub mod contact_force;
pub mod contact_log;
pub mod course;
pub mod curve;
pub mod drive;
pub mod drive_log;
pub mod driven_rig;
pub mod effect;
pub mod files;
pub mod filters;
pub mod generate;
pub mod laws;
pub mod pressure;
pub mod random;
pub mod reference_rig;
pub mod rig;
pub mod scenario;
pub mod sensors;
pub mod shadow;
pub mod truth;

pub use effect::Effect;
pub use generate::generate;
pub use scenario::{Base, CasePaths, Form, GeneratedCase, Plan, Scenario, ScenarioError};
