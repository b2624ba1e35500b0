//! The true rig of a case: drawn from its seed around the assumed numbers of the real one.
//!
//! Values are rounded where they are drawn, so that a rig file can state them exactly.
//! Left out: anything an effect brings along; that is drawn in [`crate::laws`].

use serde::Serialize;

use crate::random::{Stream, rounded};
use crate::scenario::Base;

/// Sliding speed at 10 rpm on a radius of 0.06 m.
const SLOW_M_S: f64 = 10.0 / 60.0 * std::f64::consts::TAU * 0.06;
/// Normal force at which stick-slip is judged.
const MIDDLING_N: f64 = 88.0;

/// A bridge amplifier: the sensor's own mode, then a second-order Butterworth low-pass.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Bridge {
    /// Mode of the strained part.
    pub mode_hz: f64,
    /// Its damping ratio.
    pub damping_ratio: f64,
    /// Corner of the low-pass.
    pub lowpass_hz: f64,
}

/// Mechanics and electronics.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Rig {
    /// Radius of the elements' track.
    pub friction_radius_m: f64,
    /// Normal force per torque of M1.
    pub lever_gain_n_per_nm: f64,
    /// Rated torque of both motors.
    pub rated_torque_nm: f64,
    /// Lag of M1's torque loop.
    pub m1_lag_s: f64,
    /// Lag of M2's torque loop.
    pub m2_lag_s: f64,
    /// Motor M2 and disc.
    pub inertia_kg_m2: f64,
    /// Encoder lines per revolution, before quadrature.
    pub pulses_per_rev: f64,
    /// Force of the foil springs that lift the elements.
    pub preload_n: f64,
    /// Mode of the normal force.
    pub pressure_mode_hz: f64,
    /// Its damping ratio.
    pub pressure_damping: f64,
    /// Normal force per angle of M1 (compliance of the mechanism).
    pub mechanism_n_per_rad: f64,
    /// Bearing friction of M2, Coulomb part.
    pub bearing_coulomb_nm: f64,
    /// Bearing friction of M2, viscous part.
    pub bearing_viscous_nm_s: f64,
    /// Friction bridge; `None` is an ideal sensor.
    pub friction_bridge: Option<Bridge>,
    /// Normal-force bridge; `None` is an ideal sensor.
    pub normal_bridge: Option<Bridge>,
}

impl Rig {
    /// Draws a rig.
    #[must_use]
    pub fn draw(seed: u64) -> Self {
        let mut s = Stream::new(seed, "rig");
        let mut about = |value: f64, share: f64| rounded(s.about(value, share), 4);
        let mut rig = Self {
            friction_radius_m: 0.06,
            lever_gain_n_per_nm: about(30.0, 0.08),
            rated_torque_nm: 8.0,
            m1_lag_s: about(1e-3, 0.2),
            m2_lag_s: about(1e-3, 0.2),
            inertia_kg_m2: about(0.02, 0.2),
            pulses_per_rev: 120_000.0,
            preload_n: about(8.0, 0.25),
            pressure_mode_hz: about(120.0, 0.15),
            pressure_damping: about(0.25, 0.2),
            mechanism_n_per_rad: 0.0,
            bearing_coulomb_nm: about(0.17, 0.35),
            bearing_viscous_nm_s: about(0.006, 0.4),
            friction_bridge: Some(Bridge {
                mode_hz: about(600.0, 0.1),
                damping_ratio: about(0.025, 0.3),
                lowpass_hz: 1000.0,
            }),
            normal_bridge: Some(Bridge {
                mode_hz: about(900.0, 0.15),
                damping_ratio: about(0.03, 0.3),
                lowpass_hz: 1000.0,
            }),
        };
        if s.chance(0.4) {
            rig.normal_bridge = None;
        }
        // From a spindle that turns most of a revolution to a lever that hardly turns M1 at all.
        rig.mechanism_n_per_rad = rounded(s.log_uniform(50.0, 3000.0), 4);
        rig
    }
}

