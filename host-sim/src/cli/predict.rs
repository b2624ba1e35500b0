//! `rig predict`: a model driven with the measured inputs of a log.

use std::collections::BTreeMap;
use std::path::PathBuf;

use serde::Serialize;

use super::common::{SetArgs, say};
use super::prediction_page;
use crate::files::drive_model::DriveModel;
use crate::files::log::Log;
use crate::files::model_file::ModelFile;
use crate::files::output_dir::OutputDir;
use crate::files::rig_file::RigFile;
use crate::files::signal::Signal;
use crate::input_error::InputError;
use crate::predict::drive_model::predict_drive_log;
use crate::predict::observed_slip::{self, predict_by_observed_slip};
use crate::predict::{
    Comparison, ContactInputs, acts_on_friction, effects_elsewhere, nrmse as nrmse_of, predict_drive,
    predict_normal_force, simulate_friction,
};
use crate::report::prediction::Prediction;
use crate::report::{Block, Page, Table};

/// Drive a model with the measured inputs of a log; write measured, predicted, residual
#[derive(clap::Args, Debug)]
#[command(after_long_help = "\
Example:
  rig predict --rig rig.toml --model model.toml --log run.csv --out target/predict
  rig predict --model drive.toml --log drive.csv --out target/predict

Reads time_s, m2_speed_rad_s (or m2_angle_rad), normal_force_n and friction_torque_nm, in SI units, at
200 Hz to 20 kHz, even or not. The friction model sees the measured speed and normal force; what it says
goes through the rig's friction bridge and is compared with the measured friction torque.
Where the log has m1_torque_nm or m2_torque_nm, normal force and M2's torque are predicted too.
That is a simulation in open loop: where the element sticks and slips it may slip at other instants than the
rig did. Beside it stands the one-step prediction, the friction law at the slip that the measured force shows.

A model of kind = \"drive\" (as fit and diagnose write it for a drive) is compared with a drive log, time_s,
m2_torque_nm, m2_angle_rad or time_s, force_n, position_m: the torque or force that the motion asks for, both
low-passed and decimated to 100 Hz, moving samples only. --rig is not needed.

Writes prediction.csv:
  time_s                           s
  measured, predicted, residual    friction torque, N m; residual = measured - predicted
                                   (of a drive N m, or N)
  predicted_by_observed_slip       friction torque one step ahead, N m; models without effects on friction
  normal_force_measured_n, ...     N, from M1's torque
  m2_torque_measured_nm, ...       N m, from inertia, bearing and measured friction, means over 10 ms
report.html, with the residual in bins of speed, normal force, place on the disc and time;
and summary.json with the nrmse (RMS of the residual over RMS of the measured signal) of each subsystem:
friction, pressure, drive; and nrmse_by_observed_slip, that of the one-step prediction.
With --out X.parquet the table goes to X.parquet and the summary beside it.
Effects of the model file that act on the contact or on the friction channel are applied.")]
pub(super) struct Predict {
    /// Rig file (TOML); the assumed rig where left out
    #[arg(long, value_name = "RIG.toml")]
    rig: Option<PathBuf>,
    /// Model file (TOML)
    #[arg(long, value_name = "MODEL.toml")]
    model: PathBuf,
    /// Log (CSV, or Parquet by its name)
    #[arg(long, value_name = "LOG.csv")]
    log: PathBuf,
    /// Folder for the results
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    #[command(flatten)]
    set: SetArgs,
}

#[derive(Serialize)]
struct Summary {
    model: &'static str,
    samples: usize,
    simulated_s: f64,
    /// `None` where nothing but zero was measured.
    nrmse: BTreeMap<&'static str, Option<f64>>,
    /// Of the friction law at the slip observed from the measured force; `None` where the model has effects on friction.
    nrmse_by_observed_slip: Option<f64>,
    /// Keys of the rig file that were left out and assumed.
    assumed: Vec<String>,
    /// Effects of the model file that act on pressure or drive and are not in this prediction.
    effects_not_applied: Vec<String>,
}

#[derive(Serialize)]
struct DriveSummary {
    model: &'static str,
    samples: usize,
    simulated_s: f64,
    /// Relative force error: RMS of the residual over RMS of the effort, both low-passed and decimated.
    nrmse: BTreeMap<&'static str, Option<f64>>,
    effects_not_applied: Vec<String>,
}

