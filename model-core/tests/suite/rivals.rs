//! Every model of the registry against its equations, written here once more from their sources and integrated by the
//! classical Runge–Kutta rule with fine steps: one f32 step a control period must follow to a thousandth. A model that
//! has no such check fails [`every_kind_of_the_registry_has_its_check`]. LuGre, the modified model and the series
//! element have another one beside, by a solver of order 5, in `ode_reference.rs`.

use model_core::friction::series_maxwell::{branches, loss_tangent, shift_decades};
use model_core::friction::{Contact, FrictionParameters, ModelKind};

const DURATION_S: f64 = 0.4;
const PERIOD_S: f64 = 1e-4;

/// Sliding speed with two reversals, and a normal force that rises.
fn motion(t: f64) -> (f64, f64) {
    (0.12 + 0.3 * (14.0 * t).sin(), 60.0 + 40.0 * (9.0 * t).sin())
}

fn g(p: &FrictionParameters<f64>, v: f64) -> f64 {
    let n = |name| p.get(name).unwrap();
    n("theta") * (n("a0") + n("a1") * (-(v.abs() / n("v0_m_s")).powf(n("delta"))).exp())
}

/// Rates of a state and the force, from the state, sliding speed and load.
type Equations = dyn Fn(&[f64], f64, f64) -> (Vec<f64>, f64);

/// Force at every control period.
fn runge_kutta(equations: &Equations, first: &[f64], period: usize) -> Vec<f64> {
    let step = PERIOD_S / period as f64;
    let steps = (DURATION_S / step).round() as usize;
    let mut y = first.to_vec();
    let mut force = Vec::new();
    let rate = |y: &[f64], t: f64| {
        let (v, n) = motion(t);
        equations(y, v, n).0
    };
    let moved = |y: &[f64], k: &[f64], h: f64| y.iter().zip(k).map(|(y, k)| y + h * k).collect::<Vec<_>>();
    for k in 0..steps {
        let t = k as f64 * step;
        let a = rate(&y, t);
        let b = rate(&moved(&y, &a, 0.5 * step), t + 0.5 * step);
        let c = rate(&moved(&y, &b, 0.5 * step), t + 0.5 * step);
        let d = rate(&moved(&y, &c, step), t + step);
        for i in 0..y.len() {
            y[i] += step / 6.0 * (a[i] + 2.0 * b[i] + 2.0 * c[i] + d[i]);
        }
        if (k + 1) % period == 0 {
            let (v, n) = motion(t + step);
            force.push(equations(&y, v, n).1);
        }
    }
    force
}

fn stepped(p: &FrictionParameters<f64>) -> Vec<f64> {
    let step = PERIOD_S;
    let model = p.cast::<f32>().model(step as f32).unwrap();
    let mut state = model.rest();
    let steps = (DURATION_S / step).round() as usize;
    let contact = |k: usize| {
        let (v, _) = motion((k as f64 + 0.5) * step);
        let (_, n) = motion((k as f64 + 1.0) * step);
        Contact::new(v as f32, n as f32)
    };
    (0..steps).map(|k| f64::from(model.step(&mut state, &contact(k)).force_n)).collect()
}

fn assert_follows(p: &FrictionParameters<f64>, equations: &Equations, first: &[f64], period: usize) {
    assert_near(p, &runge_kutta(equations, first, period));
}

/// The model in steps of a control period is near these forces.
fn assert_near(p: &FrictionParameters<f64>, exact: &[f64]) {
    let error: f64 = exact.iter().zip(&stepped(p)).map(|(a, b)| (a - b).powi(2)).sum();
    let nrmse = (error / exact.iter().map(|a| a * a).sum::<f64>()).sqrt();
    println!("{}: NRMSE {nrmse:.1e}", p.kind().name());
    assert!(nrmse < 1e-3, "{}: {nrmse}", p.kind().name());
}

