//! Tests across crates, in one program: it is linked once, and its tests fill both cores.
//! `cargo test -p rig-tests --test suite diagnosis::` runs those of one file.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

mod diagnosis;
mod fit_coverage;
mod fuzzing;
mod generator;
mod generator_laws;
mod pc_rig;
mod plausible;
mod predict;
mod real_machines;
mod reference_rig;
mod single_precision;
#[cfg(unix)]
mod trials;
