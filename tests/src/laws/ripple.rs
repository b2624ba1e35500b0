//! Torque that ripples with a motor's angle θ: cogging (`m2_ripple`, and `m1_ripple` over M1's small travel).
//!
//! n is the order, slots or poles in a turn; all have unit amplitude here.
//! - few: one or two orders, each a sine pressed towards a triangle or a square (D. C. Hanselman, *Brushless
//!   Permanent Magnet Motor Design*, 2003);
//! - harmonics: n, 2n, 3n with amplitudes that fall (Z. Q. Zhu, D. Howe, IEEE Trans. Energy Convers. 15, 2000);
//! - skewed: sin(x + b sin x), steeper on one side (L. Dosiek, P. Pillay, IEEE Trans. Ind. Appl. 43, 2007);
//! - reserved, trapezoid: flat tops and straight flanks, asin(r sin x)-like, clamp(sin(x)/w, −1, 1) (slots
//!   with parallel teeth: J. F. Gieras, IEEE Trans. Ind. Appl. 40, 2004).

use serde::Serialize;

use crate::laws::family::LawFamily;
use crate::random::Stream;

#[derive(Debug, Clone, Copy, Serialize)]
#[serde(tag = "law", rename_all = "snake_case")]
enum Wave {
    Few { press: f64 },
    Harmonics,
    Skewed { bend: f64 },
    Trapezoid { flank: f64 },
}

/// A ripple.
#[derive(Debug, Clone, Serialize)]
pub struct Ripple {
    #[serde(flatten)]
    wave: Wave,
    /// (order per unit of travel, amplitude, phase)
    waves: Vec<(f64, f64, f64)>,
}

impl Ripple {
    /// Draws one of this RMS about; `orders` per unit of travel are those to choose from.
    pub fn draw(s: &mut Stream, family: LawFamily, orders: &[f64], rms: f64) -> Self {
        let wave = match family.pick(s, &[0, 1, 2], 3) {
            0 => Wave::Few { press: s.uniform(-0.3, 0.5) },
            1 => Wave::Harmonics,
            2 => Wave::Skewed { bend: s.uniform(0.2, 0.6) },
            _ => Wave::Trapezoid { flank: s.uniform(0.25, 0.6) },
        };
        let first = s.pick(orders);
        let peak = rms * 2.0_f64.sqrt();
        let waves = match wave {
            Wave::Few { .. } if orders.len() > 1 && s.chance(0.5) => {
                let others: Vec<f64> = orders.iter().copied().filter(|order| *order != first).collect();
                vec![(first, 0.8 * peak, s.phase()), (s.pick(&others), 0.6 * peak, s.phase())]
            }
            Wave::Harmonics => {
                let fall = s.uniform(0.25, 0.5);
                (0..3).map(|k| (first * f64::from(k + 1), 0.93 * peak * fall.powi(k), s.phase())).collect()
            }
            _ => vec![(first, peak, s.phase())],
        };
        Self { wave, waves }
    }

    /// The same made smaller, where it is steeper than this (torque per angle) anywhere.
    #[must_use]
    pub fn no_steeper_than(mut self, limit: f64) -> Self {
        let lowest = self.waves.iter().map(|wave| wave.0).fold(f64::INFINITY, f64::min);
        // Over several periods: two orders add up where their phases meet.
        let step = std::f64::consts::TAU / lowest / 500.0;
        let slope = |i: i32| (self.at(f64::from(i + 1) * step) - self.at(f64::from(i) * step)).abs() / step;
        let steepest = (0..4000).map(slope).fold(0.0, f64::max);
        let factor = (limit / steepest).min(1.0);
        for wave in &mut self.waves {
            wave.1 *= factor;
        }
        self
    }

    /// Torque at an angle of the motor.
    #[must_use]
    pub fn at(&self, angle: f64) -> f64 {
        let shape = |turn: f64| match self.wave {
            Wave::Few { press } => {
                let (sine, cosine) = turn.sin_cos();
                sine / (1.0 + press * cosine * cosine).sqrt()
            }
            Wave::Harmonics => turn.sin(),
            Wave::Skewed { bend } => (turn + bend * turn.sin()).sin(),
            Wave::Trapezoid { flank } => (turn.sin() / flank).clamp(-1.0, 1.0),
        };
        self.waves.iter().map(|(order, amplitude, phase)| amplitude * shape(order * angle + phase)).sum()
    }
}