/// The test of a kind.
fn check_of(kind: ModelKind) -> Option<fn()> {
    Some(match kind {
        ModelKind::Brush => a_brush_follows_its_equations,
        ModelKind::BrushCurve => a_brush_with_a_curve_follows_its_equations,
        ModelKind::Lugre => lugre_follows_its_equation,
        ModelKind::ModifiedLugre | ModelKind::ModifiedLugreFold => the_modified_model_follows_its_equation,
        ModelKind::Series => a_series_element_follows_its_equations,
        ModelKind::Dahl => dahl_follows_its_equation_for_every_exponent,
        ModelKind::ElastoPlastic => elasto_plastic_bristles_follow_their_equation,
        ModelKind::FrictionalLag => a_lagging_coefficient_follows_its_equations,
        ModelKind::MaxwellSlip => maxwell_slip_follows_its_equations,
        ModelKind::Dieterich | ModelKind::Ruina => rate_and_state_contacts_follow_their_equations,
        ModelKind::PrakashClifton => a_contact_that_feels_its_load_late_follows_its_equations,
        ModelKind::SeriesZener => zener_rubber_follows_its_equations,
        ModelKind::SeriesMaxwell => filled_rubber_follows_its_equations,
        _ => return None,
    })
}

#[test]
fn every_kind_of_the_registry_has_its_check() {
    let without: Vec<&str> =
        ModelKind::ALL.iter().filter(|kind| check_of(**kind).is_none()).map(|kind| kind.name()).collect();
    assert!(
        without.is_empty(),
        "no independent solver for {without:?}: write its test here, and name it in check_of"
    );
}

#[test]
fn lugre_follows_its_equation() {
    let p =
        FrictionParameters::typical(ModelKind::Lugre).with("sigma0_n_per_m", 1e5).with("a2_s_per_m", 0.05);
    let equations = move |y: &[f64], v: f64, n: f64| {
        (vec![v - 1e5 * v.abs() * y[0] / (n * g(&p, v))], 1e5 * y[0] + n * 0.05 * v)
    };
    assert_follows(&p, &equations, &[0.0], 100);
}

#[test]
fn the_modified_model_follows_its_equation() {
    // Inside the condition for one root, where the folded kind is the same model. Outside, the trace jumps.
    for kind in [ModelKind::ModifiedLugre, ModelKind::ModifiedLugreFold] {
        let p = FrictionParameters::typical(kind)
            .with("a0", 0.5)
            .with("a1", 0.7)
            .with("delta", 0.5)
            .with("v0_m_s", 0.5)
            .with("sigma0_n_per_m", 1e5);
        let equations = move |y: &[f64], v: f64, n: f64| {
            // s g(s) = σ0 |u v|/F_N, by bisection.
            let right = 1e5 / n * (y[0] * v).abs();
            let (mut low, mut high) = (0.0, right / 0.5);
            for _ in 0..60 {
                let middle = 0.5 * (low + high);
                if middle * g(&p, middle) > right { high = middle } else { low = middle }
            }
            (vec![v - low.copysign(y[0])], 1e5 * y[0])
        };
        assert_follows(&p, &equations, &[0.0], 20);
    }
}

#[test]
fn a_series_element_follows_its_equations() {
    // The assumed rubber: its bristles take 6 µs, which steps of 1 µs resolve.
    let p = FrictionParameters::typical(ModelKind::Series);
    assert_follows(&p, &branched(p, vec![]), &[0.0; 2], 100);
}

/// Force of a spring at every control period that breaks loose at `mu_s` times the load and slides with a coefficient of the
/// speed until the motion turns.
fn brush(stiffness: f64, mu_s: f64, coefficient: impl Fn(f64) -> f64) -> Vec<f64> {
    let period = 100;
    let step = PERIOD_S / period as f64;
    let steps = (DURATION_S / step).round() as usize;
    let (mut force, mut slips, mut last_v, mut out) = (0.0f64, false, 0.0f64, Vec::new());
    for k in 0..steps {
        let ((v, _), (_, n)) = (motion((k as f64 + 0.5) * step), motion((k as f64 + 1.0) * step));
        slips &= v * last_v > 0.0;
        last_v = v;
        if !slips {
            force += stiffness * v * step;
            slips = force.abs() >= mu_s * n;
        }
        if slips {
            force = (coefficient(v) * n).copysign(v);
        }
        if (k + 1) % period == 0 {
            out.push(force);
        }
    }
    out
}

#[test]
fn a_brush_follows_its_equations() {
    let p = FrictionParameters::<f64>::typical(ModelKind::Brush);
    let n = |name| p.get(name).unwrap();
    let (stiffness, mu_s, mu_c) = (n("c_n_per_m"), n("mu_s"), n("mu_c"));
    assert_near(&p, &brush(stiffness, mu_s, |_| mu_c));
}

