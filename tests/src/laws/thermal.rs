//! µ falls as sliding heats the surface, and recovers as it cools.
//!
//! P = F v is the power of sliding, T temperatures over ambient.
//! - two nodes: a thin layer backed by the bulk of the element, C_f Ṫ_f = P − G (T_f − T_b),
//!   C_b Ṫ_b = G (T_f − T_b) − H T_b; µ/µ0 = r + (1 − r)/(1 + (T_f/T_h)^p), a softening that levels off
//!   (rubber between glass and plateau; K. A. Grosch, Proc. R. Soc. A 274, 1963);
//! - lumped: C Ṫ = P − H T, µ/µ0 = max(r, exp(−β T)) (brake fade with one heat capacity: T. P. Newcomb,
//!   R. T. Spurr, *Braking of Road Vehicles*, 1967);
//! - flash: temperature of the contact spots in proportion to power, 1 K/W, over a body that warms slowly
//!   (H. Blok, Proc. Inst. Mech. Eng. 2, 1937; J. F. Archard, Wear 2, 1959); µ/µ0 = 1 − A T/(T_h + T);
//! - reserved, WLF: one temperature; the friction curve shifts along the logarithm of speed by
//!   log10 a_T = −C1 T/(C2 + T), C1 = 8.86, C2 = 101.6 K (M. L. Williams, R. F. Landel, J. D. Ferry,
//!   J. Am. Chem. Soc. 77, 1955), of which the falling side's slope makes µ/µ0 = 1 − m |log10 a_T|.

use serde::Serialize;

use crate::laws::family::{LawFamily, size};
use crate::laws::slide::Slide;
use crate::random::Stream;

/// Power of a middling slide, at which typical temperatures are stated.
const TYPICAL_W: f64 = 30.0;
/// Time after which they are stated.
const TYPICAL_S: f64 = 6.0;
const WLF: (f64, f64) = (8.86, 101.6);

/// Law of the fade.
#[derive(Debug, Clone, Serialize)]
#[serde(tag = "law", rename_all = "snake_case")]
enum Fade {
    TwoNodes {
        layer_j_per_k: f64,
        bulk_j_per_k: f64,
        to_bulk_w_per_k: f64,
        to_air_w_per_k: f64,
        half_k: f64,
        power: f64,
        residual: f64,
    },
    Lumped {
        heat_j_per_k: f64,
        cooling_time_s: f64,
        fade_per_k: f64,
        residual: f64,
    },
    Flash {
        spots_s: f64,
        body_s: f64,
        body_share: f64,
        half_k: f64,
        depth: f64,
    },
    Wlf {
        heat_j_per_k: f64,
        cooling_time_s: f64,
        per_decade: f64,
    },
}

/// The fade with its temperatures.
#[derive(Debug, Clone, Serialize)]
pub struct ThermalFade {
    #[serde(flatten)]
    law: Fade,
    #[serde(skip)]
    surface_k: f64,
    #[serde(skip)]
    body_k: f64,
}

#[derive(Clone, Copy)]
enum Kind {
    TwoNodes,
    Lumped,
    Flash,
    Wlf,
}

fn heat_of(s: &mut Stream) -> (f64, f64, f64) {
    let cooling_time_s = s.log_uniform(2.0, 40.0);
    // A middling slide warms the surface by 20 to 60 K within the time of a scene or two.
    let typical_k = s.uniform(20.0, 60.0);
    let warmed_s = cooling_time_s * (1.0 - (-TYPICAL_S / cooling_time_s).exp());
    (TYPICAL_W * warmed_s / typical_k, cooling_time_s, typical_k)
}

impl ThermalFade {
    fn new(law: Fade) -> Self {
        Self { law, surface_k: 0.0, body_k: 0.0 }
    }

