//! What every friction model takes and gives.

use crate::real::Real;

/// Kinematics and load of the contact over one step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Contact<T> {
    /// Sliding speed v_r of the element's root over the road, mean over the step, m/s.
    pub sliding_speed_m_s: T,
    /// Normal force at the end of the step, N. Zero or less means: no contact, no friction.
    pub normal_force_n: T,
    /// Scales the road factor θ of the parameters; 1 leaves it. Effects that change the friction
    /// coefficient in time (temperature, wear, disc angle) act through it. As eqs. 13–14 have it, it
    /// multiplies g alone and leaves the viscous term F_N a2 v.
    pub road_factor: T,
}

impl<T: Real> Contact<T> {
    /// A contact on the road that the parameters were identified on.
    #[inline]
    pub fn new(sliding_speed_m_s: T, normal_force_n: T) -> Self {
        Self { sliding_speed_m_s, normal_force_n, road_factor: T::ONE }
    }

    /// The load that g is multiplied with: normal force × road factor, not below zero.
    #[inline]
    pub(crate) fn load_n(&self) -> T {
        (self.normal_force_n * self.road_factor).at_least(T::ZERO)
    }

    /// The viscous term F_N a2 v of eq. 14, which the road factor leaves alone.
    #[inline]
    pub(crate) fn viscous_n(&self, a2_s_per_m: T, speed_m_s: T) -> T {
        self.normal_force_n * a2_s_per_m * speed_m_s
    }
}

/// Result of one step.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct FrictionForce<T> {
    /// Friction force that resists a positive sliding speed, N, at the end of the step.
    pub force_n: T,
    /// Speed at which the asperities really slide, m/s: equal to the sliding speed of the root
    /// except where an elastic block lies between (the series element).
    pub tip_speed_m_s: T,
}
