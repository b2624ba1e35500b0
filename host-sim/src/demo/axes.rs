//! The paper's figures on the paper's own axes: motor torque beside the ring's, true torque beside the measured channel, and
//! what becomes of a statement where an assumed number is another one. One row a statement, with the command that
//! shows it.

use std::f64::consts::TAU;

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::runs::{ClosedLoop, Runs};
use crate::files::experiment_file::{ExperimentFile, PatchCrossing};
use crate::files::model_file::ModelFile;
use crate::files::rig_file::RigFile;
use crate::input_error::InputError;
use crate::lockstep::{Frame, Recording, Setup};
use crate::plant::{PERIOD_S, PERIODS_PER_S};
use crate::report::{Role, Table};
use crate::studies::patch_crossing;
use crate::studies::speed_sweep::BELL;
use crate::summary::Summary;
use model_core::friction::static_curve::Bell;

/// Natural frequencies of the normal force that are tried; the assumed one is 120 Hz.
const LOAD_MODES_HZ: [f64; 6] = [20.0, 40.0, 60.0, 90.0, 120.0, 200.0];
/// Damping ratios of that mode that are tried with it; the assumed one is 0.25.
const LOAD_DAMPING_RATIOS: [f64; 4] = [0.1, 0.25, 0.5, 0.8];
/// When the load steps in Figs. 18–21, s.
const LOAD_STEP_S: f64 = 4.0;

/// The table.
///
/// # Errors
/// What plant, core or a model refuse.
pub(super) fn table(runs: &Runs) -> Result<Table, InputError> {
    let mut rows = Vec::new();
    rows.extend(runs.named("fig22").map(loop_row));
    rows.extend(runs.named("fig23").map(step_row));
    rows.push(channel_row(runs));
    rows.push(load_mode_row()?);
    rows.push(later_load_row()?);
    rows.push(preload_row()?);
    rows.push(crossing_row(runs)?);
    rows.extend(bell_row());
    rows.extend(deformation_row(runs));
    let head = ["the paper's statement", "reproduced", "found", "command"];
    Ok(Table { head: head.map(Into::into).to_vec(), rows })
}

fn row(statement: &str, reproduced: &str, found: String, command: &str) -> Vec<String> {
    vec![statement.into(), reproduced.into(), found, format!("`{command}`")]
}

/// A figure once with each of these changes to the assumed rig.
fn summaries<const N: usize>(figure: &str, changed: &[[(&str, f64); N]]) -> Result<Vec<Summary>, InputError> {
    let (experiment, model) = (ExperimentFile::named_or_read(figure, &[])?, ModelFile::assumed(&[])?);
    let one = |changes: &[(&str, f64); N]| {
        let changes = changes.map(|(key, value)| (key.to_string(), format!("{value:?}")));
        let setup = Setup::from_files(&experiment, &RigFile::assumed_rig(&changes)?, &model, &model)?;
        Ok(ClosedLoop::run(&experiment, &setup, |_, _| {})?.summary)
    };
    changed.par_iter().map(one).collect()
}

/// ∮ T dθ in a period of 2 rad/s, mean of the whole periods after the first of a sine that begins at 0.5 s.
fn loop_energy_j(recording: &Recording, torque_nm: impl Fn(&Frame) -> f64) -> f64 {
    let per_period = TAU / 2.0 / PERIOD_S;
    let first = (0.5 / PERIOD_S + per_period) as usize;
    let periods = ((recording.frames.len() - first) as f64 / per_period) as usize;
    let last = first + (periods as f64 * per_period) as usize;
    let work = recording.frames[first..last].windows(2).map(|w| {
        0.5 * (torque_nm(&w[0]) + torque_nm(&w[1])) * (w[1].truth.disc_angle_rad - w[0].truth.disc_angle_rad)
    });
    work.sum::<f64>() / periods.max(1) as f64
}

