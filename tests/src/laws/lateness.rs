//! Laws of a channel or a motor that comes late (`friction_delay`, `drive_delay`).
//!
//! - pure: y(t) = x(t − T) (transport, buffers; J. E. Normey-Rico, E. F. Camacho, *Control of Dead-time
//!   Processes*, 2007);
//! - average: a part of T, 0.1 to 0.4 of it, is a mean over twice that time, a digital filter of linear phase (A.
//!   V. Oppenheim, R. W. Schafer, *Discrete-Time Signal Processing*, 1989), the rest is pure;
//! - held: taken every P and passed on after D, T = D + P/2 (bus cycle of a fieldbus drive or converter; K. J.
//!   Åström, B. Wittenmark, *Computer-Controlled Systems*, 1984);
//! - reserved, Bessel: a part, 0.2 to 0.5 of T, is a fourth-order filter of maximally flat delay (W. E. Thomson,
//!   Proc. IEE 96, 1949), the rest is pure.

use std::collections::VecDeque;

use serde::Serialize;

use crate::filters::{Delay, Mode};
use crate::laws::family::LawFamily;
use crate::random::Stream;

/// Roots of the fourth-order Bessel polynomial normalised to unit delay: (frequency, damping ratio) of the
/// two pairs, and their product of squared frequencies is 105.
const BESSEL: [(f64, f64); 2] = [(3.023_265, 0.958_044), (3.389_366, 0.620_703)];

#[derive(Debug, Clone, Copy, Serialize)]
#[serde(tag = "law", rename_all = "snake_case")]
enum Way {
    Pure,
    Average { share: f64 },
    Held { period_s: f64 },
    Bessel { share: f64 },
}

/// A lateness.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct Lateness {
    #[serde(flatten)]
    way: Way,
    /// Mean delay.
    pub delay_s: f64,
}

impl Lateness {
    /// Draws one with a mean delay between these.
    pub fn draw(s: &mut Stream, family: LawFamily, low_s: f64, high_s: f64) -> Self {
        let delay_s = s.log_uniform(low_s, high_s);
        let way = match family.pick(s, &[0, 1, 2], 3) {
            0 => Way::Pure,
            1 => Way::Average { share: s.uniform(0.1, 0.4) },
            2 => Way::Held { period_s: s.uniform(0.3, 0.9) * delay_s },
            _ => Way::Bessel { share: s.uniform(0.2, 0.5) },
        };
        Self { way, delay_s }
    }

    /// The same as a running filter that has seen `start` for ever.
    #[must_use]
    pub fn running(&self, step_s: f64, start: f64) -> Late {
        let rest = |share: f64| Delay::new((1.0 - share) * self.delay_s, step_s, start);
        match self.way {
            Way::Pure => Late::Pure(Delay::new(self.delay_s, step_s, start)),
            Way::Average { share } => {
                let count = ((2.0 * share * self.delay_s / step_s).round() as usize).max(1);
                let past = VecDeque::from(vec![start; count]);
                Late::Average { past, sum: start * count as f64, after: rest(share) }
            }
            Way::Held { period_s } => {
                let every = ((period_s / step_s).round() as usize).max(1);
                let rest = self.delay_s - 0.5 * every as f64 * step_s;
                Late::Held { every, phase: 0, held: start, after: Delay::new(rest.max(0.0), step_s, start) }
            }
            Way::Bessel { share } => {
                let mode = |(w, ratio): (f64, f64)| {
                    let hz = w / (share * self.delay_s) / std::f64::consts::TAU;
                    Mode::new(hz, ratio, step_s, start)
                };
                Late::Bessel(mode(BESSEL[0]), mode(BESSEL[1]), rest(share))
            }
        }
    }
}

/// A running lateness.
#[derive(Debug, Clone)]
pub enum Late {
    /// Pure delay.
    Pure(Delay),
    /// Running mean.
    Average {
        /// What it averages.
        past: VecDeque<f64>,
        /// Their sum.
        sum: f64,
        /// What follows.
        after: Delay,
    },
    /// Sample and hold.
    Held {
        /// Steps between samples.
        every: usize,
        /// Steps since the last.
        phase: usize,
        /// What is held.
        held: f64,
        /// What follows.
        after: Delay,
    },
    /// Two second-order sections, and what follows.
    Bessel(Mode, Mode, Delay),
}

impl Late {
    /// One step: puts in the present value, gives the late one.
    pub fn step(&mut self, input: f64) -> f64 {
        match self {
            Self::Pure(delay) => delay.step(input),
            Self::Average { past, sum, after } => {
                let count = past.len() as f64;
                past.push_back(input);
                *sum += input - past.pop_front().unwrap_or(input);
                after.step(*sum / count)
            }
            Self::Held { every, phase, held, after } => {
                if *phase == 0 {
                    *held = input;
                }
                *phase = (*phase + 1) % *every;
                after.step(*held)
            }
            Self::Bessel(first, second, after) => {
                let between = first.step(input);
                after.step(second.step(between))
            }
        }
    }
}
