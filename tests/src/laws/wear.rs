//! µ changes with the distance slid, s, and does not come back.
//!
//! - power: 1 + A (1 − (1 + s/s0)^−p), a running-in that slows down (P. J. Blau, *Friction and Wear
//!   Transitions of Materials*, 1989);
//! - running-in: 1 + A (1 − e^(−s/s0)) (P. J. Blau, Tribology Int. 38, 2005);
//! - linear: 1 + A s/s0, as far as 1 ± 0.5 (wear in proportion to distance: J. F. Archard, J. Appl. Phys.
//!   24, 1953);
//! - reserved, incubation: 1 + A (S(s) − S(0)), S(s) = 1/(1 + e^(−(s − s1)/w)): nothing at first, then a
//!   transition (the S-shaped ones of Blau's classes).

use serde::Serialize;

use crate::laws::family::{LawFamily, size};
use crate::laws::slide::Slide;
use crate::random::Stream;

#[derive(Debug, Clone, Copy, Serialize)]
#[serde(tag = "law", rename_all = "snake_case")]
enum Wear {
    Power { change: f64, scale_m: f64, power: f64 },
    RunningIn { change: f64, scale_m: f64 },
    Linear { per_m: f64 },
    Incubation { change: f64, middle_m: f64, width_m: f64 },
}

/// The drift with the distance slid.
#[derive(Debug, Clone, Serialize)]
pub struct WearDrift {
    #[serde(flatten)]
    law: Wear,
    #[serde(skip)]
    slid_m: f64,
}

impl WearDrift {
    /// Draws one; `distance_m` is what a log slides.
    pub fn draw(s: &mut Stream, family: LawFamily, distance_m: f64) -> Self {
        let size = s.sign() * size(s);
        let scale_m = distance_m * s.uniform(0.2, 0.6);
        let law = match family.pick(s, &[0, 1, 2], 3) {
            0 => Wear::Power { change: 2.0 * size, scale_m, power: s.uniform(0.6, 1.2) },
            1 => Wear::RunningIn { change: 1.35 * size, scale_m },
            2 => Wear::Linear { per_m: 1.7 * size / distance_m },
            _ => Wear::Incubation {
                change: 1.5 * size,
                middle_m: distance_m * s.uniform(0.3, 0.6),
                width_m: distance_m * s.uniform(0.05, 0.15),
            },
        };
        Self { law, slid_m: 0.0 }
    }

    /// Factor on µ; slides on by a step.
    pub fn factor(&mut self, slide: &Slide) -> f64 {
        if slide.normal_n > 0.5 {
            self.slid_m += slide.step_s * slide.tip_speed_m_s.abs();
        }
        match self.law {
            Wear::Power { change, scale_m, power } => {
                1.0 + change * (1.0 - (1.0 + self.slid_m / scale_m).powf(-power))
            }
            Wear::RunningIn { change, scale_m } => 1.0 + change * (1.0 - (-self.slid_m / scale_m).exp()),
            Wear::Linear { per_m } => 1.0 + (per_m * self.slid_m).clamp(-0.5, 0.5),
            Wear::Incubation { change, middle_m, width_m } => {
                let done = |slid: f64| 1.0 / (1.0 + ((middle_m - slid) / width_m).exp());
                1.0 + change * (done(self.slid_m) - done(0.0))
            }
        }
    }
}