fn loop_row(run: &ClosedLoop) -> Vec<String> {
    let motor = loop_energy_j(&run.recording, |f| f.truth.m2_torque_nm);
    let ring = loop_energy_j(&run.recording, |f| f.truth.friction_torque_nm);
    let bearing = loop_energy_j(&run.recording, |f| f.truth.bearing_torque_nm);
    row(
        "Torque over angle is a loop: the element loses energy (Fig. 22, M2's torque).",
        "only if the bearing's part is taken off",
        format!(
            "M2's torque encloses {:.1} mJ, the ring's {:.2} mJ; {:.0} % of M2's loop is the bearing's. What the figure shows \
             is first of all the bearing.",
            1e3 * motor,
            1e3 * ring,
            100.0 * bearing / motor
        ),
        "cargo rig simulate --experiment fig22 --out run",
    )
}

fn step_row(run: &ClosedLoop) -> Vec<String> {
    let step = (LOAD_STEP_S / PERIOD_S) as usize;
    let frames = &run.recording.frames[step..];
    let torque: Vec<f64> = frames.iter().map(|f| f.truth.m2_torque_nm).collect();
    let settled = torque[torque.len() - 1000..].iter().sum::<f64>() / 1000.0;
    let rise = torque.iter().position(|t| *t > 0.9 * settled).unwrap_or(0) as f64 * PERIOD_S;
    let peak = torque.iter().copied().fold(0.0, f64::max);
    let bearing = frames.last().map_or(0.0, |f| f.truth.bearing_torque_nm);
    row(
        "A torque step is answered with strong damping (Fig. 23, M2's actual torque).",
        if run.summary.damping_ratio.unwrap_or(0.0) > 0.15 { "yes" } else { "no" },
        format!(
            "M2's actual torque reaches 90 % after {:.1} ms, peaks {:.1} % above {settled:.2} N m; the bearing holds {bearing:.2} N m of \
             it at rest. The damping ratio {:.2} is the disc's on the blocks, not the motor's.",
            1e3 * rise,
            100.0 * (peak / settled - 1.0),
            run.summary.damping_ratio.unwrap_or(0.0)
        ),
        "cargo rig simulate --experiment fig23 --out run",
    )
}

/// Peak over the mean of the last second, less one, after the load step.
fn overshoot(recording: &Recording, signal: impl Fn(&Frame) -> f64) -> f64 {
    let after = &recording.frames[(LOAD_STEP_S / PERIOD_S) as usize..];
    let settled =
        after[after.len() - PERIODS_PER_S..].iter().map(&signal).sum::<f64>() / PERIODS_PER_S as f64;
    after.iter().map(&signal).fold(0.0, f64::max) / settled - 1.0
}

fn load_steps(runs: &Runs) -> impl Iterator<Item = &ClosedLoop> {
    ["fig18", "fig19", "fig20", "fig21"].into_iter().filter_map(|name| runs.named(name))
}

fn channel_row(runs: &Runs) -> Vec<String> {
    let each = load_steps(runs).map(|run| {
        let truth = overshoot(&run.recording, |f| f.truth.friction_torque_nm);
        let seen = overshoot(&run.recording, |f| f64::from(f.record.friction_torque_nm));
        format!("{} {:.1} % true, {:.1} % measured", run.label(), 100.0 * truth, 100.0 * seen)
    });
    row(
        "Friction overshoots (Figs. 18–21, torque measured on the ring).",
        "yes",
        format!("{}. The rest is the ring's own ringing and noise.", each.collect::<Vec<_>>().join("; ")),
        "cargo demo",
    )
}

