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
//! **Step.** u and z by the second-order backward differences (BDF2, for steps of any length), both in
//! terms of the unknown tip speed v at the end of the step, which leaves one scalar equation
//! φ(v) = 0. Second order matters at the control period: on the motion of Fig. 18 a first-order step
//! errs by 1.3e-3 of the force, this one by a tenth of that. Nothing rings, however stiff the bristles.
//!
//! Where g falls faster than the block's impedance k_uΔt/(1 + m) + c_u can follow, φ has several
//! roots: the fold of stick-slip. The root is searched from the last tip speed in the one direction in
//! which φ falls to zero, so it stays on the branch it was on and jumps only when that branch ends.
//!
//! Rubber that relaxes ([`super::series_zener`]) has Maxwell branches beside k_u: linear in the
//! block's rate, so they only add to the two numbers of the block's side.
//!
//! Left out: the mass of the block, and the spread of deformation over its cross-section.

use super::FrictionModel;
use super::contact::{Contact, FrictionForce};
use super::element::{Element, ParameterSpec, exactly};
use super::lugre::{Lugre, LugreParameters, and_bristles};
use super::stribeck::Stribeck;
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
pub struct Series<T, const N: usize = 0> {
    k_u: T,
    c_u: T,
    lugre: Lugre<T>,
    /// For a step as long as the last one.
    weights: Weights<T>,
    inverse_step: T,
    sigma1_per_step: T,
    branches: [Branch<T>; N],
}

/// A Maxwell branch beside block and damper, ḟ = k u̇ − f/τ, over a step of held u̇.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Branch<T> {
    stiffness: T,
    inverse_time: T,
    /// What is left of its force after a step.
    decay: T,
    /// Force per rate of the block, N·s/m.
    gain: T,
}

/// How the end of a step weighs in the block's motion over it.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Weights<T> {
    /// Δt/(Δt + last Δt): how far the mean tip speed leans on that of the last step.
    memory: T,
    /// 1/(1 + memory)
    share: T,
    /// k_uΔt · share + c_u: what a change of tip speed costs the block in force.
    impedance: T,
    inverse_impedance: T,
}

/// State of the series element.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SeriesState<T, const N: usize = 0> {
    /// Block deformation u, m.
    pub deformation_m: T,
    /// Bristle deflection z, m.
    pub deflection_m: T,
    /// Tip speed v at the end of the last step, m/s: tells on which branch the element is.
    pub tip_speed_m_s: T,
    /// Mean rate of the bristle deflection over the last step, m/s.
    pub deflection_rate_m_s: T,
    /// Mean tip speed over the last step, m/s.
    pub mean_tip_speed_m_s: T,
    /// Mean sliding speed of the root over the last step, m/s.
    pub mean_root_speed_m_s: T,
    /// Length of the last step, s; zero before the first.
    pub last_step_s: T,
    /// Forces of the Maxwell branches, N.
    pub branch_n: [T; N],
    /// (g, v·g′) at the tip speed, where the last step knows it: the next step's search begins there.
    pub tip_curve: Option<(T, T)>,
}

impl<T: Real, const N: usize> Default for SeriesState<T, N> {
    fn default() -> Self {
        Self {
            deformation_m: T::ZERO,
            deflection_m: T::ZERO,
            tip_speed_m_s: T::ZERO,
            deflection_rate_m_s: T::ZERO,
            mean_tip_speed_m_s: T::ZERO,
            mean_root_speed_m_s: T::ZERO,
            last_step_s: T::ZERO,
            branch_n: [T::ZERO; N],
            tip_curve: None,
        }
    }
}

/// φ and what follows from the same evaluation.
struct Balance<T> {
    value: T,
    slope: T,
    deflection_m: T,
    bristle_force_n: T,
    /// (g, v·g′)
    curve: (T, T),
}

/// The load side of one step, constant while v is searched.
struct Load<T> {
    /// What g is multiplied with.
    load_n: T,
    /// F_N a2, N s/m; the road factor has no part in it.
    viscous: T,
    /// Steady deflection per unit of g: F_N/σ0.
    reach_m: T,
    /// Δt σ0/F_N
    stiffness_rate: T,
    /// Force of the block at v = 0.
    drive_n: T,
    impedance: T,
    inverse_impedance: T,
    /// 1 + memory
    lead: T,
    /// What the bristles' last step and place carry into this one.
    carried_m: T,
}

