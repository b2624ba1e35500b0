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

/// What presses the elements: lever and springs of M1, with their mode.
pub struct Mechanism {
    gain_n_per_nm: f64,
    preload_n: f64,
    mode: SecondOrder<f64>,
    state: SecondOrderState<f64>,
}

impl Mechanism {
    /// That of a rig, settled under a torque of M1, N m.
    pub fn settled(rig: &RigFile, m1_torque_nm: f64) -> Self {
        let mut settled = Self {
            gain_n_per_nm: rig.lever_gain_n_per_nm,
            preload_n: rig.preload_n,
            mode: SecondOrder::new(rig.pressure.mode_hz, rig.pressure.damping_ratio, SOME_STEP_S),
            state: SecondOrderState::default(),
        };
        settled.state = SecondOrderState::holding(settled.pressed_n(m1_torque_nm));
        settled
    }

    /// What a steady torque presses with, N; less than nothing lifts the elements.
    fn pressed_n(&self, m1_torque_nm: f64) -> f64 {
        self.gain_n_per_nm * m1_torque_nm - self.preload_n
    }

    /// Normal force, N.
    pub fn force_n(&self) -> f64 {
        self.state.value.max(0.0)
    }

    /// Normal force at the end of a step under this torque, N.
    pub fn step(&mut self, step_s: f64, m1_torque_nm: f64) -> f64 {
        self.mode.set_step_s(step_s);
        let pressed_n = self.pressed_n(m1_torque_nm);
        self.mode.step(&mut self.state, pressed_n);
        self.force_n()
    }
}

/// Predicts the normal force of a log from its `m1_torque_nm`.
pub fn predict_normal_force(
    rig: &RigFile,
    time_s: &[f64],
    m1_torque_nm: &[f64],
    normal_force_n: &[f64],
) -> Comparison {
    let mut mechanism = Mechanism::settled(rig, m1_torque_nm.first().copied().unwrap_or(0.0));
    let mut bridge = BridgeModel::new(&rig.normal_bridge, mechanism.force_n());
    let mut predicted = vec![mechanism.force_n()];
    for (times, torque_nm) in time_s.windows(2).zip(m1_torque_nm.iter().skip(1)) {
        let step_s = times[1] - times[0];
        predicted.push(bridge.step(step_s, mechanism.step(step_s, *torque_nm)));
    }
    predicted.truncate(time_s.len());
    Comparison { measured: normal_force_n.to_vec(), predicted }
}
