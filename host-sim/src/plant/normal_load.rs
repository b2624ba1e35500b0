//! M1 and the lever: torque command → torque → normal force, with contact loss.
//!
//! T₁ τ̇ = τ_cmd − τ;   ẍ + 2ζω ẋ + ω² x = ω² (G τ − F₀);   F_N = max(0, x)
//!
//! G is the lever's gain, F₀ the force with which the foil springs lift the elements off, ω and ζ those of the
//! normal-force mode (assumed 120 Hz, 0.25). x is the force the mechanism would exert on a road that could also
//! pull; below zero the elements are off the road. The angle of M1 follows from x by an assumed stiffness of the
//! mechanism: angle = (x + F₀)/K, zero without torque.
//!
//! Left out: friction and play in the lever, springs that harden, the change of stiffness when contact is lost.

use super::linear::Held;
use super::parameters::PlantParameters;

/// The normal-load actuator, prepared for a step size.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct NormalLoad {
    system: Held<3, 2>,
    preload_n: f64,
    gain_n_per_nm: f64,
    radian_per_newton: f64,
}

/// Torque of M1, force x and its rate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct NormalLoadState([f64; 3]);

impl NormalLoad {
    pub(crate) fn new(p: &PlantParameters, step_s: f64) -> Self {
        let rate = 1.0 / p.m1.lag_s();
        let w = std::f64::consts::TAU * p.pressure.mode_hz;
        let ww = w * w;
        let a = [
            [-rate, 0.0, 0.0],
            [0.0, 0.0, 1.0],
            [ww * p.geometry.lever_gain_n_per_nm, -ww, -2.0 * p.pressure.damping_ratio * w],
        ];
        let b = [[rate, 0.0], [0.0, 0.0], [0.0, -ww]];
        Self {
            system: Held::new(&a, &b, step_s),
            preload_n: p.pressure.preload_n,
            gain_n_per_nm: p.geometry.lever_gain_n_per_nm,
            radian_per_newton: 1.0 / p.geometry.mechanism_stiffness_n_per_rad,
        }
    }

    /// At rest without torque: the springs hold the elements off.
    pub(crate) fn rest(&self) -> NormalLoadState {
        NormalLoadState([0.0, -self.preload_n, 0.0])
    }

    #[inline]
    pub(crate) fn step(&self, state: &mut NormalLoadState, command_nm: f64, hand_nm: f64) {
        // A hand on the shaft works on the mechanism at once, without the drive's lag.
        let held_up_n = self.preload_n - self.gain_n_per_nm * hand_nm;
        state.0 = self.system.step(&state.0, &[command_nm, held_up_n]);
    }

    pub(crate) fn angle_rad(&self, state: &NormalLoadState) -> f64 {
        (state.0[1] + self.preload_n) * self.radian_per_newton
    }

    pub(crate) fn speed_rad_s(&self, state: &NormalLoadState) -> f64 {
        state.0[2] * self.radian_per_newton
    }
}

impl NormalLoadState {
    pub(crate) fn torque_nm(&self) -> f64 {
        self.0[0]
    }

    #[inline]
    pub(crate) fn normal_force_n(&self) -> f64 {
        self.0[1].max(0.0)
    }
}
