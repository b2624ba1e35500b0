//! Inverse dynamic identification of a drive: F = M q̈ + Fv q̇ + Fc sign(q̇) + offset.
//!
//! Steps and settings are those of the reference models of EMPS (Janot, Gautier, Brunot, 2019 Workshop
//! on Nonlinear System Identification Benchmarks): position through a zero-phase Butterworth low-pass
//! of fourth order with a cut-off of 5 × 20 Hz, the bandwidth of the closed loop; speed and
//! acceleration by central differences; force and regressors through one and the same decimation to
//! 100 Hz (10 at 1 kHz, whose pass band is twice that bandwidth); linear least squares. Both sides of
//! the equation see the same decimation filter, so it biases nothing; the position filter acts on one
//! side only and must stay well above the motion's bandwidth. The first and last 50 ms, where the
//! filter starts up, are left out.
//!
//! What is minimised is the force error: force carries the noise (ripple of the amplifier, unmodelled
//! friction), while the encoder's noise after the low-pass is small against acceleration and speed, so
//! the bias by noise in the regressors is small. Samples at rest, where friction is a reaction and not
//! a function of speed, are left out.
//! Left out: what [`crate::identify`] finds in a drive beside these.

use nalgebra::{DMatrix, DVector};

use super::butterworth::LowPass;
use super::decimate::Decimator;
use super::record::{DriveRecord, central_difference};
use crate::fit::covariance;
use crate::fit::error::FitError;
use crate::fit::identifiability::{self, Identifiability};

/// Cut-off of the position filter, Hz, where the sampling rate allows it.
const CUTOFF_HZ: f64 = 100.0;
/// The cut-off is at most this share of the sampling rate.
const LARGEST_CUTOFF_SHARE: f64 = 0.2;
/// Rate after decimation, Hz.
const DECIMATED_HZ: f64 = 100.0;
/// Left out at each end, s.
const BORDER_S: f64 = 0.05;
/// Speeds below this many standard deviations of the speed's noise count as rest.
const REST_DEVIATIONS: f64 = 4.0;

/// Whether friction is the same in both directions.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Friction {
    /// M, Fv, Fc, offset.
    Symmetric,
    /// M, Fv and Fc per direction; an offset cannot be told apart from a difference of the two Fc.
    PerDirection,
}

/// Unit of the drive's motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Motion {
    /// Newton metres and radians.
    Rotary,
    /// Newtons and metres.
    Linear,
}

impl Friction {
    /// Names of the parameters, with units, in the order of [`DriveFit::values`].
    pub fn names(self, motion: Motion) -> &'static [&'static str] {
        match (self, motion) {
            (Self::Symmetric, Motion::Rotary) => {
                &["inertia_kg_m2", "viscous_nm_s_per_rad", "coulomb_nm", "offset_nm"]
            }
            (Self::Symmetric, Motion::Linear) => &["mass_kg", "viscous_n_s_per_m", "coulomb_n", "offset_n"],
            (Self::PerDirection, Motion::Rotary) => &[
                "inertia_kg_m2",
                "viscous_forward_nm_s_per_rad",
                "viscous_backward_nm_s_per_rad",
                "coulomb_forward_nm",
                "coulomb_backward_nm",
            ],
            (Self::PerDirection, Motion::Linear) => &[
                "mass_kg",
                "viscous_forward_n_s_per_m",
                "viscous_backward_n_s_per_m",
                "coulomb_forward_n",
                "coulomb_backward_n",
            ],
        }
    }
}

/// Force measured and modelled after filtering and decimation, of one record.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Comparison {
    /// Time, s.
    pub time_s: Vec<f64>,
    /// Measured effort.
    pub measured: Vec<f64>,
    /// Effort that the inverse model asks for.
    pub predicted: Vec<f64>,
}

/// An identified drive.
#[derive(Debug, Clone)]
pub struct DriveFit {
    /// Names with units.
    pub names: &'static [&'static str],
    /// Values in the order of the names.
    pub values: Vec<f64>,
    /// Standard deviations that allow for a coloured residual.
    pub std: Vec<f64>,
    /// Correlations.
    pub correlations: DMatrix<f64>,
    /// RMS(F − F_model)/RMS(F) over all records.
    pub relative_force_error: f64,
    /// One for each record.
    pub comparisons: Vec<Comparison>,
}

impl DriveFit {
    /// A value by its name.
    pub fn get(&self, name: &str) -> Option<f64> {
        self.names.iter().position(|n| *n == name).map(|at| self.values[at])
    }
}

