//! Rate-and-state friction under an elastic block: what rock mechanics says in place of asperities that bend.
//!
//! F = F_N µ(V, θ),  µ = a asinh(V/(2 V0) · exp((µ0 + b ψ)/a)),  ψ = ln(V0 θ/D_c)
//!
//! [`Dieterich`] (ageing): θ̇ = 1 − V θ/D_c.  [`Ruina`] (slip): θ̇ = −(V θ/D_c) ln(V θ/D_c).
//!
//! k_u u + c_u u̇ = F,  u̇ = v_r − V. In steady sliding µ = µ0 + (a − b) ln(V/V0): it falls with speed where b > a. A
//! change of speed meets the direct effect a at once and the fall after a *distance* D_c; a rest makes the contact
//! stronger with the logarithm of its time. **Load steps** (`load_memory`, Linker and Dieterich's α, 0 for none): a change
//! of load changes θ̇ by −(α/b) θ Ṅ/N, so friction follows a load step only after a distance of the order of D_c, too.
//!
//! Sources: J. Dieterich, J. Geophysical Research 84 (1979) 2161; A. Ruina, J. Geophysical Research 88 (1983) 10359;
//! regularised at V = 0 after J. Rice and Y. Ben-Zion, Proc. Nat. Acad. Sci. 93 (1996) 3811; load: M. Linker and J.
//! Dieterich, J. Geophysical Research 97 (1992) 4923. V0 = 0.1 m/s, so µ0 is friction at that speed.
//!
//! **Step**: ψ exact for a held V; with that ψ the balance of block and contact is one equation in V that rises
//! strictly and is convex in ln V: Newton from above finds its only root. u by the trapezoidal rule. A contact begins
//! as if it had crept at 0.1 mm/s.
//!
//! Left out: melting, and any elasticity of the contact itself (the block has it).

use super::contact::{Contact, FrictionForce};
use super::element::{Element, ParameterSpec, exactly};
use super::lugre::require_step;
use crate::error::{ParameterError, require};
use crate::real::Real;

/// Speed V0 at which µ0 holds, m/s.
pub const REFERENCE_SPEED_M_S: f64 = 0.1;
/// ψ of a contact that creeps at 0.1 mm/s.
const FIRST_PSI: f64 = 6.907_755;
/// ln(V/2V0) below which nothing moves: 1e-26 of V0.
const STILL: f64 = -60.0;
/// Newton steps at most; five are usual.
const MOST_ITERATIONS: u32 = 40;

/// How the state evolves at a held speed.
pub trait Law: Copy + core::fmt::Debug + PartialEq {
    /// ψ after sliding for `reach` = V Δt/D_c at ln(V0/V) = `slow`.
    fn evolved<T: Real>(psi: T, reach: T, slow: T, rest: T) -> T;
}

/// Ageing law.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ageing;

/// Slip law.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Slip;

impl Law for Ageing {
    fn evolved<T: Real>(psi: T, reach: T, slow: T, rest: T) -> T {
        let gone = -(-reach).exp_m1();
        if reach < T::from_f64(1e-4) {
            // θ⁺ = θ (1 − reach) + Δt, in ψ; without V in a denominator.
            let added = rest * (-psi).exp();
            return psi + (added - reach).ln_1p();
        }
        // θ⁺ = θ e^{−reach} + (D_c/V)(1 − e^{−reach})
        psi + ((slow - psi).exp() * gone - gone).ln_1p()
    }
}

impl Law for Slip {
    fn evolved<T: Real>(psi: T, reach: T, slow: T, _rest: T) -> T {
        psi - (-reach).exp_m1() * (slow - psi)
    }
}

/// Rate-and-state contact under a block, prepared for a step size.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RateState<T, L> {
    k_u: T,
    c_u: T,
    mu_0: T,
    a: T,
    b: T,
    inverse_distance: T,
    load_memory_per_b: T,
    step_s: T,
    law: L,
}

/// With the ageing law.
pub type Dieterich<T> = RateState<T, Ageing>;

/// With the slip law.
pub type Ruina<T> = RateState<T, Slip>;