/// Whether friction peaks after the normal force has settled, over the assumed mode of the normal-load actuator.
fn load_mode_row() -> Result<Vec<String>, InputError> {
    let mut each = Vec::new();
    let mut all = true;
    for figure in ["fig18", "fig19", "fig20"] {
        let mut fails = Vec::new();
        let changed = LOAD_MODES_HZ.map(|mode_hz| [("pressure.mode_hz", mode_hz)]);
        for ([(_, mode_hz)], s) in changed.iter().zip(summaries(figure, &changed)?) {
            let after = s.friction_peak_time_s.zip(s.normal_settled_time_s).is_some_and(|(f, n)| f > n);
            if !after {
                fails.push(format!("{mode_hz:.0}"));
            }
        }
        all &= fails.is_empty();
        let label = figure.replace("fig", "fig. ");
        each.push(if fails.is_empty() {
            format!("{label} at every one")
        } else {
            format!("{label} not at {} Hz", fails.join(", "))
        });
    }
    Ok(row(
        "At 10–30 rpm friction peaks after the normal force has settled (Figs. 18–20).",
        if all { "yes" } else { "only if the normal force is fast" },
        format!(
            "With a mode of the normal force at {LOAD_MODES_HZ:?} Hz (assumed 120): {}.",
            each.join("; ")
        ),
        "cargo rig simulate --experiment fig20 --set rig.pressure.mode_hz=60.0 --out run",
    ))
}

/// Fig. 21: friction is lower when the normal force later has the value of the peak again.
fn later_load_row() -> Result<Vec<String>, InputError> {
    let mut each = Vec::new();
    let mut holds = false;
    let damped = |mode_hz| {
        LOAD_DAMPING_RATIOS
            .map(|damping| [("pressure.mode_hz", mode_hz), ("pressure.damping_ratio", damping)])
    };
    let changed = LOAD_MODES_HZ.map(damped).concat();
    for ([(_, mode_hz), (_, damping)], summary) in changed.iter().zip(summaries("fig21", &changed)?) {
        if let Some(later) = summary.friction_ratio_at_same_normal {
            holds |= later < 0.95;
            each.push(format!("{mode_hz:.0} Hz, {damping}: {later:.2}"));
        }
    }
    let found = if each.is_empty() {
        "The normal force has the value of that moment never again with any mode tried.".into()
    } else {
        format!(
            "Friction then over friction at the peak, by mode and damping ratio of the normal force: {}.",
            each.join("; ")
        )
    };
    Ok(row(
        "At 120 rpm friction is markedly lower when the normal force has the value at the peak again (Fig. 21).",
        if holds { "only if the normal force has a suitable mode" } else { "no" },
        found,
        "cargo rig simulate --experiment fig21 --set rig.pressure.mode_hz=200.0 rig.pressure.damping_ratio=0.5 --out run",
    ))
}

fn preload_row() -> Result<Vec<String>, InputError> {
    let changed = [4.0, 8.0].map(|preload_n| [("pressure.preload_n", preload_n)]);
    let settled: Vec<f64> =
        summaries("fig18", &changed)?.iter().map(|s| s.normal_settled_n.unwrap_or(0.0)).collect();
    let (soft, hard) = (settled[0], settled[1]);
    Ok(row(
        "Softer springs give more pressure.",
        if soft > hard { "yes" } else { "no" },
        format!(
            "With foil springs that lift with 4 N in place of 8 N the normal force settles at {soft:.1} N in place of {hard:.1} N: \
             M1 has so much less to overcome, and nothing else changes."
        ),
        "cargo rig simulate --experiment fig18 --set rig.pressure.preload_n=4.0 --out run",
    ))
}

fn crossing_row(runs: &Runs) -> Result<Vec<String>, InputError> {
    let mut each = Vec::new();
    let (mut some, mut every) = (false, true);
    for (sliding_speed_m_s, rolling_speed_m_s) in
        [(0.03, 0.8), (0.06, 0.8), (0.12, 0.8), (0.3, 0.8), (0.3, 4.0), (1.0, 4.0)]
    {
        let slip =
            PatchCrossing { sliding_speed_m_s, rolling_speed_m_s, patch_length_m: 0.1, normal_force_n: 88.0 };
        let crossing = patch_crossing::run(&slip, &runs.rubber)?;
        let series = crossing.profiles.iter().find(|p| p.role == Role::Series);
        let u = series.map_or(0.0, |p| p.overshoot());
        let force = series.map_or(0.0, |p| {
            let end = p.coefficient.last().copied().unwrap_or(1.0);
            p.coefficient.iter().copied().fold(0.0, f64::max) / end - 1.0
        });
        some |= u > 1e-3;
        every &= u > 1e-3;
        each.push(format!(
            "{sliding_speed_m_s}/{rolling_speed_m_s} m/s: u {:.1} %, force {:.1} %",
            100.0 * u,
            100.0 * force
        ));
    }
    let word = match (some, every) {
        (_, true) => "yes",
        (true, _) => "only if it slides slowly",
        _ => "no",
    };
    Ok(row(
        "u(s) passes a maximum on the way through the patch (Fig. 26).",
        word,
        format!(
            "Series element, by sliding and rolling speed, maximum over the end: {}. Where the block's damping carries most \
             of the force, u rises without a maximum though the force has one.",
            each.join("; ")
        ),
        "cargo rig simulate --experiment fig26 --set experiment.slip.sliding_speed_m_s=0.3 --out run",
    ))
}

