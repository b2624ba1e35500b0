//! Every bristle model against an independent adaptive solver (Radau IIA of order 5) on the same
//! smooth motion: f64 for the order of convergence, f32 at the control period for accuracy.

use std::ops::Range;

use crate::common::bristles;
use differential_equations::prelude::*;
use model_core::friction::{Contact, FrictionModel, lugre::LugreParameters, series::SeriesParameters};
use model_core::friction::{lugre::Scheme, stribeck::StribeckParameters};
use model_core::real::Real as ModelReal;

const DURATION_S: f64 = 0.4;

/// Sliding speed with two reversals, and a normal force that rises.
fn motion(t: f64) -> (f64, f64) {
    (0.12 + 0.3 * (14.0 * t).sin(), 60.0 + 40.0 * (9.0 * t).sin())
}

fn g(p: &LugreParameters<f64>, v: f64) -> f64 {
    let s = &p.stribeck;
    s.theta * (s.a0 + s.a1 * (-(v.abs() / s.v0_m_s).powf(s.delta)).exp())
}

/// The equations as the paper prints them, for the solver.
enum Equations {
    Lugre(LugreParameters<f64>),
    Modified(LugreParameters<f64>),
    Series(SeriesParameters<f64>),
}

impl Equations {
    fn rate(&self, t: f64, y: &[f64; 2]) -> [f64; 2] {
        let (v, load) = motion(t);
        match self {
            Self::Lugre(p) => [v - p.sigma0_n_per_m * v.abs() * y[0] / (load * g(p, v)), 0.0],
            Self::Modified(p) => {
                let right = p.sigma0_n_per_m / load * y[0].abs() * v.abs();
                // s g(s) = right, by bisection: no trick shared with the model.
                let (mut low, mut high) = (0.0, right / (p.stribeck.a0 * p.stribeck.theta));
                for _ in 0..200 {
                    let middle = 0.5 * (low + high);
                    if middle * g(p, middle) > right { high = middle } else { low = middle }
                }
                [v - low.copysign(y[0]), 0.0]
            }
            Self::Series(p) => {
                let tip = self.tip_speed(p, v, y);
                let b = &p.bristles;
                [v - tip, tip - b.sigma0_n_per_m * tip.abs() * y[1] / (load * g(b, tip))]
            }
        }
    }

    fn tip_speed(&self, p: &SeriesParameters<f64>, v: f64, y: &[f64; 2]) -> f64 {
        v + (p.k_u_n_per_m * y[0] - p.bristles.sigma0_n_per_m * y[1]) / p.c_u_n_s_per_m
    }

    fn force(&self, t: f64, y: &[f64; 2]) -> f64 {
        let (v, load) = motion(t);
        match self {
            Self::Lugre(p) | Self::Modified(p) => {
                let rate = self.rate(t, y)[0];
                p.sigma0_n_per_m * y[0] + p.sigma1_n_s_per_m * rate + load * p.a2_s_per_m * v
            }
            Self::Series(p) => p.bristles.sigma0_n_per_m * y[1],
        }
    }

    fn model<T: ModelReal>(&self, step_s: f64) -> FrictionModel<T> {
        let cast = |p: &LugreParameters<f64>| LugreParameters {
            sigma0_n_per_m: T::from_f64(p.sigma0_n_per_m),
            sigma1_n_s_per_m: T::from_f64(p.sigma1_n_s_per_m),
            a2_s_per_m: T::from_f64(p.a2_s_per_m),
            stribeck: StribeckParameters {
                a0: T::from_f64(p.stribeck.a0),
                a1: T::from_f64(p.stribeck.a1),
                v0_m_s: T::from_f64(p.stribeck.v0_m_s),
                delta: T::from_f64(p.stribeck.delta),
                theta: T::from_f64(p.stribeck.theta),
            },
        };
        let step = T::from_f64(step_s);
        match self {
            Self::Lugre(p) => FrictionModel::lugre(&cast(p), step).unwrap(),
            Self::Modified(p) => FrictionModel::modified_lugre(&cast(p), step).unwrap(),
            Self::Series(p) => {
                let series = SeriesParameters {
                    k_u_n_per_m: T::from_f64(p.k_u_n_per_m),
                    c_u_n_s_per_m: T::from_f64(p.c_u_n_s_per_m),
                    bristles: cast(&p.bristles),
                };
                FrictionModel::series(&series, step).unwrap()
            }
        }
    }
}

impl ODE<f64, [f64; 2]> for Equations {
    fn diff(&self, t: f64, y: &[f64; 2], dydt: &mut [f64; 2]) {
        *dydt = self.rate(t, y);
    }
}

