//! Friction models of a rubber element on asphalt.
//!
//! | model | equations | overshoots at constant sliding speed and normal force? |
//! |---|---|---|
//! | [`brush`] | 4–6 | a drop by µ_s/µ_c − 1, as a discontinuity |
//! | [`brush_patch`] | 7–11 | each element as above; the sum over the patch hardly |
//! | [`lugre`] | 12–14 | no: the bristle deflection rises monotonically |
//! | [`lugre_patch`] | 15–16 | no |
//! | [`modified_lugre`] | 17–19 | no, the implicit equation has one root (see there) |
//! | [`series`] | Fig. 25 | yes: the tip speed lags the root speed while the block winds up |
//!
//! Equation and figure numbers are those of Božić, Petrović, Matuško (2009). Every model is a value
//! prepared once from validated parameters, and a pure `step(&self, &mut state, &contact)`.

pub mod brush;
pub mod brush_patch;
mod contact;
pub mod element;
pub mod lugre;
pub mod lugre_patch;
pub mod modified_lugre;
mod parameters;
pub mod registry;
pub mod series;
pub mod static_curve;
pub mod stribeck;

pub use contact::{Contact, FrictionForce};
pub use element::{Element, MOST_PARAMETERS, ParameterSpec};
pub use parameters::FrictionParameters;
pub use registry::{FrictionModel, FrictionState, ModelKind};
