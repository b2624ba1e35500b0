//! `rig fit`: parameters from logs, with intervals.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};

use nalgebra::DMatrix;
use serde::Serialize;

use super::common::{SetArgs, say};
use super::prediction_page;
use super::progress::Progress;
use crate::files::log::{Log, LogKind};
use crate::files::model_file::ModelFile;
use crate::files::number;
use crate::files::output_dir::OutputDir;
use crate::files::rig_file::RigFile;
use crate::files::signal::Signal;
use crate::fit::covariance::INTERVAL_95;
use crate::fit::drive::inverse::{DriveFit, Friction, Motion, identify};
use crate::fit::drive::record::DriveRecord;
use crate::identify::fit_contact::{self, Begin, ContactFit};
use crate::identify::fit_parameters;
use crate::input_error::InputError;
use crate::predict::drive_model;
use crate::predict::observed_slip::{self, predict_by_observed_slip};
use crate::predict::{Comparison, ContactInputs, simulate_friction};
use crate::report::prediction::Prediction;
use crate::report::{Block, Page, Table, value};

/// Identify the parameters of a friction model, or of a drive, from logs
#[derive(clap::Args, Debug)]
#[command(after_long_help = "\
Examples:
  rig fit --rig rig.toml --model start.toml --train run1.csv run2.csv --out target/fit
  rig fit --train drive.csv --out target/drive

Contact logs (time_s, m2_speed_rad_s or m2_angle_rad, normal_force_n, friction_torque_nm): the friction
model's parameters, by the likelihood of the friction torque that the law makes of the slip observed from the
measured force, started from the model file, which may be wrong by a factor of two, and around it. Held unless
--free names them: theta and delta always, sigma1_n_s_per_m and a2_s_per_m where they are 0, sigma0_n_per_m of
the series model. What the logs do not show at all, or only together with another parameter, is refused by
name; what they show too little of has no interval and is listed as \"not determined by these logs\".
Drive logs (time_s, m2_torque_nm, m2_angle_rad, or time_s, force_n, position_m): inertia or mass, viscous
and Coulomb friction and offset, by least squares of the force that the measured motion asks for; once
with the same friction in both directions, once with friction per direction. --rig and --model are not
needed.

Writes model.toml (values, standard deviations, 95 % intervals, correlations as comments), summary.json
(the same, and the error) and prediction.csv or prediction_1.csv … (measured, predicted, residual; predicted
is the simulation in open loop, predicted_by_observed_slip the one-step prediction that was fitted).")]
pub(super) struct Fit {
    /// Rig file (TOML); the assumed rig where left out
    #[arg(long, value_name = "RIG.toml")]
    rig: Option<PathBuf>,
    /// Model file (TOML) to start from; the assumed model where left out
    #[arg(long, value_name = "MODEL.toml")]
    model: Option<PathBuf>,
    /// Logs (CSV, or Parquet by their names), all of one kind
    #[arg(long, value_name = "LOG.csv", num_args = 1.., required = true)]
    train: Vec<PathBuf>,
    /// Identify these parameters instead of the usual ones
    #[arg(long, value_name = "NAME", num_args = 1.., value_delimiter = ',')]
    free: Vec<String>,
    /// Hold these parameters at their start values
    #[arg(long, value_name = "NAME", num_args = 1.., value_delimiter = ',')]
    fix: Vec<String>,
    /// Folder for the results
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    #[command(flatten)]
    set: SetArgs,
}

#[derive(Serialize)]
struct Parameter {
    value: f64,
    std: Option<f64>,
    low_95: Option<f64>,
    high_95: Option<f64>,
}

#[derive(Serialize)]
struct Part {
    parameters: BTreeMap<String, Parameter>,
    /// Pairs of parameters with a correlation of more than 0.5.
    correlations: BTreeMap<String, f64>,
    nrmse: f64,
}

#[derive(Serialize)]
struct ContactSummary {
    kind: &'static str,
    #[serde(flatten)]
    fit: Part,
    /// Of the friction law at the slip observed from the measured force.
    nrmse_by_observed_slip: f64,
    /// Whether a simulation decided in the end, since it left less than the observed slip.
    fitted_by_simulation: bool,
    /// What the observed slip was biased by in logs of this kind and was taken off, relative to the value.
    bias_removed: BTreeMap<String, f64>,
    /// Parameters that these logs do not determine within a factor of e; they have no interval.
    undetermined: Vec<String>,
    /// How much later than the rig file says the friction channel is, found beside the parameters.
    channel_late_ms: f64,
    singular_ratio: f64,
    on_bound: Vec<String>,
    starts_agreeing: usize,
    /// Sets of derivatives that the search took.
    rounds: u64,
    samples: usize,
    assumed: Vec<String>,
}

