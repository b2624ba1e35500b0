//! The supervisor: which mode the rig is in.

use super::numbered::numbered;

numbered! {
    /// Mode of the rig. `Boot`, `Stopping` and `Fault` cannot be commanded.
    pub enum Mode {
        Boot = 0, "The controller checks itself after its start.";
        Disabled = 1, "Drives are off.";
        Armed = 2, "Drives are on, at zero torque.";
        Running = 3, "An experiment runs.";
        Stopping = 4, "The motors are being brought to rest.";
        Fault = 5, "A fault is latched; drives are off.";
    }
}

/// Why the controller started, as the firmware found out from reset flags and kept memory.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Restart {
    /// Power came on, or a person pressed reset.
    #[default]
    Ordinary,
    /// The watchdog.
    Watchdog,
    /// The firmware stopped itself.
    Panic,
    /// The processor trapped.
    HardFault,
}