struct Prepared {
    time_s: Vec<f64>,
    effort: Vec<f64>,
    columns: Vec<Vec<f64>>,
}

/// Position, speed and acceleration after the zero-phase low-pass.
#[derive(Debug, Clone)]
pub struct Kinematics {
    /// Smoothed position.
    pub position: Vec<f64>,
    /// Speed.
    pub speed: Vec<f64>,
    /// Acceleration.
    pub acceleration: Vec<f64>,
    /// Speed below which the drive may be at rest.
    pub rest_speed: f64,
}

impl Kinematics {
    /// Derivatives of a record's position behind a low-pass of `cutoff_hz`.
    pub fn new(record: &DriveRecord, cutoff_hz: f64) -> Self {
        let rate_hz = record.rate_hz();
        let cutoff_hz = cutoff_hz.min(LARGEST_CUTOFF_SHARE * rate_hz);
        let position = LowPass::new(cutoff_hz, rate_hz).zero_phase(&record.position);
        let speed = central_difference(&position, record.step_s);
        let acceleration = central_difference(&speed, record.step_s);
        let noise = position_noise(&record.position);
        // Derivative of white noise behind a low-pass at f_c: σ 2π f_c √(2 f_c/(3 rate)).
        let omega = 2.0 * std::f64::consts::PI * cutoff_hz;
        let rest_speed = REST_DEVIATIONS * noise * omega * (2.0 * cutoff_hz / (3.0 * rate_hz)).sqrt();
        Self { position, speed, acceleration, rest_speed }
    }
}

/// Standard deviation of the white part of a position: from its third differences, which a motion
/// contributes little to, by their median absolute value; at least that of a count's rounding.
pub fn position_noise(position: &[f64]) -> f64 {
    let mut third: Vec<f64> =
        position.windows(4).map(|w| (w[3] - 3.0 * w[2] + 3.0 * w[1] - w[0]).abs()).collect();
    let mut counts: Vec<f64> =
        position.windows(2).map(|w| (w[1] - w[0]).abs()).filter(|step| *step > 0.0).collect();
    if third.is_empty() || counts.is_empty() {
        return 0.0;
    }
    let middle = third.len() / 2;
    // White noise of variance 1 has third differences of variance 1 + 9 + 9 + 1; the median of a
    // normal's absolute value is 0.6745 σ.
    let white = *third.select_nth_unstable_by(middle, f64::total_cmp).1 / (0.6745 * 20f64.sqrt());
    // The least change between samples is at most a count where there are rests or slow motion.
    let few = counts.len() / 100;
    let count = *counts.select_nth_unstable_by(few, f64::total_cmp).1;
    let rounding = (count / 12f64.sqrt()).min(white);
    white.max(rounding)
}

/// `added` is an effort over the speed, the last column.
fn prepare(record: &DriveRecord, friction: Friction, added: Option<&dyn Fn(f64) -> f64>) -> Prepared {
    let motion = Kinematics::new(record, CUTOFF_HZ);
    let border = (BORDER_S / record.step_s).round() as usize;
    let inside = border.min(record.len() / 4)..record.len() - border.min(record.len() / 4);
    let (speed, acceleration) = (&motion.speed[inside.clone()], &motion.acceleration[inside.clone()]);
    let effort = &record.effort[inside.clone()];
    let each = |f: &dyn Fn(f64) -> f64| speed.iter().map(|v| f(*v)).collect::<Vec<f64>>();
    let (forward, backward) = (|v: f64| f64::from(v > 0.0), |v: f64| f64::from(v < 0.0));
    let mut raw: Vec<Vec<f64>> = match friction {
        Friction::Symmetric => {
            vec![acceleration.to_vec(), speed.to_vec(), each(&|v| forward(v) - backward(v)), each(&|_| 1.0)]
        }
        Friction::PerDirection => vec![
            acceleration.to_vec(),
            each(&|v| v * forward(v)),
            each(&|v| v * backward(v)),
            each(&forward),
            each(&|v| -backward(v)),
        ],
    };
    raw.extend(added.map(each));
    let decimator = Decimator::new((record.rate_hz() / DECIMATED_HZ).round() as usize);
    let positions = decimator.positions(speed.len());
    let window = (0.5 * record.rate_hz() / DECIMATED_HZ).ceil() as usize;
    let moving: Vec<bool> = positions
        .iter()
        .map(|&at| {
            let near = &speed[at.saturating_sub(window)..(at + window + 1).min(speed.len())];
            near.iter().any(|v| v.abs() > motion.rest_speed)
        })
        .collect();
    let keep = |signal: Vec<f64>| -> Vec<f64> {
        signal.into_iter().zip(&moving).filter(|(_, moving)| **moving).map(|(x, _)| x).collect()
    };
    Prepared {
        time_s: keep(positions.iter().map(|at| record.time_s(at + inside.start)).collect()),
        effort: keep(decimator.apply(effort)),
        columns: raw.iter().map(|column| keep(decimator.apply(column))).collect(),
    }
}

