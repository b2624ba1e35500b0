//! Force between the elements and the disc, in fixed small steps.
//!
//! Bristles: ż = v − |v| z/q with q = F_N µ(v)/σ0; force σ0 z + σ1 ż + F_N a2 v.
//! - LuGre: v is the sliding speed itself; z by backward Euler.
//! - Series: a massless block between disc and bristles, v = v_r − u̇, and
//!   block(u, u̇) = bristle force. Backward Euler turns this into one equation in v, solved by Newton's
//!   method from the last step's v, so that the root stays on its branch; where the branch ends (the
//!   fold of stick-slip) a search outwards finds the nearest root.
//! - Modified LuGre: s = v_r − u̇ with s µ(s) = σ0 |v_r| u/F_N; backward Euler, one root.
//!
//! The block may have Maxwell branches (creep) and a spring that is not linear; the baseline has neither.
//! Accuracy: first order. At 25 µs the error of a transient is a shift in time of about 12 µs.
//! Left out: the extent of the contact patch, and the mass of block and tip.

use crate::curve::Curve;
use crate::laws::block::{Branch, Spring};
use crate::laws::film::Film;
use crate::rig::Friction;
use crate::scenario::Base;

/// Normal force below which there is no contact.
const LIFTED_N: f64 = 1e-6;
/// Newton steps before the search for a bracket starts.
const NEWTON_STEPS: usize = 12;

/// What the contact feels during one step.
#[derive(Debug, Clone, Copy)]
pub struct Touch {
    /// Sliding speed of the disc under the elements' roots.
    pub root_speed_m_s: f64,
    /// Normal force.
    pub normal_n: f64,
    /// Factor on the coefficient of friction.
    pub scale: f64,
}

/// Contact with its state.
#[derive(Debug, Clone)]
pub struct Contact {
    base: Base,
    step_s: f64,
    sigma0: f64,
    sigma1: f64,
    a2: f64,
    k_u: f64,
    c_u: f64,
    block_spring: Spring,
    curve: Curve,
    film: Option<Film>,
    branches: Vec<(Branch, f64)>,
    bristle_m: f64,
    block_m: f64,
    tip_speed_m_s: f64,
    force_n: f64,
}

impl Contact {
    /// A contact at rest without load.
    #[must_use]
    pub fn new(friction: &Friction, curve: Curve, step_s: f64) -> Self {
        Self {
            base: friction.base,
            step_s,
            sigma0: friction.sigma0_n_per_m,
            sigma1: friction.sigma1_n_s_per_m,
            a2: friction.a2_s_per_m,
            k_u: friction.k_u_n_per_m,
            c_u: friction.c_u_n_s_per_m,
            block_spring: Spring::Linear,
            curve,
            film: None,
            branches: Vec::new(),
            bristle_m: 0.0,
            block_m: 0.0,
            tip_speed_m_s: 0.0,
            force_n: 0.0,
        }
    }

    /// Adds a dragging film.
    #[must_use]
    pub fn with_film(mut self, film: Option<Film>) -> Self {
        self.film = film;
        self
    }

    /// Makes the block creep, and gives it this spring.
    #[must_use]
    pub fn with_block(mut self, branches: &[Branch], spring: Spring) -> Self {
        self.branches = branches.iter().map(|branch| (*branch, 0.0)).collect();
        self.block_spring = spring;
        self
    }

    /// Force on the elements, > 0 for positive sliding.
    #[must_use]
    pub fn force_n(&self) -> f64 {
        self.force_n
    }

    /// Speed at which the tips slide.
    #[must_use]
    pub fn tip_speed_m_s(&self) -> f64 {
        self.tip_speed_m_s
    }

    /// One step; returns the force.
    pub fn step(&mut self, touch: &Touch) -> f64 {
        self.force_n = match self.base {
            Base::Series => self.step_series(touch),
            Base::ModifiedLugre => self.step_modified(touch),
            Base::Lugre | Base::BySeed => self.step_lugre(touch),
        };
        self.force_n
    }

    fn film_at(&self, v: f64, normal: f64) -> (f64, f64) {
        self.film.map_or((0.0, 0.0), |film| film.at(v, normal))
    }

    fn step_lugre(&mut self, touch: &Touch) -> f64 {
        let v = touch.root_speed_m_s;
        self.tip_speed_m_s = v;
        if touch.normal_n < LIFTED_N {
            self.bristle_m = 0.0;
            return 0.0;
        }
        let q = touch.normal_n * touch.scale * self.curve.at(v).0 / self.sigma0;
        let next = (self.bristle_m + self.step_s * v) * q / (q + self.step_s * v.abs());
        let rate = (next - self.bristle_m) / self.step_s;
        self.bristle_m = next;
        self.sigma0 * next
            + self.sigma1 * rate
            + touch.normal_n * self.a2 * v
            + self.film_at(v, touch.normal_n).0
    }