/// Least squares of a0 + a1 e^{−(v/v0)^δ} + a2 v: linear in the coefficients, by search in the other two.
fn best_stribeck(speeds: &[f64], bell: &[f64]) -> (f64, f64, f64) {
    let target = DVector::from_column_slice(bell);
    let mut best = (f64::INFINITY, 0.0, 0.0);
    for k in 0..80 {
        let v0 = 1e-3 * (f64::from(k) * 0.1).exp();
        for j in 0..36 {
            let delta = 0.25 + 0.05 * f64::from(j);
            let column = |i: usize, j: usize| match j {
                0 => 1.0,
                1 => (-(speeds[i] / v0).powf(delta)).exp(),
                _ => speeds[i],
            };
            let matrix = DMatrix::from_fn(speeds.len(), 3, column);
            let Ok(x) = matrix.clone().svd(true, true).solve(&target, 1e-9) else { continue };
            // What a LuGre model may have: a0 > 0, a1 ≥ 0, a2 ≥ 0.
            if x[0] <= 0.0 || x[1] < 0.0 || x[2] < 0.0 {
                continue;
            }
            let error = (matrix * x - &target).norm() / target.norm();
            if error < best.0 {
                best = (error, v0, delta);
            }
        }
    }
    best
}

fn bell_row() -> Option<Vec<String>> {
    let bell = Bell::new(&BELL).ok()?;
    let from = |low: f64| {
        let speeds: Vec<f64> = (0..60).map(|k| low * (2.0f64 / low).powf(f64::from(k) / 59.0)).collect();
        let values: Vec<f64> = speeds.iter().map(|v| bell.coefficient(*v)).collect();
        best_stribeck(&speeds, &values)
    };
    let (above, whole) = (from(BELL.v_m_m_s), from(1e-3));
    Some(row(
        "LuGre fits the measured curve above v_m and not below (Fig. 27).",
        if above.0 < 0.02 && whole.0 > 3.0 * above.0 { "yes" } else { "only in part" },
        format!(
            "Best g(v) + a2 v against the bell (assumed: maximum at {} m/s): {:.1} % of its RMS above v_m up to 2 m/s (v0 {:.2} m/s, \
             δ {:.2}), {:.1} % from 1 mm/s on. Below v_m a falling curve can only be flat.",
            BELL.v_m_m_s,
            100.0 * above.0,
            above.1,
            above.2,
            100.0 * whole.0
        ),
        "cargo rig simulate --experiment fig27 --out run",
    ))
}

fn deformation_row(runs: &Runs) -> Option<Vec<String>> {
    let most = load_steps(runs)
        .map(|run| {
            let most = run.recording.frames.iter().map(|f| f.truth.deformation_m.abs()).fold(0.0, f64::max);
            (run.label(), most)
        })
        .max_by(|a, b| a.1.total_cmp(&b.1))?;
    Some(row(
        "The elements deform by more than 1 mm.",
        if most.1 > 1e-3 { "yes" } else { "no" },
        format!(
            "{:.1} mm in {}; it follows from the assumed stiffness alone, F_N µ/k_u. The history of its stress is k_u u + c_u u̇ = \
             friction: there is one state more than the bristles, and Figs. 5, 24 and 25 ask for no other.",
            1e3 * most.1,
            most.0
        ),
        "cargo demo",
    ))
}
