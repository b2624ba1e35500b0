//! `rig predict`: a friction model driven with the measured inputs of a log.

use std::collections::BTreeMap;
use std::path::PathBuf;

use serde::Serialize;

use super::common::{SetArgs, say};
use crate::files::log::Log;
use crate::files::model_file::ModelFile;
use crate::files::output_dir::OutputDir;
use crate::files::rig_file::RigFile;
use crate::files::signal::Signal;
use crate::input_error::InputError;
use crate::predict::{
    Comparison, ContactInputs, effects_elsewhere, predict_drive, predict_normal_force, simulate_friction,
};

/// Drive a friction model with the measured inputs of a log; write measured, predicted, residual
#[derive(clap::Args, Debug)]
#[command(after_long_help = "\
Example:
  rig predict --rig rig.toml --model model.toml --log run.csv --out target/predict

Reads time_s, m2_speed_rad_s (or m2_angle_rad), normal_force_n and friction_torque_nm, in SI units, at
200 Hz to 20 kHz, even or not. The friction model sees the measured speed and normal force; what it says
goes through the rig's friction bridge and is compared with the measured friction torque.
Where the log has m1_torque_nm or m2_torque_nm, normal force and M2's torque are predicted too.

Writes prediction.csv:
  time_s                           s
  measured, predicted, residual    friction torque, N m; residual = measured - predicted
  normal_force_measured_n, ...     N, from M1's torque
  m2_torque_measured_nm, ...       N m, from inertia, bearing and measured friction, means over 10 ms
and summary.json with the nrmse (RMS of the residual over RMS of the measured signal) of each subsystem:
friction, pressure, drive.
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
    /// Keys of the rig file that were left out and assumed.
    assumed: Vec<String>,
    /// Effects of the model file that act on pressure or drive and are not in this prediction.
    effects_not_applied: Vec<String>,
}

impl Predict {
    /// Runs the command.
    pub(super) fn run(self) -> Result<(), InputError> {
        let overrides = self.set.overrides()?;
        overrides.only(true, true, false)?;
        let rig = RigFile::read_or_assumed(self.rig.as_deref(), &overrides.rig)?;
        let model = ModelFile::read(&self.model, &overrides.model)?;
        let log = Log::read(&self.log)?;
        let signals = log.contact()?;
        let mut output = OutputDir::new(&self.out)?;

        let inputs = ContactInputs::new(&signals, &rig);
        let friction = Comparison {
            measured: signals.friction_torque_nm.to_vec(),
            predicted: simulate_friction(&model, &rig, &inputs)?,
        };
        let mut table = Log::default();
        table.set_signal(Signal::Time, signals.time_s.to_vec());
        let mut nrmse = BTreeMap::from([("friction", friction.nrmse())]);
        add(&mut table, ["measured", "predicted", "residual"], friction);
        if let Some(m1_torque_nm) = log.signal(Signal::M1Torque) {
            let pressure = predict_normal_force(&rig, signals.time_s, m1_torque_nm, signals.normal_force_n);
            nrmse.insert("pressure", pressure.nrmse());
            let names = ["normal_force_measured_n", "normal_force_predicted_n", "normal_force_residual_n"];
            add(&mut table, names, pressure);
        }
        if let Some(m2_torque_nm) = log.signal(Signal::M2Torque) {
            let drive = predict_drive(&rig, &signals, m2_torque_nm);
            nrmse.insert("drive", drive.nrmse());
            add(
                &mut table,
                ["m2_torque_measured_nm", "m2_torque_predicted_nm", "m2_torque_residual_nm"],
                drive,
            );
        }
        let span_s =
            signals.time_s.last().zip(signals.time_s.first()).map_or(0.0, |(end, start)| end - start);
        let summary = Summary {
            model: model.kind.name(),
            samples: log.len(),
            simulated_s: span_s,
            nrmse,
            assumed: rig.assumed.clone(),
            effects_not_applied: effects_elsewhere(&model),
        };
        output.write_table("prediction.csv", &table)?;
        output.write_json("summary.json", &summary)?;
        let output_folder = output.folder().to_path_buf();
        output.finish()?;
        for (subsystem, nrmse) in &summary.nrmse {
            match nrmse {
                Some(nrmse) => say(&format!("{subsystem:9} nrmse {nrmse:.3e}")),
                None => say(&format!("{subsystem:9} nothing but zero was measured")),
            }
        }
        say(&format!("written to {}", output_folder.display()));
        Ok(())
    }
}

fn add(table: &mut Log, names: [&str; 3], comparison: Comparison) {
    let residual = comparison.residual();
    for (name, values) in names.into_iter().zip([comparison.measured, comparison.predicted, residual]) {
        table.set_numbers(name, values);
    }
}