/// State of the contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RateStateState<T> {
    /// Block deformation u, m.
    pub deformation_m: T,
    /// Sliding speed V of the contact at the end of the last step, m/s.
    pub tip_speed_m_s: T,
    /// ψ = ln(V0 θ/D_c).
    pub psi: T,
    /// Load of the last step, N; 0 before the first.
    pub load_n: T,
    /// Mean speed of the root over the last step, m/s; `None` before the first.
    pub root_speed_m_s: Option<T>,
}

impl<T: Real, L: Law> RateState<T, L> {
    fn new(values: &[T], step_s: T, law: L) -> Result<Self, ParameterError> {
        let [k_u, c_u, mu_0, a, b, d_c, load_memory] = exactly(values)?;
        let between = |name, value: T, low: f64, high: f64, allowed| {
            require(name, value, value >= T::from_f64(low) && value <= T::from_f64(high), allowed)
        };
        let b = between("b", b, 1e-4, 1.0, "1e-4 to 1")?;
        Ok(Self {
            k_u: between("k_u_n_per_m", k_u, 1.0, 1e9, "1 to 1e9 N/m")?,
            c_u: between("c_u_n_s_per_m", c_u, 1e-3, 1e6, "1e-3 to 1e6 N s/m")?,
            mu_0: between("mu_0", mu_0, 1e-3, 10.0, "1e-3 to 10")?,
            a: between("a", a, 1e-4, 1.0, "1e-4 to 1")?,
            b,
            inverse_distance: T::ONE / between("d_c_m", d_c, 1e-8, 10.0, "1e-8 to 10 m")?,
            load_memory_per_b: between("load_memory", load_memory, 0.0, 2.0, "0 to 2")? / b,
            step_s: require_step(step_s)?,
            law,
        })
    }

    fn evolved(&self, psi: T, speed_m_s: T, step_s: T) -> T {
        let speed = speed_m_s.abs().at_least(T::from_f64(1e-12));
        let slow = T::from_f64(libm::log(REFERENCE_SPEED_M_S)) - speed.ln();
        let rest = step_s * T::from_f64(REFERENCE_SPEED_M_S) * self.inverse_distance;
        L::evolved(psi, step_s * speed * self.inverse_distance, slow, rest)
    }

    /// asinh(eˣ) and its slope over x, without overflow.
    fn asinh_exp(x: T) -> (T, T) {
        if x > T::ZERO {
            let small = (T::ZERO - x - x).exp();
            let root = (T::ONE + small).sqrt();
            (x + (T::ONE + root).ln(), T::ONE / root)
        } else {
            let w = x.exp();
            let root = (T::ONE + w * w).sqrt();
            ((w + w * w / (T::ONE + root)).ln_1p(), w / root)
        }
    }

    /// V ≥ 0 with F_N µ(V, ψ) + Z V = `drive_n` ≥ 0.
    fn speed(&self, psi: T, load_n: T, impedance: T, drive_n: T) -> T {
        let twice = T::from_f64(2.0 * REFERENCE_SPEED_M_S);
        let strength = (self.mu_0 + self.b * psi) / self.a;
        let direct_n = load_n * self.a;
        // Each term alone gives an upper bound of ln(V/2V0).
        let level = drive_n / direct_n;
        // ln sinh x = x + ln((1 − e^{−2x})/2)
        let gone = -(-(level + level)).exp_m1();
        let by_friction = level + (T::HALF * gone).ln() - strength;
        let by_damping = (drive_n / (impedance * twice)).ln();
        let mut y = by_friction.at_most(by_damping);
        if y <= T::from_f64(STILL) || !y.is_finite() {
            return T::ZERO;
        }
        for _ in 0..MOST_ITERATIONS {
            let (value, slope) = Self::asinh_exp(y + strength);
            let damping_n = impedance * twice * y.exp();
            let move_by = (direct_n * value + damping_n - drive_n) / (direct_n * slope + damping_n);
            y -= move_by;
            if move_by.abs() <= T::from_f64(4.0) * T::EPSILON * y.abs().at_least(T::ONE) {
                break;
            }
        }
        twice * y.exp()
    }

    fn rest_state() -> RateStateState<T> {
        RateStateState {
            deformation_m: T::ZERO,
            tip_speed_m_s: T::ZERO,
            psi: T::from_f64(FIRST_PSI),
            load_n: T::ZERO,
            root_speed_m_s: None,
        }
    }