    fn step_series(&mut self, touch: &Touch) -> f64 {
        let h = self.step_s;
        if touch.normal_n < LIFTED_N {
            // The free block springs back against its own damping.
            self.bristle_m = 0.0;
            let (force, slope) = self.spring(self.block_m);
            let rate = -force / (self.c_u + h * slope);
            self.block_m += h * rate;
            for (branch, force) in &mut self.branches {
                *force = (*force + branch.stiffness_n_per_m * h * rate) / (1.0 + h / branch.relaxation_s);
            }
            self.tip_speed_m_s = touch.root_speed_m_s - rate;
            return 0.0;
        }
        let v = self.solve_tip_speed(touch);
        let rate = touch.root_speed_m_s - v;
        self.bristle_m = self.next_bristle(v, touch).0;
        for (branch, force) in &mut self.branches {
            *force = (*force + branch.stiffness_n_per_m * h * rate) / (1.0 + h / branch.relaxation_s);
        }
        self.block_m += h * rate;
        self.tip_speed_m_s = v;
        let creep: f64 = self.branches.iter().map(|(_, force)| force).sum();
        self.spring(self.block_m).0 + self.c_u * rate + creep
    }

    fn spring(&self, u: f64) -> (f64, f64) {
        let (force, slope) = self.block_spring.at(u);
        (self.k_u * force, self.k_u * slope)
    }

    /// Bristle deformation after the step if the tips slide at `v`, and its derivative.
    fn next_bristle(&self, v: f64, touch: &Touch) -> (f64, f64) {
        let h = self.step_s;
        let (g, slope) = self.curve.at(v);
        let per_g = touch.normal_n * touch.scale / self.sigma0;
        let (q, dq) = (per_g * g, per_g * slope);
        let pushed = self.bristle_m + h * v;
        let room = q + h * v.abs();
        let next = pushed * q / room;
        (next, (h * q + pushed * dq) / room - next * (dq + h * v.signum()) / room)
    }

    /// Block force minus tip force if the tips slide at `v`, and its derivative.
    fn imbalance(&self, v: f64, touch: &Touch) -> (f64, f64) {
        let h = self.step_s;
        let rate = touch.root_speed_m_s - v;
        let (spring, stiffness) = self.spring(self.block_m + h * rate);
        let mut block = spring + self.c_u * rate;
        let mut slope = -stiffness * h - self.c_u;
        for (branch, force) in &self.branches {
            let fade = 1.0 + h / branch.relaxation_s;
            block += (force + branch.stiffness_n_per_m * h * rate) / fade;
            slope -= branch.stiffness_n_per_m * h / fade;
        }
        let (next, dnext) = self.next_bristle(v, touch);
        let (film, dfilm) = self.film_at(v, touch.normal_n);
        let tip = self.sigma0 * next
            + self.sigma1 * (next - self.bristle_m) / h
            + touch.normal_n * self.a2 * v
            + film;
        let dtip = (self.sigma0 + self.sigma1 / h) * dnext + touch.normal_n * self.a2 + dfilm;
        (block - tip, slope - dtip)
    }

    fn solve_tip_speed(&self, touch: &Touch) -> f64 {
        let mut v = self.tip_speed_m_s;
        for _ in 0..NEWTON_STEPS {
            let (miss, slope) = self.imbalance(v, touch);
            if slope >= 0.0 {
                break;
            }
            let change = miss / slope;
            v -= change;
            if change.abs() < 1e-10 + 1e-9 * v.abs() {
                return v;
            }
        }
        self.search_tip_speed(touch)
    }

    /// Nearest sign change around the last tip speed, then bisection.
    fn search_tip_speed(&self, touch: &Touch) -> f64 {
        let start = self.tip_speed_m_s;
        let at_start = self.imbalance(start, touch).0;
        // The imbalance falls with v, so the sign tells on which side the root must exist.
        let side = at_start.signum();
        let (mut near, mut reach) = (start, 1e-7);
        let mut far = start + side * reach;
        while self.imbalance(far, touch).0 * side > 0.0 && reach < 1e3 {
            near = far;
            reach *= 1.5;
            far = start + side * reach;
        }
        for _ in 0..60 {
            let middle = 0.5 * (near + far);
            if self.imbalance(middle, touch).0 * side > 0.0 {
                near = middle;
            } else {
                far = middle;
            }
        }
        0.5 * (near + far)
    }

    fn step_modified(&mut self, touch: &Touch) -> f64 {
        let (h, root) = (self.step_s, touch.root_speed_m_s);
        self.tip_speed_m_s = root;
        if touch.normal_n < LIFTED_N {
            self.bristle_m = 0.0;
            return 0.0;
        }
        let per_g = touch.normal_n * touch.scale / self.sigma0;
        let pull = root.abs();
        // s µ(s) per_g = |v_r| (u + h (v_r − s)) has one root, between these two.
        let miss = |s: f64| s * self.curve.at(s).0 * per_g - pull * (self.bristle_m + h * (root - s));
        let ends = root + self.bristle_m / h;
        let (mut low, mut high) = (ends.min(0.0), ends.max(0.0));
        let mut s = (self.bristle_m / per_g).clamp(low, high);
        for _ in 0..60 {
            let value = miss(s);
            if value > 0.0 {
                high = s;
            } else {
                low = s;
            }
            let (g, slope) = self.curve.at(s);
            let step = value / ((g + s * slope) * per_g + pull * h);
            let next = s - step;
            let next = if next > low && next < high { next } else { 0.5 * (low + high) };
            let done = (next - s).abs() < 1e-12 + 1e-10 * s.abs();
            s = next;
            if done {
                break;
            }
        }
        self.bristle_m += h * (root - s);
        self.sigma0 * self.bristle_m
    }
}
