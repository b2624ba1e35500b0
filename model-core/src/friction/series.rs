//! Rubber block in series with LuGre bristles: Fig. 25 taken literally.
//!
//! A massless block (stiffness k_u, damping c_u) carries the bristles at its tip. With the root's
//! sliding speed v_r and the tip's v:
//!
//! u̇ = v_r − v,   k_u u + c_u u̇ = σ0 z + σ1 ż + F_N a2 v,   ż = v − σ0 |v| z / (F_N g(v))
//!
//! This is what can overshoot: while the block winds up, the tip is slower than the root, so the
//! bristles feel a higher g(v) than that of steady sliding.
//!
//! **Step.** u by backward Euler, z exactly for a held v, both in terms of the unknown v at the end
//! of the step, which leaves one scalar equation φ(v) = 0. Where g falls faster than k_uΔt + c_u can
//! follow, φ has several roots: the fold of stick-slip. The root is searched from the last tip speed
//! in the one direction in which φ falls to zero, so it stays on the branch it was on and jumps only
//! when that branch ends.
//!
//! Left out: the mass of the block, and the spread of deformation over its cross-section.

use super::contact::{Contact, FrictionForce};
use super::lugre::{Lugre, LugreParameters};
use crate::error::{ParameterError, require};
use crate::real::Real;

/// Parameters of block and bristles, in physical units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SeriesParameters<T> {
    /// Block stiffness k_u, N/m, > 0.
    pub k_u_n_per_m: T,
    /// Block damping c_u, N·s/m, > 0.
    pub c_u_n_s_per_m: T,
    /// The bristles at the tip.
    pub bristles: LugreParameters<T>,
}

/// Series element, prepared for a step size.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Series<T> {
    k_u: T,
    c_u: T,
    lugre: Lugre<T>,
    /// k_uΔt + c_u: what a change of tip speed costs the block in force.
    impedance: T,
    inverse_impedance: T,
    sigma1_per_step: T,
}

/// State of the series element.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SeriesState<T> {
    /// Block deformation u, m.
    pub deformation_m: T,
    /// Bristle deflection z, m.
    pub deflection_m: T,
    /// Tip speed v of the last step, m/s: tells on which branch the element is.
    pub tip_speed_m_s: T,
}

/// φ and what follows from the same evaluation.
struct Balance<T> {
    value: T,
    slope: T,
    deflection_m: T,
    bristle_force_n: T,
}

/// The load side of one step, constant while v is searched.
struct Load<T> {
    load_n: T,
    /// Steady deflection per unit of g: F_N/σ0.
    reach_m: T,
    /// Δt σ0/F_N
    stiffness_rate: T,
    /// Force of the block at v = 0.
    drive_n: T,
}

/// Newton steps, each followed by a bisection where it gained too little; reached only where φ is
/// flat to rounding.
const MOST_ITERATIONS: u32 = 30;

impl<T: Real> Series<T> {
    /// Prepares the element for a step of `step_s` seconds, or names the parameter out of range.
    pub fn new(p: &SeriesParameters<T>, step_s: T) -> Result<Self, ParameterError> {
        let k_allowed = p.k_u_n_per_m >= T::ONE && p.k_u_n_per_m <= T::from_f64(1e9);
        let k_u = require("k_u_n_per_m", p.k_u_n_per_m, k_allowed, "1 to 1e9 N/m")?;
        let c_allowed = p.c_u_n_s_per_m >= T::from_f64(1e-3) && p.c_u_n_s_per_m <= T::from_f64(1e6);
        let c_u = require("c_u_n_s_per_m", p.c_u_n_s_per_m, c_allowed, "1e-3 to 1e6 N s/m")?;
        let lugre = Lugre::new(&p.bristles, step_s)?;
        let mut element =
            Self { k_u, c_u, lugre, impedance: T::ONE, inverse_impedance: T::ONE, sigma1_per_step: T::ZERO };
        element.set_step_s(step_s);
        Ok(element)
    }

    /// Changes the step size, s, for unevenly sampled inputs. The caller keeps it positive.
    #[inline]
    pub fn set_step_s(&mut self, step_s: T) {
        self.lugre.set_step_s(step_s);
        self.impedance = self.k_u * step_s + self.c_u;
        self.inverse_impedance = T::ONE / self.impedance;
        self.sigma1_per_step = self.lugre.sigma1 / step_s;
    }

    /// The bristles at the tip.
    pub fn bristles(&self) -> &Lugre<T> {
        &self.lugre
    }

    /// Block stiffness k_u, N/m.
    pub fn stiffness_n_per_m(&self) -> T {
        self.k_u
    }

    /// Block damping c_u, N·s/m.
    pub fn damping_n_s_per_m(&self) -> T {
        self.c_u
    }

    /// Least block damping, N·s/m, for which the element has no fold at tip speed v:
    /// c_u > F_N |g′(v)|. Below it the element sticks and slips there.
    pub fn least_damping_n_s_per_m(&self, normal_force_n: T, tip_speed_m_s: T) -> T {
        let (_, momentum_slope) = self.lugre.stribeck.coefficient_and_slope(tip_speed_m_s);
        normal_force_n * momentum_slope.abs() / tip_speed_m_s.abs()
    }

