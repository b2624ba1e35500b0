//! Linear parts, stepped exactly for an input that is held over the step.
//!
//! - [`Lag`]: τ ẏ = u − y.
//! - [`Mode`]: ÿ + 2ζω ẏ + ω² y = ω² u, 0 < ζ < 1.
//! - [`BridgeFilter`]: the sensor's mode, then a second-order Butterworth low-pass (ζ = 1/√2).
//! - [`Delay`]: a pure delay, linear between steps.

use std::collections::VecDeque;
use std::f64::consts::{FRAC_1_SQRT_2, TAU};

use crate::laws::measurement::Ring;
use crate::rig::Bridge;

/// First-order lag.
#[derive(Debug, Clone)]
pub struct Lag {
    keep: f64,
    value: f64,
}

impl Lag {
    /// A lag of this time constant, at rest at `start`.
    #[must_use]
    pub fn new(time_constant_s: f64, step_s: f64, start: f64) -> Self {
        Self { keep: (-step_s / time_constant_s).exp(), value: start }
    }

    /// One step.
    pub fn step(&mut self, input: f64) -> f64 {
        self.value = input + (self.value - input) * self.keep;
        self.value
    }

    /// Present output.
    #[must_use]
    pub fn value(&self) -> f64 {
        self.value
    }
}

/// Second-order mode of unit static gain.
#[derive(Debug, Clone)]
pub struct Mode {
    position: f64,
    rate: f64,
    pp: f64,
    pr: f64,
    rp: f64,
    rr: f64,
}

impl Mode {
    /// A mode at rest at `start`.
    #[must_use]
    pub fn new(frequency_hz: f64, damping_ratio: f64, step_s: f64, start: f64) -> Self {
        let omega = TAU * frequency_hz;
        let damped = omega * (1.0 - damping_ratio * damping_ratio).sqrt();
        let decay = (-damping_ratio * omega * step_s).exp();
        let (sine, cosine) = (damped * step_s).sin_cos();
        let skew = damping_ratio * omega / damped * sine;
        Self {
            position: start,
            rate: 0.0,
            pp: decay * (cosine + skew),
            pr: decay * sine / damped,
            rp: -decay * omega * omega / damped * sine,
            rr: decay * (cosine - skew),
        }
    }

    /// One step towards `input`.
    pub fn step(&mut self, input: f64) -> f64 {
        let away = self.position - input;
        let rate = self.rate;
        self.position = input + self.pp * away + self.pr * rate;
        self.rate = self.rp * away + self.rr * rate;
        self.position
    }
}

/// A bridge with its amplifier.
#[derive(Debug, Clone)]
pub struct BridgeFilter {
    stages: Option<(Mode, Mode)>,
    /// The other mode of a ring that is not round, and its share.
    second: Option<(Mode, f64)>,
}

impl BridgeFilter {
    /// A bridge at rest at `start`; `None` passes everything.
    #[must_use]
    pub fn new(bridge: Option<&Bridge>, step_s: f64, start: f64) -> Self {
        let stages = bridge.map(|b| {
            (
                Mode::new(b.mode_hz, b.damping_ratio, step_s, start),
                Mode::new(b.lowpass_hz, FRAC_1_SQRT_2, step_s, start),
            )
        });
        Self { stages, second: None }
    }

    /// The friction bridge of a ring whose mode is another than stated, or two.
    #[must_use]
    pub fn ringing(bridge: Option<&Bridge>, ring: &Ring, step_s: f64, start: f64) -> Self {
        let bridge =
            bridge.map(|b| Bridge { mode_hz: ring.mode_hz, damping_ratio: ring.damping_ratio, ..*b });
        let second_hz = ring.mode_hz * (1.0 + ring.split);
        let second = (ring.second_share > 0.0)
            .then(|| (Mode::new(second_hz, ring.damping_ratio, step_s, start), ring.second_share));
        Self { second, ..Self::new(bridge.as_ref(), step_s, start) }
    }

    /// One step.
    pub fn step(&mut self, input: f64) -> f64 {
        match &mut self.stages {
            Some((mode, lowpass)) => {
                let mut strained = mode.step(input);
                if let Some((second, share)) = &mut self.second {
                    strained += *share * (second.step(input) - strained);
                }
                lowpass.step(strained)
            }
            None => input,
        }
    }
}

/// Pure delay.
#[derive(Debug, Clone)]
pub struct Delay {
    past: VecDeque<f64>,
    share: f64,
}

impl Delay {
    /// A delay that has seen `start` for ever.
    #[must_use]
    pub fn new(delay_s: f64, step_s: f64, start: f64) -> Self {
        let steps = delay_s / step_s;
        let whole = steps.floor();
        Self { past: VecDeque::from(vec![start; whole as usize + 1]), share: steps - whole }
    }

    /// One step: puts in the present value, gives the delayed one.
    pub fn step(&mut self, input: f64) -> f64 {
        self.past.push_back(input);
        let older = self.past.pop_front().unwrap_or(input);
        let newer = self.past.front().copied().unwrap_or(input);
        // `newer` is `whole` steps old, `older` one step more.
        newer + (older - newer) * self.share
    }
}
