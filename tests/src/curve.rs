//! The coefficient of friction over speed, with its slope.
//!
//! Falling curve: g(v) = a0 + a1·exp(−(|v|/v0)^δ). An effect may replace it by a bell or make it depend on
//! the direction.
//!
//! Bells (`bell_curve`), x = |v|/v_m:
//! - log-normal: low + rise·exp(−ln²((|v| + v_s)/(v_m + v_s))/(2w²)), as the master curves of rubber are
//!   (K. A. Grosch, Proc. R. Soc. A 274, 1963; A. R. Savkoor, Wear 8, 1965);
//! - Debye: low + rise·2x/(1 + x²), the loss of one relaxation (D. F. Moore, *The Friction and Lubrication
//!   of Elastomers*, 1972);
//! - junctions: low + rise·x·exp(1 − x), bonds that need time to form and are torn (A. Schallamach, Wear
//!   6, 1963; A. E. Filippov, J. Klafter, M. Urbakh, Phys. Rev. Lett. 92, 2004);
//! - reserved, Cole–Cole: low + rise·(1 + cos(πα/2))/(cosh(α ln x) + cos(πα/2)), a broad loss peak
//!   (K. S. Cole, R. H. Cole, J. Chem. Phys. 9, 1941).
//!
//! Direction (`direction_asymmetry`), s = ±1 by direction, joined over a few mm/s:
//! - coefficients: a0 and a1 each with a pair of their own (two Coulomb and Stribeck sets: B. Armstrong-
//!   Hélouvry, *Control of Machines with Friction*, 1991);
//! - whole: g (1 + A s) (anisotropic surface: A. Zmitrowicz, Wear 73, 1981);
//! - shape: a0 (1 + A s) and v0 (1 + B s) (anisotropic Stribeck curve after running one way);
//! - reserved, wedge: (g + t s)/(1 − g t s), asperities that lean by atan t (F. P. Bowden, D. Tabor, *The
//!   Friction and Lubrication of Solids*, 1950).
//!
//! Valid for any speed; the slope's pole at v = 0 for δ < 1 is cut at 0.1 µm/s, and the slope leaves out
//! what the joint of the two directions adds.

use serde::Serialize;

use crate::laws::family::{LawFamily, size};
use crate::random::Stream;
use crate::rig::Friction;

/// Least speed at which a slope is taken.
const FLOOR_M_S: f64 = 1e-7;

#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(tag = "law", rename_all = "snake_case")]
enum Swell {
    LogNormal { shift_m_s: f64, width: f64 },
    Debye,
    Junctions,
    ColeCole { alpha: f64 },
}

/// A bell: friction rises to a maximum, then falls.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Bell {
    #[serde(flatten)]
    swell: Swell,
    low: f64,
    rise: f64,
    peak_speed_m_s: f64,
}

impl Bell {
    /// Draws a bell.
    pub fn draw(s: &mut Stream, family: LawFamily) -> Self {
        let swell = match family.pick(s, &[0, 1, 2], 3) {
            0 => Swell::LogNormal { shift_m_s: s.uniform(0.01, 0.03), width: s.uniform(0.9, 1.3) },
            1 => Swell::Debye,
            2 => Swell::Junctions,
            _ => Swell::ColeCole { alpha: s.uniform(0.6, 0.9) },
        };
        Self {
            swell,
            low: s.uniform(0.42, 0.6),
            rise: s.uniform(0.3, 0.6),
            peak_speed_m_s: s.log_uniform(0.1, 0.35),
        }
    }

    fn at(&self, speed: f64) -> (f64, f64) {
        let peak = self.peak_speed_m_s;
        let x = speed / peak;
        let (swell, slope) = match self.swell {
            Swell::LogNormal { shift_m_s, width } => {
                let log = ((speed + shift_m_s) / (peak + shift_m_s)).ln();
                let swell = (-0.5 * (log / width).powi(2)).exp();
                (swell, -swell * log / (width * width * (speed + shift_m_s)))
            }
            Swell::Debye => {
                let square = 1.0 + x * x;
                (2.0 * x / square, 2.0 * (1.0 - x * x) / (square * square * peak))
            }
            Swell::Junctions => {
                let fall = (1.0 - x).exp();
                (x * fall, (1.0 - x) * fall / peak)
            }
            Swell::ColeCole { alpha } => {
                let (up, cosine) = (x.powf(alpha), (alpha * std::f64::consts::FRAC_PI_2).cos());
                let (cosh, sinh) = (0.5 * (up + 1.0 / up), 0.5 * (up - 1.0 / up));
                let swell = (1.0 + cosine) / (cosh + cosine);
                (swell, -swell * alpha * sinh / ((cosh + cosine) * speed))
            }
        };
        (self.low + self.rise * swell, self.rise * slope)
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(tag = "law", rename_all = "snake_case")]
enum Sides {
    Coefficients { coulomb_share: f64, falling_share: f64 },
    Whole { share: f64 },
    Shape { coulomb_share: f64, speed_share: f64 },
    Wedge { tilt: f64 },
}

/// Coefficients that differ by direction.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Asymmetry {
    #[serde(flatten)]
    sides: Sides,
    join_m_s: f64,
}