    /// φ(v): bristle force minus block force, its slope, and the bristles' state at that v.
    #[inline]
    fn balance(&self, z: T, load: &Load<T>, v: T) -> Balance<T> {
        let (g, v_slope) = self.lugre.stribeck.coefficient_and_slope(v);
        let rate_per_speed = load.stiffness_rate / g;
        let lambda = rate_per_speed * v.abs();
        let gone = -(-lambda).exp_m1();
        let steady = (load.reach_m * g).copysign(v);
        let deflection_m = z - gone * z + gone * steady;
        // dλ/dv = λ/v (1 − v g′/g); d(steady)/dv = reach · g′. Both stay finite as v → 0.
        let lambda_slope = (rate_per_speed * (T::ONE - v_slope / g)).copysign(v);
        let gone_per_speed = if lambda > T::from_f64(1e-6) { gone / v.abs() } else { rate_per_speed };
        let slope = (T::ONE - gone) * lambda_slope * (steady - z) + gone_per_speed * load.reach_m * v_slope;
        let viscous = load.load_n * self.lugre.a2;
        let bristle_force_n =
            self.lugre.sigma0 * deflection_m + self.sigma1_per_step * (deflection_m - z) + viscous * v;
        Balance {
            value: bristle_force_n + self.impedance * v - load.drive_n,
            slope: (self.lugre.sigma0 + self.sigma1_per_step) * slope + viscous + self.impedance,
            deflection_m,
            bristle_force_n,
        }
    }

    /// Advances block and bristles by one step and returns the friction force.
    pub fn step(&self, state: &mut SeriesState<T>, contact: &Contact<T>) -> FrictionForce<T> {
        let v_root = contact.sliding_speed_m_s;
        let load_n = contact.load_n();
        let drive_n = self.k_u * state.deformation_m + self.impedance * v_root;
        if load_n <= T::ZERO {
            // Off the road the block relaxes: k_u u + c_u u̇ = 0.
            let v = drive_n * self.inverse_impedance;
            state.deformation_m += self.lugre.step_s * (v_root - v);
            state.deflection_m = T::ZERO;
            state.tip_speed_m_s = v;
            return FrictionForce { force_n: T::ZERO, tip_speed_m_s: v };
        }
        let load = Load {
            load_n,
            reach_m: load_n * self.lugre.inverse_sigma0,
            stiffness_rate: self.lugre.step_s * self.lugre.sigma0 / load_n,
            drive_n,
        };
        let (v, balance) = self.solve(state, &load);
        state.deformation_m += self.lugre.step_s * (v_root - v);
        state.deflection_m = balance.deflection_m;
        state.tip_speed_m_s = v;
        FrictionForce { force_n: balance.bristle_force_n, tip_speed_m_s: v }
    }

    /// The root of φ that is reached from the last tip speed without crossing another.
    ///
    /// φ has a kink at v = 0, where its value is known without any function call. Newton would
    /// jump to and fro across it, so the search keeps to the side on which the root lies.
    #[inline]
    fn solve(&self, state: &SeriesState<T>, load: &Load<T>) -> (T, Balance<T>) {
        let z = state.deflection_m;
        let tolerance = T::from_f64(4.0) * T::EPSILON * (load.drive_n.abs() + load.load_n);
        let at_rest = self.lugre.sigma0 * z - load.drive_n;
        let mut v = state.tip_speed_m_s;
        let mut at = self.balance(z, load, v);
        if at.value.abs() <= tolerance {
            return (v, at);
        }
        let rising = at.value < T::ZERO;
        let crosses =
            if rising { v < T::ZERO && at_rest < T::ZERO } else { v > T::ZERO && at_rest > T::ZERO };
        if crosses {
            v = if rising { T::ZERO } else { -T::ZERO };
            at = self.balance(z, load, v);
        }
        // |bristle force| never exceeds its stored or its steady value, so the root lies within.
        let reach = self.lugre.sigma0 + self.sigma1_per_step;
        let strongest = reach * (z.abs() + load.reach_m * self.lugre.stribeck.largest());
        let margin = strongest * self.inverse_impedance;
        let centre = load.drive_n * self.inverse_impedance;
        let (mut low, mut high) = if rising {
            (v, if v < T::ZERO { T::ZERO } else { centre.at_least(v) + margin })
        } else {
            (if v > T::ZERO { T::ZERO } else { centre.at_most(v) - margin }, v)
        };
        for _ in 0..MOST_ITERATIONS {
            let newton = v - at.value / at.slope;
            let next = if at.slope > T::ZERO && newton > low && newton < high {
                newton
            } else {
                T::HALF * (low + high)
            };
            let (last_value, moved) = (at.value, (next - v).abs());
            v = next;
            at = self.balance(z, load, v);
            if at.value.abs() <= tolerance || moved <= T::from_f64(2.0) * T::EPSILON * v.abs() {
                break;
            }
            if at.value > T::ZERO {
                high = v;
            } else {
                low = v;
            }
            if at.value.abs() > T::HALF * last_value.abs() {
                // Newton gains too little here: halve the bracket instead.
                v = T::HALF * (low + high);
                at = self.balance(z, load, v);
                if at.value > T::ZERO {
                    high = v;
                } else {
                    low = v;
                }
            }
        }
        (v, at)
    }
}