impl Predict {
    /// Runs the command.
    pub(super) fn run(self) -> Result<(), InputError> {
        let overrides = self.set.overrides()?;
        overrides.only(true, true, false)?;
        if let Some(drive) = DriveModel::read_if_drive(&self.model, &overrides.model)? {
            return self.drive(&drive);
        }
        let rig = RigFile::read_or_assumed(self.rig.as_deref(), &overrides.rig)?;
        let model = ModelFile::read(&self.model, &overrides.model)?;
        let log = Log::read_as_sampled(&self.log)?;
        let signals = log.contact()?;
        let output = OutputDir::new(&self.out)?;

        let inputs = ContactInputs::new(&signals, &rig);
        let friction = Comparison {
            measured: signals.friction_torque_nm.to_vec(),
            predicted: simulate_friction(&model, &rig, &inputs)?,
        };
        let mut table = Log::default();
        table.set_signal(Signal::Time, signals.time_s.to_vec());
        let mut nrmse = BTreeMap::from([("friction", friction.nrmse())]);
        let mut blocks =
            prediction_page::friction("Friction torque", &signals, &friction.measured, &friction.predicted)
                .blocks();
        add(&mut table, ["measured", "predicted", "residual"], friction);
        let mut by_observed_slip = None;
        if !acts_on_friction(&model) {
            let predicted = predict_by_observed_slip(&model, &rig, &log)?;
            by_observed_slip = nrmse_of(signals.friction_torque_nm, &predicted);
            table.set_numbers(observed_slip::COLUMN, predicted);
        }
        if let Some(m1_torque_nm) = log.signal(Signal::M1Torque) {
            let pressure = predict_normal_force(&rig, signals.time_s, m1_torque_nm, signals.normal_force_n);
            nrmse.insert("pressure", pressure.nrmse());
            let over =
                vec![("torque of M1, N m", m1_torque_nm.to_vec()), ("time, s", signals.time_s.to_vec())];
            blocks.extend(of("Normal force", "normal force, N", signals.time_s, &pressure, over));
            let names = ["normal_force_measured_n", "normal_force_predicted_n", "normal_force_residual_n"];
            add(&mut table, names, pressure);
        }
        if let Some(m2_torque_nm) = log.signal(Signal::M2Torque) {
            let drive = predict_drive(&rig, &signals, m2_torque_nm);
            nrmse.insert("drive", drive.nrmse());
            let over = prediction_page::of_contact(&signals);
            blocks.extend(of("Torque of M2", "torque of M2, N m", signals.time_s, &drive, over));
            add(
                &mut table,
                ["m2_torque_measured_nm", "m2_torque_predicted_nm", "m2_torque_residual_nm"],
                drive,
            );
        }
        let summary = Summary {
            model: model.kind.name(),
            samples: log.len(),
            simulated_s: span_s(signals.time_s),
            nrmse,
            nrmse_by_observed_slip: by_observed_slip,
            assumed: rig.assumed.clone(),
            effects_not_applied: effects_elsewhere(&model),
        };
        finish(output, &table, &summary, page(&summary.nrmse, blocks))?;
        show(&summary.nrmse);
        if let Some(nrmse) = by_observed_slip {
            say(&format!("friction  {:6.2} % one step ahead, by the observed slip", 100.0 * nrmse));
        }
        Ok(())
    }

    fn drive(&self, model: &DriveModel) -> Result<(), InputError> {
        let log = Log::read_as_sampled(&self.log)?;
        let prediction = predict_drive_log(model, &log)?;
        let output = OutputDir::new(&self.out)?;
        let (mut table, main) = (Log::default(), prediction.main);
        table.set_signal(Signal::Time, main.time_s);
        let main = Comparison { measured: main.measured, predicted: main.predicted };
        let time_s = table.time_s().to_vec();
        let over = vec![("time, s", time_s.clone())];
        let blocks = of("Drive", "torque or force of the drive, N m or N", &time_s, &main, over);
        let mut nrmse = BTreeMap::from([("drive", main.nrmse())]);
        let measured = main.measured.clone();
        add(&mut table, ["measured", "predicted", "residual"], main);
        if let Some(directed) = prediction.per_direction {
            nrmse.insert("drive_per_direction", nrmse_of(&measured, &directed.predicted));
            table.set_numbers("predicted_per_direction", directed.predicted);
        }
        let summary = DriveSummary {
            model: "drive",
            samples: log.len(),
            simulated_s: span_s(log.drive()?.time_s),
            nrmse,
            effects_not_applied: prediction.not_applied,
        };
        finish(output, &table, &summary, page(&summary.nrmse, blocks))?;
        show(&summary.nrmse);
        if !summary.effects_not_applied.is_empty() {
            say(&format!(
                "effects of the file that are not applied: {}",
                summary.effects_not_applied.join(", ")
            ));
        }
        Ok(())
    }
}

fn span_s(time_s: &[f64]) -> f64 {
    time_s.last().zip(time_s.first()).map_or(0.0, |(end, start)| end - start)
}

fn finish(
    mut output: OutputDir,
    table: &Log,
    summary: &impl Serialize,
    page: Page,
) -> Result<(), InputError> {
    output.write_table("prediction.csv", table)?;
    output.write_json("summary.json", summary)?;
    output.write("report.html", page.to_html())?;
    output.finish()
}

fn of(
    name: &str,
    quantity: &str,
    time_s: &[f64],
    comparison: &Comparison,
    over: Vec<(&str, Vec<f64>)>,
) -> Vec<Block> {
    let (measured, predicted) = (&comparison.measured[..], &comparison.predicted[..]);
    Prediction { name: name.into(), quantity, time_s, measured, predicted, over }.blocks()
}

fn page(nrmse: &BTreeMap<&'static str, Option<f64>>, blocks: Vec<Block>) -> Page {
    let figure = |nrmse: &Option<f64>| {
        nrmse.map_or("nothing but zero was measured".into(), |n| format!("{:.2} %", 100.0 * n))
    };
    let rows: Vec<Vec<String>> = nrmse.iter().map(|(name, n)| vec![(*name).to_owned(), figure(n)]).collect();
    let head = ["signal", "RMS of the residual over RMS of the signal"].map(str::to_owned).to_vec();
    let mut all = vec![Block::Table(Table { head, rows })];
    all.extend(blocks);
    let lead = "A model driven with the measured inputs of a log: what it predicts, what is left, and what that follows.";
    Page { title: "Prediction".into(), lead: lead.into(), blocks: all }
}

fn show(nrmse: &BTreeMap<&'static str, Option<f64>>) {
    say("RMS of the residual over that of the measured signal:");
    for (subsystem, nrmse) in nrmse {
        match nrmse {
            Some(nrmse) => say(&format!("{subsystem:9} {:6.2} %", 100.0 * nrmse)),
            None => say(&format!("{subsystem:9} nothing but zero was measured")),
        }
    }
}

fn add(table: &mut Log, names: [&str; 3], comparison: Comparison) {
    let residual = comparison.residual();
    for (name, values) in names.into_iter().zip([comparison.measured, comparison.predicted, residual]) {
        table.set_numbers(name, values);
    }
}
