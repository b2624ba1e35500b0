//! Identification of a friction model from contact logs.
//!
//! **What is minimised** is the output error: measured friction torque minus the torque that the model,
//! driven with the measured motion and load and seen through the rig's friction bridge, would show.
//! An equation error would need the bristles' and the block's states, which nothing measures. Speed and
//! normal force are noisy too, and a model driven with noise would answer to it; so they are smoothed
//! first, as far as the data allow without moving a jump ([`crate::diagnose::smooth`]). What noise is
//! left in them is small against the friction channel's own.
//!
//! Residuals are divided by the channel's noise and a small part of the signal, and enter as
//! ρ(r) = ν ln(1 + r²/ν): a load step that is off by a sample must not outvote a second of sliding.
//! Samples at which the channel clips count nothing. The first sample tells what force the element
//! holds when the log begins. Without load there is no friction to compare, and such samples count
//! nothing either.
//!
//! θ scales a0 and a1 and cannot be told from them; δ shapes the same curve as a1 and v0. Both are held
//! unless asked for, as are σ1 and a2 where the start value is zero, and σ0 of the series element,
//! whose bristles yield micrometres where the block yields millimetres.
//! Left out: gain and zero of the channels.

use std::sync::atomic::{AtomicU64, Ordering};

use nalgebra::DMatrix;

use super::bounds::Parameter;
use super::error::FitError;
use super::least_squares::{Options, Solution, minimise, search};
use crate::diagnose::record::Record;
use crate::files::model_file::{Interval, ModelFile, ModelKind};
use crate::files::rig_file::RigFile;
use crate::fit::covariance::INTERVAL_95;
use crate::input_error::InputError;
use crate::predict::{Accuracy, Comparison, ContactInputs, StepPlan, simulate_planned};

/// ν of the loss.
const FREEDOM: f64 = 20.0;
/// Part of the friction's RMS that a model is not blamed for: rounding of the steps.
const SIGNAL_SHARE: f64 = 3e-3;
/// Loads below this share of the largest do not tell about friction.
const LEAST_LOAD: f64 = 0.02;
/// Starts that the search is run from.
const STARTS: usize = 2;

/// An identified friction model.
#[derive(Debug, Clone)]
pub struct ContactFit {
    /// The model with its intervals.
    pub model: ModelFile,
    /// Names of the free parameters.
    pub names: Vec<String>,
    /// Their values.
    pub values: Vec<f64>,
    /// Their standard deviations.
    pub std: Vec<f64>,
    /// Their correlations.
    pub correlations: DMatrix<f64>,
    /// Smallest over largest singular value of the scaled Jacobian.
    pub singular_ratio: f64,
    /// Parameters that ended on a bound.
    pub on_bound: Vec<String>,
    /// Starts that ended at the same optimum.
    pub starts_agreeing: usize,
    /// RMS error over RMS of the friction torque, over all logs.
    pub nrmse: f64,
    /// Simulations that it took.
    pub simulations: u64,
    /// Friction torque of each log.
    pub comparisons: Vec<Comparison>,
}

/// Search range of a parameter around a start value; `None` for a name without one.
fn parameter(name: &str, value: f64) -> Option<Parameter> {
    let log = |low: f64, high: f64| {
        Some(Parameter::logarithmic(name, value.clamp(low, high), low.min(value), high.max(value)))
    };
    let linear = |low: f64, high: f64| {
        Some(Parameter::linear(name, value.clamp(low, high), low.min(value), high.max(value)))
    };
    match name {
        "sigma0_n_per_m" => log(1e3, 1e9),
        "sigma1_n_s_per_m" => linear(0.0, 1e4),
        "a0" => log(0.01, 3.0),
        "a1" => linear(0.0, 3.0),
        "a2_s_per_m" => linear(0.0, 2.0),
        "v0_m_s" => log(1e-4, 10.0),
        "delta" => linear(0.3, 2.0),
        "theta" => log(0.1, 5.0),
        "k_u_n_per_m" => log(1e2, 1e7),
        "c_u_n_s_per_m" => log(0.1, 1e5),
        "c_n_per_m" => log(1e2, 1e8),
        "mu_s" | "mu_c" => log(0.01, 5.0),
        _ => None,
    }
}

