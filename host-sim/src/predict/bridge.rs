//! A strain-gauge bridge: the mode of ring or frame, then the amplifier's low-pass.
//!
//! Both are second-order systems of unit gain; the amplifier is a Butterworth. What the rig file leaves out is ideal.
//! Left out: quantisation, noise, zero and gain errors.

use model_core::sensor::{SecondOrder, SecondOrderState, SensorChain};

use crate::files::model_file::SOME_STEP_S;
use crate::files::rig_file::Bridge;

/// A bridge with its state.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BridgeModel {
    mode: Option<Stage>,
    low_pass: Option<Stage>,
}

/// A stage of the bridge with its state.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Stage {
    system: SecondOrder<f64>,
    state: SecondOrderState<f64>,
}

fn mode_of(bridge: &Bridge) -> Option<SecondOrder<f64>> {
    bridge.mode.map(|mode| SecondOrder::new(mode.mode_hz, mode.damping_ratio, SOME_STEP_S))
}

fn low_pass_of(bridge: &Bridge) -> Option<SecondOrder<f64>> {
    bridge.lowpass_hz.map(|hz| SecondOrder::butterworth(hz, SOME_STEP_S))
}

impl BridgeModel {
    /// At rest at the value `start`.
    pub fn new(bridge: &Bridge, start: f64) -> Self {
        let at_rest = |system| Stage { system, state: SecondOrderState::holding(start) };
        Self { mode: mode_of(bridge).map(at_rest), low_pass: low_pass_of(bridge).map(at_rest) }
    }

    /// The amplifier's low-pass alone.
    pub(super) fn low_pass_alone(bridge: &Bridge, start: f64) -> Self {
        Self { mode: None, ..Self::new(bridge, start) }
    }

    /// Delay of slow signals.
    pub fn delay_s(bridge: &Bridge) -> f64 {
        let stages = [mode_of(bridge), low_pass_of(bridge)];
        stages.iter().flatten().map(SecondOrder::delay_s).sum()
    }

    /// Moves on by `step_s`, over which the true value went in a straight line to `value`; returns
    /// what is measured.
    #[inline]
    pub fn step(&mut self, step_s: f64, value: f64) -> f64 {
        for stage in [&mut self.mode, &mut self.low_pass].into_iter().flatten() {
            stage.system.set_step_s(step_s);
        }
        self.show(value)
    }
}

impl SensorChain for BridgeModel {
    type Signal = f64;

    #[inline]
    fn mode(&mut self, value: f64) -> f64 {
        self.mode.as_mut().map_or(value, |stage| stage.system.step(&mut stage.state, value))
    }

    #[inline]
    fn low_pass(&mut self, value: f64) -> f64 {
        self.low_pass.as_mut().map_or(value, |stage| stage.system.step(&mut stage.state, value))
    }
}