/// Parameters of the friction model behind the log.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Friction {
    /// Which model.
    #[serde(rename = "kind", serialize_with = "kind_name")]
    pub base: Base,
    /// Bristle stiffness.
    pub sigma0_n_per_m: f64,
    /// Bristle damping.
    pub sigma1_n_s_per_m: f64,
    /// Coulomb coefficient.
    pub a0: f64,
    /// Static minus Coulomb coefficient.
    pub a1: f64,
    /// Viscous coefficient, per normal force.
    pub a2_s_per_m: f64,
    /// Speed scale of the falling curve.
    pub v0_m_s: f64,
    /// Exponent of the falling curve.
    pub delta: f64,
    /// Block stiffness (series).
    pub k_u_n_per_m: f64,
    /// Block damping (series).
    pub c_u_n_s_per_m: f64,
}

fn kind_name<S: serde::Serializer>(base: &Base, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(kind(*base))
}

/// Name of a friction model in model files.
#[must_use]
pub fn kind(base: Base) -> &'static str {
    match base {
        Base::BySeed | Base::Lugre => "lugre",
        Base::Series => "series",
        Base::ModifiedLugre => "modified_lugre",
    }
}

impl Friction {
    /// Draws the true friction of a case; `base` must be decided.
    #[must_use]
    pub fn draw(seed: u64, base: Base) -> Self {
        let mut s = Stream::new(seed, "friction");
        let a0 = s.uniform(0.42, 0.62);
        let a1 = s.uniform(0.35, 0.75);
        let v0 = s.log_uniform(0.25, 0.8);
        let delta = if s.chance(0.75) { 0.5 } else { s.uniform(0.6, 1.0) };
        let a2 = if s.chance(0.5) { 0.0 } else { s.uniform(0.01, 0.06) };
        let sigma0 = s.log_uniform(1.2e7, 2.5e7);
        let sigma1 = if s.chance(0.5) { 0.0 } else { s.uniform(50.0, 500.0) };
        let k_u = s.log_uniform(2.2e4, 4.0e4);
        // A third of the rubber contacts stick and slip: a block is steady where its damping beats the fall of
        // the curve (ratio 1).
        let damping_ratio = s.log_uniform(0.5, 3.0);
        let plain = base == Base::ModifiedLugre;
        let mut friction = Self {
            base,
            sigma0_n_per_m: rounded(sigma0, 4),
            sigma1_n_s_per_m: if base == Base::Lugre { rounded(sigma1, 4) } else { 0.0 },
            a0: rounded(a0, 4),
            a1: rounded(a1, 4),
            a2_s_per_m: if plain { 0.0 } else { rounded(a2, 4) },
            v0_m_s: rounded(v0, 4),
            delta: if plain { 0.5 } else { rounded(delta, 4) },
            k_u_n_per_m: rounded(k_u, 4),
            c_u_n_s_per_m: 0.0,
        };
        friction.c_u_n_s_per_m = rounded(damping_ratio * friction.steepest_fall(), 4);
        friction
    }

    /// F_N |g′| at 10 rpm under 88 N, N·s/m: the block's damping below which it sticks and slips there.
    #[must_use]
    pub fn steepest_fall(&self) -> f64 {
        let ratio = SLOW_M_S / self.v0_m_s;
        let power = ratio.powf(self.delta);
        MIDDLING_N * self.a1 * self.delta * power / SLOW_M_S * (-power).exp()
    }

    /// Whether a block sticks and slips at 10 rpm.
    #[must_use]
    pub fn sticks_and_slips(&self) -> bool {
        self.base == Base::Series && self.c_u_n_s_per_m < self.steepest_fall()
    }

    /// What a user would have in the model file: each number up to 30 % off, evenly in the logarithm, the
    /// exponent right.
    #[must_use]
    pub fn nominal(&self, seed: u64) -> Self {
        let mut s = Stream::new(seed, "nominal");
        let mut off = |value: f64| rounded(value * s.log_uniform(1.0 / 1.3, 1.3), 3);
        Self {
            base: self.base,
            sigma0_n_per_m: off(self.sigma0_n_per_m),
            sigma1_n_s_per_m: off(self.sigma1_n_s_per_m),
            a0: off(self.a0),
            a1: off(self.a1),
            a2_s_per_m: off(self.a2_s_per_m),
            v0_m_s: off(self.v0_m_s),
            delta: self.delta,
            k_u_n_per_m: off(self.k_u_n_per_m),
            c_u_n_s_per_m: off(self.c_u_n_s_per_m),
        }
    }
}