/// Newton steps, each followed by a bisection where it gained too little; reached only where φ is
/// flat to rounding.
const MOST_ITERATIONS: u32 = 30;

impl<T: Real> Series<T> {
    /// Prepares the element for a step of `step_s` seconds, or names the parameter out of range.
    pub fn new(p: &SeriesParameters<T>, step_s: T) -> Result<Self, ParameterError> {
        Self::with_branches(p, [], step_s)
    }
}

impl<T: Real, const N: usize> Series<T, N> {
    /// As [`Series::new`] with Maxwell branches of given stiffness (N/m) and relaxation time (s) beside the block. The
    /// caller has checked these.
    pub(super) fn with_branches(
        p: &SeriesParameters<T>,
        branches: [(T, T); N],
        step_s: T,
    ) -> Result<Self, ParameterError> {
        let k_allowed = p.k_u_n_per_m >= T::ONE && p.k_u_n_per_m <= T::from_f64(1e9);
        let k_u = require("k_u_n_per_m", p.k_u_n_per_m, k_allowed, "1 to 1e9 N/m")?;
        let c_allowed = p.c_u_n_s_per_m >= T::from_f64(1e-3) && p.c_u_n_s_per_m <= T::from_f64(1e6);
        let c_u = require("c_u_n_s_per_m", p.c_u_n_s_per_m, c_allowed, "1e-3 to 1e6 N s/m")?;
        let lugre = Lugre::new(&p.bristles, step_s)?;
        let mut element = Self {
            k_u,
            c_u,
            lugre,
            weights: Weights::default(),
            inverse_step: T::ONE,
            sigma1_per_step: T::ZERO,
            branches: branches.map(|(stiffness, time_s)| Branch {
                stiffness,
                inverse_time: T::ONE / time_s,
                decay: T::ONE,
                gain: T::ZERO,
            }),
        };
        element.set_step_s(step_s);
        Ok(element)
    }

