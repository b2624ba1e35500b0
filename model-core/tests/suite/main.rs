//! The models against closed forms, independent solvers and the paper's claims, in one program.
//! `cargo test -p model-core --test suite rivals::` runs those of one file.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

mod analytic;
mod claims;
mod common;
mod ode_reference;
mod passivity;
mod rivals;
