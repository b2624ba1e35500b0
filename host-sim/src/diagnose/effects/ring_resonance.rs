//! The torque ring's mode is lower or less damped than the rig file says
//! ([`model_core::extension::ring_resonance`]).
//!
//! Signature: after every jump of friction the channel rings at one frequency, whatever the speed and load.
//! Rivals: the press rings in the normal force too; a torsional shaft rings in the speed.

use model_core::extension::Extension;

use super::{ContactEffect, ContactModel, Parameter, Scales, Start};

pub(super) struct RingResonance;

impl ContactEffect for RingResonance {
    fn id(&self) -> &'static str {
        "ring_resonance"
    }

    fn parameters(&self, _variant: usize, scales: &Scales) -> Vec<Parameter> {
        let highest = scales.ring_hz.unwrap_or(600.0).min(0.45 / scales.step_s);
        vec![
            Parameter::logarithmic("mode_hz", 0.3 * highest, 5.0_f64.min(0.5 * highest), highest),
            Parameter::logarithmic("damping_ratio", 0.03, 1e-3, 0.7),
        ]
    }

    fn starts(&self, variant: usize, scales: &Scales) -> Vec<Start> {
        let highest = self.parameters(variant, scales)[0].high;
        let mut starts = Vec::new();
        for mode_hz in [30.0, 45.0, 65.0, 90.0, 120.0, 160.0, 210.0, 280.0, 370.0, 480.0] {
            if mode_hz < 0.98 * highest {
                starts.push(Start::whole(&[mode_hz, 0.04]));
            }
        }
        for mode_hz in scales.ring_peaks_hz.iter().filter(|hz| **hz < 0.98 * highest) {
            starts.extend([0.006, 0.03].map(|damping_ratio| Start::whole(&[*mode_hz, damping_ratio])));
        }
        starts
    }

    fn apply(
        &self,
        _variant: usize,
        values: &[f64],
        _origin: f64,
        _scales: &Scales,
        model: &mut ContactModel,
    ) {
        model.set(Extension::RingResonance, values.to_vec());
    }
}