/// Parameters that are identified where nothing else is asked for.
pub fn default_free(model: &ModelFile) -> Vec<String> {
    let held = |name: &str, value: f64| match name {
        "theta" | "delta" => true,
        "sigma1_n_s_per_m" | "a2_s_per_m" => value == 0.0,
        "sigma0_n_per_m" => model.kind == ModelKind::Series,
        _ => false,
    };
    model.parameters().filter(|(name, value)| !held(name, *value)).map(|(name, _)| name.to_string()).collect()
}

struct Case<'a> {
    record: &'a Record,
    inputs: ContactInputs,
    /// 1/σ, zero where a sample does not count.
    weight: Vec<f64>,
}

impl<'a> Case<'a> {
    fn new(record: &'a Record, rig: &RigFile) -> Self {
        let radius_m = rig.friction_radius_m;
        let friction = &record.friction_nm;
        let (speed_rad_s, load) = record.inputs(None);
        let largest = load.iter().copied().fold(0.0, f64::max);
        let square = friction.values.iter().map(|x| x * x).sum::<f64>() / friction.values.len().max(1) as f64;
        let sigma = (friction.noise_std.powi(2) + SIGNAL_SHARE.powi(2) * square).sqrt().max(1e-12);
        let weight = (0..record.len())
            .map(|i| {
                let counts = i > 0 && !friction.clipped(i) && load[i] > LEAST_LOAD * largest;
                if counts { 1.0 / sigma } else { 0.0 }
            })
            .collect();
        let inputs = ContactInputs {
            time_s: record.time_s.clone(),
            sliding_speed_m_s: speed_rad_s.iter().map(|v| v * radius_m).collect(),
            disc_angle_rad: record.angle_rad.clone(),
            normal_force_n: load,
            initial_friction_n: friction.values.first().copied().unwrap_or(0.0) / radius_m,
        };
        Self { record, inputs, weight }
    }

    /// Friction coefficients in steady sliding, sorted by size.
    fn coefficients(&self, radius_m: f64) -> Vec<f64> {
        let fast = self.inputs.sliding_speed_m_s.iter().map(|v| v.abs()).fold(0.0, f64::max);
        let mut all: Vec<f64> = (0..self.inputs.len())
            .filter(|&i| self.weight[i] > 0.0 && self.inputs.sliding_speed_m_s[i].abs() > 0.02 * fast)
            .map(|i| self.record.friction_nm.values[i].abs() / radius_m / self.inputs.normal_force_n[i])
            .collect();
        all.sort_by(f64::total_cmp);
        all
    }
}

