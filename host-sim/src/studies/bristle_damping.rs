//! LuGre with bristle damping: force is not deflection.
//!
//! With σ1 > 0 the deflection of LuGre still rises monotonically at constant speed and load, but its force begins at σ1 v_r,
//! so it overshoots where σ1 v_r > F_N g(v_r). The sweep asks how much damping Figs. 18–21 would take: with the
//! rubber's stiffness in the bristles, in closed loop, where speed and load are what motors and lever make of
//! their steps, and at constant speed and load.

use rayon::prelude::*;

use model_core::friction::FrictionParameters;
use model_core::friction::lugre::LugreParameters;
use model_core::friction::series::SeriesParameters;
use model_core::friction::stribeck::Stribeck;

use super::contenders::constant_overshoot;
use super::readings::SPEEDS_RPM;
use crate::demo::ClosedLoop;
use crate::files::experiment_file::ExperimentFile;
use crate::files::model_file::{ModelFile, ModelKind};
use crate::files::rig_file::RigFile;
use crate::input_error::InputError;
use crate::lockstep::Setup;
use crate::plant::ElementParameters;

/// Dampings that are tried, N s/m; 160 is the block's.
pub const SIGMA1_N_S_PER_M: [f64; 4] = [0.0, 40.0, 160.0, 640.0];

/// What one damping shows.
#[derive(Debug, Clone, PartialEq)]
pub struct Damped {
    /// σ1; `None` is the series element with σ1 = 0, for comparison.
    pub sigma1_n_s_per_m: Option<f64>,
    /// Overshoot of the friction torque in closed loop, Figs. 18–21; `None` where a run was stopped.
    pub closed_loop: [Option<f64>; 4],
    /// Overshoot at constant speed and load.
    pub constant: [f64; 4],
}

/// The damping above which the force overshoots at each of the speeds, N s/m.
///
/// # Errors
/// A parameter out of range.
pub fn needed(rubber: &SeriesParameters<f64>, normal_force_n: f64) -> Result<[f64; 4], InputError> {
    let curve = Stribeck::new(&rubber.bristles.stribeck)?;
    Ok(SPEEDS_RPM.map(|rpm| normal_force_n * curve.coefficient(speed_m_s(rpm)) / speed_m_s(rpm)))
}

fn speed_m_s(rpm: f64) -> f64 {
    rpm * std::f64::consts::TAU / 60.0 * 0.06
}

/// The sweep.
///
/// # Errors
/// What plant, core or model refuse.
pub fn sweep(rubber: &SeriesParameters<f64>, normal_force_n: f64) -> Result<Vec<Damped>, InputError> {
    let rig = RigFile::assumed_rig(&[])?;
    let row = |sigma1: Option<f64>| -> Result<Damped, InputError> {
        let parameters = match sigma1 {
            Some(sigma1_n_s_per_m) => FrictionParameters::lugre(&LugreParameters {
                sigma0_n_per_m: rubber.k_u_n_per_m,
                sigma1_n_s_per_m,
                ..rubber.bristles
            }),
            None => FrictionParameters::series(rubber),
        };
        let model = file(&parameters)?;
        let mut damped = Damped { sigma1_n_s_per_m: sigma1, closed_loop: [None; 4], constant: [0.0; 4] };
        for (k, rpm) in SPEEDS_RPM.into_iter().enumerate() {
            let experiment = ExperimentFile::named_or_read(&format!("fig{}", 18 + k), &[])?;
            let setup = Setup::from_files(&experiment, &rig, &model, &model)?;
            let run = ClosedLoop::run(&experiment, &setup, |_, _| {})?;
            damped.closed_loop[k] = run.summary.friction_overshoot.filter(|_| run.recording.fault.is_none());
            let elements = ElementParameters::Elements(parameters);
            damped.constant[k] = constant_overshoot(&elements, speed_m_s(rpm), normal_force_n)?;
        }
        Ok(damped)
    };
    let rows: Vec<Option<f64>> = SIGMA1_N_S_PER_M.into_iter().map(Some).chain([None]).collect();
    rows.into_par_iter().map(row).collect()
}

/// A model file with these numbers.
pub(super) fn file(parameters: &FrictionParameters<f64>) -> Result<ModelFile, InputError> {
    let kind: ModelKind = parameters.kind();
    let names = kind.parameters().iter().map(|spec| spec.name);
    let numbers: Vec<(&str, f64)> = names.zip(parameters.values().iter().copied()).collect();
    ModelFile::new(kind.name(), kind, &numbers)
}
