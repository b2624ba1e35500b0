//! A fitted press in the form that the comparison of causes reads.

use super::model::{Filtered, Model};
use super::solve::{Solved, training};
use crate::diagnose::analysis::{Channel, Estimate, Fit, LogFit};
use crate::diagnose::uncertainty::{has_influence, set_std};

/// Step of a difference for the derivative by a nonlinear value, of its range.
const STEP: f64 = 1e-3;

/// A nonlinear value: a shape, or what a log has for itself.
#[derive(Debug, Clone, Copy)]
enum Place {
    Shape(usize),
    Own { part: usize, log: usize },
}

/// The fit with residuals and sensitivities of all logs.
pub fn fit(logs: &[Filtered], solved: &Solved, effects: &[&'static str]) -> Fit {
    let model = Model { logs, parts: &solved.parts };
    let estimate = |effect, name: &str, value, log| Estimate {
        effect,
        name: name.to_string(),
        value,
        std: f64::NAN,
        log,
    };
    let mut parameters: Vec<Estimate> = solved
        .names
        .iter()
        .zip(&solved.sizes)
        .map(|(name, value)| estimate(name.effect, name.name, *value, None))
        .collect();
    let mut places = Vec::new();
    let mut at = 0;
    for (k, part) in solved.parts.iter().enumerate() {
        for shape in part.prepared.shapes() {
            let value = solved.shapes.values[at];
            let step = STEP * shape.typical(value);
            places.push((Place::Shape(at), if value + step <= shape.high { step } else { -step }));
            parameters.push(estimate(Some(part.id), &shape.name, value, None));
            at += 1;
        }
        let Some(own) = part.prepared.own_value() else { continue };
        for log in usize::from(own.first_stays)..logs.len() {
            let value = solved.shapes.own[k][log];
            let step = 10.0 * STEP * own.half_span;
            places.push((Place::Own { part: k, log }, if value > 0.0 { -step } else { step }));
            parameters.push(estimate(Some(part.id), own.name, value, Some(log)));
        }
    }
    let channels: Vec<Channel> =
        (0..logs.len()).map(|index| channel(&model, solved, index, &places)).collect();
    let train: Vec<&Channel> = training(logs).into_iter().map(|i| &channels[i]).collect();
    let free: Vec<usize> = (0..parameters.len())
        .filter(|&p| has_influence(&train, p))
        // A coefficient on its bound of 0 is not free.
        .filter(|&p| parameters[p].value != 0.0)
        .collect();
    set_std(&mut parameters, &train, &free);
    for part in &solved.parts {
        let constants = part.prepared.constants();
        parameters.extend(
            constants
                .into_iter()
                .map(|(name, value)| Estimate { std: 0.0, ..estimate(Some(part.id), name, value, None) }),
        );
    }
    let logs = channels.into_iter().enumerate().map(|(i, c)| log_fit(&model, solved, i, c)).collect();
    Fit { effects: effects.to_vec(), parameters, logs }
}

fn channel(model: &Model<'_>, solved: &Solved, index: usize, places: &[(Place, f64)]) -> Channel {
    let problem = model.whitened(&solved.shapes, index);
    let residual = problem.residual(&solved.sizes);
    let mut sensitivity: Vec<Vec<f64>> =
        problem.columns.iter().map(|column| column.iter().map(|x| -x).collect()).collect();
    for (place, step) in places {
        let mut shapes = solved.shapes.clone();
        match *place {
            Place::Shape(at) => shapes.values[at] += step,
            Place::Own { part, log } if log == index => shapes.own[part][log] += step,
            Place::Own { .. } => {
                sensitivity.push(Vec::new());
                continue;
            }
        }
        let moved = model.whitened(&shapes, index).residual(&solved.sizes);
        sensitivity.push(moved.iter().zip(&residual).map(|(a, b)| (a - b) / step).collect());
    }
    let log = &model.logs[index].log;
    let positions = log.whitener.positions(log.len());
    let counted = |(r, at): (&f64, &usize)| if log.weight[*at] > 0.0 { *r } else { f64::NAN };
    Channel {
        name: "normal force",
        time_s: positions.iter().map(|at| log.start_s + log.step_s * *at as f64).collect(),
        residual: residual.iter().zip(&positions).map(counted).collect(),
        sensitivity,
        samples_per_noise: log.whitener.samples_per_noise,
    }
}

fn log_fit(model: &Model<'_>, solved: &Solved, index: usize, channel: Channel) -> LogFit {
    let log = &model.logs[index].log;
    let mut predicted = vec![0.0; log.len()];
    for (column, size) in model.columns(&solved.shapes, index).iter().zip(&solved.sizes) {
        predicted.iter_mut().zip(column).for_each(|(sum, x)| *sum += size * x);
    }
    LogFit {
        role: log.role,
        time_s: (0..log.len()).map(|i| log.start_s + log.step_s * i as f64).collect(),
        measured: log.normal_n.clone(),
        predicted,
        noise_std: vec![log.sample_std_n; log.len()],
        used: log.weight.iter().map(|w| *w > 0.0).collect(),
        channels: vec![channel],
    }
}

/// Sentences with numbers about one effect in a fit.
pub fn evidence(effect: &'static str, fit: &Fit) -> Vec<String> {
    let own: Vec<&Estimate> =
        fit.parameters.iter().filter(|p| p.effect == Some(effect) && p.log.is_none()).collect();
    let value = |name: &str| own.iter().find(|p| p.name == name).map(|p| p.value);
    let gain = fit.get(None, super::model::BASELINE[0]).map_or(f64::NAN, |p| p.value);
    let sentence = match effect {
        "lever_hysteresis" => {
            let half: f64 = own.iter().filter(|p| p.name.starts_with("friction")).map(|p| p.value).sum();
            Some(format!(
                "on the way up the normal force lies {:.2} N below that on the way down: a band of ±{:.3} N m \
                 of M1's torque",
                2.0 * half,
                half / gain
            ))
        }
        "foil_hardening" => value("hardening_n").zip(value("full_travel_n")).zip(value("exponent")).map(
            |((lost, full), exponent)| {
                format!(
                    "at {full:.1} N the normal force is {lost:.2} N short of the straight line from zero; \
                     the loss grows with the power {exponent:.2} of the travel"
                )
            },
        ),
        "m1_ripple" => {
            let pair = |cos: &str, sin: &str| value(cos).zip(value(sin)).map(|(c, s)| c.hypot(s) / gain);
            let wave = value("order").map(|n| format!("{n:.1} times per turn of M1")).or_else(|| {
                value("wave_rad_per_n").map(|w| format!("every {:.2} N", std::f64::consts::TAU / w))
            });
            pair("cos_1_n", "sin_1_n").zip(wave).map(|(size, wave)| {
                format!("M1's torque ripples by ±{size:.4} N m, {wave}, on the way up and down alike")
            })
        }
        _ => None,
    };
    let fitted: Vec<String> = own
        .iter()
        .filter(|p| p.std > 0.0)
        .map(|p| format!("{} = {:.4} ± {:.1e}", p.name, p.value, p.std))
        .collect();
    let fitted = (!fitted.is_empty()).then(|| format!("fitted to the normal force: {}", fitted.join(", ")));
    sentence.into_iter().chain(fitted).collect()
}