/// Identifies the parameters `free` of `model` from prepared logs. `told` hears of every simulation.
pub fn identify(
    model: &ModelFile,
    rig: &RigFile,
    records: &[Record],
    free: &[String],
    told: &(dyn Fn() + Sync),
) -> Result<ContactFit, InputError> {
    let refuse = |problem: String| InputError::new(problem).file(model.source.as_str());
    let cases: Vec<Case<'_>> = records.iter().map(|record| Case::new(record, rig)).collect();
    let mut parameters = free
        .iter()
        .map(|name| {
            let value = model.get(name);
            value.and_then(|value| parameter(name, value)).ok_or_else(|| {
                let names: Vec<&str> = model.parameters().map(|(name, _)| name).collect();
                refuse("unknown parameter".into()).key(name.as_str()).allowed(names.join(", "))
            })
        })
        .collect::<Result<Vec<_>, _>>()?;
    if parameters.is_empty() {
        return Err(refuse("no parameter is free".into()));
    }
    let simulations = AtomicU64::new(0);
    let with = |values: &[f64], parameters: &[Parameter]| -> Option<ModelFile> {
        let mut trial = model.clone();
        trial.extensions.clear();
        for (parameter, value) in parameters.iter().zip(values) {
            trial.set(&parameter.name, *value).ok()?;
        }
        if let (Some(mu_s), Some(mu_c)) = (trial.get("mu_s"), trial.get("mu_c"))
            && mu_c > mu_s
        {
            trial.set("mu_c", mu_s).ok()?;
        }
        Some(trial)
    };
    let plans_for = |trial: &ModelFile| -> Result<Vec<StepPlan>, InputError> {
        let element = trial.friction_model(1e-4)?;
        Ok(cases
            .iter()
            .map(|case| StepPlan::new(&element, &rig.friction_bridge, &case.inputs, Accuracy::Fast))
            .collect())
    };
    let simulate = |trial: &ModelFile, plans: &[StepPlan]| -> Option<Vec<Vec<f64>>> {
        cases
            .iter()
            .zip(plans)
            .map(|(case, plan)| {
                simulations.fetch_add(1, Ordering::Relaxed);
                told();
                simulate_planned(trial, rig, &case.inputs, plan).ok()
            })
            .collect()
    };
    let residuals = |values: &[f64], parameters: &[Parameter], plans: &[StepPlan]| -> Option<Vec<f64>> {
        let predicted = simulate(&with(values, parameters)?, plans)?;
        let mut all = Vec::with_capacity(cases.iter().map(|case| case.weight.len()).sum());
        for (case, predicted) in cases.iter().zip(&predicted) {
            let measured = &case.record.friction_nm.values;
            all.extend(
                measured.iter().zip(predicted).zip(&case.weight).map(|((m, p), w)| softened((m - p) * w)),
            );
        }
        Some(all)
    };

    let first: Vec<f64> = parameters.iter().map(|p| p.start).collect();
    let plans =
        plans_for(&with(&first, &parameters).ok_or_else(|| refuse(FitError::NotFinite.to_string()))?)?;
    let cost = |values: &[f64]| -> f64 {
        residuals(values, &parameters, &plans).map_or(f64::INFINITY, |r| r.iter().map(|r| r * r).sum())
    };
    let mut starts: Vec<(f64, Vec<f64>)> =
        starts(&parameters, &cases, rig.friction_radius_m).into_iter().map(|s| (cost(&s), s)).collect();
    starts.push((cost(&first), first));
    starts.sort_by(|a, b| a.0.total_cmp(&b.0));
    starts.truncate(STARTS);
    let coarse = Options { patience: 2, tolerance: 1e-3, one_sided: true, ..Options::default() };
    let mut found: Vec<(f64, Vec<f64>)> = Vec::new();
    let mut refused = None;
    for (_, start) in &starts {
        let mut from = parameters.clone();
        from.iter_mut().zip(start).for_each(|(parameter, value)| parameter.start = *value);
        match search(&from, &[], &|values| residuals(values, &parameters, &plans), coarse) {
            Ok(values) => found.push((cost(&values), values)),
            Err(why) => refused = Some(why),
        }
    }
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
    let Some((best, values)) = found.first().cloned() else {
        return Err(refuse(refused.unwrap_or(FitError::NotFinite).to_string()));
    };
    let starts_agreeing = found.iter().filter(|(cost, _)| *cost < 1.02 * best).count();
    // Once more with steps made for the parameters found, and with what can be said about them.
    parameters.iter_mut().zip(&values).for_each(|(parameter, value)| parameter.start = *value);
    let plans =
        plans_for(&with(&values, &parameters).ok_or_else(|| refuse(FitError::NotFinite.to_string()))?)?;
    let fine = Options { patience: 2, tolerance: 1e-5, ..Options::default() };
    let solution = minimise(&parameters, &[], &|values| residuals(values, &parameters, &plans), fine)
        .map_err(|why| refuse(why.to_string()))?;
    let mut fitted =
        with(&solution.values, &parameters).ok_or_else(|| refuse(FitError::NotFinite.to_string()))?;
    fitted.extensions.clone_from(&model.extensions);
    set_intervals(&mut fitted, &parameters, &solution);
    let predicted = simulate(&fitted, &plans).ok_or_else(|| refuse(FitError::NotFinite.to_string()))?;
    let comparisons: Vec<Comparison> = cases
        .iter()
        .zip(predicted)
        .map(|(case, predicted)| Comparison { measured: case.record.friction_nm.values.clone(), predicted })
        .collect();
    let (mut error, mut signal) = (0.0, 0.0);
    for comparison in &comparisons {
        error += comparison.residual().iter().map(|x| x * x).sum::<f64>();
        signal += comparison.measured.iter().map(|x| x * x).sum::<f64>();
    }
    Ok(ContactFit {
        model: fitted,
        names: parameters.iter().map(|p| p.name.clone()).collect(),
        on_bound: solution.on_bound.iter().map(|i| parameters[*i].name.clone()).collect(),
        values: solution.values,
        std: solution.std,
        correlations: solution.correlations,
        singular_ratio: solution.singular_ratio,
        starts_agreeing,
        nrmse: (error / f64::max(signal, f64::MIN_POSITIVE)).sqrt(),
        simulations: simulations.into_inner(),
        comparisons,
    })
}

