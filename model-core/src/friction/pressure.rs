//! Normal force over the contact patch, F_N(s): what each place of a patch bears.
//!
//! As printed, eqs. 15 and 19 have no load in the deflection, so u(s) of a LuGre patch is the same under every distribution,
//! and only the sum changes: F = Σ w_i F_N (σ0 u_i + a2 v_r), Σ w_i = 1. With x = s/L:
//!
//! * uniform: w ∝ 1;
//! * parabolic: w ∝ 6 x (1 − x), a round tyre at rest;
//! * trapezoidal: rises over the share `edge` of the length, holds, and falls over the same share: a loaded tyre with stiff
//!   carcass.
//!
//! Source of the forms: C. Canudas-de-Wit, P. Tsiotras, E. Velenis, M. Basset, G. Gissinger, "Dynamic friction models for
//! road/tire longitudinal interaction", Vehicle System Dynamics 39 (2003) 189–226, section 4. Weights are integrals over
//! each element, exact whatever their number.
//!
//! Left out: the shift of the distribution under a brake torque.

use super::contact::Contact;
use super::lugre_patch::{LugrePatch, PatchState};
use crate::error::{ParameterError, require};
use crate::real::Real;

/// Form of F_N(s).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Pressure<T> {
    /// The same everywhere.
    #[default]
    Uniform,
    /// Zero at both ends, 1.5 of the mean in the middle.
    Parabolic,
    /// Zero at both ends, constant between.
    Trapezoidal {
        /// Share of the length over which it rises, and over which it falls, 0 to ½.
        edge: T,
    },
}

impl<T: Real> Pressure<T> {
    /// Checks the numbers of the form.
    ///
    /// # Errors
    /// An edge out of range.
    pub fn checked(self) -> Result<Self, ParameterError> {
        if let Self::Trapezoidal { edge } = self {
            require("edge", edge, edge > T::ZERO && edge <= T::HALF, "above 0 and up to 0.5 of the length")?;
        }
        Ok(self)
    }

    /// Share of the load on the part of the patch from its begin to x = s/L.
    pub fn up_to(&self, x: T) -> T {
        let (two, three) = (T::ONE + T::ONE, T::ONE + T::ONE + T::ONE);
        match *self {
            Self::Uniform => x,
            Self::Parabolic => x * x * (three - two * x),
            Self::Trapezoidal { edge } => {
                let height = T::ONE / (T::ONE - edge);
                let ramp = |x: T| T::HALF * height * x * x / edge;
                if x < edge {
                    ramp(x)
                } else if x > T::ONE - edge {
                    T::ONE - ramp(T::ONE - x)
                } else {
                    T::HALF * height * edge + height * (x - edge)
                }
            }
        }
    }

    /// Share of the load on each of `N` equal elements; the sum is one.
    #[must_use]
    pub fn weights<const N: usize>(&self) -> [T; N] {
        #[allow(clippy::cast_precision_loss)]
        let place = |k: usize| T::from_f64(k as f64 / N as f64);
        core::array::from_fn(|k| self.up_to(place(k + 1)) - self.up_to(place(k)))
    }
}

impl<T: Real, const N: usize> LugrePatch<T, N> {
    /// Friction force of a deflected patch whose elements bear these shares of the load, N. For equal shares it is what
    /// [`LugrePatch::step`] returned.
    pub fn force_under_n(&self, state: &PatchState<T, N>, contact: &Contact<T>, weights: &[T; N]) -> T {
        let borne = state.deflection_m.iter().zip(weights).fold(T::ZERO, |sum, (u, w)| sum + *u * *w);
        let load_n = contact.load_n();
        load_n * (self.stiffness_per_m() * borne)
            + contact.viscous_n(self.viscous_s_per_m(), contact.sliding_speed_m_s)
    }
}

#[cfg(test)]
mod tests {
    use super::super::lugre_patch::PatchParameters;
    use super::super::stribeck::StribeckParameters;
    use super::*;

    const FORMS: [Pressure<f64>; 4] = [
        Pressure::Uniform,
        Pressure::Parabolic,
        Pressure::Trapezoidal { edge: 0.1 },
        Pressure::Trapezoidal { edge: 0.5 },
    ];

    #[test]
    fn the_shares_add_up_to_one_and_are_symmetric() {
        for form in FORMS {
            let w = form.weights::<25>();
            assert!((w.iter().sum::<f64>() - 1.0).abs() < 1e-14, "{form:?}");
            assert!((0..25).all(|k| w[k] > 0.0 && (w[k] - w[24 - k]).abs() < 1e-14), "{form:?}");
        }
        assert!((Pressure::<f64>::Parabolic.weights::<25>()[12] * 25.0 - 1.5).abs() < 3e-3);
        assert!(Pressure::Trapezoidal { edge: 0.6 }.checked().is_err());
    }

    /// Steady friction by the closed form u(s) = (g/σ0)(1 − e^{−s/Z}), integrated over each form by Simpson's rule.
    #[test]
    fn steady_friction_under_each_form_is_the_integral_of_the_closed_form() {
        let stribeck = StribeckParameters { a0: 0.8, a1: 0.75, v0_m_s: 6.57, delta: 0.5, theta: 1.0 };
        let p = PatchParameters {
            sigma0_per_m: 181.54,
            a2_s_per_m: 0.0,
            stribeck,
            length_m: 0.2,
            largest_transport_speed_m_s: 20.0,
        };
        let patch = LugrePatch::<f64, 400>::new(&p, 1e-4).unwrap();
        let (roll, v) = (10.0, 0.5);
        let contact = Contact::new(v, 1000.0);
        let mut state = PatchState::default();
        let mut stepped = 0.0;
        for _ in 0..2000 {
            stepped = patch.step(&mut state, &contact, roll);
        }
        let g = 0.8 + 0.75 * (-(v / 6.57f64).sqrt()).exp();
        let reach_m = g * roll / (181.54 * v);
        for form in FORMS {
            let density = |x: f64| match form {
                Pressure::Uniform => 1.0,
                Pressure::Parabolic => 6.0 * x * (1.0 - x),
                Pressure::Trapezoidal { edge } => (x / edge).min((1.0 - x) / edge).min(1.0) / (1.0 - edge),
            };
            let n = 2000;
            let simpson = (0..=n).map(|k| {
                let x = f64::from(k) / f64::from(n);
                let weight = if k == 0 || k == n { 1.0 } else { 2.0 + 2.0 * f64::from(k % 2) };
                weight * density(x) * g * (1.0 - (-x * 0.2 / reach_m).exp())
            });
            let exact = 1000.0 * simpson.sum::<f64>() / (3.0 * f64::from(n));
            let found = patch.force_under_n(&state, &contact, &form.weights());
            assert!((found / exact - 1.0).abs() < 5e-3, "{form:?}: {found} {exact}");
        }
        assert!(
            (patch.force_under_n(&state, &contact, &Pressure::Uniform.weights()) / stepped - 1.0).abs()
                < 1e-12
        );
    }
}
