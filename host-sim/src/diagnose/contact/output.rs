//! A fitted contact in the form that the comparison of causes reads, and as a model file.

use rayon::prelude::*;

use super::model::ContactModel;
use super::problem::{Fitted, Problem, Slot};
use crate::diagnose::analysis::{Channel, Estimate, Fit, LogFit, Role};
use crate::diagnose::record::Record;
use crate::diagnose::search;
use crate::files::model_file::{Extension, Interval, ModelFile};
use crate::fit::bounds::{Parameter, Scale};
use crate::fit::covariance::INTERVAL_95;
use crate::input_error::InputError;

/// Name of the friction channel.
pub const FRICTION: &str = "friction torque";
/// Name of the balance of torques at the disc.
pub const BALANCE: &str = "torque balance of the disc";

/// The fit with residuals and sensitivities of all logs.
pub fn fit(problem: &Problem, fitted: &Fitted, effects: &[&'static str]) -> Result<Fit, String> {
    let origins: Vec<f64> =
        (0..problem.records.len()).into_par_iter().map(|log| problem.origin(fitted, log)).collect();
    let mut logs = (0..problem.records.len())
        .into_par_iter()
        .map(|log| log_fit(problem, fitted, log, origins[log]))
        .collect::<Result<Vec<_>, _>>()?;
    for role in [Role::Train, Role::Holdout] {
        add_balance(problem, fitted, role, &origins, &mut logs);
    }
    let mut parameters = estimates(fitted);
    if problem.has_origin(&fitted.combination) {
        let effect = fitted.slots.iter().find(|slot| slot.log.is_some()).and_then(|slot| slot.effect);
        for (log, value) in origins.iter().copied().enumerate().skip(problem.training()) {
            let name = "origin_rad".to_string();
            parameters.push(Estimate { effect, name, value, std: f64::NAN, log: Some(log) });
        }
    }
    Ok(Fit { effects: effects.to_vec(), parameters, logs })
}

fn estimates(fitted: &Fitted) -> Vec<Estimate> {
    let parameters: Vec<Parameter> = fitted.slots.iter().map(|slot| slot.parameter.clone()).collect();
    let (sum, count) = fitted
        .point
        .residuals
        .iter()
        .filter(|r| !r.is_nan())
        .fold((0.0, 0usize), |(sum, count), r| (sum + search::loss(*r), count + 1));
    // Where the model is not true, what it leaves counts as noise.
    let inflation = (sum / count.max(1) as f64).max(1.0);
    let std = search::standard_deviations(&fitted.point, &parameters, inflation);
    let estimate = |((slot, value), std): ((&Slot, &f64), f64)| Estimate {
        effect: slot.effect,
        name: slot.parameter.name.clone(),
        value: *value,
        std,
        log: slot.log,
    };
    fitted.slots.iter().zip(&fitted.point.values).zip(std).map(estimate).collect()
}

fn log_fit(problem: &Problem, fitted: &Fitted, log: usize, origin: f64) -> Result<LogFit, String> {
    let record = &problem.records[log];
    let model = problem.model_with(fitted, log, origin);
    let all = problem.run_samples(&model, log).map_err(|e| e.to_string())?;
    let sigma = &problem.sigma_nm[log];
    let own = record.friction_nm.noise_std;
    let (mut noise_std, mut used) = (Vec::with_capacity(record.len()), Vec::with_capacity(record.len()));
    for (bin, sigma) in problem.bins[log].iter().zip(sigma) {
        // A bin's mean has less of the channel's noise than a sample.
        let inputs = (sigma * sigma - own * own / bin.len() as f64).max(0.0);
        noise_std.extend(std::iter::repeat_n((inputs + own * own).sqrt(), bin.len()));
        used.extend(std::iter::repeat_n(sigma.is_finite(), bin.len()));
    }
    Ok(LogFit {
        role: record.role,
        time_s: record.time_s.clone(),
        measured: record.friction_nm.values.clone(),
        predicted: all.shown_nm,
        noise_std,
        used,
        channels: vec![friction_channel(problem, fitted, log, &model)?],
    })
}

fn friction_channel(
    problem: &Problem,
    fitted: &Fitted,
    log: usize,
    model: &ContactModel,
) -> Result<Channel, String> {
    let shown = problem.run(model, log).map_err(|e| e.to_string())?.shown_nm;
    Ok(Channel {
        name: FRICTION,
        time_s: problem.plans[log].time_s.clone(),
        residual: problem.friction_residuals(log, &shown),
        sensitivity: problem.rows_of(log).map_or(Vec::new(), |rows| sensitivity(fitted, rows)),
        samples_per_noise: 1.0,
    })
}

/// Rows of the fit's derivatives, by the parameters themselves.
fn sensitivity(fitted: &Fitted, rows: std::ops::Range<usize>) -> Vec<Vec<f64>> {
    let columns = fitted.point.columns.iter().zip(&fitted.slots).zip(&fitted.point.values);
    columns
        .map(|((column, slot), value)| {
            let scale = match slot.parameter.scale {
                Scale::Linear => 1.0,
                Scale::Logarithmic => 1.0 / value,
            };
            column.get(rows.clone()).map_or(Vec::new(), |part| part.iter().map(|x| scale * x).collect())
        })
        .collect()
}

fn add_balance(problem: &Problem, fitted: &Fitted, role: Role, origins: &[f64], logs: &mut [LogFit]) {
    let Some(witness) = problem.witness(role) else { return };
    let own: Vec<usize> = (0..logs.len()).filter(|i| logs[*i].role == role).collect();
    let torques: Option<Vec<_>> = own
        .par_iter()
        .map(|log| problem.run(&problem.model_with(fitted, *log, origins[*log]), *log).ok())
        .collect();
    let Some(torques) = torques else { return };
    let residual = witness.residuals(&torques);
    let first_row = problem.friction_rows();
    let mut at = 0;
    for (log, time_s) in own.into_iter().zip(witness.times_s()) {
        let rows = at..at + time_s.len();
        at = rows.end;
        let sensitivity = match role {
            Role::Train => sensitivity(fitted, first_row + rows.start..first_row + rows.end),
            Role::Holdout => Vec::new(),
        };
        logs[log].channels.push(Channel {
            name: BALANCE,
            time_s,
            residual: residual[rows].to_vec(),
            sensitivity,
            samples_per_noise: 1.0,
        });
    }
}

/// Where the training logs' channels end: those ends at which one clips.
pub fn ends(records: &[Record]) -> Vec<(&'static str, f64)> {
    let train = || records.iter().filter(|record| record.role == Role::Train);
    let lowest = |end: fn(&Record) -> Option<f64>| train().filter_map(end).reduce(f64::min);
    let highest = |end: fn(&Record) -> Option<f64>| train().filter_map(end).reduce(f64::max);
    [
        ("friction_low_nm", lowest(|record| record.friction_nm.clipping.low)),
        ("friction_high_nm", highest(|record| record.friction_nm.clipping.high)),
        ("normal_force_low_n", lowest(|record| record.normal_n.clipping.low)),
        ("normal_force_high_n", highest(|record| record.normal_n.clipping.high)),
    ]
    .into_iter()
    .filter_map(|(name, end)| Some((name, end?)))
    .collect()
}

/// The fitted model as a file.
pub fn model_file(
    problem: &Problem,
    fitted: &Fitted,
    fit: &Fit,
    source: &str,
) -> Result<ModelFile, InputError> {
    let model = problem.model_with(fitted, 0, 0.0);
    let mut file = model.to_file(source)?;
    for estimate in fit.parameters.iter().filter(|p| p.std.is_finite() && p.log.is_none()) {
        let is_own = file.get(&estimate.name).is_some();
        if is_own {
            let half = INTERVAL_95 * estimate.std;
            let (low, high) = (estimate.value - half, estimate.value + half);
            file.intervals.insert(estimate.name.clone(), Interval { std: estimate.std, low, high });
        }
    }
    for (extension, values) in &model.effects {
        let names = extension.names().iter().map(|name| (*name).to_string());
        let parameters = names.zip(values.iter().copied()).collect();
        file.extensions.push(Extension { id: extension.id().into(), parameters });
    }
    Ok(file)
}