/// The square root of ρ with the residual's sign.
fn softened(residual: f64) -> f64 {
    (FREEDOM * (residual * residual / FREEDOM).ln_1p()).sqrt().copysign(residual)
}

/// Starts from the data: friction coefficients as measured, with several characteristic speeds.
fn starts(parameters: &[Parameter], cases: &[Case<'_>], radius_m: f64) -> Vec<Vec<f64>> {
    let mut all: Vec<f64> = cases.iter().flat_map(|case| case.coefficients(radius_m)).collect();
    all.sort_by(f64::total_cmp);
    let at = |share: f64| all.get((share * all.len() as f64) as usize).copied();
    let (Some(low), Some(high)) = (at(0.1), at(0.98)) else { return Vec::new() };
    let fast = cases
        .iter()
        .flat_map(|case| case.inputs.sliding_speed_m_s.iter().map(|v| v.abs()))
        .fold(0.0, f64::max);
    [None, Some(0.03 * fast), Some(0.2 * fast), Some(fast)]
        .into_iter()
        .map(|speed| {
            parameters
                .iter()
                .map(|p| {
                    let value = match p.name.as_str() {
                        "a0" | "mu_c" => low,
                        "mu_s" => high,
                        // The curve at standstill lies above what is reached in sliding.
                        "a1" => 1.5 * (high - low),
                        "v0_m_s" => speed.unwrap_or(p.start),
                        _ => p.start,
                    };
                    value.clamp(p.low, p.high)
                })
                .collect()
        })
        .collect()
}

fn set_intervals(model: &mut ModelFile, parameters: &[Parameter], solution: &Solution) {
    for (i, parameter) in parameters.iter().enumerate() {
        let (value, std) = (solution.values[i], solution.std[i]);
        if std.is_finite() {
            let half = INTERVAL_95 * std;
            let interval = Interval { std, low: value - half, high: value + half };
            model.intervals.insert(parameter.name.clone(), interval);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::analysis::Role;
    use crate::files::log::Log;
    use crate::files::signal::Signal;
    use crate::predict::simulate_friction;

    /// A log of a known LuGre element: reversals at several speeds and loads, noise on all channels.
    fn log(model: &ModelFile, rig: &RigFile, sticking: bool, seed: u64) -> Log {
        let mut seed = seed;
        let mut noise = |size: f64| {
            let mut sum = 0.0;
            for _ in 0..12 {
                seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                sum += (seed >> 11) as f64 / (1u64 << 53) as f64 - 0.5;
            }
            size * sum
        };
        let time: Vec<f64> = (0..8000).map(|i| 1e-3 * f64::from(i)).collect();
        let speed: Vec<f64> = time
            .iter()
            .map(|t| {
                if sticking { (8.0 * (1.3 * t).sin() + 4.0 * (3.1 * t).sin()).clamp(-9.0, 9.0) } else { 9.0 }
            })
            .collect();
        let load: Vec<f64> = time.iter().map(|t| 70.0 + 25.0 * (0.7 * t).sin()).collect();
        let mut clean = Log::default();
        clean.set_signal(Signal::Time, time);
        clean.set_signal(Signal::M2Speed, speed.clone());
        clean.set_signal(Signal::NormalForce, load.clone());
        clean.set_signal(Signal::FrictionTorque, vec![0.0; speed.len()]);
        let torque =
            simulate_friction(model, rig, &ContactInputs::new(&clean.contact().unwrap(), rig)).unwrap();
        let mut shown = clean;
        shown.set_signal(Signal::M2Speed, speed.iter().map(|v| v + noise(0.01)).collect());
        shown.set_signal(Signal::NormalForce, load.iter().map(|n| n + noise(0.3)).collect());
        shown.set_signal(Signal::FrictionTorque, torque.iter().map(|t| t + noise(0.02)).collect());
        shown
    }

    fn truth() -> ModelFile {
        let numbers = [("sigma0_n_per_m", 3e4), ("a0", 0.6), ("a1", 0.4), ("v0_m_s", 0.1)];
        ModelFile::new("truth", ModelKind::Lugre, &numbers).unwrap()
    }

    fn guess() -> ModelFile {
        let numbers = [("sigma0_n_per_m", 2e5), ("a0", 0.9), ("a1", 0.2), ("v0_m_s", 0.5)];
        ModelFile::new("guess", ModelKind::Lugre, &numbers).unwrap()
    }

    #[test]
    fn a_lugre_element_is_identified_from_noisy_inputs_within_its_intervals() {
        let rig = RigFile::assumed_rig(&[]).unwrap();
        let logs = [log(&truth(), &rig, true, 1), log(&truth(), &rig, true, 2)];
        let records: Vec<Record> = logs.iter().map(|l| Record::new(l, Role::Train, &rig).unwrap()).collect();
        let fit = identify(&guess(), &rig, &records, &default_free(&guess()), &|| ()).unwrap();
        for (name, value) in truth().parameters().filter(|(name, _)| fit.names.contains(&name.to_string())) {
            let found = fit.model.get(name).unwrap();
            // Noise of 0.5 % of the friction on 16 000 samples; smoothing of the inputs biases by some 1 %.
            assert!((found / value - 1.0).abs() < 0.04, "{name}: {found} for {value}");
            assert!(fit.model.intervals[name].std < 0.05 * value, "{name}");
        }
        assert!(fit.nrmse < 0.02, "{}", fit.nrmse);
    }

    #[test]
    fn steady_sliding_does_not_tell_the_bristle_stiffness() {
        let rig = RigFile::assumed_rig(&[]).unwrap();
        let logs = [log(&truth(), &rig, false, 3)];
        let records: Vec<Record> = logs.iter().map(|l| Record::new(l, Role::Train, &rig).unwrap()).collect();
        let error =
            identify(&guess(), &rig, &records, &default_free(&guess()), &|| ()).unwrap_err().to_string();
        assert!(error.contains("a0") || error.contains("sigma0_n_per_m"), "{error}");
    }

    #[test]
    fn theta_and_the_coefficients_that_it_scales_are_refused_together() {
        let rig = RigFile::assumed_rig(&[]).unwrap();
        let logs = [log(&truth(), &rig, true, 4)];
        let records: Vec<Record> = logs.iter().map(|l| Record::new(l, Role::Train, &rig).unwrap()).collect();
        let free: Vec<String> = ["theta", "a0", "a1", "v0_m_s"].map(String::from).to_vec();
        let error = identify(&guess(), &rig, &records, &free, &|| ()).unwrap_err().to_string();
        for name in ["theta", "a0", "a1"] {
            assert!(error.contains(name), "{error}");
        }
        assert!(error.contains("cannot be told apart"), "{error}");
    }
}
