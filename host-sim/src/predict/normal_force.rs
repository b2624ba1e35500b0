//! Normal force from the torque of M1.
//!
//! ẍ + 2ζω ẋ + ω² x = ω² (G τ1 − F0),  F_N = max(0, x), then the normal bridge; G is the lever's gain,
//! F0 the foil springs' preload. The normal-load actuator is taken to be settled at the first sample.
//! Left out: friction of the lever, hardening of the springs, ripple of M1.

use model_core::sensor::{SecondOrder, SecondOrderState};

use super::Comparison;
use super::bridge::BridgeModel;
use crate::files::model_file::SOME_STEP_S;
use crate::files::rig_file::RigFile;

/// Predicts the normal force of a log from its `m1_torque_nm`.
pub fn predict_normal_force(
    rig: &RigFile,
    time_s: &[f64],
    m1_torque_nm: &[f64],
    normal_force_n: &[f64],
) -> Comparison {
    let pressed = |torque_nm: f64| rig.lever_gain_n_per_nm * torque_nm - rig.preload_n;
    let start_n = m1_torque_nm.first().map_or(0.0, |torque_nm| pressed(*torque_nm));
    let mut actuator = SecondOrder::new(rig.pressure.mode_hz, rig.pressure.damping_ratio, SOME_STEP_S);
    let mut state = SecondOrderState::holding(start_n);
    let mut bridge = BridgeModel::new(&rig.normal_bridge, start_n.max(0.0));
    let mut predicted = vec![start_n.max(0.0)];
    for (times, torque_nm) in time_s.windows(2).zip(m1_torque_nm.iter().skip(1)) {
        let step_s = times[1] - times[0];
        actuator.set_step_s(step_s);
        let force_n = actuator.step(&mut state, pressed(*torque_nm)).max(0.0);
        predicted.push(bridge.step(step_s, force_n));
    }
    predicted.truncate(time_s.len());
    Comparison { measured: normal_force_n.to_vec(), predicted }
}
