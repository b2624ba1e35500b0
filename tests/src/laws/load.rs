//! µ depends on the normal force F. All are 1 at a middling force F_r.
//!
//! - Thirion: 1/µ = a + b F (P. Thirion, Rev. Gén. Caoutchouc 23, 1946);
//! - power: µ ~ F^−n, n ≤ 1/3, that of a Hertzian contact (A. Schallamach, Proc. Phys. Soc. B 65, 1952);
//! - adhesion: µ ~ 1 + F_a/F, a friction force that is affine in the load and not zero without it
//!   (B. V. Derjaguin, Z. Phys. 88, 1934); here F_a/(F + 2 N), since a film of zero load does not hold;
//! - reserved, area: µ ~ h + (1 − h) (F_s/F)(1 − e^(−F/F_s)), adhesion in proportion to a real contact area
//!   that saturates (J. A. Greenwood, J. B. P. Williamson, Proc. R. Soc. A 295, 1966, for the start;
//!   B. N. J. Persson, J. Chem. Phys. 115, 2001, for the saturation) beside hysteresis in proportion to load.

use serde::Serialize;

use crate::laws::family::{LawFamily, size};
use crate::laws::slide::Slide;
use crate::random::Stream;

/// Spread of ln F over a course, weighted with the friction force.
const LOG_SPREAD: f64 = 0.45;
/// Load below which no law is evaluated.
const LEAST_N: f64 = 1.0;

#[derive(Debug, Clone, Copy, Serialize)]
#[serde(tag = "law", rename_all = "snake_case")]
enum Load {
    Thirion { scale_n: f64 },
    Power { exponent_n: f64 },
    Adhesion { adhesion_n: f64 },
    Area { saturation_n: f64, hysteresis_share: f64 },
}

/// The dependence.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct LoadDependence {
    #[serde(flatten)]
    law: Load,
    reference_n: f64,
}

impl Load {
    fn at(self, force: f64) -> f64 {
        match self {
            Self::Thirion { scale_n } => 1.0 / (1.0 + force / scale_n),
            Self::Power { exponent_n } => force.powf(-exponent_n),
            Self::Adhesion { adhesion_n } => 1.0 + adhesion_n / (force + 2.0),
            Self::Area { saturation_n, hysteresis_share: h } => {
                let x = force / saturation_n;
                h + (1.0 - h) * -(-x).exp_m1() / x
            }
        }
    }
}

impl LoadDependence {
    /// Draws one.
    pub fn draw(s: &mut Stream, family: LawFamily) -> Self {
        // Size over spread is the slope −d ln µ/d ln F at the reference.
        let slope = (size(s) / LOG_SPREAD).min(0.33);
        let reference_n = s.uniform(40.0, 60.0);
        let law = match family.pick(s, &[0, 1, 2], 3) {
            // Slope of Thirion's law: x/(1 + x), x = F/F_s.
            0 => Load::Thirion { scale_n: reference_n * (1.0 - slope) / slope },
            1 => Load::Power { exponent_n: slope },
            // Slope of the affine law: x/(1 + x), x = F_a/F.
            2 => Load::Adhesion { adhesion_n: reference_n * slope / (1.0 - slope) },
            _ => {
                let saturation_n = s.uniform(25.0, 80.0);
                let x = reference_n / saturation_n;
                let area = -(-x).exp_m1() / x;
                let fall = area - (-x).exp();
                // slope = (1 − h) fall/(h + (1 − h) area), solved for h.
                let h = (fall - slope * area) / (fall - slope * area + slope);
                Load::Area { saturation_n, hysteresis_share: h.clamp(0.0, 0.95) }
            }
        };
        Self { law, reference_n }
    }

    /// Factor on µ.
    #[must_use]
    pub fn factor(&self, slide: &Slide) -> f64 {
        self.law.at(slide.normal_n.max(LEAST_N)) / self.law.at(self.reference_n)
    }
}
