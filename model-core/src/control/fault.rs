//! Faults: what makes the rig drop its torques and stay down until a person has looked.
//!
//! A fault is latched by the supervisor; it leaves only by command, with its cause gone and the arm
//! switch opened in between. What merely holds a command back is a limit (`limit.rs`), not a fault.

use super::numbered::{numbered, numbered_set};

numbered! {
    /// A reason to make safe. Lower numbers are reported first when several come in one tick.
    pub enum Fault {
        EmergencyStop = 1, "The emergency stop is pressed or its circuit is open.";
        M1DriveFault = 2, "The drive of M1 reports a fault.";
        M2DriveFault = 3, "The drive of M2 reports a fault.";
        AdcStalled = 4, "The analogue inputs gave no new scan in time.";
        AdcOverrun = 5, "Analogue samples were overwritten before they were read.";
        FrictionBridgeOpen = 8, "The friction bridge reads as an open wire.";
        FrictionBridgeShort = 9, "The friction bridge reads as a short circuit.";
        FrictionBridgeSaturated = 10, "The friction bridge's amplifier is saturated.";
        NormalBridgeOpen = 11, "The normal force bridge reads as an open wire.";
        NormalBridgeShort = 12, "The normal force bridge reads as a short circuit.";
        NormalBridgeSaturated = 13, "The normal force bridge's amplifier is saturated.";
        M1EncoderJump = 16, "The encoder of M1 made a step no motion can make.";
        M1EncoderNoCounts = 17, "The torque of M1 changed, and its encoder did not count.";
        M1EncoderNoTorque = 18, "The encoder of M1 counted, and no torque explains it.";
        M2EncoderJump = 19, "The encoder of M2 made a step no motion can make.";
        M2EncoderNoCounts = 20, "M2 has torque to turn, and its encoder does not count.";
        M2EncoderNoTorque = 21, "The encoder of M2 shows acceleration no torque explains.";
        OverSpeed = 24, "The disc turns faster than allowed.";
        M1OverTorque = 25, "The torque of M1 is larger than allowed.";
        M2OverTorque = 26, "The torque of M2 is larger than allowed.";
        OverForce = 27, "The normal force is larger than allowed.";
        M1TorqueMismatch = 28, "The torque of M1 is not what its drive was asked for.";
        M2TorqueMismatch = 29, "The torque of M2 is not what its drive was asked for.";
        SupplyLow = 32, "The supply voltage is too low.";
        SupplyHigh = 33, "The supply voltage is too high.";
        AnalogueFrozen = 34, "An analogue input stays at one code, without its noise.";
        DeadlineBudget = 36, "Too many control ticks ended late.";
        LinkLost = 37, "The host was not heard while the drives were on.";
        CalculationInvalid = 38, "A control value was not a finite number.";
        TickIrregular = 39, "Control ticks did not come a period apart.";
        SettingsCorrupt = 40, "The stored settings are damaged.";
        WatchdogReset = 41, "The watchdog restarted the controller.";
        Panic = 42, "The firmware stopped itself and restarted; its message is kept.";
        HardFault = 43, "The processor trapped and restarted; its registers are kept.";
        StateCorrupt = 44, "The mode in memory and its copy differ: a bit turned over.";
    }
}

numbered_set! {
    /// Several faults at once.
    FaultSet(u64) of Fault
}