/// Identifies a drive from records of the same motion.
pub fn identify(records: &[DriveRecord], friction: Friction, motion: Motion) -> Result<DriveFit, FitError> {
    let names = friction.names(motion);
    let prepared: Vec<Prepared> = records.iter().map(|record| prepare(record, friction, None)).collect();
    let samples: usize = prepared.iter().map(|p| p.effort.len()).sum();
    let needed = 10 * names.len();
    if samples < needed {
        return Err(FitError::TooFewSamples { samples, needed });
    }
    let all = |column: usize| prepared.iter().flat_map(move |p| p.columns[column].iter().copied());
    let jacobian = DMatrix::from_columns(
        &(0..names.len()).map(|c| DVector::from_iterator(samples, all(c))).collect::<Vec<_>>(),
    );
    let effort = DVector::from_iterator(samples, prepared.iter().flat_map(|p| p.effort.iter().copied()));
    let named = |columns: Vec<usize>| columns.into_iter().map(|c| names[c].to_string()).collect();
    // Columns brought to length one first: their units differ by orders of magnitude.
    match identifiability::examine(
        &jacobian.clone().map_with_location(|_, c, x| x / jacobian.column(c).norm().max(1e-300)),
    ) {
        Identifiability::NoInfluence(columns) => return Err(FitError::NoInfluence { names: named(columns) }),
        Identifiability::Inseparable { parameters, singular_ratio } => {
            return Err(FitError::Inseparable { names: named(parameters), singular_ratio });
        }
        Identifiability::Full { .. } => {}
    }
    let solution = jacobian
        .clone()
        .svd(true, true)
        .solve(&effort, 1e-12)
        .map_err(|why| FitError::NotConverged(why.to_string()))?;
    let predicted = &jacobian * &solution;
    let residual = &effort - &predicted;
    let (std, correlations) = match covariance::sandwich(&jacobian, &residual, None) {
        Some(covariance) => {
            let std = covariance.diagonal().iter().map(|v| v.max(0.0).sqrt()).collect();
            (std, covariance::correlations(&covariance))
        }
        None => (vec![f64::NAN; names.len()], DMatrix::identity(names.len(), names.len())),
    };
    let mut comparisons = Vec::new();
    let mut from = 0;
    for record in prepared {
        let to = from + record.effort.len();
        let predicted = predicted.as_slice()[from..to].to_vec();
        comparisons.push(Comparison { time_s: record.time_s, measured: record.effort, predicted });
        from = to;
    }
    Ok(DriveFit {
        names,
        values: solution.as_slice().to_vec(),
        std,
        correlations,
        relative_force_error: residual.norm() / effort.norm(),
        comparisons,
    })
}

