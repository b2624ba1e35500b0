//! The modified LuGre model as printed, eqs. 17–19.
//!
//! ∂u/∂t = v_r − σ0 |v_r| u / (F_N g(s)) − rω ∂u/∂x,   s = v_r − ∂u/∂t
//!
//! g is evaluated at s, which holds the rate that is sought, so a step is an implicit equation. Eq. 18 as typeset
//! is ambiguous; it is read as exp(−(|v_r − ∂u/∂t|/v0)^δ), consistent with eq. 13. Eqs. 15 and 19 drop
//! F_N; here σ0 is in N/m and F_N is kept, so that the parameters are those of the LuGre model. As in the
//! rest of the project the road factor θ of eq. 13 multiplies g alone, and so does a factor that changes in time
//! ([`Contact::road_factor`]); the viscous term F_N a2 v has neither.
//!
//! **Which rate.** A single element has one rate. In a patch there are two, and two models by name:
//! [`Scheme::Literal`] takes the rate at a place, ∂u/∂t, as printed; in steady rolling it is zero, s = v_r, and the patch
//! is LuGre's. [`Scheme::Implicit`] takes the rate of the material, Du/Dt = ∂u/∂t + rω ∂u/∂x, the speed that the
//! asperities really have; an element then does on its way through the patch what it does in time alone.
//!
//! **No overshoot of the deflection**, under a condition. For one element at constant v_r and F_N, s·g(s) = (σ0/F_N) u |v_r|.
//! Where a0 > a1 δ exp(−(1 + 1/δ)) (δ = ½: a0 > 0.025 a1; δ = 2: a0 > 0.45 a1) the left side rises strictly, so s is a
//! function of u, and u̇ = v_r − s(u) is scalar and autonomous: u rises monotonically to F_N g(v_r)/σ0. Outside the
//! condition there are up to three roots, u jumps between branches, may overshoot and may never settle: [`ModifiedLugre`]
//! refuses such parameters, [`Folded`] takes them and keeps to its branch. *Force is not deflection*: with σ1 > 0
//! the force overshoots where σ1 v_r > F_N g, as LuGre's does.
//!
//! The paper prints an overshoot. g at the previous step's rate ([`Scheme::Lagged`]) makes one with a coarse step, and a
//! physical lag of s makes one at any step; which of them the authors had, they do not say.

use super::FrictionModel;
use super::contact::{Contact, FrictionForce};
use super::element::{Element, ParameterSpec, curve_and_stiffness_of, does_what};
use super::lugre::{self, Lugre, LugreParameters, LugreState};
use super::stribeck::Stribeck;
use crate::error::{ParameterError, require};
use crate::real::Real;

/// How the implicit equation is treated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Scheme {
    /// Backward Euler with the implicit equation solved for its one root; s = v_r − Du/Dt.
    #[default]
    Implicit,
    /// The same with s = v_r − ∂u/∂t, as printed. They differ in a patch only.
    Literal,
    /// g at the previous step's u̇, explicit. Kept to show the overshoot it makes; do not use.
    Lagged,
}

/// Modified LuGre model, prepared for a step size.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ModifiedLugre<T> {
    bristles: Lugre<T>,
    inverse_step: T,
    scheme: Scheme,
    several_roots: bool,
}

/// State of the modified LuGre model.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ModifiedLugreState<T> {
    /// Deflection u, m.
    pub deflection_m: T,
    /// Its last rate u̇, m/s.
    pub rate_m_s: T,
    /// s of the last step, m/s: tells on which branch the element is.
    pub tip_speed_m_s: T,
}

/// Newton or bisection steps of the scalar equation; eight are usual at most.
const MOST_ITERATIONS: u32 = 40;

impl<T: Real> ModifiedLugre<T> {
    /// Prepares the model for a step of `step_s` seconds, or names the parameter out of range.
    ///
    /// Parameters for which the implicit equation could have several roots are refused under the
    /// name `a0`.
    pub fn new(p: &LugreParameters<T>, step_s: T) -> Result<Self, ParameterError> {
        let model = Self::any(p, step_s)?;
        let allowed = "a0 > a1 delta exp(-(1 + 1/delta)), else several roots (then kind modified_lugre_fold)";
        require("a0", p.stribeck.a0, !model.several_roots, allowed)?;
        Ok(model)
    }

    /// As [`Self::new`] with parameters that may allow several roots.
    fn any(p: &LugreParameters<T>, step_s: T) -> Result<Self, ParameterError> {
        let bristles = Lugre::new(p, step_s)?;
        let several_roots = !bristles.stribeck.momentum_rises();
        Ok(Self { bristles, inverse_step: T::ONE / step_s, scheme: Scheme::Implicit, several_roots })
    }

    /// The same model with another treatment of the implicit equation.
    #[must_use]
    pub fn with_scheme(self, scheme: Scheme) -> Self {
        Self { scheme, ..self }
    }