impl Asymmetry {
    /// Draws an asymmetry.
    pub fn draw(s: &mut Stream, family: LawFamily) -> Self {
        let size = s.sign() * size(s);
        let sides = match family.pick(s, &[0, 1, 2], 3) {
            0 => Sides::Coefficients { coulomb_share: size, falling_share: size * s.uniform(-0.5, 2.0) },
            1 => Sides::Whole { share: size },
            2 => Sides::Shape { coulomb_share: size, speed_share: size * s.uniform(-1.0, 2.0) },
            // (g + t)/(1 − g t) is about g (1 + t (g + 1/g)); g + 1/g is 2 to 2.3 here.
            _ => Sides::Wedge { tilt: size / 2.1 },
        };
        Self { sides, join_m_s: s.uniform(1e-3, 4e-3) }
    }

    /// Greatest relative change that it makes.
    fn reach(&self) -> f64 {
        match self.sides {
            Sides::Coefficients { coulomb_share, falling_share } => {
                coulomb_share.abs().max(falling_share.abs())
            }
            Sides::Whole { share } => share.abs(),
            Sides::Shape { coulomb_share, .. } => coulomb_share.abs(),
            Sides::Wedge { tilt } => 2.5 * tilt.abs(),
        }
    }
}

/// The curve of a case.
#[derive(Debug, Clone)]
pub struct Curve {
    a0: f64,
    a1: f64,
    v0: f64,
    delta: f64,
    bell: Option<Bell>,
    asymmetry: Option<Asymmetry>,
}

impl Curve {
    /// The falling curve of `friction`, changed by the effects given.
    #[must_use]
    pub fn new(friction: &Friction, bell: Option<Bell>, asymmetry: Option<Asymmetry>) -> Self {
        Self { a0: friction.a0, a1: friction.a1, v0: friction.v0_m_s, delta: friction.delta, bell, asymmetry }
    }

    /// Coefficient at sliding speed `v_m_s` and its derivative.
    #[must_use]
    pub fn at(&self, v_m_s: f64) -> (f64, f64) {
        let speed = v_m_s.abs().max(FLOOR_M_S);
        let sign = v_m_s.signum();
        if let Some(bell) = &self.bell {
            let (g, slope) = bell.at(speed);
            return (g, sign * slope);
        }
        let Some(asymmetry) = &self.asymmetry else {
            let (g, slope) = self.falling(speed, self.a0, self.a1, self.v0);
            return (g, sign * slope);
        };
        let side = v_m_s / v_m_s.hypot(asymmetry.join_m_s);
        let (a0, a1, v0) = (self.a0, self.a1, self.v0);
        let (g, slope) = match asymmetry.sides {
            Sides::Coefficients { coulomb_share, falling_share } => {
                self.falling(speed, a0 * (1.0 + coulomb_share * side), a1 * (1.0 + falling_share * side), v0)
            }
            Sides::Whole { share } => {
                let factor = 1.0 + share * side;
                self.falling(speed, a0 * factor, a1 * factor, v0)
            }
            Sides::Shape { coulomb_share, speed_share } => {
                self.falling(speed, a0 * (1.0 + coulomb_share * side), a1, v0 * (1.0 + speed_share * side))
            }
            Sides::Wedge { tilt } => {
                let (g, slope) = self.falling(speed, a0, a1, v0);
                let (lean, room) = (tilt * side, 1.0 - g * tilt * side);
                ((g + lean) / room, slope * (1.0 + lean * lean) / (room * room))
            }
        };
        (g, sign * slope)
    }

    fn falling(&self, speed: f64, a0: f64, a1: f64, v0: f64) -> (f64, f64) {
        let ratio = speed / v0;
        let power = if self.delta == 0.5 { ratio.sqrt() } else { ratio.powf(self.delta) };
        let falling = a1 * (-power).exp();
        (a0 + falling, -falling * self.delta * power / speed)
    }

    /// Greatest coefficient the curve reaches.
    #[must_use]
    pub fn peak(&self) -> f64 {
        let sides = self.asymmetry.map_or(1.0, |a| 1.0 + a.reach());
        self.bell.map_or((self.a0 + self.a1) * sides, |bell| bell.low + bell.rise)
    }

    /// A coefficient the curve never falls below at the speeds the rig runs.
    #[must_use]
    pub fn least(&self) -> f64 {
        let sides = self.asymmetry.map_or(1.0, |a| 1.0 - a.reach());
        self.bell.map_or(self.a0 * sides, |bell| bell.low)
    }
}
