//! The disc, its bearing, and the shaft to M2.
//!
//! J ω̇ = τ₂ − T − b(ω),   b(ω) = C tanh(ω/ω₀) + B ω
//!
//! C = 0.15 N·m and B = 0.005 N·m·s are assumed, and so is ω₀ = 0.01 rad/s, which makes the Coulomb part smooth:
//! a disc that a torque below C pulls creeps instead of standing still, by at most ω₀ artanh(τ/C).
//!
//! With a torsional shaft (original rig, Figs. 6–7) motor and disc are two inertias:
//! J_m ω̇_m = τ₂ − τ_s,   J ω̇ = τ_s − T − b(ω),   τ_s = k·gap(θ_m − θ) + c (ω_m − ω) outside the gap,
//! where gap(x) takes off the backlash: zero for |x| ≤ β/2. In the gap τ_s = 0, and the damper never pulls the
//! flanks together.
//!
//! **Step**: velocity Verlet, second order, no drift in energy. The bearing, which is stiff near standstill
//! (C/ω₀ = 15 N·m·s), enters each half step by a linearised trapezoidal rule.

use super::parameters::{BearingParameters, ShaftParameters};
use model_core::real::Real;

/// Bearing friction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Bearing {
    coulomb_nm: f64,
    viscous_nm_s: f64,
    inverse_smooth_s: f64,
}

impl Bearing {
    pub(crate) fn new(p: &BearingParameters) -> Self {
        Self {
            coulomb_nm: p.coulomb_nm,
            viscous_nm_s: p.viscous_nm_s,
            inverse_smooth_s: 1.0 / p.smoothing_speed_rad_s,
        }
    }

    /// Torque and its slope over speed.
    #[inline]
    pub(crate) fn torque_and_slope(&self, speed_rad_s: f64) -> (f64, f64) {
        let x = speed_rad_s * self.inverse_smooth_s;
        // Beyond 20 the nearest f64 to tanh is ±1.
        let t = if x.abs() > 20.0 { 1.0f64.copysign(x) } else { tanh(x) };
        let slope = self.coulomb_nm * self.inverse_smooth_s * (1.0 - t * t) + self.viscous_nm_s;
        (self.coulomb_nm * t + self.viscous_nm_s * speed_rad_s, slope)
    }
}

/// By the `libm` of the models, so that a run gives the same bytes on every machine.
#[inline]
fn tanh(x: f64) -> f64 {
    let e = Real::exp_m1(2.0 * x);
    e / (e + 2.0)
}

/// Angles and speeds of disc and motor; equal where the shaft is rigid.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct DiscState {
    pub(crate) angle_rad: f64,
    pub(crate) speed_rad_s: f64,
    pub(crate) motor_angle_rad: f64,
    pub(crate) motor_speed_rad_s: f64,
}

/// Disc with bearing and shaft.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Disc {
    /// Everything that turns, or only the disc where the shaft is elastic.
    inertia_kg_m2: f64,
    bearing: Bearing,
    shaft: Option<ShaftParameters>,
}

impl Disc {
    pub(crate) fn new(
        inertia_kg_m2: f64,
        bearing: &BearingParameters,
        shaft: Option<ShaftParameters>,
    ) -> Self {
        let own = inertia_kg_m2 - shaft.map_or(0.0, |s| s.motor_inertia_kg_m2);
        Self { inertia_kg_m2: own, bearing: Bearing::new(bearing), shaft }
    }

    /// Changes the speeds over `dt_s`: `impulse_nm_s` is the integral of the motor's torque, `friction_nm` the
    /// friction torque.
    #[inline]
    pub(crate) fn kick(&self, state: &mut DiscState, dt_s: f64, impulse_nm_s: f64, friction_nm: f64) {
        let (bearing, slope) = self.bearing.torque_and_slope(state.speed_rad_s);
        let inertia = self.inertia_kg_m2 + 0.5 * dt_s * slope;
        match &self.shaft {
            None => {
                state.speed_rad_s += (impulse_nm_s - dt_s * (friction_nm + bearing)) / inertia;
                state.motor_speed_rad_s = state.speed_rad_s;
            }
            Some(shaft) => {
                let twist = shaft.torque_nm(
                    state.motor_angle_rad - state.angle_rad,
                    state.motor_speed_rad_s - state.speed_rad_s,
                );
                state.speed_rad_s += dt_s * (twist - friction_nm - bearing) / inertia;
                state.motor_speed_rad_s += (impulse_nm_s - dt_s * twist) / shaft.motor_inertia_kg_m2;
            }
        }
    }

    /// Moves the angles over `dt_s` at the present speeds.
    #[inline]
    pub(crate) fn drift(&self, state: &mut DiscState, dt_s: f64) {
        state.angle_rad += dt_s * state.speed_rad_s;
        state.motor_angle_rad += dt_s * state.motor_speed_rad_s;
    }

    pub(crate) fn bearing(&self) -> &Bearing {
        &self.bearing
    }
}

impl ShaftParameters {
    /// Torque the shaft carries from motor to disc.
    pub(crate) fn torque_nm(&self, twist_rad: f64, twist_speed_rad_s: f64) -> f64 {
        let half = 0.5 * self.backlash_rad;
        let strain = if twist_rad > half {
            twist_rad - half
        } else if twist_rad < -half {
            twist_rad + half
        } else {
            return 0.0;
        };
        let torque = self.stiffness_nm_per_rad * strain + self.damping_nm_s * twist_speed_rad_s;
        if self.backlash_rad == 0.0 || torque * strain > 0.0 { torque } else { 0.0 }
    }
}
