//! A strain gauge bridge: elastic mode of the part that carries the gauges, then the amplifier's low-pass.
//!
//! ÿ + 2ζω ẏ + ω² y = ω² u (the torque ring: assumed 600 Hz, ζ = 0.02);
//! ä + √2 Ω ȧ + Ω² a = Ω² y (amplifier: Butterworth of second order, assumed 1 kHz).
//!
//! The input is taken as linear over a step; see [`super::linear`]. Either part may be missing; without both it is an ideal
//! sensor. Where both are there they are one system of four states, stepped exactly at once: mode after low-pass in steps of
//! 100 µs would take what swings at 600 Hz as straight between them. Zero and gain, the amplifier's other half, do not
//! change with time here and commute with its low-pass: they are put in where the plant is sampled, [`super::analogue`].
//! Left out: crosstalk, drift, the reaction of the ring's motion on the sliding speed.

use model_core::sensor::SensorChain;

use super::linear::Sloped;
use super::parameters::BridgeParameters;

/// A bridge, prepared for a step size.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Bridge {
    Ideal,
    Mode(Sloped<2>),
    LowPass(Sloped<2>),
    Both(Sloped<4>),
}

/// Deflection of the part (in units of the input), its rate, output of the amplifier, its rate; those of a part that is
/// missing stay zero.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct BridgeState {
    mode: [f64; 2],
    low_pass: [f64; 2],
    input: f64,
    shown: f64,
}

impl BridgeState {
    /// What the bridge shows now.
    #[inline]
    pub(crate) fn shown(&self) -> f64 {
        self.shown
    }
}

/// Second order of unit gain: rows of the rate's equation.
fn second_order(frequency_hz: f64, damping_ratio: f64) -> (f64, f64) {
    let w = std::f64::consts::TAU * frequency_hz;
    (w * w, 2.0 * damping_ratio * w)
}

/// One of them alone.
fn alone((k, d): (f64, f64), step_s: f64) -> Sloped<2> {
    Sloped::new(&[[0.0, 1.0], [-k, -d]], &[0.0, k], step_s)
}

/// Damping ratio of a Butterworth low-pass.
const BUTTERWORTH: f64 = std::f64::consts::FRAC_1_SQRT_2;

impl Bridge {
    pub(crate) fn new(p: &BridgeParameters, step_s: f64) -> Self {
        let mode = p.mode.map(|m| second_order(m.mode_hz, m.damping_ratio));
        let lowpass = p.lowpass_hz.map(|hz| second_order(hz, BUTTERWORTH));
        match (mode, lowpass) {
            (None, None) => Self::Ideal,
            (Some(mode), None) => Self::Mode(alone(mode, step_s)),
            (None, Some(lowpass)) => Self::LowPass(alone(lowpass, step_s)),
            (Some((k, d)), Some((c, e))) => {
                let a = [[0.0, 1.0, 0.0, 0.0], [-k, -d, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0], [c, 0.0, -c, -e]];
                Self::Both(Sloped::new(&a, &[0.0, k, 0.0, 0.0], step_s))
            }
        }
    }

    #[inline]
    pub(crate) fn step(&self, state: &mut BridgeState, input: f64) {
        state.shown = Step { bridge: self, state }.show(input);
        state.input = input;
    }
}

/// One step of a bridge.
struct Step<'a> {
    bridge: &'a Bridge,
    state: &'a mut BridgeState,
}

impl SensorChain for Step<'_> {
    type Signal = f64;

    #[inline]
    fn mode(&mut self, input: f64) -> f64 {
        let BridgeState { mode, low_pass, input: before, .. } = &mut *self.state;
        match self.bridge {
            Bridge::Ideal | Bridge::LowPass(_) => return input,
            Bridge::Mode(system) => *mode = system.step(mode, *before, input),
            Bridge::Both(system) => {
                let [y, dy, a, da] =
                    system.step(&[mode[0], mode[1], low_pass[0], low_pass[1]], *before, input);
                (*mode, *low_pass) = ([y, dy], [a, da]);
            }
        }
        mode[0]
    }

    #[inline]
    fn low_pass(&mut self, input: f64) -> f64 {
        let BridgeState { low_pass, input: before, .. } = &mut *self.state;
        match self.bridge {
            Bridge::Ideal | Bridge::Mode(_) => return input,
            Bridge::LowPass(system) => *low_pass = system.step(low_pass, *before, input),
            // It has moved with the mode.
            Bridge::Both(_) => {}
        }
        low_pass[0]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_rings_with_the_frequency_and_decrement_of_the_mode_and_settles_at_the_input() {
        let p = BridgeParameters::default();
        let step = 1e-4;
        let bridge = Bridge::new(&p, step);
        let mut state = BridgeState::default();
        let mut y = Vec::new();
        for _ in 0..20_000 {
            bridge.step(&mut state, 3.0);
            y.push(state.shown() - 3.0);
        }
        assert!(y.last().unwrap().abs() < 1e-12);
        // Rising crossings of zero between 5 and 35 ms, interpolated: their spacing is the damped period.
        let rising: Vec<f64> = (50..350)
            .filter(|&k| y[k] < 0.0 && y[k + 1] >= 0.0)
            .map(|k| k as f64 - y[k] / (y[k + 1] - y[k]))
            .collect();
        let period = (rising[rising.len() - 1] - rising[0]) / (rising.len() - 1) as f64 * step;
        let damped = 1.0 / (600.0 * (1.0f64 - 0.02 * 0.02).sqrt());
        // Interpolating a 600 Hz sine at 10 kHz leaves about 1e-3 of a period.
        assert!((period / damped - 1.0).abs() < 1e-3, "{period} against {damped}");
        let size = |from: usize| y[from..from + 50].iter().fold(0.0f64, |m, v| m.max(v.abs()));
        let decay = (size(100) / size(300)).ln();
        let expected = 0.02 * std::f64::consts::TAU * 600.0 * 0.02;
        assert!((decay / expected - 1.0).abs() < 0.03, "{decay} against {expected}");
    }
}
