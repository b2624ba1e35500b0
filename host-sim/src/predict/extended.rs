//! Friction torque from an extended model, as the control core's observer runs it.
//!
//! The friction channel is a [`SensorChain`] in two parts: mode, amplifier and low-pass act on the steps, delay and clipping
//! on the samples, as steps of changing length have no common memory. A ring among the effects stands in for the rig
//! file's. The element is taken as cold and unworn at the first sample. Effects of
//! pressure and drive do not act here.

use model_core::extension::adc_saturation::AdcSaturation;
use model_core::extension::{ExtendedFriction, ExtendedInput, Extension, Extensions};
use model_core::sensor::SensorChain;

use super::bridge::BridgeModel;
use super::curve::shifted;
use super::friction::StepPlan;
use super::inputs::ContactInputs;
use crate::files::model_file::{ModelFile, SOME_STEP_S};
use crate::files::rig_file::RigFile;
use crate::input_error::InputError;

/// Whether the model has an effect that changes the friction channel.
pub fn acts_on_friction(model: &ModelFile) -> bool {
    model.extensions.iter().any(|extension| Extension::with_id(&extension.id).is_some())
}

/// Ids of the model's effects that do not act on the friction channel.
pub fn effects_elsewhere(model: &ModelFile) -> Vec<String> {
    let ids = model.extensions.iter().map(|extension| extension.id.clone());
    ids.filter(|id| Extension::with_id(id).is_none()).collect()
}

/// Friction torque (N·m) as the friction channel shows it, at each sample.
pub(super) fn simulate(
    model: &ModelFile,
    rig: &RigFile,
    inputs: &ContactInputs,
    plan: &StepPlan,
) -> Result<Vec<f64>, InputError> {
    let radius_m = rig.friction_radius_m;
    let mut effects = Extensions::none(SOME_STEP_S);
    if let Some(mode) = rig.friction_bridge.mode {
        effects.set(Extension::RingResonance, &[mode.mode_hz, mode.damping_ratio])?;
    }
    let mut samples = Samples { time_s: &inputs.time_s, delay_s: 0.0, clipping: None };
    for extension in &model.extensions {
        let Some(effect) = Extension::with_id(&extension.id) else { continue };
        let values: Vec<f64> = extension.parameters.iter().map(|(_, value)| *value).collect();
        match (effect, values.as_slice()) {
            (Extension::FrictionDelay, [delay_s]) => samples.delay_s += delay_s,
            (Extension::AdcSaturation, [low, high, knee]) => {
                samples.clipping = Some(AdcSaturation::new(&[*low, *high, *knee])?);
            }
            _ => effects.set(effect, &values)?,
        }
    }
    let mut extended = ExtendedFriction::new(model.friction_model(SOME_STEP_S)?, effects, radius_m)?;
    let Some(first) = plan.steps.first() else { return Ok(Vec::new()) };
    let input = |speed_m_s: f64, load_n: f64, angle_rad: f64| ExtendedInput {
        disc_speed_rad_s: speed_m_s / radius_m,
        disc_angle_rad: angle_rad,
        normal_force_n: load_n,
    };
    let initial_nm = inputs.initial_friction_n * radius_m;
    let start = input(first.speed_m_s, first.load_n, first.angle_rad);
    let mut state = extended.holding(initial_nm, &start);
    let mut amplifier = BridgeModel::low_pass_alone(&rig.friction_bridge, initial_nm);

    let mut shown = Vec::with_capacity(inputs.len());
    shown.push(initial_nm);
    let (mut steps, mut last_step_s) = (plan.steps.iter(), 0.0);
    for count in &plan.counts {
        let mut last_nm = 0.0;
        for step in steps.by_ref().take(usize::from(*count)) {
            if step.length_s != last_step_s {
                extended.set_step_s(step.length_s);
                last_step_s = step.length_s;
            }
            let low_pass = |torque_nm: f64| amplifier.step(step.length_s, torque_nm);
            let input = input(step.speed_m_s, step.load_n, step.angle_rad);
            last_nm = extended.step_filtered(&mut state, &input, low_pass).shown_nm;
        }
        shown.push(last_nm);
    }
    Ok(samples.show(shown))
}