/// Force at every 100 µs from the solver.
fn reference(equations: &Equations) -> Vec<f64> {
    let solution = IVP::ode(equations, 0.0, DURATION_S, [0.0, 0.0])
        .t_eval((1..=4000).map(|k| f64::from(k) * 1e-4).collect::<Vec<_>>())
        .method(ImplicitRungeKutta::radau5().rtol(1e-9).atol(1e-14).h0(1e-9).max_steps(10_000_000))
        .solve()
        .unwrap();
    let force: Vec<f64> = solution.iter().map(|(t, y)| equations.force(*t, y)).collect();
    assert_eq!(force.len(), 4000);
    force
}

/// Force at every 100 µs from the model with `per_period` steps in each.
fn run<T: ModelReal>(mut model: FrictionModel<T>, per_period: usize) -> Vec<f64> {
    let step = 1e-4 / per_period as f64;
    model.set_step_s(T::from_f64(step));
    let mut state = model.rest();
    let mut force = Vec::new();
    for k in 0..4000 * per_period {
        let (v, _) = motion((k as f64 + 0.5) * step);
        let (_, load) = motion((k as f64 + 1.0) * step);
        let out = model.step(&mut state, &Contact::new(T::from_f64(v), T::from_f64(load)));
        if k % per_period == per_period - 1 {
            force.push(out.force_n.to_f64());
        }
    }
    force
}

fn nrmse(a: &[f64], b: &[f64], range: Range<usize>) -> f64 {
    let error: f64 = range.clone().map(|k| (a[k] - b[k]).powi(2)).sum();
    let power: f64 = range.map(|k| b[k].powi(2)).sum();
    (error / power).sqrt()
}

fn lugre(sigma0: f64) -> LugreParameters<f64> {
    bristles(0.5, 0.7, 0.5, 0.5, sigma0)
}

fn series() -> SeriesParameters<f64> {
    SeriesParameters { k_u_n_per_m: 3e4, c_u_n_s_per_m: 160.0, bristles: lugre(1.76e7) }
}

#[test]
fn one_f32_step_per_control_period_follows_the_solver() {
    // 0.4 s of harsh motion without any steady stretch. The modified model with stiff bristles has a
    // time constant of a step and a half here (160 µs); backward Euler then costs more.
    for (name, equations, allowed) in [
        ("LuGre, soft", Equations::Lugre(lugre(1e5)), 1e-3),
        ("LuGre", Equations::Lugre(lugre(1e6)), 1e-3),
        ("modified, soft", Equations::Modified(lugre(1e5)), 1e-3),
        ("modified", Equations::Modified(lugre(1e6)), 2e-3),
        ("series", Equations::Series(series()), 1e-3),
    ] {
        let exact = reference(&equations);
        let single = nrmse(&run(equations.model::<f32>(1e-4), 1), &exact, 0..4000);
        let double = nrmse(&run(equations.model::<f64>(1e-4), 1), &exact, 0..4000);
        println!("{name}: f32 {single:.2e}, f64 {double:.2e}");
        assert!(single < allowed, "{name}: {single}");
        // What single precision adds is far below what the step size costs.
        assert!((single - double).abs() < 1e-5, "{name}: {single}, {double}");
    }
}

#[test]
fn halving_the_step_divides_the_error_by_two_to_the_order_of_the_scheme() {
    // The LuGre step is exact for a held speed; what is left is that the held speed is the mean of
    // the step and not the one at its end.
    for (name, equations, order) in [
        ("LuGre", Equations::Lugre(lugre(1e5)), 1.0),
        ("modified", Equations::Modified(lugre(1e5)), 1.0),
        ("series", Equations::Series(series()), 2.0),
    ] {
        let exact = reference(&equations);
        // From rest to the first reversal: past it the square root at v = 0 lowers every order.
        let error = |n| nrmse(&run(equations.model::<f64>(1e-4), n), &exact, 100..2400);
        let (coarse, fine) = (error(2), error(4));
        let seen = (coarse / fine).log2();
        println!("{name}: {coarse:.2e} {fine:.2e}, order {seen:.2}");
        assert!((seen - order).abs() < 0.2, "{name}: order {seen}");
    }
}

#[test]
fn backward_euler_is_bounded_and_of_first_order() {
    let equations = Equations::Lugre(lugre(1e5));
    let exact = reference(&equations);
    let error = |n: usize| {
        let FrictionModel::Lugre(model) = equations.model::<f64>(1e-4) else { unreachable!() };
        let model = FrictionModel::Lugre(model.with_scheme(Scheme::BackwardEuler));
        nrmse(&run(model, n), &exact, 100..2400)
    };
    let order = (error(2) / error(4)).log2();
    assert!((order - 1.0).abs() < 0.2, "{order}");
}
