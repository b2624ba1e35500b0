//! What a law of the coefficient of friction may depend on.

/// State of the contact at one step.
#[derive(Debug, Clone, Copy)]
pub struct Slide {
    /// Step.
    pub step_s: f64,
    /// Time in the log.
    pub time_s: f64,
    /// Speed at which the tips slide.
    pub tip_speed_m_s: f64,
    /// Speed of the disc under the elements.
    pub root_speed_m_s: f64,
    /// Normal force.
    pub normal_n: f64,
    /// Friction force of the last step.
    pub force_n: f64,
    /// Angle of the disc itself, whatever the encoder counts.
    pub disc_angle_rad: f64,
}

impl Slide {
    /// Power that sliding turns to heat.
    #[must_use]
    pub fn power_w(&self) -> f64 {
        (self.force_n * self.tip_speed_m_s).max(0.0)
    }
}
