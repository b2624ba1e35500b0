//! A strain-gauge bridge: the mode of ring or frame, then the amplifier's low-pass.
//!
//! Both are second-order low-passes with unit gain; the amplifier is a Butterworth, ζ = 1/√2. What the
//! rig file leaves out is ideal. Left out: quantisation, noise, zero and gain errors.

use std::f64::consts::FRAC_1_SQRT_2;

use super::second_order::SecondOrder;
use crate::files::rig_file::Bridge;

/// A bridge with its state.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BridgeModel {
    mode: Option<SecondOrder>,
    lowpass: Option<SecondOrder>,
}

impl BridgeModel {
    /// At rest at the value `start`.
    pub fn new(bridge: &Bridge, start: f64) -> Self {
        Self {
            mode: bridge.mode.map(|mode| SecondOrder::new(mode.mode_hz, mode.damping_ratio, start)),
            lowpass: bridge.lowpass_hz.map(|hz| SecondOrder::new(hz, FRAC_1_SQRT_2, start)),
        }
    }

    /// Delay of slow signals.
    pub fn delay_s(bridge: &Bridge) -> f64 {
        let mode = bridge.mode.map_or(0.0, |mode| SecondOrder::delay_s(mode.mode_hz, mode.damping_ratio));
        mode + bridge.lowpass_hz.map_or(0.0, |hz| SecondOrder::delay_s(hz, FRAC_1_SQRT_2))
    }

    /// Moves on by `step_s`, over which the true value went in a straight line to `value`; returns
    /// what is measured.
    #[inline]
    pub fn step(&mut self, step_s: f64, value: f64) -> f64 {
        let shaken = self.mode.as_mut().map_or(value, |mode| mode.step(step_s, value));
        self.lowpass.as_mut().map_or(shaken, |lowpass| lowpass.step(step_s, shaken))
    }
}
