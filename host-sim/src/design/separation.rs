//! How far two models are apart on an experiment, after the wrong one has done what it can.
//!
//! δ = y_i − y_j on the motion and load of one closed-loop run. A model that would be fitted again moves its
//! parameters by Δ, as far as they are uncertain: min over Δ of |δ − S Δ|²/σ² + Σ (Δ/s)², S the derivatives
//! of y_j, σ the noise of a sample, s the parameters' standard deviations. What is left of δ, as RMS over σ,
//! is the separation (T-optimality, Atkinson and Fedorov 1975, with a prior). The smaller of both directions
//! counts: either may be the true one.
//!
//! Where a model sticks and slips, the smallest change of a parameter moves every later event, and two runs of one rubber differ
//! as much as two rubbers. So each model is run once more with every parameter moved by a hair (`HAIR`): what its derivatives do not
//! explain of that cannot be repeated, and is taken off.
//! Left out: what noise in motion and load does, and a model that is wrong in a third way.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use crate::files::model_file::ModelFile;
use crate::files::rig_file::RigFile;
use crate::input_error::InputError;
use crate::predict::{Accuracy, ContactInputs, simulate_friction_as};

/// Relative standard deviation of a friction parameter that the file gives no interval for (assumed).
const UNKNOWN_PARAMETER: f64 = 0.1;
/// The same for an effect's parameter: a fit would move it freely.
const UNKNOWN_EFFECT: f64 = 0.5;
/// Step of the difference quotients, in standard deviations.
const DIFFERENCE: f64 = 0.05;
/// Part of that by which every parameter is moved, up and down in turn, to see what can be repeated.
const HAIR: f64 = 0.1;

/// A model's prediction, and what it could be with other parameters.
#[derive(Debug, Clone)]
pub struct Reach {
    /// Friction torque, N·m.
    pub torque_nm: Vec<f64>,
    /// Its change by one standard deviation of each parameter, N·m.
    pub moves_nm: Vec<Vec<f64>>,
    /// The prediction with every parameter moved by a hair.
    pub again_nm: Vec<f64>,
}

impl Reach {
    /// Runs a model on motion and load, and once more for every parameter.
    pub fn new(model: &ModelFile, rig: &RigFile, inputs: &ContactInputs) -> Result<Self, InputError> {
        let run = |model: &ModelFile| simulate_friction_as(model, rig, inputs, Accuracy::Fast);
        let torque_nm = run(model)?;
        let again_nm = run(&twin(model)).unwrap_or_else(|_| torque_nm.clone());
        let moves_nm = neighbours(model)
            .into_par_iter()
            // A neighbour beyond a parameter's range is a direction in which the model cannot move.
            .filter_map(|neighbour| run(&neighbour).ok())
            .map(|moved| moved.iter().zip(&torque_nm).map(|(m, t)| (m - t) / DIFFERENCE).collect())
            .collect();
        Ok(Self { torque_nm, moves_nm, again_nm })
    }

    /// RMS of what two runs of this model differ by, over the noise.
    #[must_use]
    pub fn unrepeatable(&self, noise_nm: f64) -> f64 {
        self.distance_from(&self.again_nm, noise_nm)
    }

    /// RMS of what is left of `truth` − this model after its parameters moved, over the noise.
    #[must_use]
    pub fn distance_from(&self, truth: &[f64], noise_nm: f64) -> f64 {
        let scaled =
            |values: &[f64]| DVector::from_iterator(values.len(), values.iter().map(|x| x / noise_nm));
        let delta = scaled(truth) - scaled(&self.torque_nm);
        let moves: Vec<DVector<f64>> = self.moves_nm.iter().map(|m| scaled(m)).collect();
        let count = moves.len();
        let mut left = delta.clone();
        if count > 0 {
            let mut normal = DMatrix::from_fn(count, count, |i, j| moves[i].dot(&moves[j]));
            (0..count).for_each(|i| normal[(i, i)] += 1.0);
            let right = DVector::from_iterator(count, moves.iter().map(|m| m.dot(&delta)));
            if let Some(factor) = normal.cholesky() {
                let steps = factor.solve(&right);
                moves.iter().zip(steps.iter()).for_each(|(m, step)| left.axpy(-step, m, 1.0));
            }
        }
        left.norm() / (truth.len().max(1) as f64).sqrt()
    }
}

/// How far a parameter is uncertain; `None` where it is not moved.
fn standard_deviation(model: &ModelFile, name: &str, value: f64) -> Option<f64> {
    let known = model.intervals.get(name).map(|interval| interval.std).filter(|std| *std > 0.0);
    let std = known.unwrap_or(UNKNOWN_PARAMETER * value.abs());
    // The road factor scales a0 and a1, the exponent is a choice of the model's form.
    (std > 0.0 && !matches!(name, "theta" | "delta")).then_some(std)
}

/// The model with every parameter moved by a hair; what is refused stays.
fn twin(model: &ModelFile) -> ModelFile {
    let mut moved = model.clone();
    for (place, (name, value)) in model.parameters().enumerate() {
        let Some(std) = standard_deviation(model, name, value) else { continue };
        let hair = if place % 2 == 0 { HAIR } else { -HAIR };
        let _ = moved.set(name, value + hair * DIFFERENCE * std);
    }
    moved
}

/// The model with one parameter at a time moved by [`DIFFERENCE`] of its standard deviation.
fn neighbours(model: &ModelFile) -> Vec<ModelFile> {
    let mut all = Vec::new();
    for (name, value) in model.parameters() {
        let Some(std) = standard_deviation(model, name, value) else { continue };
        let mut moved = model.clone();
        if moved.set(name, value + DIFFERENCE * std).is_ok() {
            all.push(moved);
        }
    }
    for effect in 0..model.extensions.len() {
        for at in 0..model.extensions[effect].parameters.len() {
            let mut moved = model.clone();
            let value = &mut moved.extensions[effect].parameters[at].1;
            if *value != 0.0 {
                *value += DIFFERENCE * UNKNOWN_EFFECT * value.abs();
                all.push(moved);
            }
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_parameter_can_make_up_for_does_not_separate() {
        let time: Vec<f64> = (0..1000).map(|i| 1e-2 * f64::from(i)).collect();
        let wave = |k: f64| -> Vec<f64> { time.iter().map(|t| (k * t).sin()).collect() };
        let again_nm: Vec<f64> = wave(1.0).iter().zip(wave(5.1)).map(|(a, b)| 0.1 * a + 0.01 * b).collect();
        let reach = Reach { torque_nm: vec![0.0; 1000], moves_nm: vec![wave(1.0)], again_nm };
        let noise_nm = 0.01;
        // Half a standard deviation of the parameter explains the first wave: 1/√1000 of it is not moved.
        let explained: Vec<f64> = wave(1.0).iter().map(|x| 0.5 * x).collect();
        assert!(reach.distance_from(&explained, noise_nm) < 0.01);
        let other: Vec<f64> = wave(7.3).iter().map(|x| 0.5 * x).collect();
        let rms = 0.5 / std::f64::consts::SQRT_2 / noise_nm;
        assert!((reach.distance_from(&other, noise_nm) / rms - 1.0).abs() < 0.02);
        // Of the second run the derivative explains the first wave.
        assert!((reach.unrepeatable(noise_nm) / (0.02 * rms) - 1.0).abs() < 0.02);
    }
}
