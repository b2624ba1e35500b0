//! What one control tick reads: raw values, exactly as the hardware gives them.

/// Everything sampled for one tick. Raw codes and levels; scaling belongs to the core.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Samples {
    /// Quadrature counter of M1 at the begin of the period; wraps at the width given in the settings.
    pub m1_count: u32,
    /// Quadrature counter of M2 at the same instant.
    pub m2_count: u32,
    /// The counters' instant and that of the previous tick are not one control period apart: the readings are those of
    /// before, or a period had no tick of its own.
    pub counts_irregular: bool,
    /// The time since the previous tick is no control period.
    pub tick_irregular: bool,
    /// The last complete scan of the analogue inputs.
    pub adc: AdcScan,
    /// The scan is newer than the one of the previous tick.
    pub adc_fresh: bool,
    /// The converter or its DMA reported that samples were lost since the previous tick.
    pub adc_overrun: bool,
    /// True while the emergency stop is pressed or its circuit is open.
    pub emergency_stop: bool,
    /// True while the arm switch is on.
    pub arm_switch: bool,
    /// True while the drive of M1 reports a fault.
    pub m1_drive_fault: bool,
    /// True while the drive of M2 reports a fault.
    pub m2_drive_fault: bool,
    /// The previous tick ended after its period, or was left out.
    pub deadline_missed: bool,
    /// A valid frame came from the host since the previous tick.
    pub link_heard: bool,
}

/// Codes of one scan, 16 bit, right aligned.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct AdcScan {
    /// Bridge of the torque ring: friction.
    pub friction_bridge: u16,
    /// Bridge of the frame: normal force.
    pub normal_bridge: u16,
    /// Torque monitor of M1's drive.
    pub m1_torque: u16,
    /// Torque monitor of M2's drive.
    pub m2_torque: u16,
    /// Supply voltage through its divider.
    pub supply: u16,
}