    fn advance(&self, state: &mut RateStateState<T>, contact: &Contact<T>) -> FrictionForce<T> {
        let (root, load_n) = (contact.sliding_speed_m_s, contact.load_n());
        let before = state.tip_speed_m_s;
        let half = T::HALF * self.step_s;
        let free_m = state.deformation_m + self.step_s * root - half * before;
        // Speed of the root at the end of the step, from its means over two steps.
        let root_end = state.root_speed_m_s.map_or(root, |last| root + T::HALF * (root - last));
        let drive_n = self.k_u * free_m + self.c_u * root_end;
        let impedance = self.k_u * half + self.c_u;
        let (speed, psi) = if load_n <= T::ZERO {
            (drive_n / impedance, T::from_f64(FIRST_PSI))
        } else {
            let mut psi = state.psi;
            if state.load_n > T::ZERO {
                psi -= self.load_memory_per_b * (load_n / state.load_n).ln();
            }
            // ψ at the end for the speed before; then again for the mean of both speeds.
            let guess = self.evolved(psi, before, self.step_s);
            let speed = self.speed(guess, load_n, impedance, drive_n.abs());
            let mean = T::HALF * (before.abs() + speed);
            let psi = self.evolved(psi, mean, self.step_s);
            (self.speed(psi, load_n, impedance, drive_n.abs()).copysign(drive_n), psi)
        };
        *state = RateStateState {
            deformation_m: free_m - half * speed,
            tip_speed_m_s: speed,
            psi,
            load_n: load_n.at_least(T::ZERO),
            root_speed_m_s: Some(root),
        };
        let force_n = if load_n <= T::ZERO { T::ZERO } else { drive_n - impedance * speed };
        FrictionForce { force_n, tip_speed_m_s: speed }
    }
}

const PARAMETERS: &[ParameterSpec] = &[
    ParameterSpec::required("k_u_n_per_m", 3e4).searched(1e3, 1e6).extensive(),
    ParameterSpec::required("c_u_n_s_per_m", 20.0).searched(0.1, 1e4).extensive(),
    ParameterSpec::required("mu_0", 0.95).searched(0.02, 5.0),
    ParameterSpec::required("a", 0.05).searched(1e-3, 0.5),
    ParameterSpec::required("b", 0.12).searched(1e-3, 0.8),
    ParameterSpec::required("d_c_m", 3e-4).searched(1e-6, 1e-1),
    ParameterSpec::optional("load_memory", 0.0).searched(0.0, 1.0),
];

macro_rules! element {
    ($law:ident) => {
        impl<T: Real> Element<T> for RateState<T, $law> {
            type State = RateStateState<T>;

            const PARAMETERS: &'static [ParameterSpec] = PARAMETERS;

            fn build(values: &[T], step_s: T) -> Result<Self, ParameterError> {
                Self::new(values, step_s, $law)
            }

            fn rest(&self) -> RateStateState<T> {
                Self::rest_state()
            }

            fn holding(&self, force_n: T, contact: &Contact<T>) -> RateStateState<T> {
                let most_n = contact.load_n() * Element::largest_coefficient(self);
                RateStateState {
                    deformation_m: force_n.within(most_n) / self.k_u,
                    tip_speed_m_s: contact.sliding_speed_m_s,
                    ..Self::rest_state()
                }
            }

            fn set_step_s(&mut self, step_s: T) {
                self.step_s = step_s;
            }

            fn step(&self, state: &mut RateStateState<T>, contact: &Contact<T>) -> FrictionForce<T> {
                self.advance(state, contact)
            }

            fn deformation_m(state: &RateStateState<T>) -> T {
                state.deformation_m
            }

            /// After creep at 1 µm/s, slid at 1 m/s: the model itself has no bound.
            fn largest_coefficient(&self) -> T {
                let decades = |n: f64| T::from_f64(n * core::f64::consts::LN_10);
                self.mu_0 + self.a * decades(1.0) + self.b * decades(5.0)
            }

            fn sticking_stiffness_n_per_m(&self, _load_n: T) -> T {
                self.k_u
            }

            fn block_time_s(&self) -> Option<T> {
                Some(self.c_u / self.k_u)
            }
        }
    };
}

element!(Ageing);
element!(Slip);