    /// Changes the step size, s, for unevenly sampled inputs. The caller keeps it positive.
    #[inline]
    pub fn set_step_s(&mut self, step_s: T) {
        self.lugre.set_step_s(step_s);
        for branch in &mut self.branches {
            let gone = -(-(step_s * branch.inverse_time)).exp_m1();
            branch.decay = T::ONE - gone;
            branch.gain = branch.stiffness * gone / branch.inverse_time;
        }
        self.weights = self.weights(T::HALF);
        self.inverse_step = T::ONE / step_s;
        self.sigma1_per_step = self.lugre.sigma1 * self.inverse_step;
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

    fn weights(&self, memory: T) -> Weights<T> {
        let share = T::ONE / (T::ONE + memory);
        let branches = self.branches.iter().fold(T::ZERO, |sum, branch| sum + branch.gain);
        let impedance = (self.k_u * self.lugre.step_s + branches) * share + self.c_u;
        Weights { memory, share, impedance, inverse_impedance: T::ONE / impedance }
    }

    /// φ(v): bristle force minus block force, its slope, and the bristles' state at that v.
    #[inline]
    fn balance(&self, z: T, load: &Load<T>, v: T) -> Balance<T> {
        self.balance_on(self.lugre.stribeck.coefficient_and_slope(v), z, load, v)
    }

    /// As [`Self::balance`] with the curve's value and slope at v known.
    #[inline]
    fn balance_on(&self, curve: (T, T), z: T, load: &Load<T>, v: T) -> Balance<T> {
        let (g, v_slope) = curve;
        let inverse_g = T::ONE / g;
        let rate_per_speed = load.stiffness_rate * inverse_g;
        // (1 + m)(z⁺ − z) − m (last z⁺ − z) = Δt (v − rate |v| z⁺), with vλ′ = λ (1 − v g′/g).
        let inverse = T::ONE / (load.lead + rate_per_speed * v.abs());
        let deflection_m = (load.carried_m + self.lugre.step_s * v) * inverse;
        let lambda_slope = (rate_per_speed * (T::ONE - v_slope * inverse_g)).copysign(v);
        let slope = (self.lugre.step_s - deflection_m * lambda_slope) * inverse;
        let bristle_force_n =
            self.lugre.sigma0 * deflection_m + self.sigma1_per_step * (deflection_m - z) + load.viscous * v;
        Balance {
            value: bristle_force_n + load.impedance * v - load.drive_n,
            slope: (self.lugre.sigma0 + self.sigma1_per_step) * slope + load.viscous + load.impedance,
            deflection_m,
            bristle_force_n,
            curve,
        }
    }

    /// Advances block and bristles by one step and returns the friction force.
    pub fn step(&self, state: &mut SeriesState<T, N>, contact: &Contact<T>) -> FrictionForce<T> {
        let v_root = contact.sliding_speed_m_s;
        let load_n = contact.load_n();
        let step_s = self.lugre.step_s;
        let even = state.last_step_s == step_s || state.last_step_s <= T::ZERO;
        let weights = if even { self.weights } else { self.weights(step_s / (step_s + state.last_step_s)) };
        // Mean tip speed of this step: share · v plus what the last one leaves.
        let left = weights.share * weights.memory * state.mean_tip_speed_m_s;
        let free_m = state.deformation_m + step_s * (v_root - left);
        // Speed of the root at the end of the step, from its means over two steps.
        let root_end = if state.last_step_s <= T::ZERO {
            v_root
        } else {
            v_root + weights.memory * (v_root - state.mean_root_speed_m_s)
        };
        let mut drive_n = self.k_u * free_m + self.c_u * root_end;
        for (branch, force_n) in self.branches.iter().zip(&state.branch_n) {
            drive_n += branch.decay * *force_n + branch.gain * (v_root - left);
        }
        let (v, deflection_m, force_n, tip_curve) = if load_n <= T::ZERO {
            // Off the road the block relaxes: k_u u + c_u u̇ = 0.
            (drive_n * weights.inverse_impedance, T::ZERO, T::ZERO, None)
        } else {
            let lead = T::ONE + weights.memory;
            let reach_m = load_n * self.lugre.inverse_sigma0;
            let z = state.deflection_m;
            // Extrapolation must not carry the bristles out of what the load (or they themselves) allow.
            let most = (reach_m * self.lugre.stribeck.largest()).at_least(z.abs());
            let carried_m = z + weights.memory * (z + step_s * state.deflection_rate_m_s);
            let carried_m = carried_m.within(lead * most);
            let load = Load {
                load_n,
                viscous: contact.viscous_n(self.lugre.a2, T::ONE),
                reach_m,
                stiffness_rate: step_s * self.lugre.sigma0 / load_n,
                drive_n,
                impedance: weights.impedance,
                inverse_impedance: weights.inverse_impedance,
                lead,
                carried_m,
            };
            let (v, balance) = self.solve(state, &load);
            (v, balance.deflection_m, balance.bristle_force_n, Some(balance.curve))
        };
        let mut branch_n = state.branch_n;
        for (branch, force_n) in self.branches.iter().zip(&mut branch_n) {
            *force_n = branch.decay * *force_n + branch.gain * (v_root - left - weights.share * v);
        }
        let deflection_rate_m_s = (deflection_m - state.deflection_m) * self.inverse_step;
        *state = SeriesState {
            deflection_rate_m_s,
            deformation_m: free_m - step_s * weights.share * v,
            deflection_m,
            tip_speed_m_s: v,
            mean_tip_speed_m_s: left + weights.share * v,
            mean_root_speed_m_s: v_root,
            last_step_s: step_s,
            branch_n,
            tip_curve,
        };
        FrictionForce { force_n, tip_speed_m_s: v }
    }

    /// The root of φ that is reached from the last tip speed without crossing another.
    ///
    /// φ has a kink at v = 0, where its value is known without any function call. Newton would
    /// jump to and fro across it, so the search keeps to the side on which the root lies.
    #[inline]
    fn solve(&self, state: &SeriesState<T, N>, load: &Load<T>) -> (T, Balance<T>) {
        let z = state.deflection_m;
        // In f32 what rounding allows; in f64 a bound that one Newton step from the last tip speed reaches in calm motion.
        let relative = (T::from_f64(4.0) * T::EPSILON).at_least(T::from_f64(1e-12));
        let tolerance = relative * (load.drive_n.abs() + load.load_n);
        let resting_m = load.carried_m / load.lead;
        let at_rest = self.lugre.sigma0 * resting_m + self.sigma1_per_step * (resting_m - z) - load.drive_n;
        let mut v = state.tip_speed_m_s;
        let curve = state.tip_curve.unwrap_or_else(|| self.lugre.stribeck.coefficient_and_slope(v));
        // A state belongs to the element that stepped it.
        debug_assert!(!v.is_finite() || curve == self.lugre.stribeck.coefficient_and_slope(v));
        let mut at = self.balance_on(curve, z, load, v);
        if at.value.abs() <= tolerance {
            return (v, at);
        }
        let rising = at.value < T::ZERO;
        let crosses =
            if rising { v < T::ZERO && at_rest < T::ZERO } else { v > T::ZERO && at_rest > T::ZERO };
        if crosses {
            v = if rising { T::ZERO } else { -T::ZERO };
            at = self.balance(z, load, v);
            // Where only rounding says that the root lies beyond, it lies here: no search would find it.
            if at.value.abs() <= tolerance {
                return (v, at);
            }
        }
        // |bristle force| never exceeds its stored or its steady value, so the root lies within.
        let reach = self.lugre.sigma0 + self.sigma1_per_step;
        let strongest =
            reach * (z.abs() + load.carried_m.abs() + load.reach_m * self.lugre.stribeck.largest());
        let margin = strongest * load.inverse_impedance;
        let centre = load.drive_n * load.inverse_impedance;
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

impl<T: Real> SeriesParameters<T> {
    /// In the order of [`Element::PARAMETERS`].
    pub(super) fn values(&self) -> [T; 10] {
        let [a, b, c, d, e, f, g, h] = self.bristles.values();
        [a, b, c, d, e, f, g, h, self.k_u_n_per_m, self.c_u_n_s_per_m]
    }

    /// From as many values in that order.
    pub(super) fn from_values(values: &[T]) -> Result<Self, ParameterError> {
        let [bristles @ .., k_u_n_per_m, c_u_n_s_per_m] = exactly::<T, 10>(values)?;
        let bristles = LugreParameters::from_values(&bristles)?;
        Ok(Self { k_u_n_per_m, c_u_n_s_per_m, bristles })
    }
}

impl<T: Real> FrictionModel<T> {
    /// A series element.
    pub fn series(p: &SeriesParameters<T>, step_s: T) -> Result<Self, ParameterError> {
        Series::new(p, step_s).map(Self::Series)
    }
}

impl<T: Real, const N: usize> SeriesState<T, N> {
    /// Of the block.
    pub(super) fn deformation_m(&self) -> T {
        self.deformation_m
    }
}

/// Built by its own numbers, an element's branches carry nothing.
impl<T: Real, const N: usize> Element<T> for Series<T, N> {
    type State = SeriesState<T, N>;

    const PARAMETERS: &'static [ParameterSpec] = &and_bristles::<2, 10>([
        ParameterSpec::required("k_u_n_per_m", 3e4).searched(1e3, 1e6).extensive(),
        ParameterSpec::required("c_u_n_s_per_m", 160.0).searched(2.0, 1e4).extensive(),
    ]);

    fn build(values: &[T], step_s: T) -> Result<Self, ParameterError> {
        let parameters = SeriesParameters::from_values(values)?;
        Self::with_branches(&parameters, [(T::ZERO, T::ONE); N], step_s)
    }

    fn rest(&self) -> SeriesState<T, N> {
        SeriesState::default()
    }

    /// Its branches are relaxed.
    fn holding(&self, force_n: T, contact: &Contact<T>) -> SeriesState<T, N> {
        let held = force_n.within(contact.load_n() * self.lugre.stribeck.largest());
        SeriesState {
            deformation_m: held / self.k_u,
            deflection_m: held * self.lugre.inverse_sigma0,
            tip_speed_m_s: contact.sliding_speed_m_s,
            mean_tip_speed_m_s: contact.sliding_speed_m_s,
            mean_root_speed_m_s: contact.sliding_speed_m_s,
            ..SeriesState::default()
        }
    }

    #[inline]
    fn set_step_s(&mut self, step_s: T) {
        self.set_step_s(step_s);
    }

    #[inline]
    fn step(&self, state: &mut SeriesState<T, N>, contact: &Contact<T>) -> FrictionForce<T> {
        self.step(state, contact)
    }

    fn deformation_m(state: &SeriesState<T, N>) -> T {
        state.deformation_m
    }

    fn largest_coefficient(&self) -> T {
        self.lugre.stribeck.largest()
    }

    /// Against a motion too quick for the branches to relax.
    fn sticking_stiffness_n_per_m(&self, _load_n: T) -> T {
        self.branches.iter().fold(self.k_u, |sum, branch| sum + branch.stiffness)
    }

    fn stribeck(&self) -> Option<&Stribeck<T>> {
        Some(&self.lugre.stribeck)
    }

    fn block_time_s(&self) -> Option<T> {
        Some(self.c_u / self.sticking_stiffness_n_per_m(T::ZERO))
    }
}
