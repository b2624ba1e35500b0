//! The five models in one experiment: each in the closed loop, each driven by the true motion, each at constant
//! speed and load.

use super::runs::ClosedLoop;
use crate::files::experiment_file::{Course, ExperimentFile, Quantity, Study};
use crate::input_error::InputError;
use crate::lockstep::Setup;
use crate::plant::{PERIOD_S, PERIODS_PER_S};
use crate::report::Role;
use crate::studies::candidate_models::{CandidateModel, constant_overshoot, drive, five};
use model_core::friction::series::SeriesParameters;

/// One model in one experiment.
#[derive(Debug, Clone)]
pub struct Candidate {
    /// The model.
    pub model: CandidateModel,
    /// True friction torque with this model on the disc, in closed loop.
    pub closed_nm: Vec<f64>,
    /// Friction torque of the model driven by the motion of the rig with the series element.
    pub open_nm: Vec<f64>,
    /// Overshoot of each over its settled value.
    pub closed_overshoot: f64,
    /// The same, driven.
    pub open_overshoot: f64,
    /// The same at constant speed and normal force.
    pub constant_overshoot: f64,
}

/// All models in one experiment.
#[derive(Debug, Clone)]
pub struct Comparison {
    /// The experiment.
    pub name: String,
    /// Speed of the disc, rpm.
    pub rpm: f64,
    /// Time of each sample.
    pub time_s: Vec<f64>,
    /// Normal force of the closed loop with the series element.
    pub normal_force_n: Vec<f64>,
    /// The models.
    pub candidates: Vec<Candidate>,
}

/// Sliding speed at the end of an experiment's speed references, m/s; 0 without one.
pub(super) fn reference_speed(experiment: &ExperimentFile, radius_m: f64) -> f64 {
    let Study::ClosedLoop { m2, .. } = &experiment.study else { return 0.0 };
    let last = m2.iter().rev().find(|s| s.quantity == Quantity::SpeedRadS);
    last.map_or(0.0, |s| match s.course {
        Course::Constant { value } => value * radius_m,
        Course::Ramp { to, .. } => to * radius_m,
        Course::Sine { offset, .. } => offset * radius_m,
    })
}

/// Load step of Figs. 18–21.
pub(super) const LOAD_STEP_S: f64 = 4.0;

impl Comparison {
    /// Runs the five models. `real` is the run with the series element.
    pub(super) fn run(
        experiment: &ExperimentFile,
        setup: &Setup,
        real: &ClosedLoop,
        rubber: &SeriesParameters<f64>,
        sliding_speed_m_s: f64,
    ) -> Result<Self, InputError> {
        let frames = &real.recording.frames;
        let radius_m = setup.plant.geometry.friction_radius_m;
        let load = real.summary.normal_settled_n.unwrap_or(0.0);
        let motion: Vec<(f64, f64)> = (0..frames.len())
            .map(|k| {
                let (before, now) = (&frames[k.saturating_sub(1)].truth, &frames[k].truth);
                let speed = 0.5 * (before.disc_speed_rad_s + now.disc_speed_rad_s);
                (speed * radius_m, now.normal_force_n)
            })
            .collect();
        let mut candidates = Vec::new();
        for model in five(rubber, sliding_speed_m_s, load)? {
            let closed_nm = if model.role == Role::Series {
                real.recording.column(|f| f.truth.friction_torque_nm)
            } else {
                let mut setup = setup.clone();
                setup.plant.elements = model.parameters;
                let run = ClosedLoop::run(experiment, &setup, |_, _| {})?;
                run.recording.column(|f| f.truth.friction_torque_nm)
            };
            let force = drive(&model.parameters.model(PERIOD_S)?, motion.iter().copied());
            let open_nm: Vec<f64> = force.into_iter().map(|f| f * radius_m).collect();
            candidates.push(Candidate {
                closed_overshoot: overshoot(&closed_nm),
                open_overshoot: overshoot(&open_nm),
                constant_overshoot: constant_overshoot(&model.parameters, sliding_speed_m_s, load)?,
                model,
                closed_nm,
                open_nm,
            });
        }
        Ok(Self {
            name: real.name.clone(),
            rpm: sliding_speed_m_s / radius_m * 60.0 / std::f64::consts::TAU,
            time_s: (0..frames.len()).map(|k| real.recording.time_s(k)).collect(),
            normal_force_n: real.recording.column(|f| f.truth.normal_force_n),
            candidates,
        })
    }

    /// The candidate of a role.
    #[must_use]
    pub fn of(&self, role: Role) -> Option<&Candidate> {
        self.candidates.iter().find(|c| c.model.role == role)
    }
}

/// Peak after the load step over the mean of the last second, less one.
fn overshoot(torque_nm: &[f64]) -> f64 {
    let from = ((LOAD_STEP_S / PERIOD_S) as usize).min(torque_nm.len());
    let peak = torque_nm[from..].iter().copied().fold(0.0, f64::max);
    let last = &torque_nm[torque_nm.len() - torque_nm.len().min(PERIODS_PER_S)..];
    let settled = last.iter().sum::<f64>() / last.len() as f64;
    peak / settled - 1.0
}
