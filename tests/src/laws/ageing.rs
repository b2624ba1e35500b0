//! Breakaway grows with dwell. The age of the contact ψ grows with time and is renewed by sliding:
//! ψ̇ = 1 − |v| ψ/D (A. Ruina, J. Geophys. Res. 88, 1983); lifted elements have age 0.
//!
//! - settling: µ/µ0 = 1 + B (1 − (1 + ψ/τ)^−q), along the logarithm of ψ over two to three decades;
//! - logarithm: 1 + B ln(1 + ψ/τ) (J. H. Dieterich, J. Geophys. Res. 77, 1972);
//! - exponential: 1 + B (1 − e^(−(ψ/τ)^m)), m from 0.36 to 0.67 (S. Kato, N. Sato, T. Matsubayashi,
//!   J. Lubrication Technology 94, 1972);
//! - reserved, power: 1 + B ((1 + ψ/τ)^p − 1) (E. Rabinowicz, *Friction and Wear of Materials*, 1965;
//!   Y. Bréchet, Y. Estrin, Scripta Metall. Mater. 30, 1994), p from 0.1 to 0.2.

use serde::Serialize;

use crate::laws::family::{LawFamily, size};
use crate::laws::slide::Slide;
use crate::random::Stream;

#[derive(Debug, Clone, Copy, Serialize)]
#[serde(tag = "law", rename_all = "snake_case")]
enum Age {
    Settling { gain: f64, onset_s: f64, power: f64 },
    Logarithm { gain: f64, onset_s: f64 },
    Exponential { gain: f64, onset_s: f64, power: f64 },
    Power { gain: f64, onset_s: f64, power: f64 },
}

/// Ageing with the contact's age.
#[derive(Debug, Clone, Serialize)]
pub struct StaticAgeing {
    #[serde(flatten)]
    law: Age,
    renewal_m: f64,
    #[serde(skip)]
    age_s: f64,
}

impl StaticAgeing {
    /// Draws one. The size is that of the growth within a second, six times the usual one: it shows only at
    /// breakaways, and 20 to 60 % is what is reported for rubber (A. D. Roberts, A. G. Thomas, Wear 33, 1975).
    pub fn draw(s: &mut Stream, family: LawFamily) -> Self {
        let growth = (6.0 * size(s)).clamp(0.2, 0.75);
        let onset_s = s.log_uniform(0.02, 0.12);
        let age = 1.0 / onset_s;
        let law = match family.pick(s, &[0, 1, 2], 3) {
            0 => {
                let power: f64 = s.uniform(0.2, 0.3);
                Age::Settling { gain: growth / (1.0 - (1.0 + age).powf(-power)), onset_s, power }
            }
            1 => Age::Logarithm { gain: growth / (1.0 + age).ln(), onset_s },
            2 => {
                let (onset_s, power) = (s.log_uniform(0.2, 1.0), s.uniform(0.36, 0.67));
                let grown = 1.0 - (-(1.0 / onset_s).powf(power)).exp();
                Age::Exponential { gain: growth / grown, onset_s, power }
            }
            _ => {
                let power = s.uniform(0.1, 0.2);
                Age::Power { gain: growth / ((1.0 + age).powf(power) - 1.0), onset_s, power }
            }
        };
        Self { law, renewal_m: s.log_uniform(1.5e-3, 4e-3), age_s: 0.0 }
    }

    /// Factor on µ; ages by a step.
    pub fn factor(&mut self, slide: &Slide) -> f64 {
        if slide.normal_n > 0.5 {
            let renewal = slide.step_s * slide.tip_speed_m_s.abs() / self.renewal_m;
            self.age_s = (self.age_s + slide.step_s) / (1.0 + renewal);
        } else {
            self.age_s = 0.0;
        }
        1.0 + match self.law {
            Age::Settling { gain, onset_s, power } => {
                gain * (1.0 - (1.0 + self.age_s / onset_s).powf(-power))
            }
            Age::Logarithm { gain, onset_s } => gain * (self.age_s / onset_s).ln_1p(),
            Age::Exponential { gain, onset_s, power } => {
                gain * (1.0 - (-(self.age_s / onset_s).powf(power)).exp())
            }
            Age::Power { gain, onset_s, power } => gain * ((1.0 + self.age_s / onset_s).powf(power) - 1.0),
        }
    }
}