#[derive(Serialize)]
struct DriveSummary {
    kind: &'static str,
    symmetric: Part,
    per_direction: Option<Part>,
    samples: usize,
}

/// Ends of 95 % intervals even about the values.
fn even_ends(values: &[f64], std: &[f64]) -> Vec<Option<(f64, f64)>> {
    let ends = |(value, std): (&f64, &f64)| {
        std.is_finite().then_some((value - INTERVAL_95 * std, value + INTERVAL_95 * std))
    };
    values.iter().zip(std).map(ends).collect()
}

/// Where there are no ends a parameter is not determined.
fn part(
    names: &[&str],
    values: &[f64],
    std: &[f64],
    ends: &[Option<(f64, f64)>],
    correlations: &DMatrix<f64>,
    nrmse: f64,
) -> Part {
    let parameter = |i: usize| {
        let (low_95, high_95) = ends[i].unzip();
        Parameter { value: values[i], std: ends[i].map(|_| std[i]), low_95, high_95 }
    };
    let mut pairs = BTreeMap::new();
    for i in 0..names.len() {
        for j in 0..i {
            if correlations[(i, j)].abs() > 0.5 {
                pairs.insert(format!("{} / {}", names[j], names[i]), correlations[(i, j)]);
            }
        }
    }
    let parameters = names.iter().enumerate().map(|(i, name)| (name.to_string(), parameter(i))).collect();
    Part { parameters, correlations: pairs, nrmse }
}

impl Part {
    fn comments(&self) -> String {
        let mut text = format!("# nrmse on the logs fitted: {}\n", number::text(self.nrmse));
        for (pair, correlation) in &self.correlations {
            text += &format!("# correlation {pair}: {correlation:.3}\n");
        }
        text
    }

    /// Parameters with their intervals, and what is left of each log.
    fn page(&self, names: &[&str], nrmse: f64, blocks: Vec<Block>) -> Page {
        let rows = names.iter().filter_map(|name| {
            let p = self.parameters.get(*name)?;
            let found = p.std.map_or_else(
                || format!("{} (not determined by these logs)", value::plain(p.value)),
                |std| value::with_uncertainty(p.value, std),
            );
            let interval = p.low_95.zip(p.high_95).map_or("–".to_owned(), |(low, high)| {
                format!("{} to {}", value::plain(low), value::plain(high))
            });
            Some(vec![(*name).to_owned(), found, interval])
        });
        let head = ["parameter", "value ± standard deviation", "95 % interval"].map(str::to_owned).to_vec();
        let mut all = vec![Block::Table(Table { head, rows: rows.collect() })];
        if !self.correlations.is_empty() {
            let rows =
                self.correlations.iter().map(|(pair, c)| vec![pair.clone(), format!("{c:.2}")]).collect();
            let head = ["parameters", "correlation"].map(str::to_owned).to_vec();
            all.push(Block::Heading("Parameters that these logs tell apart badly".into()));
            all.push(Block::Table(Table { head, rows }));
        }
        all.extend(blocks);
        let lead = format!(
            "Residual of {:.2} % RMS on the logs that were fitted; other logs decide.",
            100.0 * nrmse
        );
        Page { title: "Fit".into(), lead, blocks: all }
    }

    fn print(&self, names: &[&str]) {
        for name in names {
            let Some(p) = self.parameters.get(*name) else { continue };
            match p.std {
                Some(std) => say(&format!("{name:32} {}", value::with_uncertainty(p.value, std))),
                None => {
                    say(&format!("{name:32} {}  not determined by these logs", value::plain(p.value)));
                }
            }
        }
    }
}

impl Fit {
    /// Runs the command.
    pub(super) fn run(self) -> Result<(), InputError> {
        let logs = self.train.iter().map(|path| Log::read_as_sampled(path)).collect::<Result<Vec<_>, _>>()?;
        let kind = same_kind(&logs)?;
        match kind {
            LogKind::Contact => self.contact(&logs),
            LogKind::RotaryDrive => self.drive(&logs, Motion::Rotary),
            LogKind::LinearDrive => self.drive(&logs, Motion::Linear),
        }
    }

