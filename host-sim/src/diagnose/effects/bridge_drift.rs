//! Zero or gain of a bridge drifts with time ([`model_core::extension::bridge_drift`]).
//!
//! Signature: a residual that moves with time, whether the disc turns or not, and that the other witness of
//! the same quantity (M2's torque for friction, M1's for normal force) does not share. Rivals: wear and
//! thermal fade are felt by M2.
//! The first form is drift of the friction bridge, the second of the normal bridge.

use model_core::extension::Extension;

use super::{ContactEffect, ContactModel, Parameter, Scales, Start};

pub(super) struct BridgeDrift;

impl ContactEffect for BridgeDrift {
    fn id(&self) -> &'static str {
        "bridge_drift"
    }

    fn variants(&self) -> usize {
        2
    }

    fn parameters(&self, variant: usize, scales: &Scales) -> Vec<Parameter> {
        // Changes over the record, in the channel's unit and relative.
        let (name, most) = match variant {
            0 => ("friction_zero_nm", 3.0 * scales.torque_nm),
            _ => ("normal_zero_n", 2.0 * scales.load_n),
        };
        let gain = if variant == 0 { "friction_gain" } else { "normal_gain" };
        vec![
            Parameter::linear(name, 0.0, -most, most),
            Parameter::linear(gain, 0.0, -0.9, 2.0),
            Parameter::linear("settling", 0.0, -4.0, 40.0),
        ]
    }

    fn starts(&self, _variant: usize, _scales: &Scales) -> Vec<Start> {
        [0.0, 3.0, 12.0].map(|settling| Start::shape(&[0.0, 0.0, settling], &[0, 1])).to_vec()
    }

    fn apply(&self, variant: usize, values: &[f64], _origin: f64, scales: &Scales, model: &mut ContactModel) {
        let (duration_s, settling) = (scales.duration_s, values[2]);
        // h at the end of the record.
        let reached_s =
            if settling.abs() < 1e-6 { duration_s } else { -(-settling).exp_m1() / settling * duration_s };
        let (zero, gain) = (values[0] / reached_s, values[1] / reached_s);
        let rates = if variant == 0 { [zero, gain, 0.0, 0.0] } else { [0.0, 0.0, zero, gain] };
        let mut all = rates.to_vec();
        all.push(settling / duration_s);
        model.set(Extension::BridgeDrift, all);
    }
}
