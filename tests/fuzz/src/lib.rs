//! What the fuzzers call: each takes any bytes and panics where a promise is broken.
//!
//! The readers of files are behind a feature, as they take most of the build. The same functions run in `cargo test` on a
//! bounded number of inputs (`tests/tests/suite/fuzzing.rs`).

pub mod link;
#[cfg(feature = "readers")]
pub mod readers;
