//! µ varies round the disc; φ is the angle of the disc itself.
//!
//! - orders: µ/µ0 = exp(Σ A_k sin(n_k φ + ψ_k)), two or three orders (run-out of a brake disc's friction:
//!   H. Jacobsson, Proc. Inst. Mech. Eng. D 217, 2003);
//! - waviness: orders 1 to 8 with amplitudes that fall as n^−w (spectra of surfaces fall with wave
//!   number: J. B. P. Williamson, Proc. Inst. Mech. Eng. 182, 1967; ISO 8608);
//! - patch: one polished or rough place, 1 + A (e^(κ (cos(φ − φ0) − 1)) − mean) (as left by a long stand);
//! - reserved, sectors: two stretches of different make with joints of some degrees,
//!   1 + A tanh((cos(φ − φ0) − c)/w) (split-µ surface).

use serde::Serialize;

use crate::laws::family::{LawFamily, size};
use crate::laws::slide::Slide;
use crate::random::Stream;

/// The variation.
#[derive(Debug, Clone, Serialize)]
#[serde(tag = "law", rename_all = "snake_case")]
pub enum DiscAngle {
    /// A few orders: (order per revolution, amplitude, phase).
    Orders {
        /// Waves.
        waves: Vec<(f64, f64, f64)>,
    },
    /// Many orders that fall off: (order per revolution, amplitude, phase).
    Waviness {
        /// Waves.
        waves: Vec<(f64, f64, f64)>,
    },
    /// One place that differs.
    Patch {
        /// Change of µ at its middle.
        depth: f64,
        /// Concentration κ.
        narrowness: f64,
        /// Its angle.
        at_rad: f64,
    },
    /// Two stretches.
    Sectors {
        /// Half the difference.
        depth: f64,
        /// Cosine at the joints.
        joint: f64,
        /// Width of the joints.
        width: f64,
        /// Angle of the middle of the one.
        at_rad: f64,
    },
}

impl DiscAngle {
    /// Draws one.
    pub fn draw(s: &mut Stream, family: LawFamily) -> Self {
        let size = size(s);
        let waves = |s: &mut Stream, list: Vec<(f64, f64)>| {
            let sum: f64 = list.iter().map(|(_, weight)| weight * weight).sum();
            let scale = size * (2.0 / sum).sqrt();
            list.into_iter().map(|(order, weight)| (order, scale * weight, s.phase())).collect()
        };
        match family.pick(s, &[0, 1, 2], 3) {
            0 => {
                let mut orders = [1.0, 2.0, 3.0, 4.0, 5.0];
                s.shuffle(&mut orders);
                let count = 2 + s.below(2);
                let list = orders[..count].iter().map(|order| (*order, s.uniform(0.5, 1.0))).collect();
                Self::Orders { waves: waves(s, list) }
            }
            1 => {
                let fall = s.uniform(0.8, 1.5);
                let list = (1..=8).map(|n| (f64::from(n), f64::from(n).powf(-fall))).collect();
                Self::Waviness { waves: waves(s, list) }
            }
            2 => {
                let narrowness = s.uniform(2.0, 8.0);
                // RMS of the bump about its mean is 0.25 to 0.3 of its height.
                Self::Patch { depth: s.sign() * 3.5 * size, narrowness, at_rad: s.phase() }
            }
            _ => Self::Sectors {
                depth: size,
                joint: s.uniform(-0.4, 0.4),
                width: s.uniform(0.08, 0.25),
                at_rad: s.phase(),
            },
        }
    }

    /// Factor on µ.
    #[must_use]
    pub fn factor(&self, slide: &Slide) -> f64 {
        let angle = slide.disc_angle_rad;
        match self {
            Self::Orders { waves } | Self::Waviness { waves } => waves
                .iter()
                .map(|(order, amplitude, phase)| amplitude * (order * angle + phase).sin())
                .sum::<f64>()
                .exp(),
            Self::Patch { depth, narrowness, at_rad } => {
                1.0 + depth * ((narrowness * ((angle - at_rad).cos() - 1.0)).exp() - 0.25)
            }
            Self::Sectors { depth, joint, width, at_rad } => {
                1.0 + depth * (((angle - at_rad).cos() - joint) / width).tanh()
            }
        }
    }
}
