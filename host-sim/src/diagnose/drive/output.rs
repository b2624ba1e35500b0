//! A fitted drive in the form that the comparison of causes reads.

use super::model::{FRICTION_RING, Filtered, Model, Shapes, curvature, delayed, gross, is_timing};
use super::solve::Solved;
use crate::diagnose::analysis::{Channel, Estimate, Fit, LogFit, Role};
use crate::diagnose::uncertainty::{has_influence, set_std};

/// Step of a difference for the derivative by a shape, of its range.
const SHAPE_STEP: f64 = 1e-3;

/// What is fitted beside the sizes: a shape, or a log's origin.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Nonlinear {
    Shape { at: usize, step: f64 },
    Origin { log: usize, step: f64 },
}

/// The fit with residuals and sensitivities of all logs.
pub fn fit(logs: &[Filtered], solved: &Solved, effects: &[&'static str]) -> Fit {
    let model = Model { logs, parts: &solved.parts };
    let (nonlinear, mut parameters) = nonlinear(&model, solved);
    let linear: Vec<Estimate> = solved
        .names
        .iter()
        .zip(&solved.sizes.values)
        .map(|(name, value)| Estimate {
            effect: name.effect,
            name: name.name.clone(),
            value: *value,
            std: f64::NAN,
            log: None,
        })
        .collect();
    let linear_count = linear.len();
    parameters.splice(0..0, linear);
    let channels: Vec<Channel> =
        (0..logs.len()).map(|index| channel(&model, solved, index, &nonlinear)).collect();
    let train = channels.iter().zip(logs).filter(|(_, log)| log.log.role == Role::Train);
    let train: Vec<&Channel> = train.map(|(channel, _)| channel).collect();
    let held = |p: usize| p < linear_count && is_timing(&solved.names[p]);
    let free: Vec<usize> = (0..parameters.len()).filter(|&p| has_influence(&train, p) && !held(p)).collect();
    set_std(&mut parameters, &train, &free);
    for part in &solved.parts {
        let constant = |(name, value)| Estimate { effect: Some(part.id), name, value, std: 0.0, log: None };
        parameters.extend(part.prepared.constants().into_iter().map(constant));
    }
    let logs =
        channels.into_iter().enumerate().map(|(i, channel)| log_fit(&model, solved, i, channel)).collect();
    Fit { effects: effects.to_vec(), parameters, logs }
}

fn nonlinear(model: &Model<'_>, solved: &Solved) -> (Vec<Nonlinear>, Vec<Estimate>) {
    let (mut places, mut estimates) = (Vec::new(), Vec::new());
    let mut at = 0;
    for part in &solved.parts {
        for shape in part.prepared.shapes() {
            let value = solved.shapes.values[at];
            let room = (shape.high - value).max(value - shape.low);
            let step = (SHAPE_STEP * shape.typical(value)).min(0.5 * room);
            let step = if value + step <= shape.high { step } else { -step };
            places.push(Nonlinear::Shape { at, step });
            let name = shape.name.clone();
            estimates.push(Estimate { effect: Some(part.id), name, value, std: f64::NAN, log: None });
            at += 1;
        }
        if let Some(origins) = part.prepared.origins() {
            for log in 1..model.logs.len() {
                places.push(Nonlinear::Origin { log, step: 0.1 * origins.step });
                let value = solved.shapes.origins[log];
                let name = "origin".to_string();
                estimates.push(Estimate {
                    effect: Some(part.id),
                    name,
                    value,
                    std: f64::NAN,
                    log: Some(log),
                });
            }
        }
    }
    (places, estimates)
}

fn channel(model: &Model<'_>, solved: &Solved, index: usize, nonlinear: &[Nonlinear]) -> Channel {
    let problem = model.whitened(&solved.shapes, index);
    let residual = problem.residual(&solved.sizes.values);
    let mut sensitivity: Vec<Vec<f64>> =
        problem.columns.iter().map(|column| column.iter().map(|x| -x).collect()).collect();
    for place in nonlinear {
        let mut shapes: Shapes = solved.shapes.clone();
        let step = match *place {
            Nonlinear::Shape { at, step } => {
                shapes.values[at] += step;
                step
            }
            Nonlinear::Origin { log, step } if log == index => {
                shapes.origins[log] += step;
                step
            }
            Nonlinear::Origin { .. } => {
                sensitivity.push(Vec::new());
                continue;
            }
        };
        let moved = model.whitened(&shapes, index).residual(&solved.sizes.values);
        sensitivity.push(moved.iter().zip(&residual).map(|(a, b)| (a - b) / step).collect());
    }
    let filtered = &model.logs[index];
    let positions = filtered.whitener.positions(filtered.log.len());
    let mask = masked(filtered, &positions);
    Channel {
        name: "force",
        time_s: positions.iter().map(|at| filtered.log.record.time_s(*at)).collect(),
        residual: residual.iter().zip(mask).map(|(r, masked)| if masked { f64::NAN } else { *r }).collect(),
        sensitivity,
        samples_per_noise: filtered.whitener.samples_per_noise,
    }
}

/// Outputs of the filter whose centre does not count.
fn masked(filtered: &Filtered, positions: &[usize]) -> Vec<bool> {
    positions.iter().map(|&at| filtered.log.weight[at] == 0.0).collect()
}

/// Measured and predicted effort as the contract compares them: decimated to 100 Hz.
fn log_fit(model: &Model<'_>, solved: &Solved, index: usize, channel: Channel) -> LogFit {
    let log = &model.logs[index].log;
    let mut predicted = vec![0.0; log.len()];
    let columns = model.regressors(&solved.shapes, index);
    for (column, size) in columns.iter().zip(&solved.sizes.values) {
        predicted.iter_mut().zip(column).for_each(|(sum, x)| *sum += size * x);
    }
    let time_of = |name: &str| {
        let at = solved.names.iter().position(|n| is_timing(n) && n.name == name);
        at.map_or(0.0, |at| solved.sizes.values[at])
    };
    let step_s = log.record.step_s;
    if let Some(contact) = &log.contact {
        // The true friction is the measured one of `friction_timing_s` later.
        let friction = delayed(&contact.friction, -time_of("friction_timing_s") / step_s);
        let (ring, curved) = (time_of(FRICTION_RING), curvature(&contact.friction, step_s));
        for ((sum, t), curve) in predicted.iter_mut().zip(&friction).zip(&curved) {
            *sum += t + ring * curve;
        }
    }
    // The effort of now moves the drive a delay later: what it is now, the motion of then asks for.
    let delay_s = model.delay_s(&solved.shapes).unwrap_or_else(|| time_of("torque_timing_s"));
    let predicted = delayed(&predicted, -delay_s / step_s);
    let decimator = log.decimator();
    let positions = decimator.positions(log.len());
    let reach = (0.5 * log.record.rate_hz() / super::conditioned::REPORT_HZ).ceil() as usize;
    let used = positions
        .iter()
        .map(|&at| {
            let near = &log.weight[at.saturating_sub(reach)..(at + reach + 1).min(log.len())];
            near.iter().all(|w| *w > 0.0)
        })
        .collect();
    let noise = noise_std(model, solved, index);
    LogFit {
        role: log.role,
        time_s: positions.iter().map(|at| log.record.time_s(*at)).collect(),
        measured: decimator.apply(&gross(log)),
        predicted: decimator.apply(&predicted),
        noise_std: vec![noise; positions.len()],
        used,
        channels: vec![channel],
    }
}

/// Standard deviation of the decimated force error that the noise of both channels gives.
fn noise_std(model: &Model<'_>, solved: &Solved, index: usize) -> f64 {
    let log = &model.logs[index].log;
    let rate_hz = log.record.rate_hz();
    let limit_hz = (0.5 * super::conditioned::REPORT_HZ).min(0.5 * rate_hz);
    let mut force = log.force_std.powi(2) * 2.0 * limit_hz / rate_hz;
    if let (Some(resonance), Some(contact)) = (model.resonance(&solved.shapes), &log.contact) {
        // The friction's noise reaches the motor through the disc.
        let steps = 2000;
        let mean = (0..steps)
            .map(|i| resonance.gain_squared((f64::from(i) + 0.5) / f64::from(steps) * limit_hz))
            .sum::<f64>()
            / f64::from(steps);
        force += (mean - 1.0) * contact.friction_std.powi(2) * 2.0 * limit_hz / rate_hz;
    }
    // ∫ (2πf)⁴ df over the band.
    let omega = 2.0 * std::f64::consts::PI;
    let curved = omega.powi(4) * limit_hz.powi(5) / 5.0 * 2.0 / rate_hz;
    (force + curved * (solved.sizes.values[0] * log.position_std).powi(2)).sqrt()
}

/// Sentences with numbers about one effect in a fit.
pub fn evidence(effect: &'static str, fit: &Fit, baseline: [&str; 3]) -> Vec<String> {
    let own: Vec<&Estimate> = fit.parameters.iter().filter(|p| p.effect == Some(effect)).collect();
    let mut sentences = Vec::new();
    let significant: Vec<String> = own
        .iter()
        .filter(|p| p.std > 0.0 && p.log.is_none())
        .map(|p| format!("{} = {:.4} ± {:.1e}", p.name, p.value, p.std))
        .collect();
    if !significant.is_empty() {
        sentences.push(format!("fitted to the force error of the inverse model: {}", significant.join(", ")));
    }
    let coulomb = fit.get(None, baseline[2]).map(|p| p.value);
    let value = |name: &str| own.iter().find(|p| p.name.starts_with(name)).map(|p| p.value);
    let more = match effect {
        "torque_offset" => value("offset").zip(coulomb).map(|(offset, coulomb)| {
            format!(
                "the force error has the same mean in both directions: {:.1} % of Coulomb friction",
                100.0 * offset / coulomb
            )
        }),
        "bearing_asymmetry" => value("viscous_difference").map(|half| {
            format!("viscous friction differs by {:.4} between forward and backward", 2.0 * half)
        }),
        "bearing_stribeck" => value("stribeck_speed").map(|speed| {
            format!("friction falls with speed below about {speed:.3e}, on the way up and down alike")
        }),
        "presliding" => value("yield_length").map(|length| {
            format!("after reversals friction builds up over {length:.3e} of travel, whatever the speed")
        }),
        "drive_delay" => value("delay_s").map(|delay| {
            format!("motion follows the effort {:.2} ms later, in fast and slow motion", 1e3 * delay)
        }),
        "shaft_torsion" => value("natural_frequency_hz").map(|hz| {
            format!("the force error rings at {hz:.1} Hz after fast changes, in proportion to them")
        }),
        "backlash" => value("gap")
            .map(|gap| format!("at torque reversals the motor moves {gap:.3e} with its own inertia alone")),
        "encoder_eccentricity" => value("cos_1").zip(value("sin_1")).map(|(cos, sin)| {
            format!(
                "torque and speed swing once per turn, the torque in proportion to the speed's square: the angle \
                 is wrong by up to {:.4} rad",
                cos.hypot(sin)
            )
        }),
        "m2_ripple" => {
            let lines: Vec<String> = (1..=own.len())
                .filter_map(|i| {
                    let name = |what: &str| format!("{what}_{i}");
                    let wave = value(&name("order")).map(|n| format!("order {n:.0}")).or_else(|| {
                        value(&name("wavelength")).map(|l| format!("wavelength {:.4} mm", 1e3 * l))
                    })?;
                    let size = value(&name("cos"))?.hypot(value(&name("sin"))?);
                    Some(format!("{wave}: {size:.4}"))
                })
                .collect();
            (!lines.is_empty())
                .then(|| format!("the force error repeats with position: {}", lines.join(", ")))
        }
        _ => None,
    };
    sentences.extend(more);
    sentences
}
