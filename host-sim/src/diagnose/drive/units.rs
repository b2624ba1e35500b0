//! Names of parameters with the units of a rotary or a linear drive.

use crate::fit::drive::inverse::Motion;

/// Unit suffixes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Units {
    effort: &'static str,
    speed: &'static str,
    position: &'static str,
    viscous: &'static str,
    inertia: &'static str,
    stiffness: &'static str,
}

impl Units {
    /// Those of a kind of motion.
    pub const fn of(motion: Motion) -> Self {
        match motion {
            Motion::Rotary => Self {
                effort: "nm",
                speed: "rad_s",
                position: "rad",
                viscous: "nm_s_per_rad",
                inertia: "kg_m2",
                stiffness: "nm_per_rad",
            },
            Motion::Linear => Self {
                effort: "n",
                speed: "m_s",
                position: "m",
                viscous: "n_s_per_m",
                inertia: "kg",
                stiffness: "n_per_m",
            },
        }
    }

    /// A torque or force.
    pub fn effort(self, name: &str) -> String {
        format!("{name}_{}", self.effort)
    }

    /// A speed.
    pub fn speed(self, name: &str) -> String {
        format!("{name}_{}", self.speed)
    }

    /// An angle or a length.
    pub fn position(self, name: &str) -> String {
        format!("{name}_{}", self.position)
    }

    /// A viscous coefficient.
    pub fn viscous(self, name: &str) -> String {
        format!("{name}_{}", self.viscous)
    }

    /// An inertia or a mass.
    pub fn inertia(self, name: &str) -> String {
        format!("{name}_{}", self.inertia)
    }

    /// A stiffness.
    pub fn stiffness(self, name: &str) -> String {
        format!("{name}_{}", self.stiffness)
    }
}