    fn contact(&self, logs: &[Log]) -> Result<(), InputError> {
        let overrides = self.set.overrides()?;
        overrides.only(true, true, false)?;
        let rig = RigFile::read_or_assumed(self.rig.as_deref(), &overrides.rig)?;
        let model = ModelFile::read_or_assumed(self.model.as_deref(), &overrides.model)?;
        let output = OutputDir::new(&self.out)?;
        let mut free =
            if self.free.is_empty() { fit_parameters::default_free(&model) } else { self.free.clone() };
        for name in &self.fix {
            if model.get(name).is_none() {
                let names: Vec<&str> = model.parameters().map(|(name, _)| name).collect();
                return Err(InputError::new("unknown parameter")
                    .file("--fix")
                    .key(name.as_str())
                    .allowed(names.join(", ")));
            }
            free.retain(|free| free != name);
        }
        // Five starts of at most five rounds, some ten to converge, then some twenty steps by simulation.
        let bar = Mutex::new(Progress::new("fitting", 55));
        let rounds = AtomicU64::new(0);
        let progress = || {
            rounds.fetch_add(1, Ordering::Relaxed);
            bar.lock().unwrap_or_else(PoisonError::into_inner).advance(1);
        };
        let fit = fit_contact::identify(&model, &rig, logs, &free, Begin::Around, &progress)?;
        drop(bar);
        write_contact(output, &fit, logs, &rig, rounds.into_inner())
    }

    fn drive(&self, logs: &[Log], motion: Motion) -> Result<(), InputError> {
        if let Some(name) = self.free.iter().chain(&self.fix).next() {
            return Err(InputError::new("a drive's parameters are all identified")
                .key(name.as_str())
                .allowed("--free and --fix for contact logs"));
        }
        let mut output = OutputDir::new(&self.out)?;
        let records = logs.iter().map(drive_model::record).collect::<Result<Vec<_>, _>>()?;
        let refuse = |why: crate::fit::error::FitError| {
            InputError::new(why.to_string())
                .file(logs.iter().map(|l| l.source.as_str()).collect::<Vec<_>>().join(", "))
        };
        let symmetric = identify(&records, Friction::Symmetric, motion).map_err(refuse)?;
        // Motion in one direction only does not tell the other's friction; the symmetric model stands.
        let directed = identify(&records, Friction::PerDirection, motion).ok();
        let summed = |fit: &DriveFit| {
            let ends = even_ends(&fit.values, &fit.std);
            part(fit.names, &fit.values, &fit.std, &ends, &fit.correlations, fit.relative_force_error)
        };
        let main = summed(&symmetric);
        main.print(symmetric.names);
        say(&format!("relative force error {:.3} %", 100.0 * symmetric.relative_force_error));
        if let Some(directed) = &directed {
            say("with friction per direction:");
            summed(directed).print(directed.names);
            say(&format!("relative force error {:.3} %", 100.0 * directed.relative_force_error));
        }
        output.write("model.toml", drive_toml(&main, &symmetric, directed.as_ref()))?;
        let mut blocks = Vec::new();
        for (i, comparison) in symmetric.comparisons.iter().enumerate() {
            let prediction = Prediction {
                name: format!("Effort, {}", logs.get(i).map_or("", |log| log.source.as_str())),
                quantity: if motion == Motion::Linear { "force, N" } else { "torque, N m" },
                time_s: &comparison.time_s,
                measured: &comparison.measured,
                predicted: &comparison.predicted,
                over: vec![("time, s", comparison.time_s.clone())],
            };
            blocks.extend(prediction.blocks());
            let residual =
                comparison.measured.iter().zip(&comparison.predicted).map(|(m, p)| m - p).collect();
            let columns = (
                comparison.time_s.clone(),
                comparison.measured.clone(),
                comparison.predicted.clone(),
                residual,
            );
            output.write_table(&table_name(i, records.len()), &table(columns))?;
        }
        let page = main.page(symmetric.names, symmetric.relative_force_error, blocks);
        output.write("report.html", page.to_html())?;
        let summary = DriveSummary {
            kind: "drive",
            symmetric: main,
            per_direction: directed.as_ref().map(summed),
            samples: records.iter().map(DriveRecord::len).sum(),
        };
        output.write_json("summary.json", &summary)?;
        output.finish()
    }
}