    /// Changes the step size, s, for unevenly sampled inputs. The caller keeps it positive.
    #[inline]
    pub fn set_step_s(&mut self, step_s: T) {
        self.bristles.set_step_s(step_s);
        self.inverse_step = T::ONE / step_s;
    }

    /// Largest deflection that the load allows, m.
    pub fn largest_deflection_m(&self, normal_force_n: T) -> T {
        self.bristles.largest_deflection_m(normal_force_n)
    }

    /// The curve of steady sliding.
    pub fn stribeck(&self) -> &Stribeck<T> {
        self.bristles.stribeck()
    }

    /// Advances the deflection by one step and returns the friction force.
    #[inline]
    pub fn step(&self, state: &mut ModifiedLugreState<T>, contact: &Contact<T>) -> FrictionForce<T> {
        self.step_convected(state, contact, T::ZERO, T::ZERO)
    }

    /// As [`Self::step`] for one element of a patch: `courant` = rωΔt/Δs times the difference to
    /// the element before it is carried along; `upstream_m` is that element's deflection.
    #[inline]
    pub(crate) fn step_convected(
        &self,
        state: &mut ModifiedLugreState<T>,
        contact: &Contact<T>,
        courant: T,
        upstream_m: T,
    ) -> FrictionForce<T> {
        let v = contact.sliding_speed_m_s;
        let load = contact.load_n();
        if load <= T::ZERO {
            *state = ModifiedLugreState::default();
            return FrictionForce { force_n: T::ZERO, tip_speed_m_s: v };
        }
        let u = state.deflection_m;
        let carried = u - courant * (u - upstream_m);
        let gain = self.bristles.sigma0 * v.abs() / load;
        let mut tip_speed_m_s = v - state.rate_m_s;
        let next = match self.scheme {
            // u⁺ = carried + Δt (v − s),  s g(s) = gain u⁺
            Scheme::Implicit => {
                let free = carried + self.bristles.step_s * v;
                let held = gain * self.bristles.step_s;
                let s = if self.several_roots {
                    self.root_on_branch(state.tip_speed_m_s, gain * free, held)
                } else {
                    self.root(gain * free, held)
                };
                tip_speed_m_s = s;
                // Two forms of the same number; each is free of cancellation where it is used.
                if held > T::ONE {
                    s * self.bristles.stribeck.coefficient(s) / gain
                } else {
                    free - self.bristles.step_s * s
                }
            }
            // u⁺ = u + Δt (v − s),  (s − w) g(s) = gain u⁺,  w = rω ∂u/∂x
            Scheme::Literal => {
                let (free, held) = (u + self.bristles.step_s * v, gain * self.bristles.step_s);
                let s = self.shifted_root(gain * free, held, (u - carried) * self.inverse_step);
                tip_speed_m_s = s;
                free - self.bristles.step_s * s
            }
            Scheme::Lagged => {
                let g = self.bristles.stribeck.coefficient(v - state.rate_m_s);
                carried + self.bristles.step_s * (v - gain * u / g)
            }
        };
        let rate = (next - u) * self.inverse_step;
        *state = ModifiedLugreState { deflection_m: next, rate_m_s: rate, tip_speed_m_s };
        FrictionForce {
            force_n: self.bristles.sigma0 * next
                + self.bristles.sigma1 * rate
                + contact.viscous_n(self.bristles.a2, v),
            tip_speed_m_s: v - rate,
        }
    }

    /// The root of s g(s) + b s = r; the left side rises strictly for b ≥ 0.
    #[inline]
    fn root(&self, r: T, b: T) -> T {
        let size = r.abs();
        if size == T::ZERO {
            return T::ZERO;
        }
        let mut low = size / (self.bristles.stribeck.largest() + b);
        let mut high = size / (self.bristles.stribeck.smallest() + b);
        let mut s = low;
        for _ in 0..MOST_ITERATIONS {
            let (g, slope) = self.bristles.stribeck.coefficient_and_slope(s);
            let value = s * (g + b) - size;
            if value > T::ZERO {
                high = s;
            } else {
                low = s;
            }
            let newton = s - value / (g + slope + b);
            let next = if newton >= low && newton <= high { newton } else { T::HALF * (low + high) };
            let moved = (next - s).abs();
            s = next;
            if moved <= T::from_f64(2.0) * T::EPSILON * s {
                break;
            }
        }
        s.copysign(r)
    }

