//! Laws of M1, its lever and the foil springs.

use serde::Serialize;

use crate::random::Stream;
use crate::rig::Rig;

/// Bouc–Wen hysteresis of the lever's joints (Y. K. Wen, J. Eng. Mech. 102, 1976):
/// ẇ = (τ̇/τ_y)(1 − |w|^n (γ + (1 − γ) sgn(τ̇ w))), torque lost = band·w.
#[derive(Debug, Clone, Serialize)]
pub struct LeverHysteresis {
    band_nm: f64,
    yield_nm: f64,
    power: f64,
    gamma: f64,
    #[serde(skip)]
    state: f64,
    #[serde(skip)]
    last_nm: Option<f64>,
}

impl LeverHysteresis {
    /// Draws one.
    pub fn draw(s: &mut Stream) -> Self {
        Self {
            band_nm: s.uniform(0.1, 0.25),
            yield_nm: s.uniform(0.05, 0.15),
            power: s.uniform(1.0, 2.0),
            gamma: s.uniform(0.4, 0.6),
            state: 0.0,
            last_nm: None,
        }
    }

    /// Torque lost on the way from M1 to the elements.
    pub fn lost(&mut self, torque_nm: f64) -> f64 {
        let change = torque_nm - self.last_nm.replace(torque_nm).unwrap_or(torque_nm);
        let along = self.gamma + (1.0 - self.gamma) * (change * self.state).signum();
        let next = self.state + change / self.yield_nm * (1.0 - self.state.abs().powf(self.power) * along);
        self.state = next.clamp(-1.0, 1.0);
        self.band_nm * self.state
    }
}

/// Foil springs that take an extra H (sinh(x/x_s) − x/x_s) of the force, x the force that bends them.
#[derive(Debug, Clone, Serialize)]
pub struct FoilHardening {
    extra_n: f64,
    scale_n: f64,
}

impl FoilHardening {
    /// Draws one that takes 10 to 20 % of the greatest normal force.
    pub fn draw(s: &mut Stream, greatest_n: f64) -> Self {
        let scale = greatest_n / s.uniform(1.6, 2.6);
        let top = greatest_n / scale;
        Self { extra_n: s.uniform(0.1, 0.2) * greatest_n / (top.sinh() - top), scale_n: scale }
    }

    /// Extra force of the springs.
    #[must_use]
    pub fn at(&self, force_n: f64) -> f64 {
        let x = force_n / self.scale_n;
        self.extra_n * (x.sinh() - x)
    }
}

/// Cogging of M1 over its angle: A sin(kθ + ψ + b sin(kθ + ψ)).
#[derive(Debug, Clone, Serialize)]
pub struct M1Ripple {
    amplitude_nm: f64,
    per_rad: f64,
    phase_rad: f64,
    bend: f64,
}

impl M1Ripple {
    /// Draws one that shows two to four periods over M1's travel and cannot hold the mechanism in a well.
    pub fn draw(s: &mut Stream, travel_rad: f64, rig: &Rig) -> Self {
        let per_rad = (std::f64::consts::TAU * s.uniform(2.0, 4.0) / travel_rad).round();
        let greatest = 0.6 * rig.mechanism_n_per_rad / (per_rad * rig.lever_gain_n_per_nm);
        Self {
            amplitude_nm: s.uniform(0.06, 0.13).min(greatest),
            per_rad,
            phase_rad: s.phase(),
            bend: s.uniform(0.2, 0.5),
        }
    }

    /// Torque at M1's angle.
    #[must_use]
    pub fn at(&self, angle_rad: f64) -> f64 {
        let turn = self.per_rad * angle_rad + self.phase_rad;
        self.amplitude_nm * (turn + self.bend * turn.sin()).sin()
    }
}