/// What a drive with these values, in the order of [`Friction::names`], asks for where it moves as recorded; `added` is a
/// further effort over its speed.
///
/// # Errors
/// A record too short for the filters, or without motion.
pub fn predict(
    record: &DriveRecord,
    friction: Friction,
    values: &[f64],
    added: &dyn Fn(f64) -> f64,
) -> Result<Comparison, FitError> {
    let Prepared { time_s, effort: measured, columns } = prepare(record, friction, Some(added));
    if measured.is_empty() {
        return Err(FitError::TooFewSamples { samples: 0, needed: 1 });
    }
    let factors = || values.iter().copied().chain([1.0]);
    let predicted =
        (0..measured.len()).map(|i| columns.iter().zip(factors()).map(|(c, x)| x * c[i]).sum()).collect();
    Ok(Comparison { time_s, measured, predicted })
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use super::*;

    /// The measured record, if it is on this machine.
    fn measured() -> Option<DriveRecord> {
        let shared = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../shared/data/emps_train.csv");
        let path = std::env::var_os("EMPS_TRAIN_CSV").map_or(shared, PathBuf::from);
        let Ok(text) = std::fs::read_to_string(&path) else {
            eprintln!("skipped: {} is not here; EMPS_TRAIN_CSV may name it", path.display());
            return None;
        };
        let mut columns = [Vec::new(), Vec::new(), Vec::new()];
        for line in text.lines().filter(|line| line.starts_with(|c: char| c.is_ascii_digit())) {
            let mut cells = line.split(',');
            for column in &mut columns {
                column.push(cells.next().unwrap().parse().unwrap());
            }
        }
        DriveRecord::new(&columns[0], &columns[1], &columns[2])
    }

    /// A stage like it: known parameters, jerky reversals, rounded position, noisy force.
    fn synthetic(fv: [f64; 2], fc: [f64; 2], offset: f64) -> DriveRecord {
        let step_s = 1e-3;
        let mass = 95.0;
        let (mut effort, mut position) = (Vec::new(), Vec::new());
        let mut seed = 5u64;
        for i in 0..20_000 {
            let t = step_s * f64::from(i);
            // Motion given, force computed: no integration between the truth and the record.
            let (w1, w2) = (2.1, 5.3);
            let x = 0.03 * (w1 * t).sin() + 0.01 * (w2 * t).sin();
            let v = 0.03 * w1 * (w1 * t).cos() + 0.01 * w2 * (w2 * t).cos();
            let a = -0.03 * w1 * w1 * (w1 * t).sin() - 0.01 * w2 * w2 * (w2 * t).sin();
            let direction = usize::from(v < 0.0);
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            let noise = (seed >> 11) as f64 / (1u64 << 53) as f64 - 0.5;
            effort.push(mass * a + fv[direction] * v + fc[direction] * v.signum() + offset + noise);
            position.push((x / 5e-8).round() * 5e-8);
        }
        DriveRecord { start_s: 0.0, step_s, effort, position }
    }

    #[test]
    fn a_stage_of_known_parameters_is_identified() {
        let record = synthetic([203.5; 2], [20.4; 2], -3.2);
        let fit = identify(&[record], Friction::Symmetric, Motion::Linear).unwrap();
        for (value, truth) in fit.values.iter().zip([95.0, 203.5, 20.4, -3.2]) {
            // Force noise of 0.3 N on 2000 independent samples against 20 N: 1e-3; the smoothed sign 3e-3.
            assert!((value / truth - 1.0).abs() < 1e-2, "{:?}", fit.values);
        }
        assert!(fit.relative_force_error < 0.03, "{}", fit.relative_force_error);
    }

    #[test]
    fn friction_per_direction_is_identified_and_fits_better() {
        let record = synthetic([165.0, 240.0], [20.1, 20.6], 0.0);
        let fit = identify(std::slice::from_ref(&record), Friction::PerDirection, Motion::Linear).unwrap();
        for (value, truth) in fit.values.iter().zip([95.0, 165.0, 240.0, 20.1, 20.6]) {
            assert!((value / truth - 1.0).abs() < 2e-2, "{:?}", fit.values);
        }
        let symmetric = identify(&[record], Friction::Symmetric, Motion::Linear).unwrap();
        assert!(fit.relative_force_error < 0.8 * symmetric.relative_force_error);
    }

    #[test]
    fn a_constant_speed_cannot_tell_viscous_coulomb_and_offset_apart() {
        let ramp: Vec<f64> = (0..5000).map(|i| 1e-4 * f64::from(i)).collect();
        let record = DriveRecord { start_s: 0.0, step_s: 1e-3, effort: vec![1.0; 5000], position: ramp };
        let error = identify(&[record], Friction::Symmetric, Motion::Rotary).unwrap_err().to_string();
        assert!(error.contains("inertia_kg_m2") || error.contains("coulomb_nm"), "{error}");
    }

    #[test]
    fn the_measured_stage_gives_the_published_parameters() {
        let Some(record) = measured() else { return };
        let symmetric = identify(std::slice::from_ref(&record), Friction::Symmetric, Motion::Linear).unwrap();
        for (value, published) in symmetric.values.iter().zip([95.1089, 203.5034, 20.3935, -3.1648]) {
            assert!((value / published - 1.0).abs() < 0.01, "{:?}", symmetric.values);
        }
        // Published: 4.083 % and 3.112 %; the allowance covers another decimation filter.
        assert!((symmetric.relative_force_error - 0.0408).abs() < 1e-3, "{}", symmetric.relative_force_error);
        let directed = identify(&[record], Friction::PerDirection, Motion::Linear).unwrap();
        assert!((directed.relative_force_error - 0.0311).abs() < 1e-3, "{}", directed.relative_force_error);
        eprintln!("{:?} ± {:?}: {}", symmetric.values, symmetric.std, symmetric.relative_force_error);
        eprintln!("{:?}: {}", directed.values, directed.relative_force_error);
    }
}
