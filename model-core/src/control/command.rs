//! What the operator may ask for, and why it may be refused.

use super::config::ControlConfig;
use super::fault::Fault;
use super::numbered::numbered;
use super::observer::ObserverModel;
use super::sequencer::PreparedExperiment;

/// A request, applied between two ticks by [`super::tick::apply`]. Large values are prepared outside the
/// control interrupt and handed over by reference.
#[derive(Debug, Clone, Copy)]
#[non_exhaustive]
pub enum Command<'a> {
    /// Enable the drives at zero torque; needs the arm switch too.
    Arm,
    /// Zero torque, drives off, at once.
    Disarm,
    /// Run the loaded experiment from its beginning.
    Start,
    /// End the run: both motors are brought to rest, then the rig stays armed.
    Stop,
    /// Clear latched faults whose causes are gone.
    ClearFault,
    /// Average both bridges at rest and call that zero.
    Tare,
    /// Take this experiment for the next start.
    LoadExperiment(&'a PreparedExperiment),
    /// Let the observer run this model from now on.
    SetModel(&'a ObserverModel),
    /// Swap the whole prepared configuration; only while the drives are off. A tare and a loaded
    /// experiment are forgotten: zeros and limits may have changed.
    SetConfig(&'a ControlConfig),
}

numbered! {
    /// Why a command was not carried out.
    pub enum Refusal {
        ArmSwitchOff = 1, "The arm switch is off.";
        ArmSwitchNotReleased = 2, "The arm switch must be turned off and on again first.";
        FaultLatched = 3, "A fault is latched; clear it first.";
        CausePresent = 4, "The cause of a fault is still there.";
        NotDisabled = 5, "This is possible only while the drives are off.";
        NotArmed = 6, "This is possible only while the rig is armed and at rest.";
        NotRunning = 7, "No experiment is running.";
        NoExperiment = 8, "No experiment is loaded.";
        Running = 9, "This is not possible while an experiment runs.";
        NotAtRest = 10, "The disc must be at rest, and M1 without torque.";
        NoFault = 11, "No fault is latched.";
        Starting = 12, "The controller is still checking itself after its start.";
    }
}

/// A refused command: the reason, and the fault behind it where there is one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Refused {
    /// Why.
    pub reason: Refusal,
    /// The fault that stands in the way.
    pub fault: Option<Fault>,
}

impl Refused {
    pub(crate) const fn because(reason: Refusal) -> Self {
        Self { reason, fault: None }
    }
    pub(crate) const fn by_fault(reason: Refusal, fault: Option<Fault>) -> Self {
        Self { reason, fault }
    }
}
