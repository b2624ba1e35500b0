//! Exact discretisation of a linear system ẋ = A x + B u, once when the plant is built.
//!
//! Held input: x⁺ = Φ x + Γ u, from exp([A B; 0 0] h). Input that changes linearly from u₀ to u₁ over the step
//! (first-order hold): x⁺ = Φ x + Γ₀ u₀ + Γ₁ u₁, from exp([A B 0; 0 0 1/h; 0 0 0] h). Both are exact for such
//! inputs whatever the step, so a 600 Hz mode with 2 % damping keeps its frequency and its damping.
//!
//! `nalgebra` does the matrix exponential; the step itself is plain arithmetic on small arrays.

use nalgebra::DMatrix;

/// A system of `N` states with `M` held inputs, prepared for one step size.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Held<const N: usize, const M: usize> {
    phi: [[f64; N]; N],
    gamma: [[f64; M]; N],
}

impl<const N: usize, const M: usize> Held<N, M> {
    pub(crate) fn new(a: &[[f64; N]; N], b: &[[f64; M]; N], step_s: f64) -> Self {
        let mut big = DMatrix::<f64>::zeros(N + M, N + M);
        for i in 0..N {
            for j in 0..N {
                big[(i, j)] = a[i][j] * step_s;
            }
            for j in 0..M {
                big[(i, N + j)] = b[i][j] * step_s;
            }
        }
        let e = big.exp();
        Self { phi: block(&e, 0), gamma: block(&e, N) }
    }

    #[inline]
    pub(crate) fn step(&self, x: &[f64; N], u: &[f64; M]) -> [f64; N] {
        let mut next = [0.0; N];
        for (i, out) in next.iter_mut().enumerate() {
            *out = dot(&self.phi[i], x) + dot(&self.gamma[i], u);
        }
        next
    }
}

/// A system of `N` states with one input that changes linearly over the step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Sloped<const N: usize> {
    phi: [[f64; N]; N],
    from: [f64; N],
    to: [f64; N],
}

impl<const N: usize> Sloped<N> {
    pub(crate) fn new(a: &[[f64; N]; N], b: &[f64; N], step_s: f64) -> Self {
        let mut big = DMatrix::<f64>::zeros(N + 2, N + 2);
        for i in 0..N {
            for j in 0..N {
                big[(i, j)] = a[i][j] * step_s;
            }
            big[(i, N)] = b[i] * step_s;
        }
        big[(N, N + 1)] = 1.0;
        let e = big.exp();
        let (mut from, mut to) = ([0.0; N], [0.0; N]);
        for i in 0..N {
            to[i] = e[(i, N + 1)];
            from[i] = e[(i, N)] - to[i];
        }
        Self { phi: block(&e, 0), from, to }
    }

    #[inline]
    pub(crate) fn step(&self, x: &[f64; N], u0: f64, u1: f64) -> [f64; N] {
        let mut next = [0.0; N];
        for (i, out) in next.iter_mut().enumerate() {
            *out = dot(&self.phi[i], x) + self.from[i] * u0 + self.to[i] * u1;
        }
        next
    }
}

#[inline]
fn dot<const N: usize>(a: &[f64; N], b: &[f64; N]) -> f64 {
    let mut sum = 0.0;
    for i in 0..N {
        sum += a[i] * b[i];
    }
    sum
}

fn block<const N: usize, const M: usize>(e: &DMatrix<f64>, column: usize) -> [[f64; M]; N] {
    core::array::from_fn(|i| core::array::from_fn(|j| e[(i, column + j)]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_held_lag_follows_its_exponential_whatever_the_step() {
        for step in [1e-5, 1e-3, 0.1] {
            let lag = Held::<1, 1>::new(&[[-1000.0]], &[[1000.0]], step);
            let x = lag.step(&[2.0], &[5.0])[0];
            assert!((x - (5.0 - 3.0 * (-1000.0 * step).exp())).abs() < 1e-13, "step {step}: {x}");
        }
    }

    #[test]
    fn a_ramp_through_a_lag_is_exact_with_the_sloped_input() {
        // Response to u = t is t − T (1 − e^{−t/T}).
        let (time_constant, step) = (1e-3, 7e-4);
        let lag = Sloped::<1>::new(&[[-1.0 / time_constant]], &[1.0 / time_constant], step);
        let mut x = [0.0];
        for k in 0..10 {
            x = lag.step(&x, f64::from(k) * step, f64::from(k + 1) * step);
        }
        let t: f64 = 10.0 * step;
        let exact = t - time_constant * (1.0 - (-t / time_constant).exp());
        assert!((x[0] - exact).abs() < 1e-15, "{} against {exact}", x[0]);
    }
}