fn write_contact(
    mut output: OutputDir,
    fit: &ContactFit,
    logs: &[Log],
    rig: &RigFile,
    rounds: u64,
) -> Result<(), InputError> {
    let names: Vec<&str> = fit.names.iter().map(String::as_str).collect();
    // The model that was fitted has no effects, whatever the file keeps.
    let mut plain = fit.model.clone();
    plain.extensions.clear();
    let (mut error, mut signal) = (0.0, 0.0);
    let mut blocks = Vec::new();
    for (i, log) in logs.iter().enumerate() {
        let signals = log.contact()?;
        let comparison = Comparison {
            measured: signals.friction_torque_nm.to_vec(),
            predicted: simulate_friction(&plain, rig, &ContactInputs::new(&signals, rig))?,
        };
        let residual = comparison.residual();
        error += residual.iter().map(|x| x * x).sum::<f64>();
        signal += comparison.measured.iter().map(|x| x * x).sum::<f64>();
        let name = format!("Friction torque, {}", log.source);
        blocks.extend(
            prediction_page::friction(&name, &signals, &comparison.measured, &comparison.predicted).blocks(),
        );
        let time_s = signals.time_s.to_vec();
        let mut table = table((time_s, comparison.measured, comparison.predicted, residual));
        table.set_numbers(observed_slip::COLUMN, predict_by_observed_slip(&plain, rig, log)?);
        output.write_table(&table_name(i, logs.len()), &table)?;
    }
    let nrmse = (error / f64::max(signal, f64::MIN_POSITIVE)).sqrt();
    let undetermined: Vec<String> = fit.undetermined().into_iter().map(String::from).collect();
    let found = part(&names, &fit.values, &fit.std, &fit.ends, &fit.correlations, nrmse);
    let remarks: String =
        undetermined.iter().map(|name| format!("# {name}: not determined by these logs\n")).collect();
    output.write("model.toml", found.comments() + &remarks + &fit.model.to_toml())?;
    found.print(&names);
    output.write("report.html", found.page(&names, nrmse, blocks).to_html())?;
    for name in &fit.on_bound {
        say(&format!("{name} ended on a bound: it is outside of what is searched, or not needed"));
    }
    say(&format!(
        "left of the friction torque: {:.2} % simulated from the start, {:.2} % one step ahead by the observed slip",
        100.0 * nrmse,
        100.0 * fit.nrmse_by_observed_slip
    ));
    if let Some(left_out) = &fit.left_out {
        say(left_out);
    }
    if fit.simulated {
        say(
            "a simulation of these logs leaves less than the observed slip does: the numbers are those of the simulation",
        );
    }
    let most = names.iter().zip(&fit.bias).max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()));
    if let (Some((name, bias)), false) = (most, fit.simulated) {
        say(&format!("bias of the observed slip, taken off: at most {:.1} %, of {name}", 100.0 * bias));
    }
    let summary = ContactSummary {
        kind: fit.model.kind.name(),
        fit: found,
        nrmse_by_observed_slip: fit.nrmse_by_observed_slip,
        fitted_by_simulation: fit.simulated,
        bias_removed: fit.names.iter().cloned().zip(fit.bias.iter().copied()).collect(),
        undetermined,
        channel_late_ms: fit.late_ms,
        singular_ratio: fit.singular_ratio,
        on_bound: fit.on_bound.clone(),
        starts_agreeing: fit.starts_agreeing,
        rounds,
        samples: logs.iter().map(Log::len).sum(),
        assumed: rig.assumed.clone(),
    };
    output.write_json("summary.json", &summary)?;
    output.finish()
}

/// The drive as TOML: symmetric friction, and friction per direction in a table of its own.
fn drive_toml(main: &Part, symmetric: &DriveFit, directed: Option<&DriveFit>) -> String {
    let mut text = main.comments() + "kind = \"drive\"\n\n[parameters]\n";
    let lines = |fit: &DriveFit| -> String {
        fit.names.iter().zip(&fit.values).map(|(n, v)| format!("{n} = {}\n", number::text(*v))).collect()
    };
    text += &lines(symmetric);
    text += "\n# Standard deviation and 95 % interval of each parameter.\n[intervals]\n";
    for ((name, value), std) in symmetric.names.iter().zip(&symmetric.values).zip(&symmetric.std) {
        if std.is_finite() {
            let end = |sign: f64| number::text(value + sign * INTERVAL_95 * std);
            let (std, low, high) = (number::text(*std), end(-1.0), end(1.0));
            text += &format!("{name} = {{ std = {std}, low = {low}, high = {high} }}\n");
        }
    }
    if let Some(directed) = directed {
        text += &format!("\n# nrmse {}\n[per_direction]\n", number::text(directed.relative_force_error));
        text += &lines(directed);
    }
    text
}

fn same_kind(logs: &[Log]) -> Result<LogKind, InputError> {
    let Some(first) = logs.first() else { return Err(InputError::new("no log").key("--train")) };
    let kind = first.kind()?;
    for log in logs {
        if log.kind()? != kind {
            return Err(InputError::new("another kind of log than the first")
                .file(log.source.as_str())
                .allowed(format!("logs with the columns of {}", first.source)));
        }
    }
    Ok(kind)
}

fn table_name(index: usize, count: usize) -> String {
    if count == 1 { "prediction.csv".into() } else { format!("prediction_{}.csv", index + 1) }
}

fn table((time, measured, predicted, residual): (Vec<f64>, Vec<f64>, Vec<f64>, Vec<f64>)) -> Log {
    let mut table = Log::default();
    table.set_signal(Signal::Time, time);
    table.set_numbers("measured", measured);
    table.set_numbers("predicted", predicted);
    table.set_numbers("residual", residual);
    table
}