#[test]
fn dahl_follows_its_equation_for_every_exponent() {
    for alpha in [0.5, 1.0, 2.0] {
        let p = FrictionParameters::typical(ModelKind::Dahl).with("alpha", alpha);
        let equations = move |y: &[f64], v: f64, n: f64| {
            let q = 1.0 - y[0] * v.signum() / (n * 0.9);
            (vec![3e4 * q.abs().powf(alpha) * q.signum() * v], y[0])
        };
        assert_follows(&p, &equations, &[0.0], 100);
    }
}

#[test]
fn elasto_plastic_bristles_follow_their_equation() {
    let p = FrictionParameters::typical(ModelKind::ElastoPlastic).with("sigma0_n_per_m", 1e5);
    let equations = move |y: &[f64], v: f64, n: f64| {
        let steady = n * g(&p, v) / 1e5;
        let (z, ba) = (y[0].abs(), 0.5 * steady);
        let alpha = if y[0] * v <= 0.0 || z <= ba {
            0.0
        } else if z >= steady {
            1.0
        } else {
            0.5 * (std::f64::consts::PI * (z - 0.5 * (steady + ba)) / (steady - ba)).sin() + 0.5
        };
        (vec![v * (1.0 - alpha * z / steady)], 1e5 * y[0])
    };
    assert_follows(&p, &equations, &[0.0], 100);
}

#[test]
fn a_lagging_coefficient_follows_its_equations() {
    let p = FrictionParameters::typical(ModelKind::FrictionalLag).with("sigma0_n_per_m", 1e5);
    let equations = move |y: &[f64], v: f64, n: f64| {
        (vec![v - 1e5 * v.abs() * y[0] / (n * y[1]), (g(&p, v) - y[1]) / 5e-3], 1e5 * y[0])
    };
    assert_follows(&p, &equations, &[0.0, 1.2], 100);
}

#[test]
fn a_brush_with_a_curve_follows_its_equations() {
    let p = FrictionParameters::typical(ModelKind::BrushCurve)
        .with("static_excess", 0.1)
        .with("a2_s_per_m", 0.05);
    assert_near(&p, &brush(3e4, 1.3, |v| g(&p, v) + 0.05 * v.abs()));
}

#[test]
fn a_brush_with_a_curve_drops_more_the_faster_it_slides() {
    let model = FrictionParameters::<f64>::typical(ModelKind::BrushCurve).model(1e-5).unwrap();
    let drop = |v: f64| {
        let mut state = model.rest();
        let force: Vec<f64> =
            (0..200_000).map(|_| model.step(&mut state, &Contact::new(v, 88.0)).force_n).collect();
        force.iter().copied().fold(0.0, f64::max) / force[199_999] - 1.0
    };
    for v in [0.06, 0.75] {
        let expected = 1.2 / (0.5 + 0.7 * (-(v / 0.5f64).sqrt()).exp()) - 1.0;
        assert!((drop(v) - expected).abs() < 0.01, "{v} m/s: {} {expected}", drop(v));
    }
}

#[test]
fn maxwell_slip_follows_its_equations() {
    let p = FrictionParameters::typical(ModelKind::MaxwellSlip);
    let period = 100;
    let step = PERIOD_S / period as f64;
    let steps = (DURATION_S / step).round() as usize;
    let weights = [8.0, 4.0, 2.0, 1.0].map(|w| 3e4 * w / 15.0);
    let (mut force, mut slips, mut out) = ([0.0f64; 4], [false; 4], Vec::new());
    let mut last_v = 0.0;
    for k in 0..steps {
        let ((v, _), (_, n)) = (motion((k as f64 + 0.5) * step), motion((k as f64 + 1.0) * step));
        for i in 0..4 {
            if v * last_v < 0.0 {
                slips[i] = false;
            }
            let limit = 0.25 * n * g(&p, v);
            if slips[i] {
                force[i] += step * v.signum() * 100.0 * n * (0.25 - force[i].abs() / (n * g(&p, v)));
            } else {
                force[i] += step * weights[i] * v;
                if force[i].abs() >= limit {
                    slips[i] = force[i] * v > 0.0;
                    force[i] = limit.copysign(force[i]);
                }
            }
        }
        last_v = v;
        if (k + 1) % period == 0 {
            out.push(force.iter().sum::<f64>());
        }
    }
    assert_near(&p, &out);
}

