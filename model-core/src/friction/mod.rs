//! Friction models of a rubber element on asphalt.
//!
//! | model | equations | overshoots at constant sliding speed and normal force? |
//! |---|---|---|
//! | [`brush`] | 4–6 | a drop by µ_s/µ_c − 1, as a discontinuity |
//! | [`brush_curve`] | 4–6 | the same, with µ_c falling with speed as eqs. 4 and 10 have it |
//! | [`brush_patch`] | 7–11 | each element as above; the sum over the patch hardly |
//! | [`lugre`] | 12–14 | no: the bristle deflection rises monotonically |
//! | [`lugre_patch`] | 15–16 | no |
//! | [`modified_lugre`] | 17–19 | no, the implicit equation has one root (see there) |
//! | [`series`] | Fig. 25 | yes: the tip speed lags the root speed while the block winds up |
//! | [`series_maxwell`] | | yes, with the loss of filled rubber over four decades, shifted by temperature |
//! | [`series_zener`] | | yes, with a block whose damper is elastic |
//! | [`dahl`] | | no: nothing in it falls with speed |
//! | [`elasto_plastic`] | | no: as LuGre, without its drift |
//! | [`maxwell_slip`] | | no: elements slide where they break loose |
//! | [`frictional_lag`] | | yes, where the lag is longer than the wind-up |
//! | [`prakash_clifton`] | | no: as LuGre; a step of the load acts after a distance |
//! | [`rate_state`] | | yes: by the direct effect and by the strength of a rested contact |
//!
//! Equation and figure numbers are those of Božić, Petrović, Matuško (2009). Every model is a value
//! prepared once from validated parameters, and a pure `step(&self, &mut state, &contact)`.

pub mod brush;
pub mod brush_curve;
pub mod brush_patch;
mod contact;
pub mod dahl;
pub mod elasto_plastic;
pub mod element;
pub mod frictional_lag;
pub mod lugre;
pub mod lugre_patch;
pub mod maxwell_slip;
pub mod modified_lugre;
mod parameters;
pub mod prakash_clifton;
pub mod pressure;
pub mod rate_state;
#[macro_use]
mod registry;
pub mod series;
pub mod series_maxwell;
pub mod series_zener;
pub mod static_curve;
pub mod stribeck;

pub use contact::{Contact, FrictionForce};
pub use element::{Element, MOST_PARAMETERS, ParameterSpec};
pub use parameters::FrictionParameters;

use crate::error::ParameterError;
use crate::real::Real;
use stribeck::Stribeck;

// Every model of one element: variant, type, state, and `kind` in a model file. To add one, write its file with an
// `Element` in it, declare the file above, and give it a line here. Model files, fits, plant, observer, wire, flash and
// self-check follow.
models! {
    /// Brush with reset.
    Brush, brush::Brush<T>, brush::BrushState<T>, "brush";
    /// Brush with reset whose sliding coefficient follows a curve.
    BrushCurve, brush_curve::BrushCurve<T>, brush::BrushState<T>, "brush_curve";
    /// LuGre.
    Lugre, lugre::Lugre<T>, lugre::LugreState<T>, "lugre";
    /// Modified LuGre as printed.
    ModifiedLugre, modified_lugre::ModifiedLugre<T>, modified_lugre::ModifiedLugreState<T>, "modified_lugre";
    /// Modified LuGre without the condition for one root.
    ModifiedLugreFold, modified_lugre::Folded<T>, modified_lugre::ModifiedLugreState<T>, "modified_lugre_fold";
    /// Rubber block in series with LuGre bristles.
    Series, series::Series<T>, series::SeriesState<T>, "series";
    /// Dahl: an elastic contact that yields, without a falling curve.
    Dahl, dahl::Dahl<T>, dahl::DahlState<T>, "dahl";
    /// LuGre whose bristles are elastic up to a breakaway deflection.
    ElastoPlastic, elasto_plastic::ElastoPlastic<T>, lugre::LugreState<T>, "elasto_plastic";
    /// LuGre whose coefficient lags its curve.
    FrictionalLag, frictional_lag::FrictionalLag<T>, frictional_lag::FrictionalLagState<T>, "frictional_lag";
    /// Generalised Maxwell slip.
    MaxwellSlip, maxwell_slip::MaxwellSlip<T>, maxwell_slip::MaxwellSlipState<T>, "maxwell_slip";
    /// Rate-and-state friction with the ageing law, under an elastic block.
    Dieterich, rate_state::Dieterich<T>, rate_state::RateStateState<T>, "dieterich";
    /// Rate-and-state friction with the slip law, under an elastic block.
    Ruina, rate_state::Ruina<T>, rate_state::RateStateState<T>, "ruina";
    /// LuGre that feels a change of its load over a distance of sliding.
    PrakashClifton, prakash_clifton::PrakashClifton<T>, prakash_clifton::PrakashCliftonState<T>, "prakash_clifton";
    /// Zener rubber in series with LuGre bristles.
    SeriesZener, series_zener::SeriesZener<T>, series::SeriesState<T, 1>, "series_zener";
    /// Filled rubber, a spectrum of Maxwell branches shifted by temperature, in series with LuGre bristles.
    SeriesMaxwell, series_maxwell::SeriesMaxwell<T>, series::SeriesState<T, 4>, "series_maxwell";
}