/// The part of the channel that acts on samples.
struct Samples<'a> {
    time_s: &'a [f64],
    delay_s: f64,
    clipping: Option<AdcSaturation<f64>>,
}

impl SensorChain for Samples<'_> {
    type Signal = Vec<f64>;

    fn delay(&mut self, torque_nm: Vec<f64>) -> Vec<f64> {
        shifted(self.time_s, &torque_nm, -self.delay_s)
    }

    fn clip(&mut self, mut torque_nm: Vec<f64>) -> Vec<f64> {
        if let Some(clipping) = &self.clipping {
            torque_nm.iter_mut().for_each(|torque_nm| *torque_nm = clipping.shown_nm(*torque_nm));
        }
        torque_nm
    }
}

#[cfg(test)]
mod tests {
    use super::super::simulate_friction;
    use super::*;

    const LUGRE: &str =
        "kind = \"lugre\"\n[parameters]\nsigma0_n_per_m = 1e6\na0 = 0.5\na1 = 0.7\nv0_m_s = 0.5\n";

    fn inputs() -> ContactInputs {
        let time_s: Vec<f64> = (0..2000).map(|i| f64::from(i) * 1e-3).collect();
        let sliding_speed_m_s: Vec<f64> = time_s.iter().map(|t| 0.1 + 0.05 * (7.0 * t).sin()).collect();
        ContactInputs {
            disc_angle_rad: time_s.clone(),
            normal_force_n: time_s.iter().map(|t| 80.0 + 20.0 * (11.0 * t).cos()).collect(),
            sliding_speed_m_s,
            time_s,
            initial_friction_n: 60.0,
        }
    }

    fn torque(extension: &str) -> Vec<f64> {
        let rig = RigFile::assumed_rig(&[]).unwrap();
        let model = ModelFile::parse("m", &format!("{LUGRE}{extension}")).unwrap();
        simulate_friction(&model, &rig, &inputs()).unwrap()
    }

    #[test]
    fn an_effect_of_no_size_changes_nothing() {
        let plain = torque("");
        let none = torque("[[extension]]\nid = \"viscous_film\"\ncoefficient_n_s_per_m = 0\n");
        for (a, b) in plain.iter().zip(&none) {
            // The effects' way and the plain one multiply with the radius at different places: rounding of 2000 samples.
            assert!((a - b).abs() < 1e-9, "{a} {b}");
        }
    }

    #[test]
    fn effects_change_the_torque_as_their_law_says() {
        let plain = torque("");
        let film = torque("[[extension]]\nid = \"viscous_film\"\ncoefficient_n_s_per_m = 40\n");
        let late = torque("[[extension]]\nid = \"friction_delay\"\ndelay_s = 0.005\n");
        let low = torque(
            "[[extension]]\nid = \"adc_saturation\"\nfriction_low_nm = -1.0\nfriction_high_nm = 3.5\n",
        );
        let knee = torque(
            "[[extension]]\nid = \"adc_saturation\"\nfriction_low_nm = -1.0\nfriction_high_nm = 3.5\nfriction_knee_nm = 0.1\n",
        );
        let inputs = inputs();
        for i in 100..plain.len() {
            // The film passes ring and amplifier, which delay 7 rad/s by 0.24 ms: 1e-4 of 0.12 N·m and less.
            let expected = plain[i] + 0.06 * 40.0 * inputs.sliding_speed_m_s[i];
            assert!((film[i] - expected).abs() < 1e-3, "{i}: {} {expected}", film[i]);
            assert!((late[i] - plain[i - 5]).abs() < 1e-9, "{i}");
            assert!((low[i] - plain[i].clamp(-1.0, 3.5)).abs() < 1e-9, "{i}");
            // A knee shows less, most at the end itself.
            let less = 0.1 * (-(plain[i] - 3.5).abs() / 0.1).exp().ln_1p();
            assert!((low[i] - knee[i] - less).abs() < 1e-9, "{i}: {} {}", plain[i], knee[i]);
        }
        assert!(plain.iter().any(|torque_nm| *torque_nm > 3.6), "the clipping would not matter");
    }
}
