//! `m2_ripple`: the motor's torque ripples with its position, in a few orders.
//!
//! Source: cogging and mutual torque of permanent-magnet motors; for a ball screw the errors of screw
//! and coupling, whose period is the pitch. Extension: u = … + Σ_n A_n cos(n(q − q₀)) + B_n sin(n(q − q₀)).
//! Orders are found one after the other where the spectrum of the unexplained force *over position* has
//! its highest line: whole numbers per turn for an angle, any wavelength for a length. Powers are added
//! over the logs, because logs need not share the encoder's zero; q₀ is then one origin per log.
//! Sets it apart: fixed wavelengths in position at whatever speed, in both directions alike.

use std::f64::consts::PI;
use std::sync::Arc;

use super::conditioned::DriveLog;
use super::effect::{DriveEffect, Known, Origins, Prepared, Regressor, Seen};
use super::units::Units;
use crate::fit::bounds::Parameter;
use crate::fit::drive::inverse::Motion;

/// Most orders.
const MOST_ORDERS: usize = 4;
/// Highest order of an angle, and most periods of a length's travel that are looked for.
const HIGHEST_ORDER: usize = 120;
/// A line counts when its power is this many times the mean power of all lines.
const LINE_OVER_MEAN: f64 = 8.0;
/// Position bins a period of the highest order: the spectrum is taken from bin means.
const BINS_PER_PERIOD: f64 = 8.0;

/// The effect.
pub struct M2Ripple;

struct Orders {
    motion: Motion,
    /// Wave numbers, radians per position unit.
    waves: Vec<f64>,
    starts: Vec<f64>,
    span: f64,
    step: f64,
}

impl Prepared for Orders {
    fn shapes(&self) -> &[Parameter] {
        &[]
    }

    fn regressors(&self, _shape: &[f64], seen: &Seen<'_>) -> Vec<Regressor> {
        let units = Units::of(seen.log.motion);
        let mut all = Vec::new();
        for (i, wave) in self.waves.iter().enumerate() {
            let (sin, cos): (Vec<f64>, Vec<f64>) =
                seen.log.position.iter().map(|q| (wave * (q - seen.origin)).sin_cos()).unzip();
            all.push(Regressor { name: units.effort(&format!("cos_{}", i + 1)), values: cos });
            all.push(Regressor { name: units.effort(&format!("sin_{}", i + 1)), values: sin });
        }
        all
    }

    fn constants(&self) -> Vec<(String, f64)> {
        self.waves
            .iter()
            .enumerate()
            .map(|(i, wave)| match self.motion {
                Motion::Rotary => (format!("order_{}", i + 1), *wave),
                Motion::Linear => (format!("wavelength_{}_m", i + 1), 2.0 * PI / wave),
            })
            .collect()
    }

    fn origins(&self) -> Option<Origins<'_>> {
        Some(Origins { span: self.span, step: self.step, starts: &self.starts, waves: &self.waves })
    }
}

/// Real and imaginary part of Σ r e^{−iwq}, over the number of samples; of the weighted residual.
fn line(log: &DriveLog, residual: &[f64], wave: f64) -> (f64, f64) {
    let (mut re, mut im, mut count) = (0.0, 0.0, 0.0);
    for ((q, r), w) in log.position.iter().zip(residual).zip(&log.weight) {
        let (sin, cos) = (wave * q).sin_cos();
        re += w * r * cos;
        im -= w * r * sin;
        count += w;
    }
    (2.0 * re / f64::max(count, 1.0), 2.0 * im / f64::max(count, 1.0))
}

/// A residual in bins of position: means and counts of moving samples.
struct Binned {
    first: f64,
    width: f64,
    sums: Vec<f64>,
    count: f64,
}

impl Binned {
    fn new(log: &DriveLog, residual: &[f64], width: f64) -> Self {
        let used = || log.position.iter().zip(residual).zip(&log.weight).filter(|(_, w)| **w > 0.0);
        let first = used().map(|((q, _), _)| *q).fold(f64::INFINITY, f64::min);
        let last = used().map(|((q, _), _)| *q).fold(f64::NEG_INFINITY, f64::max);
        if !first.is_finite() || last <= first {
            return Self { first: 0.0, width, sums: Vec::new(), count: 0.0 };
        }
        let mut sums = vec![0.0; ((last - first) / width) as usize + 1];
        let mut count = 0.0;
        for ((q, r), _) in used() {
            sums[((q - first) / width) as usize] += r;
            count += 1.0;
        }
        Self { first, width, sums, count }
    }

    /// Squared amplitude of a wave in it.
    fn power(&self, wave: f64) -> f64 {
        let (mut re, mut im) = (0.0, 0.0);
        let (turn_sin, turn_cos) = (wave * self.width).sin_cos();
        let (mut sin, mut cos) = (wave * (self.first + 0.5 * self.width)).sin_cos();
        for sum in &self.sums {
            re += sum * cos;
            im -= sum * sin;
            (sin, cos) = (sin * turn_cos + cos * turn_sin, cos * turn_cos - sin * turn_sin);
        }
        4.0 * (re * re + im * im) / self.count.max(1.0).powi(2)
    }
}

