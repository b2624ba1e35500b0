//! The contact model of a diagnosis: baseline, effects, and what it shows over a record.

use model_core::extension::{ExtendedFriction, ExtendedInput, ExtendedOutput, Extension, Extensions};

use super::plan::{Plan, Step};
use crate::files::model_file::{ModelFile, ModelKind};
use crate::files::rig_file::RigFile;
use crate::input_error::InputError;

/// What the rig presses with at most, about.
const LARGE_LOAD_N: f64 = 200.0;

/// A baseline with effects, in numbers.
#[derive(Debug, Clone, PartialEq)]
pub struct ContactModel {
    /// Friction model.
    pub kind: ModelKind,
    /// Its parameters.
    pub parameters: Vec<(&'static str, f64)>,
    /// Effects with their values.
    pub effects: Vec<(Extension, Vec<f64>)>,
    /// How late the friction channel is against the motion beyond what the rig file explains, s.
    pub late_s: f64,
    /// Whether the load beyond the end of a clipped normal bridge is taken from M1.
    pub restored_load: bool,
}

/// Torque over a record.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Torques {
    /// On the disc, N·m.
    pub true_nm: Vec<f64>,
    /// As the friction channel shows it, N·m.
    pub shown_nm: Vec<f64>,
}

impl ContactModel {
    /// The model of a file without its extensions.
    pub fn new(file: &ModelFile) -> Self {
        let parameters = file
            .kind
            .parameters()
            .iter()
            .map(|spec| (spec.name, file.get(spec.name).or(spec.default).unwrap_or(0.0)))
            .collect();
        Self { kind: file.kind, parameters, effects: Vec::new(), late_s: 0.0, restored_load: false }
    }

    /// Sets an effect, or replaces it.
    pub fn set(&mut self, extension: Extension, values: Vec<f64>) {
        match self.effects.iter_mut().find(|(known, _)| *known == extension) {
            Some((_, old)) => *old = values,
            None => self.effects.push((extension, values)),
        }
    }

    /// Sets a parameter of the friction model.
    pub fn set_parameter(&mut self, name: &'static str, value: f64) {
        match self.parameters.iter_mut().find(|(known, _)| *known == name) {
            Some((_, old)) => *old = value,
            None => self.parameters.push((name, value)),
        }
    }

    /// A parameter of the friction model.
    pub fn parameter(&self, name: &str) -> Option<f64> {
        self.parameters.iter().find(|(known, _)| *known == name).map(|(_, value)| *value)
    }

    /// Stiffness against small motion (N/m) and the largest friction coefficient.
    pub fn stiffness_and_friction(&self) -> (f64, f64) {
        let friction = self.to_file("the model").and_then(|file| file.friction_model(1e-4));
        friction.map_or((0.0, 0.0), |f| (f.sticking_stiffness_n_per_m(LARGE_LOAD_N), f.largest_coefficient()))
    }

    /// As a model file, without extensions.
    pub fn to_file(&self, source: &str) -> Result<ModelFile, InputError> {
        ModelFile::new(source, self.kind, &self.parameters)
    }

    /// The extended model for steps of one length, but for delay and clipping: a record's steps are uneven,
    /// so these are applied to the samples. The rig's own ring is there unless a ring among the effects stands in
    /// for it.
    fn prepare(&self, rig: &RigFile, step_s: f64) -> Result<ExtendedFriction<f64>, InputError> {
        let friction = self.to_file("the fitted model")?.friction_model(step_s)?;
        let mut set = Extensions::none(step_s);
        if let Some(mode) = rig.friction_bridge.mode.filter(|mode| mode.damping_ratio < 0.99) {
            set.set(Extension::RingResonance, &[mode.mode_hz, mode.damping_ratio.max(1e-4)])?;
        }
        let on_samples = [Extension::FrictionDelay, Extension::AdcSaturation];
        for (extension, values) in self.effects.iter().filter(|(e, _)| !on_samples.contains(e)) {
            set.set(*extension, values)?;
        }
        Ok(ExtendedFriction::new(friction, set, rig.friction_radius_m)?)
    }

