//! What the models are driven with: the contact's motion and load, one entry a control period.
//!
//! Figs. 18–21 are run in closed loop with the model that plays the rubber, so speed and load are what motors, lever and
//! that rubber make of their steps. The others are what a rig can do besides: a step of the sliding speed at constant
//! load, a step of the load at constant speed, and holds of growing length between slides.

use crate::files::experiment_file::ExperimentFile;
use crate::files::rig_file::RigFile;
use crate::input_error::InputError;
use crate::lockstep::{Setup, run};
use crate::plant::PERIOD_S;
use crate::studies::bristle_damping::file;
use model_core::friction::{Contact, FrictionModel, FrictionParameters};

/// The part of Figs. 18–21 in which something happens, s.
const WINDOW_S: (f64, f64) = (3.48, 4.18);
/// Control periods from one compared force to the next.
const EVERY: usize = 10;
/// Control periods that a search takes at once where the motion is calm; a divisor of [`EVERY`].
pub(super) const AT_ONCE: usize = 5;
/// Calm is what changes by less than these parts, and these m/s and N, from one compared force to the next.
const CALM: [(f64, f64); 2] = [(2e-3, 1e-4), (2e-3, 0.05)];

/// Mean sliding speed and final normal force of each step.
#[derive(Debug, Clone, PartialEq)]
pub struct Course {
    /// What is done.
    pub name: String,
    /// m/s, N.
    pub steps: Vec<(f64, f64)>,
    /// Whether the steps up to each compared force are calm.
    calm: Vec<bool>,
}

/// Courses to fit and to predict.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// Fitted.
    pub train: Vec<Course>,
    /// Predicted.
    pub held_out: Vec<Course>,
}

impl Course {
    fn new(name: &str, steps: Vec<(f64, f64)>) -> Self {
        let spread = |chunk: &[(f64, f64)], pick: fn(&(f64, f64)) -> f64, (part, least): (f64, f64)| {
            let (low, high) = chunk
                .iter()
                .map(pick)
                .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
            high - low <= part * low.abs().min(high.abs()) + least
        };
        let calm = steps.chunks_exact(EVERY);
        let calm = calm.map(|chunk| spread(chunk, |s| s.0, CALM[0]) && spread(chunk, |s| s.1, CALM[1]));
        Self { name: name.into(), calm: calm.collect(), steps }
    }

    /// Piecewise straight speed and load through (time s, speed m/s, load N).
    fn through(name: &str, points: &[(f64, f64, f64)]) -> Self {
        let end_s = points.last().map_or(0.0, |p| p.0);
        let at = |t: f64| {
            let next = points.iter().position(|p| p.0 > t).unwrap_or(points.len() - 1).max(1);
            let (a, b) = (points[next - 1], points[next]);
            let x = ((t - a.0) / (b.0 - a.0)).clamp(0.0, 1.0);
            (a.1 + x * (b.1 - a.1), a.2 + x * (b.2 - a.2))
        };
        let steps = (0..(end_s / PERIOD_S).round() as usize).map(|k| {
            let t = k as f64 * PERIOD_S;
            (at(t + 0.5 * PERIOD_S).0, at(t + PERIOD_S).1)
        });
        Self::new(name, steps.collect())
    }

    fn speed_step(name: &str, slow: f64, fast: f64, load_n: f64) -> Self {
        let quick = 2e-3;
        Self::through(
            name,
            &[
                (0.0, slow, load_n),
                (0.15, slow, load_n),
                (0.15 + quick, fast, load_n),
                (0.3, fast, load_n),
                (0.3 + quick, slow, load_n),
                (0.45, slow, load_n),
            ],
        )
    }

    fn load_step(name: &str, speed: f64, light_n: f64, heavy_n: f64) -> Self {
        let quick = 4e-3;
        Self::through(
            name,
            &[
                (0.0, speed, light_n),
                (0.15, speed, light_n),
                (0.15 + quick, speed, heavy_n),
                (0.3, speed, heavy_n),
                (0.3 + quick, speed, light_n),
                (0.45, speed, light_n),
            ],
        )
    }

    fn holds(name: &str, speed: f64, load_n: f64, holds_s: [f64; 2]) -> Self {
        let (mut t, mut points) = (0.0, vec![(0.0, speed, load_n)]);
        let ramp = 2e-3;
        for hold_s in holds_s {
            for (span_s, v) in [(0.1, speed), (ramp, 0.0), (hold_s, 0.0), (ramp, speed)] {
                t += span_s;
                points.push((t, v, load_n));
            }
        }
        points.push((t + 0.1, speed, load_n));
        Self::through(name, &points)
    }

