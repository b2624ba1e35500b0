//! Host-side tests across modules and of `rig` from the outside, in one program: it is linked once, and its tests fill
//! both cores. `cargo test -p host-sim --test suite plant::` runs those of one file.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

mod bad_input;
mod demo;
mod design;
mod docs;
mod fake_rig;
#[cfg(unix)]
mod interrupted;
mod link;
#[cfg(unix)]
mod link_cli;
mod lockstep;
mod own_logs;
mod plant;
mod predict_command;