/// Block and contact of rate and state, with ln θ as the state; V from the balance by bisection in ln V.
fn rate_state(p: FrictionParameters<f64>, ageing: bool) -> impl Fn(&[f64], f64, f64) -> (Vec<f64>, f64) {
    let n = move |name| p.get(name).unwrap();
    let (k, c, mu_0, a, b, d_c) =
        (n("k_u_n_per_m"), n("c_u_n_s_per_m"), n("mu_0"), n("a"), n("b"), n("d_c_m"));
    move |y: &[f64], v: f64, load: f64| {
        let (u, ln_theta) = (y[0], y[1]);
        let drive = k * u + c * v;
        let strength = (mu_0 + b * (ln_theta + (0.1 / d_c).ln())) / a;
        let friction = |speed: f64| load * a * (speed / 0.2 * strength.exp()).asinh();
        let (mut low, mut high) = (1e-30f64.ln(), 1e3f64.ln());
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if friction(middle.exp()) + c * middle.exp() > drive.abs() { high = middle } else { low = middle }
        }
        let tip = low.exp().copysign(drive);
        let x = tip.abs() * ln_theta.exp() / d_c;
        let aged = if ageing { (1.0 - x) / ln_theta.exp() } else { -x * x.ln() / ln_theta.exp() };
        (vec![v - tip, aged], drive - c * tip)
    }
}

#[test]
fn rate_and_state_contacts_follow_their_equations() {
    for (kind, ageing) in [(ModelKind::Dieterich, true), (ModelKind::Ruina, false)] {
        // Damped enough not to stick and slip: a trace of stick-slip can be compared with none.
        let p = FrictionParameters::typical(kind).with("c_u_n_s_per_m", 160.0).with("d_c_m", 2e-3);
        let first = (2e-3f64 / 1e-4).ln();
        assert_follows(&p, &rate_state(p, ageing), &[0.0, first], 10);
    }
}

#[test]
fn a_load_step_at_constant_speed_is_remembered_over_a_distance_where_the_model_says_so() {
    // Twice the load at 0.1 m/s: friction is twice as large after ln-many D_c, and less before.
    let after = |memory: f64, distance: f64| {
        let p = FrictionParameters::<f64>::typical(ModelKind::Ruina)
            .with("load_memory", memory)
            .with("k_u_n_per_m", 1e6)
            .with("d_c_m", 1e-3);
        let model = p.model(1e-5).unwrap();
        let mut state = model.rest();
        for _ in 0..100_000 {
            model.step(&mut state, &Contact::new(0.1, 50.0));
        }
        let steps = (distance / 0.1 / 1e-5) as usize;
        (0..steps).map(|_| model.step(&mut state, &Contact::new(0.1, 100.0)).force_n).last().unwrap() / 95.0
    };
    assert!(
        (after(0.0, 1e-3) - 1.0).abs() < 5e-3,
        "without memory the load acts at once: {}",
        after(0.0, 1e-3)
    );
    // α ln 2 e^{−x/D_c} of the load is missing after a distance x.
    let missing = 0.3 * 2f64.ln() / 0.95;
    assert!((1.0 - after(0.3, 1e-3) - missing * (-1f64).exp()).abs() < 0.03, "{}", after(0.3, 1e-3));
    assert!((after(0.3, 2e-2) - 1.0).abs() < 1e-3);
}

#[test]
fn a_contact_that_feels_its_load_late_follows_its_equations() {
    for length_m in [1e-4, 3e-3] {
        let p = FrictionParameters::typical(ModelKind::PrakashClifton)
            .with("sigma0_n_per_m", 1e5)
            .with("sigma1_n_s_per_m", 10.0)
            .with("a2_s_per_m", 0.05)
            .with("memory_length_m", length_m);
        let equations = move |y: &[f64], v: f64, n: f64| {
            let felt = (v.abs() + 1e-6) / length_m * (n - y[1]);
            let rate = v - 1e5 * v.abs() * y[0] / (y[1] * g(&p, v));
            (vec![rate, felt], 1e5 * y[0] + 10.0 * rate + y[1] * 0.05 * v)
        };
        assert_follows(&p, &equations, &[0.0, 60.0], 100);
    }
}

