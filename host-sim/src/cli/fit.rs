//! `rig fit`: parameters from logs, with intervals.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use nalgebra::DMatrix;
use serde::Serialize;

use super::common::{SetArgs, say};
use super::progress::Progress;
use crate::diagnose::analysis::Role;
use crate::diagnose::record::Record;
use crate::files::log::{Log, LogKind};
use crate::files::model_file::ModelFile;
use crate::files::number;
use crate::files::output_dir::OutputDir;
use crate::files::rig_file::RigFile;
use crate::files::signal::Signal;
use crate::fit::contact::{self, ContactFit};
use crate::fit::covariance::INTERVAL_95;
use crate::fit::drive::inverse::{DriveFit, Friction, Motion, identify};
use crate::fit::drive::record::{DriveRecord, FEWEST_SAMPLES};
use crate::input_error::InputError;

/// Identify the parameters of a friction model, or of a drive, from logs
#[derive(clap::Args, Debug)]
#[command(after_long_help = "\
Examples:
  rig fit --rig rig.toml --model start.toml --train run1.csv run2.csv --out target/fit
  rig fit --train drive.csv --out target/drive

Contact logs (time_s, m2_speed_rad_s or m2_angle_rad, normal_force_n, friction_torque_nm): the friction
model's parameters, by least squares of the simulated friction torque, started from the model file and
from the data. Held unless --free names them: theta and delta always, sigma1_n_s_per_m and a2_s_per_m
where they are 0, sigma0_n_per_m of the series model. What the logs cannot identify is refused by name.
Drive logs (time_s, m2_torque_nm, m2_angle_rad, or time_s, force_n, position_m): inertia or mass, viscous
and Coulomb friction and offset, by least squares of the force that the measured motion asks for; once
with the same friction in both directions, once with friction per direction. --rig and --model are not
needed.

Writes model.toml (values, standard deviations, 95 % intervals, correlations as comments), summary.json
(the same, and the error) and prediction.csv or prediction_1.csv … (measured, predicted, residual).")]
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
    singular_ratio: f64,
    on_bound: Vec<String>,
    starts_agreeing: usize,
    simulations: u64,
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

fn part(names: &[&str], values: &[f64], std: &[f64], correlations: &DMatrix<f64>, nrmse: f64) -> Part {
    let parameter = |i: usize| {
        let finite = std[i].is_finite().then_some(std[i]);
        let end = |sign: f64| finite.map(|std| values[i] + sign * INTERVAL_95 * std);
        Parameter { value: values[i], std: finite, low_95: end(-1.0), high_95: end(1.0) }
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

    fn print(&self, names: &[&str]) {
        for name in names {
            let Some(p) = self.parameters.get(*name) else { continue };
            match p.std {
                Some(std) => say(&format!("{name:32} {:12.6}  ± {std:.2e}", p.value)),
                None => say(&format!("{name:32} {:12.6}", p.value)),
            }
        }
    }
}

impl Fit {
    /// Runs the command.
    pub(super) fn run(self) -> Result<(), InputError> {
        let logs = self.train.iter().map(|path| Log::read(path)).collect::<Result<Vec<_>, _>>()?;
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
        let mut free = if self.free.is_empty() { contact::default_free(&model) } else { self.free.clone() };
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
        let records =
            logs.iter().map(|log| Record::new(log, Role::Train, &rig)).collect::<Result<Vec<_>, _>>()?;
        // About what two starts and the last search take.
        let expected = (logs.len() * 30 * (2 * free.len() + 1)) as u64;
        let progress = Mutex::new(Progress::new("simulating", expected));
        let told = || progress.lock().unwrap_or_else(PoisonError::into_inner).advance(1);
        let fit = contact::identify(&model, &rig, &records, &free, &told)?;
        drop(progress);
        self.write_contact(output, &fit, &records, &rig)
    }

    fn write_contact(
        &self,
        mut output: OutputDir,
        fit: &ContactFit,
        records: &[Record],
        rig: &RigFile,
    ) -> Result<(), InputError> {
        let names: Vec<&str> = fit.names.iter().map(String::as_str).collect();
        let found = part(&names, &fit.values, &fit.std, &fit.correlations, fit.nrmse);
        output.write("model.toml", found.comments() + &fit.model.to_toml())?;
        found.print(&names);
        for name in &fit.on_bound {
            say(&format!("{name} ended on a bound: it is outside of what is searched, or not needed"));
        }
        say(&format!("friction  nrmse {:.3e}", fit.nrmse));
        for (i, (record, comparison)) in records.iter().zip(&fit.comparisons).enumerate() {
            let residual = comparison.residual();
            let columns =
                (record.time_s.clone(), comparison.measured.clone(), comparison.predicted.clone(), residual);
            output.write_table(&table_name(i, records.len()), &table(columns))?;
        }
        let summary = ContactSummary {
            kind: fit.model.kind.name(),
            fit: found,
            singular_ratio: fit.singular_ratio,
            on_bound: fit.on_bound.clone(),
            starts_agreeing: fit.starts_agreeing,
            simulations: fit.simulations,
            samples: records.iter().map(Record::len).sum(),
            assumed: rig.assumed.clone(),
        };
        output.write_json("summary.json", &summary)?;
        finish(output)
    }

    fn drive(&self, logs: &[Log], motion: Motion) -> Result<(), InputError> {
        if let Some(name) = self.free.iter().chain(&self.fix).next() {
            return Err(InputError::new("a drive's parameters are all identified")
                .key(name.as_str())
                .allowed("--free and --fix for contact logs"));
        }
        let mut output = OutputDir::new(&self.out)?;
        let records = logs.iter().map(drive_record).collect::<Result<Vec<_>, _>>()?;
        let refuse = |why: crate::fit::error::FitError| {
            InputError::new(why.to_string())
                .file(logs.iter().map(|l| l.source.as_str()).collect::<Vec<_>>().join(", "))
        };
        let symmetric = identify(&records, Friction::Symmetric, motion).map_err(refuse)?;
        // Motion in one direction only does not tell the other's friction; the symmetric model stands.
        let directed = identify(&records, Friction::PerDirection, motion).ok();
        let summed = |fit: &DriveFit| {
            part(fit.names, &fit.values, &fit.std, &fit.correlations, fit.relative_force_error)
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
        for (i, comparison) in symmetric.comparisons.iter().enumerate() {
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
        let summary = DriveSummary {
            kind: "drive",
            symmetric: main,
            per_direction: directed.as_ref().map(summed),
            samples: records.iter().map(DriveRecord::len).sum(),
        };
        output.write_json("summary.json", &summary)?;
        finish(output)
    }
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

fn drive_record(log: &Log) -> Result<DriveRecord, InputError> {
    let signals = log.drive()?;
    DriveRecord::new(signals.time_s, signals.effort, signals.position).ok_or_else(|| {
        InputError::new(format!("{} samples", log.len()))
            .file(log.source.as_str())
            .allowed(format!("at least {FEWEST_SAMPLES} samples"))
    })
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

fn finish(output: OutputDir) -> Result<(), InputError> {
    let folder: PathBuf = Path::to_path_buf(output.folder());
    output.finish()?;
    say(&format!("written to {}", folder.display()));
    Ok(())
}