    /// Runs the model over a record that begins with `first_nm` on the friction channel; one torque a bin.
    pub fn run(&self, rig: &RigFile, plan: &Plan, first_nm: f64) -> Result<Torques, InputError> {
        let Some(first) = plan.steps.first() else { return Ok(Torques::default()) };
        let mut step_s = first.length_s;
        let mut model = self.prepare(rig, step_s)?;
        let input = |step: &Step| ExtendedInput {
            disc_speed_rad_s: step.speed_rad_s,
            disc_angle_rad: step.angle_rad,
            normal_force_n: step.load_n,
        };
        let mut state = model.holding(first_nm, &input(first));
        let mut torques = Torques {
            true_nm: Vec::with_capacity(plan.counts.len()),
            shown_nm: Vec::with_capacity(plan.counts.len()),
        };
        let mut steps = plan.steps.iter();
        let mut before: Option<ExtendedOutput<f64>> = None;
        let mut anchors = plan.anchors.iter().peekable();
        for (bin, count) in plan.counts.iter().enumerate() {
            while let Some((_, anchor_nm)) = anchors.next_if(|(at, _)| *at <= bin) {
                if let Some(step) = steps.as_slice().first() {
                    model.hold(&mut state, *anchor_nm, &input(step));
                }
            }
            let (mut middle, mut last) = (None, ExtendedOutput::default());
            for (at, step) in steps.by_ref().take(usize::from(*count)).enumerate() {
                if (step.length_s - step_s).abs() > 1e-6 * step_s {
                    step_s = step.length_s;
                    model.set_step_s(step_s);
                }
                last = model.step(&mut state, &input(step));
                if 2 * (at + 1) == usize::from(*count) {
                    middle = Some(last);
                }
            }
            // A bin of one step: halfway between its ends.
            let found = middle.unwrap_or_else(|| {
                let from = before.unwrap_or(last);
                ExtendedOutput {
                    torque_nm: 0.5 * (from.torque_nm + last.torque_nm),
                    shown_nm: 0.5 * (from.shown_nm + last.shown_nm),
                }
            });
            torques.true_nm.push(found.torque_nm);
            torques.shown_nm.push(found.shown_nm);
            before = Some(last);
        }
        torques.shown_nm = shifted(&plan.time_s, &torques.shown_nm, self.late_s + self.delay_s());
        let ends = self.effects.iter().find(|(extension, _)| *extension == Extension::AdcSaturation);
        if let Some([low, high]) = ends.map(|(_, values)| values.as_slice()) {
            torques.shown_nm.iter_mut().for_each(|shown| *shown = shown.max(*low).min(*high));
        }
        Ok(torques)
    }

    /// Frequency and damping ratio of the ring, where the effects have one.
    pub fn ring(&self) -> Option<(f64, f64)> {
        let ring = self.effects.iter().find(|(extension, _)| *extension == Extension::RingResonance);
        ring.and_then(|(_, values)| Some((*values.first()?, *values.get(1)?)))
    }

    fn delay_s(&self) -> f64 {
        let delay = self.effects.iter().find(|(extension, _)| *extension == Extension::FrictionDelay);
        delay.and_then(|(_, values)| values.first().copied()).unwrap_or(0.0)
    }
}

/// A signal as seen `late_s` later, by cubics between samples (Catmull and Rom), for shifts of a few
/// samples.
pub fn shifted(time_s: &[f64], values: &[f64], late_s: f64) -> Vec<f64> {
    let last = values.len().saturating_sub(1);
    if late_s == 0.0 || last < 3 {
        return values.to_vec();
    }
    let mut before = 0;
    let shifted = time_s.iter().map(|t| {
        let wanted_s = t - late_s;
        while before + 1 < last && time_s[before + 1] <= wanted_s {
            before += 1;
        }
        let span_s = time_s[before + 1] - time_s[before];
        let s = ((wanted_s - time_s[before]) / span_s).clamp(0.0, 1.0);
        let (a, b) = (values[before], values[before + 1]);
        let from = if before > 0 { 0.5 * (b - values[before - 1]) } else { b - a };
        let to = if before + 2 <= last { 0.5 * (values[before + 2] - a) } else { b - a };
        let (c2, c3) = (3.0 * (b - a) - 2.0 * from - to, 2.0 * (a - b) + from + to);
        a + s * (from + s * (c2 + s * c3))
    });
    shifted.collect()
}
