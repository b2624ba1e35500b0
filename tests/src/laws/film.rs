//! A film that drags beside the bristles, whatever the normal force: F = D v f(v/v_k).
//!
//! - Newtonian: f = 1 (I. Newton's law; a Couette film of constant thickness);
//! - Eyring: f = asinh(x)/x (H. Eyring, J. Chem. Phys. 4, 1936);
//! - Carreau: f = (1 + x²)^((n − 1)/2) (P. J. Carreau, Trans. Soc. Rheol. 16, 1972);
//! - reserved, Cross: f = 1/(1 + x^m) (M. M. Cross, J. Colloid Sci. 20, 1965).

use serde::Serialize;

use crate::laws::family::{LawFamily, size};
use crate::random::Stream;

#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(tag = "law", rename_all = "snake_case")]
enum Flow {
    Newtonian,
    Eyring { knee_m_s: f64 },
    Carreau { knee_m_s: f64, power: f64 },
    Cross { knee_m_s: f64, power: f64 },
}

/// The film.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Film {
    #[serde(flatten)]
    flow: Flow,
    /// Drag per speed at low speed.
    drag_n_s_per_m: f64,
}

impl Film {
    /// Draws one: at 0.6 m/s it drags 1.5 times its size of 45 N.
    pub fn draw(s: &mut Stream, family: LawFamily) -> Self {
        let size = size(s);
        let flow = match family.pick(s, &[0, 1, 2], 3) {
            0 => Flow::Newtonian,
            1 => Flow::Eyring { knee_m_s: s.uniform(0.5, 3.0) },
            2 => Flow::Carreau { knee_m_s: s.uniform(0.3, 1.5), power: s.uniform(0.5, 0.85) },
            _ => Flow::Cross { knee_m_s: s.uniform(0.6, 2.5), power: s.uniform(0.5, 0.8) },
        };
        let plain = Self { flow, drag_n_s_per_m: 1.0 };
        Self { flow, drag_n_s_per_m: 1.5 * size * 45.0 / plain.drag(0.6).0 }
    }

    fn drag(&self, v: f64) -> (f64, f64) {
        let d = self.drag_n_s_per_m;
        match self.flow {
            Flow::Newtonian => (d * v, d),
            Flow::Eyring { knee_m_s } => {
                let x = v / knee_m_s;
                (d * knee_m_s * x.asinh(), d / x.hypot(1.0))
            }
            Flow::Carreau { knee_m_s, power } => {
                let square = (v / knee_m_s).powi(2);
                let thin = (1.0 + square).powf(0.5 * (power - 1.0));
                (d * v * thin, d * thin * (1.0 + power * square) / (1.0 + square))
            }
            Flow::Cross { knee_m_s, power } => {
                let x = (v.abs() / knee_m_s).powf(power);
                (d * v / (1.0 + x), d * (1.0 + (1.0 - power) * x) / (1.0 + x).powi(2))
            }
        }
    }

    /// Force at a speed of the tips under a normal force, and its derivative by speed.
    #[must_use]
    pub fn at(&self, v: f64, normal: f64) -> (f64, f64) {
        // The film is wetted as soon as the elements touch: 2 N already cover it.
        let cover = 1.0 - (-normal / 0.7).exp();
        let (force, slope) = self.drag(v);
        (cover * force, cover * slope)
    }
}