    /// Draws one.
    pub fn draw(s: &mut Stream, family: LawFamily) -> Self {
        let size = size(s);
        let kind = family.pick(s, &[Kind::TwoNodes, Kind::Lumped, Kind::Flash], Kind::Wlf);
        Self::new(match kind {
            Kind::TwoNodes => {
                let to_bulk = s.uniform(0.6, 1.0);
                let bulk = s.uniform(3.5, 6.0);
                let power = s.uniform(1.0, 2.0);
                Fade::TwoNodes {
                    layer_j_per_k: to_bulk * s.uniform(0.25, 0.7),
                    bulk_j_per_k: bulk,
                    to_bulk_w_per_k: to_bulk,
                    to_air_w_per_k: bulk / s.uniform(5.0, 12.0),
                    half_k: 45.0 * (0.55 / size).powf(1.0 / power),
                    power,
                    residual: s.uniform(0.3, 0.45),
                }
            }
            Kind::Lumped => {
                let (heat_j_per_k, cooling_time_s, typical_k) = heat_of(s);
                let residual = s.uniform(0.4, 0.6);
                Fade::Lumped { heat_j_per_k, cooling_time_s, fade_per_k: size / typical_k, residual }
            }
            Kind::Flash => Fade::Flash {
                spots_s: s.log_uniform(0.03, 0.2),
                body_s: s.uniform(3.0, 12.0),
                body_share: s.uniform(0.5, 1.5),
                half_k: s.uniform(40.0, 120.0),
                depth: (2.0 * size).min(0.6),
            },
            Kind::Wlf => {
                let (heat_j_per_k, cooling_time_s, typical_k) = heat_of(s);
                let decades = WLF.0 * typical_k / (WLF.1 + typical_k);
                Fade::Wlf { heat_j_per_k, cooling_time_s, per_decade: size / decades }
            }
        })
    }

    /// A surface of average properties, for the temperature sensor of a case without the effect.
    #[must_use]
    pub fn average() -> Self {
        Self::new(Fade::TwoNodes {
            layer_j_per_k: 0.4,
            bulk_j_per_k: 4.7,
            to_bulk_w_per_k: 0.8,
            to_air_w_per_k: 0.6,
            half_k: 90.0,
            power: 1.6,
            residual: 0.4,
        })
    }

    /// Surface temperature over ambient.
    #[must_use]
    pub fn surface_k(&self) -> f64 {
        match &self.law {
            Fade::Flash { body_share, .. } => self.surface_k + body_share * self.body_k,
            _ => self.surface_k,
        }
    }

    /// Heats and cools for a step.
    pub fn heat(&mut self, slide: &Slide) {
        let (h, power) = (slide.step_s, slide.power_w());
        match &self.law {
            Fade::TwoNodes { layer_j_per_k, bulk_j_per_k, to_bulk_w_per_k, to_air_w_per_k, .. } => {
                let across = to_bulk_w_per_k * (self.surface_k - self.body_k);
                self.surface_k += h * (power - across) / layer_j_per_k;
                self.body_k += h * (across - to_air_w_per_k * self.body_k) / bulk_j_per_k;
            }
            Fade::Lumped { heat_j_per_k, cooling_time_s, .. }
            | Fade::Wlf { heat_j_per_k, cooling_time_s, .. } => {
                self.surface_k += h * (power / heat_j_per_k - self.surface_k / cooling_time_s);
            }
            Fade::Flash { spots_s, body_s, .. } => {
                self.surface_k += h / spots_s * (power - self.surface_k);
                self.body_k += h / body_s * (power - self.body_k);
            }
        }
    }

    /// Factor on µ; advances the heat by a step.
    pub fn factor(&mut self, slide: &Slide) -> f64 {
        self.heat(slide);
        let warm = self.surface_k().max(0.0);
        match &self.law {
            Fade::TwoNodes { half_k, power, residual, .. } => {
                residual + (1.0 - residual) / (1.0 + (warm / half_k).powf(*power))
            }
            Fade::Lumped { fade_per_k, residual, .. } => (-fade_per_k * warm).exp().max(*residual),
            Fade::Flash { half_k, depth, .. } => 1.0 - depth * warm / (half_k + warm),
            Fade::Wlf { per_decade, .. } => (1.0 - per_decade * WLF.0 * warm / (WLF.1 + warm)).max(0.3),
        }
    }
}