    /// The root of (s − w) g(s) + b s = r; the left side rises strictly where s g(s) does and s is beyond w.
    fn shifted_root(&self, r: T, b: T, w: T) -> T {
        let end = |g: T| (r + w * g) / (g + b);
        let (one, other) = (end(self.bristles.stribeck.largest()), end(self.bristles.stribeck.smallest()));
        let (mut low, mut high) = (one.at_most(other), one.at_least(other));
        let mut s = T::HALF * (low + high);
        for _ in 0..MOST_ITERATIONS {
            let (g, _) = self.bristles.stribeck.coefficient_and_slope(s);
            // g changes slowly beside s: the next s with this g is close, and never leaves the bracket.
            let value = (s - w) * g + b * s - r;
            if value > T::ZERO {
                high = s;
            } else {
                low = s;
            }
            let held = end(g);
            let next = if held >= low && held <= high { held } else { T::HALF * (low + high) };
            let moved = (next - s).abs();
            s = next;
            if moved <= T::from_f64(2.0) * T::EPSILON * s.abs() {
                break;
            }
        }
        s
    }

    /// The root of s g(s) + b s = r that is reached from `from` without crossing another: the branch the element is
    /// on, left only where it ends.
    fn root_on_branch(&self, from: T, r: T, b: T) -> T {
        let size = r.abs();
        if size == T::ZERO {
            return T::ZERO;
        }
        let value = |s: T| s * (self.bristles.stribeck.coefficient(s) + b) - size;
        let (least, most) =
            (size / (self.bristles.stribeck.largest() + b), size / (self.bristles.stribeck.smallest() + b));
        let start = if from.sign() == r.sign() { from.abs() } else { T::ZERO };
        let mut low = start.at_least(least).at_most(most);
        let mut high = low;
        let stride = T::from_f64(1.1);
        if value(low) < T::ZERO {
            while low * stride < most && value(low * stride) < T::ZERO {
                low = low * stride;
            }
            high = (low * stride).at_most(most);
        } else {
            while high > least * stride && value(high / stride) > T::ZERO {
                high = high / stride;
            }
            low = (high / stride).at_least(least);
        }
        for _ in 0..MOST_ITERATIONS {
            let middle = T::HALF * (low + high);
            if value(middle) > T::ZERO {
                high = middle;
            } else {
                low = middle;
            }
            if high - low <= T::EPSILON * high {
                break;
            }
        }
        (T::HALF * (low + high)).copysign(r)
    }
}

impl<T: Real> ModifiedLugreState<T> {
    fn deformation_m(&self) -> T {
        self.deflection_m
    }
}

impl<T: Real> FrictionModel<T> {
    /// A modified LuGre element.
    pub fn modified_lugre(p: &LugreParameters<T>, step_s: T) -> Result<Self, ParameterError> {
        ModifiedLugre::new(p, step_s).map(Self::ModifiedLugre)
    }
}

impl<T: Real> Element<T> for ModifiedLugre<T> {
    type State = ModifiedLugreState<T>;

    const PARAMETERS: &'static [ParameterSpec] = lugre::PARAMETERS;

    fn build(values: &[T], step_s: T) -> Result<Self, ParameterError> {
        Self::new(&LugreParameters::from_values(values)?, step_s)
    }

    fn rest(&self) -> ModifiedLugreState<T> {
        ModifiedLugreState::default()
    }

    fn holding(&self, force_n: T, contact: &Contact<T>) -> ModifiedLugreState<T> {
        let LugreState { deflection_m } = Element::holding(&self.bristles, force_n, contact);
        ModifiedLugreState { deflection_m, ..ModifiedLugreState::default() }
    }

    #[inline]
    fn set_step_s(&mut self, step_s: T) {
        self.set_step_s(step_s);
    }

    #[inline]
    fn step(&self, state: &mut ModifiedLugreState<T>, contact: &Contact<T>) -> FrictionForce<T> {
        self.step(state, contact)
    }

    fn deformation_m(state: &ModifiedLugreState<T>) -> T {
        state.deflection_m
    }

    curve_and_stiffness_of!(bristles);

    fn winding_reach_m(&self, load_n: T) -> Option<T> {
        Some(self.largest_deflection_m(load_n))
    }
}

/// The modified LuGre model for every set of parameters, also where the implicit equation has several roots.
///
/// The element keeps to its branch and jumps where that ends, so its deflection may overshoot and may go on for ever
/// between two values. Where there is one root it is [`ModifiedLugre`] to rounding. Use it to see what the condition
/// is for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Folded<T>(ModifiedLugre<T>);

impl<T: Real> Element<T> for Folded<T> {
    type State = ModifiedLugreState<T>;

    const PARAMETERS: &'static [ParameterSpec] = lugre::PARAMETERS;

    fn build(values: &[T], step_s: T) -> Result<Self, ParameterError> {
        let model = ModifiedLugre::any(&LugreParameters::from_values(values)?, step_s)?;
        Ok(Self(ModifiedLugre { several_roots: true, ..model }))
    }

    does_what!(0 does, with ModifiedLugreState<T>);

    fn warning(&self) -> Option<&'static str> {
        (!self.0.stribeck().momentum_rises()).then_some(
            "a0 <= a1 delta exp(-(1 + 1/delta)): the implicit equation has several roots, the element jumps between them \
             and its deflection may overshoot or never settle",
        )
    }
}