    /// One of Figs. 18–21 in closed loop with a model at the contact.
    fn figure(figure: &str, rubber: &FrictionParameters<f64>) -> Result<Self, InputError> {
        let experiment = ExperimentFile::named_or_read(figure, &[])?;
        let (rig, model) = (RigFile::assumed_rig(&[])?, file(rubber)?);
        let recording = run(&Setup::from_files(&experiment, &rig, &model, &model)?, |_, _| {})?;
        let frames = recording.frames.iter().enumerate().filter(|(k, _)| {
            let t = recording.time_s(*k);
            t >= WINDOW_S.0 && t < WINDOW_S.1
        });
        let truth: Vec<(f64, f64)> = frames
            .map(|(_, f)| (f.truth.disc_speed_rad_s * rig.friction_radius_m, f.truth.normal_force_n))
            .collect();
        let steps = truth.windows(2).map(|w| (0.5 * (w[0].0 + w[1].0), w[1].1)).collect();
        Ok(Self::new(figure, steps))
    }

    /// Force of a model, from rest, once a millisecond.
    #[must_use]
    pub fn force_n(&self, model: &FrictionModel<f64>) -> Vec<f64> {
        let mut state = model.rest();
        let mut forces = Vec::with_capacity(self.steps.len() / EVERY + 1);
        for (k, (v, n)) in self.steps.iter().enumerate() {
            let force_n = model.step(&mut state, &Contact::new(*v, *n)).force_n;
            if k % EVERY == EVERY - 1 {
                forces.push(force_n);
            }
        }
        forces
    }

    /// The same with `AT_ONCE` steps at a time where the motion is calm, by the model prepared for so long a step: good
    /// enough for a derivative, in a third of the time.
    #[must_use]
    pub fn rough_force_n(&self, model: &FrictionModel<f64>, long: &FrictionModel<f64>) -> Vec<f64> {
        let mut state = model.rest();
        let chunks = self.steps.chunks_exact(EVERY).zip(&self.calm);
        let force = chunks.map(|(chunk, calm)| {
            let (model, at_once) = if *calm { (long, AT_ONCE) } else { (model, 1) };
            let mut force_n = 0.0;
            for steps in chunk.chunks_exact(at_once) {
                let v = steps.iter().map(|s| s.0).sum::<f64>() / at_once as f64;
                let n = steps[at_once - 1].1;
                force_n = model.step(&mut state, &Contact::new(v, n)).force_n;
            }
            force_n
        });
        force.collect()
    }
}

impl Plan {
    /// The paper's plan: Figs. 18, 20 and 21 are fitted, 19 is held out.
    ///
    /// # Errors
    /// What plant, core or model refuse.
    pub fn figures(rubber: &FrictionParameters<f64>) -> Result<Self, InputError> {
        let train = ["fig18", "fig20", "fig21"].map(|f| Course::figure(f, rubber));
        Ok(Self {
            train: train.into_iter().collect::<Result<_, _>>()?,
            held_out: vec![Course::figure("fig19", rubber)?],
        })
    }

    /// The same with steps of speed and load, and holds.
    #[must_use]
    pub fn and_more(&self) -> Self {
        let mut plan = self.clone();
        plan.train.extend([
            Course::speed_step("speed step", 0.05, 0.3, 88.0),
            Course::load_step("load step", 0.1, 40.0, 100.0),
            Course::holds("holds", 0.1, 88.0, [0.02, 0.3]),
        ]);
        plan.held_out.extend([
            Course::speed_step("speed step", 0.1, 0.6, 70.0),
            Course::load_step("load step", 0.2, 30.0, 80.0),
            Course::holds("holds", 0.15, 70.0, [0.05, 0.6]),
        ]);
        plan
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::studies::rivals::all;

    #[test]
    fn rough_forces_are_close_to_the_fine_ones_in_much_fewer_steps() {
        for candidate in all() {
            let courses = [
                Course::speed_step("speed", 0.05, 0.3, 88.0),
                Course::load_step("load", 0.1, 40.0, 100.0),
                Course::holds("holds", 0.1, 88.0, [0.02, 0.3]),
            ];
            // Damped so that no block sticks and slips: such traces can be compared with none.
            let typical = candidate.typical.with("c_u_n_s_per_m", 160.0);
            let fine = typical.model(PERIOD_S).unwrap();
            let long = typical.model(PERIOD_S * AT_ONCE as f64).unwrap();
            for course in courses {
                let calm = course.calm.iter().filter(|calm| **calm).count();
                assert!(calm * 10 > course.calm.len() * 9, "{}: {calm} calm", course.name);
                let (a, b) = (course.force_n(&fine), course.rough_force_n(&fine, &long));
                assert_eq!(a.len(), b.len());
                let error: f64 = a.iter().zip(&b).map(|(a, b)| (a - b).powi(2)).sum();
                let nrmse = (error / a.iter().map(|a| a * a).sum::<f64>()).sqrt();
                assert!(nrmse < 0.05, "{} on {}: {nrmse}", candidate.name, course.name);
            }
        }
    }
}