#[test]
fn a_load_step_on_a_contact_that_feels_its_load_late_has_no_jump_and_acts_as_e_to_the_way_slid() {
    let p = FrictionParameters::<f64>::typical(ModelKind::PrakashClifton);
    let model = p.model(1e-5).unwrap();
    let mut state = model.rest();
    let mut force = |load_n: f64, steps: u32| {
        (0..steps).map(|_| model.step(&mut state, &Contact::new(0.1, load_n)).force_n).last().unwrap()
    };
    let before = force(50.0, 100_000);
    let at_once = force(100.0, 1);
    assert!((at_once / before - 1.0).abs() < 3e-3, "{before} {at_once}");
    // After 1 mm = L in all; the first step's load counts as risen over that step.
    let after = force(100.0, 999);
    let expected = before * (2.0 - (-1.0f64).exp());
    assert!((after / expected - 1.0).abs() < 2e-3, "{after} {expected}");
}

/// Block with Maxwell branches and bristles: state u, z, and the branches' forces.
fn branched(
    p: FrictionParameters<f64>,
    branches: Vec<(f64, f64)>,
) -> impl Fn(&[f64], f64, f64) -> (Vec<f64>, f64) {
    let n = move |name| p.get(name).unwrap();
    let (k, c, sigma0) = (n("k_u_n_per_m"), n("c_u_n_s_per_m"), n("sigma0_n_per_m"));
    move |y: &[f64], v: f64, load: f64| {
        let held: f64 = k * y[0] + y[2..].iter().sum::<f64>();
        let tip = v + (held - sigma0 * y[1]) / c;
        let rate = v - tip;
        let mut rates = vec![rate, tip - sigma0 * tip.abs() * y[1] / (load * g(&p, tip))];
        rates.extend(branches.iter().zip(&y[2..]).map(|((k, t), f)| k * rate - f / t));
        (rates, sigma0 * y[1])
    }
}

#[test]
fn zener_rubber_follows_its_equations() {
    let p = FrictionParameters::typical(ModelKind::SeriesZener)
        .with("sigma0_n_per_m", 1e6)
        .with("c_u_n_s_per_m", 60.0)
        .with("k_1_n_per_m", 6e4);
    assert_follows(&p, &branched(p, vec![(6e4, 3e-3)]), &[0.0; 3], 100);
}

#[test]
fn filled_rubber_follows_its_equations() {
    let p = FrictionParameters::typical(ModelKind::SeriesMaxwell)
        .with("sigma0_n_per_m", 1e6)
        .with("c_u_n_s_per_m", 60.0)
        .with("branch_ratio", 0.5);
    assert_follows(&p, &branched(p, branches(3e4, 0.5, 0.1, 20.0).to_vec()), &[0.0; 6], 100);
}

#[test]
fn filled_rubber_loses_the_same_share_at_every_frequency_and_kelvin_voigt_does_not() {
    let filled = branches(3e4, 0.2, 0.1, 20.0);
    for hz in [1.0, 3.0, 10.0, 30.0, 100.0] {
        let (new, old) = (loss_tangent(3e4, 5.0, &filled, hz), loss_tangent(3e4, 160.0, &[], hz));
        println!("{hz} Hz: tan δ {new:.3}, Kelvin–Voigt {old:.3}");
        assert!((0.1..0.3).contains(&new), "{hz} Hz: {new}");
    }
    assert!(loss_tangent(3e4, 160.0, &[], 1.0) < 0.04 && loss_tangent(3e4, 160.0, &[], 100.0) > 3.0);
}

#[test]
fn warm_rubber_is_fast_rubber() {
    // Ten degrees near 20 °C are about half a decade for T_g = −50 °C.
    assert_eq!(shift_decades(20.0), 0.0);
    assert!((shift_decades(30.0) + 0.56).abs() < 0.02, "{}", shift_decades(30.0));
    let steady = |temperature_c: f64, v: f64| {
        let p =
            FrictionParameters::<f64>::typical(ModelKind::SeriesMaxwell).with("temperature_c", temperature_c);
        let model = p.model(1e-4).unwrap();
        model.stribeck().unwrap().coefficient(v)
    };
    let slower = 10f64.powf(shift_decades(60.0));
    assert!((steady(60.0, 0.2) - steady(20.0, 0.2 * slower)).abs() < 1e-12);
}
