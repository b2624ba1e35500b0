//! Generators of logs with a hidden effect; they share no code with the product.
//!
//! [`generate::generate`] turns a [`scenario::Scenario`] into logs, rig file and baseline model file as
//! a user would have them, and the truth behind them. Same scenario, same bytes. By hand:
//! `cargo run -p rig-tests --bin generate -- --effect thermal_fade --seed 7 --out DIR`.
//!
//! Effects are hidden behind laws drawn from the literature ([`laws`]); one law of each effect is kept apart
//! ([`LawFamily::Reserved`]). A third of the rigs stick and slip ([`rig`]); no log is perfect ([`imperfections`]).
//!
//! How a contact log comes about: [`course`] → [`contact_log`] ([`pressure`], [`curve`] and
//! [`contact_force`], [`drive`], each with the effects of [`laws`]) → [`sensors`] → [`files`].
//! [`shadow`] measures how large the effect is; [`reference_rig`] is a solver's view of the rig without effects.

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
pub mod imperfections;
pub mod laws;
pub mod pressure;
pub mod random;
pub mod reference_rig;
pub mod rig;
pub mod scenario;
pub mod sensors;
pub mod shadow;
pub mod trial;
pub mod truth;

pub use effect::Effect;
pub use generate::generate;
pub use imperfections::Imperfection;
pub use laws::LawFamily;
pub use scenario::{Base, CasePaths, Form, GeneratedCase, Plan, Scenario, ScenarioError};
