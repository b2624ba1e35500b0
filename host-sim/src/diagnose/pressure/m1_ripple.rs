//! `m1_ripple`: M1's torque ripples with its position, or with that of the mechanism.
//!
//! Source: cogging and mutual torque of permanent-magnet motors; gears and screws between motor and
//! lever. F = P[G τ − F0 − Σ_n A_n cos(n w (x − x₀)) + B_n sin(n w (x − x₀))], n = 1 to 3, x the travel,
//! w any wave number with at least `FEWEST_WAVES` waves in the travel; x₀ is one origin per log.
//! w is looked for where a wave, with the gain and preload free, explains most of the residual.
//! Sets it apart: several ups and downs of the force over torque, the same on the way up and down.

use std::f64::consts::TAU;
use std::sync::Arc;

use nalgebra::{Matrix4, Vector4};

use super::conditioned::PressureLog;
use super::effect::{Column, OwnValue, Prepared, PressureEffect, travel_range};
use crate::fit::bounds::Parameter;

/// Fewest waves in the travel that is called a ripple.
const FEWEST_WAVES: f64 = 1.2;
/// Most.
const MOST_WAVES: f64 = 60.0;
/// Steps of the search in waves.
const STEP_WAVES: f64 = 0.2;
/// Samples that the search looks at in a log.
const SEARCH_SAMPLES: usize = 1500;
/// Peaks of the search that are tried.
const PEAKS: usize = 3;

/// The effect.
pub struct M1Ripple;

struct Waves {
    shapes: [Parameter; 1],
    starts: Vec<Vec<f64>>,
    /// Newtons of travel per unit of the shape's inverse.
    per_shape: f64,
    half_wave_n: f64,
}

impl Prepared for Waves {
    fn shapes(&self) -> &[Parameter] {
        &self.shapes
    }

    fn starts(&self) -> &[Vec<f64>] {
        &self.starts
    }

    fn own_value(&self) -> Option<OwnValue> {
        Some(OwnValue { name: "origin_n", half_span: self.half_wave_n, first_stays: true })
    }

    fn columns(&self, shape: &[f64], own: f64, log: &PressureLog) -> Vec<Column> {
        let wave = shape[0] * self.per_shape;
        let pair = |harmonic: f64, names: [&'static str; 2]| {
            let (sin, cos): (Vec<f64>, Vec<f64>) =
                log.travel_n.iter().map(|x| (harmonic * wave * (x - own)).sin_cos()).unzip();
            let column = |name, values| Column { name, values, not_negative: false };
            [column(names[0], cos), column(names[1], sin)]
        };
        let mut all = Vec::from(pair(1.0, ["cos_1_n", "sin_1_n"]));
        all.extend(pair(2.0, ["cos_2_n", "sin_2_n"]));
        all.extend(pair(3.0, ["cos_3_n", "sin_3_n"]));
        all
    }

    fn constants(&self) -> Vec<(&'static str, f64)> {
        Vec::new()
    }
}

impl PressureEffect for M1Ripple {
    fn id(&self) -> &'static str {
        "m1_ripple"
    }

    fn prepare(&self, logs: &[&PressureLog], residual_n: &[Vec<f64>]) -> Result<Arc<dyn Prepared>, String> {
        let (low, high) = travel_range(logs)?;
        let span = high - low;
        let count = ((MOST_WAVES - FEWEST_WAVES) / STEP_WAVES) as usize;
        let wave_at = |i: usize| TAU / span * (FEWEST_WAVES + STEP_WAVES * i as f64);
        let explained: Vec<f64> = (0..count)
            .map(|i| logs.iter().zip(residual_n).map(|(log, left)| explained(log, left, wave_at(i))).sum())
            .collect();
        let mut peaks: Vec<usize> = (0..count)
            .filter(|&i| {
                let at = |k: usize| explained.get(k).copied().unwrap_or(0.0);
                (i == 0 || explained[i] >= explained[i - 1]) && explained[i] >= at(i + 1)
            })
            .collect();
        peaks.sort_by(|a, b| explained[*b].total_cmp(&explained[*a]));
        peaks.truncate(PEAKS);
        let Some(first) = peaks.first() else { return Err("the normal force hardly varies".into()) };
        // An order per turn of M1 where its angle is known.
        let per_shape = logs[0].rad_per_n.map_or(1.0, f64::abs);
        let name = if logs[0].rad_per_n.is_some() { "order" } else { "wave_rad_per_n" };
        let shape = |waves: f64| TAU / span * waves / per_shape;
        let shapes = [Parameter::logarithmic(
            name,
            wave_at(*first) / per_shape,
            shape(0.95 * FEWEST_WAVES),
            shape(1.05 * MOST_WAVES),
        )];
        let starts = peaks.iter().map(|i| vec![wave_at(*i) / per_shape]).collect();
        let half_wave_n = 0.5 * TAU / wave_at(*first);
        Ok(Arc::new(Waves { shapes, starts, per_shape, half_wave_n }))
    }
}

/// How much of the squared residual a wave explains beyond what gain and preload do.
fn explained(log: &PressureLog, residual_n: &[f64], wave: f64) -> f64 {
    let stride = (log.len() / SEARCH_SAMPLES).max(1);
    let (mut normal, mut right) = (Matrix4::zeros(), Vector4::zeros());
    for at in (0..log.len()).step_by(stride).filter(|at| log.weight[*at] > 0.0) {
        let (sin, cos) = (wave * log.travel_n[at]).sin_cos();
        let row = Vector4::new(cos, sin, 1.0, log.torque_nm[at]);
        normal += row * row.transpose();
        right += row * residual_n[at];
    }
    let solved = normal.cholesky().map_or(0.0, |c| right.dot(&c.solve(&right)));
    let straight = normal.fixed_view::<2, 2>(2, 2).into_owned();
    let target = right.fixed_rows::<2>(2).into_owned();
    solved - straight.cholesky().map_or(0.0, |c| target.dot(&c.solve(&target)))
}
