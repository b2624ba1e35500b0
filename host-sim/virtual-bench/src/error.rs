//! What can go wrong on the bench.

use host_sim::input_error::InputError;

/// Why a run did not come to its end, or came to a wrong one.
#[derive(Debug)]
pub enum BenchError {
    /// What the user gave is wrong.
    Input(InputError),
    /// The firmware cannot be built, read or recognised.
    Firmware(String),
    /// The emulator failed.
    Emulator(String),
    /// The firmware used something the emulator cannot stand in for; one line a use.
    Gaps(Vec<String>),
    /// The port for the host tool cannot be offered.
    Port(String),
    /// The firmware did not do what was asked of it.
    Rig(String),
    /// A check failed.
    Check(String),
    /// The user ended it.
    Stopped(String),
}

impl std::fmt::Display for BenchError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Input(error) => error.fmt(f),
            Self::Firmware(why) => write!(f, "the firmware: {why}"),
            Self::Emulator(why) => write!(f, "the emulator: {why}"),
            Self::Gaps(gaps) => {
                write!(f, "the emulator cannot stand in for {} of the firmware's accesses:", gaps.len())?;
                gaps.iter().try_for_each(|gap| write!(f, "\n  {gap}"))
            }
            Self::Port(why) => write!(f, "the port: {why}"),
            Self::Rig(why) => write!(f, "the rig: {why}"),
            Self::Check(why) => write!(f, "check failed: {why}"),
            Self::Stopped(where_it_stands) => write!(f, "stopped by the user: {where_it_stands}"),
        }
    }
}

impl std::error::Error for BenchError {}

impl From<InputError> for BenchError {
    fn from(error: InputError) -> Self {
        Self::Input(error)
    }
}
