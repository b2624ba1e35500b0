//! Foil springs that take more than in proportion (`foil_hardening`): the extra force over the force x that
//! bends them.
//!
//! - sinh: H (sinh(x/x_s) − x/x_s) (clamped foils that also stretch: S. P. Timoshenko, S. Woinowsky-Krieger,
//!   *Theory of Plates and Shells*, 1959, to all orders);
//! - cubic: H x³ (G. Duffing, *Erzwungene Schwingungen*, 1918; the first order of the same);
//! - stop: a second foil takes part beyond x_s, H (x − x_s), with a rounded bend (two-leaf springs: A. M. Wahl,
//!   *Mechanical Springs*, 1963);
//! - reserved, locking: H x/(1 − x/x_l) − H x, gaps that close one after another (Wahl 1963: conical springs).

use serde::Serialize;

use crate::laws::family::{LawFamily, size};
use crate::random::Stream;

#[derive(Debug, Clone, Copy, Serialize)]
#[serde(tag = "law", rename_all = "snake_case")]
enum Hard {
    Sinh { scale_n: f64 },
    Cubic { scale_n: f64 },
    Stop { from_n: f64, bend_n: f64 },
    Locking { lock_n: f64 },
}

/// The springs' extra force.
#[derive(Debug, Clone, Serialize)]
pub struct FoilHardening {
    #[serde(flatten)]
    law: Hard,
    extra: f64,
}

impl Hard {
    fn at(self, force: f64) -> f64 {
        let x = force.max(0.0);
        match self {
            Self::Sinh { scale_n } => (x / scale_n).sinh() - x / scale_n,
            Self::Cubic { scale_n } => (x / scale_n).powi(3),
            Self::Stop { from_n, bend_n } => 0.5 * (x - from_n + (x - from_n).hypot(bend_n)),
            Self::Locking { lock_n } => x / (1.0 - (x / lock_n).min(0.95)) - x,
        }
    }
}

impl FoilHardening {
    /// Draws one; at the greatest normal force it takes 2.2 times its size.
    pub fn draw(s: &mut Stream, family: LawFamily, greatest_n: f64) -> Self {
        let size = size(s);
        let law = match family.pick(s, &[0, 1, 2], 3) {
            0 => Hard::Sinh { scale_n: greatest_n / s.uniform(1.6, 2.6) },
            1 => Hard::Cubic { scale_n: greatest_n },
            2 => Hard::Stop { from_n: greatest_n * s.uniform(0.4, 0.6), bend_n: greatest_n * 0.05 },
            _ => Hard::Locking { lock_n: greatest_n * s.uniform(1.6, 2.5) },
        };
        let (low, high) = (law.at(0.0), law.at(greatest_n));
        Self { law, extra: 2.2 * size * greatest_n / (high - low) }
    }

    /// Extra force of the springs.
    #[must_use]
    pub fn at(&self, force_n: f64) -> f64 {
        self.extra * (self.law.at(force_n) - self.law.at(0.0))
    }
}
