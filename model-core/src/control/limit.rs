//! Limits: what held a command back in this tick, and why the rig does less than it was asked.
//!
//! A limit is no fault: nothing is latched and the run goes on.

use super::numbered::{numbered, numbered_set};

numbered! {
    /// A reason why a command was held back.
    pub enum Limit {
        M1Torque = 1, "The torque of M1 is at its limit.";
        M2Torque = 2, "The torque of M2 is at its limit.";
        M1Slew = 3, "The torque of M1 follows its slew limit.";
        M2Slew = 4, "The torque of M2 follows its slew limit.";
        SpeedSlew = 5, "The speed reference follows its slew limit.";
        SpeedReference = 6, "The speed reference is above the allowed speed.";
        SpeedFoldback = 7, "The torque of M2 is cut because the disc nears the allowed speed.";
        NormalForce = 8, "The torque of M1 is cut to keep the normal force allowed.";
        M1Trim = 9, "The correction from the torque monitor of M1 is at its limit.";
        M2Trim = 10, "The correction from the torque monitor of M2 is at its limit.";
    }
}

numbered_set! {
    /// The limits that act in one tick.
    LimitSet(u16) of Limit
}