/// The residual with its slow part removed: a moving mean over position would mix directions, so a
/// moving mean over time is taken, long against the wavelengths looked for at the log's speeds.
fn centred(log: &DriveLog, residual: &[f64]) -> Vec<f64> {
    let (mut sum, mut count) = (0.0, 0.0);
    for (r, w) in residual.iter().zip(&log.weight) {
        sum += r * w;
        count += w;
    }
    let mean = sum / f64::max(count, 1.0);
    residual.iter().zip(&log.weight).map(|(r, w)| (r - mean) * w).collect()
}

impl DriveEffect for M2Ripple {
    fn id(&self) -> &'static str {
        "m2_ripple"
    }

    fn prepare(&self, logs: &[&DriveLog], known: &Known) -> Result<Arc<dyn Prepared>, String> {
        let Some(log) = logs.first() else { return Err("no training log".into()) };
        let travel = logs
            .iter()
            .map(|log| {
                let range = |f: fn(f64, f64) -> f64, from: f64| log.position.iter().copied().fold(from, f);
                range(f64::max, f64::NEG_INFINITY) - range(f64::min, f64::INFINITY)
            })
            .fold(0.0, f64::max);
        // Candidate wave numbers: whole orders of an angle, quarter steps of 1/travel of a length.
        let candidates: Vec<f64> = match log.motion {
            Motion::Rotary => (1..=HIGHEST_ORDER).map(|order| order as f64).collect(),
            Motion::Linear => {
                (12..=4 * 3 * HIGHEST_ORDER).map(|i| 2.0 * PI * i as f64 / (4.0 * travel)).collect()
            }
        };
        let highest = candidates.last().copied().unwrap_or(1.0);
        let width = 2.0 * PI / highest / BINS_PER_PERIOD;
        let mut residuals: Vec<Vec<f64>> =
            logs.iter().zip(&known.residual).map(|(log, residual)| centred(log, residual)).collect();
        let mut waves: Vec<f64> = Vec::new();
        while waves.len() < MOST_ORDERS {
            let binned: Vec<Binned> =
                logs.iter().zip(&residuals).map(|(log, r)| Binned::new(log, r, width)).collect();
            let powers: Vec<f64> =
                candidates.iter().map(|wave| binned.iter().map(|b| b.power(*wave)).sum()).collect();
            let mut sorted = powers.clone();
            let typical = super::noise::median(&mut sorted).max(1e-300);
            let Some((at, power)) = powers.iter().copied().enumerate().max_by(|a, b| a.1.total_cmp(&b.1))
            else {
                break;
            };
            if !waves.is_empty() && power < LINE_OVER_MEAN * typical {
                break;
            }
            let wave = match log.motion {
                Motion::Rotary => candidates[at],
                Motion::Linear => refine(candidates[at], 0.5 * PI / travel, |wave| {
                    binned.iter().map(|b| b.power(wave)).sum()
                }),
            };
            if waves.iter().any(|known| (known - wave).abs() < 0.5 * PI / travel.max(1e-12)) {
                break;
            }
            waves.push(wave);
            for (log, residual) in logs.iter().zip(&mut residuals) {
                let (re, im) = line(log, residual, wave);
                for (r, q) in residual.iter_mut().zip(&log.position) {
                    let (sin, cos) = (wave * q).sin_cos();
                    *r -= re * cos - im * sin;
                }
                *residual = centred(log, residual);
            }
        }
        let lines: Vec<Vec<(f64, f64)>> = logs
            .iter()
            .zip(&known.residual)
            .map(|(log, residual)| {
                let residual = centred(log, residual);
                waves.iter().map(|wave| line(log, &residual, *wave)).collect()
            })
            .collect();
        let lowest = waves.iter().copied().fold(f64::INFINITY, f64::min);
        let (span, step) = match log.motion {
            Motion::Rotary => (2.0 * PI, 2.0 * PI / (10.0 * waves.iter().copied().fold(1.0, f64::max))),
            Motion::Linear => {
                let shortest = 2.0 * PI / waves.iter().copied().fold(lowest, f64::max);
                (2.0 * PI / lowest * 3.0, 0.1 * shortest)
            }
        };
        let starts = lines.iter().map(|own| best_origin(&waves, &lines[0], own, span, step)).collect();
        Ok(Arc::new(Orders { motion: log.motion, waves, starts, span, step }))
    }
}

/// The origin at which a log's lines fall onto those of the first.
fn best_origin(waves: &[f64], first: &[(f64, f64)], own: &[(f64, f64)], span: f64, step: f64) -> f64 {
    let agreement = |origin: f64| -> f64 {
        waves
            .iter()
            .zip(first.iter().zip(own))
            .map(|(wave, (a, b))| {
                // Re(conj(a) b e^{iwo})
                let (sin, cos) = (wave * origin).sin_cos();
                let (re, im) = (a.0 * b.0 + a.1 * b.1, a.0 * b.1 - a.1 * b.0);
                re * cos - im * sin
            })
            .sum()
    };
    let steps = (0.5 * span / step).ceil() as i64;
    (-steps..=steps)
        .map(|i| step * i as f64)
        .max_by(|a, b| agreement(*a).total_cmp(&agreement(*b)))
        .unwrap_or(0.0)
}

/// The maximum near `at`, by thirds.
fn refine(at: f64, reach: f64, value: impl Fn(f64) -> f64) -> f64 {
    let (mut low, mut high) = (at - reach, at + reach);
    for _ in 0..30 {
        let (a, b) = (low + (high - low) / 3.0, high - (high - low) / 3.0);
        if value(a) < value(b) { low = a } else { high = b }
    }
    0.5 * (low + high)
}
