//! Laws of M2's bearing, ω the speed. They serve the rotary drive and the linear stage.
//!
//! Uneven by direction (`bearing_asymmetry`), s = ±1 by direction:
//! - both: Coulomb part times 1 + A s, viscous part plus B (1.2 + s) (two sets: B. Armstrong-Hélouvry, P. Dupont,
//!   C. Canudas de Wit, Automatica 30, 1994; A. Janot, M. Gautier, M. Brunot, EMPS, 2019);
//! - viscous: only the viscous part (a seal lip that pumps one way: R. Flitney, *Seals and Sealing Handbook*);
//! - Palmgren: drag plus D (1 + s)/2 |ω|^(2/3) (A. Palmgren, *Ball and Roller Bearing Engineering*, 1959);
//! - reserved, one-sided Stribeck: drag plus D (1 + s)/2 e^(−|ω|/ω_s), and B (1 + s)/2 viscous.
//!
//! Falling (`bearing_stribeck`), on top of the Coulomb part:
//! - Hess and Soom: D/(1 + (ω/ω_s)²) (D. P. Hess, A. Soom, J. Tribology 112, 1990);
//! - Tustin: D e^(−|ω|/ω_s) (A. Tustin, J. IEE 94, 1947);
//! - Gauss: D e^(−(ω/ω_s)²) (B. Armstrong-Hélouvry, *Control of Machines with Friction*, 1991);
//! - reserved, Bo and Pavelescu: D e^(−(|ω|/ω_s)^δ), δ from 0.5 to 0.7 (L. C. Bo, D. Pavelescu, Wear 82, 1982).
//!
//! Offset (`torque_offset`), a torque that nobody commanded:
//! - constant (zero of a ±10 V torque command: M. P. Kaźmierkowski, H. Tunia, *Automatic Control of Converter-Fed
//!   Drives*, 1994);
//! - per log: constant in each log, by 15 % (sd) another from log to log (zero taken at each power-up);
//! - wavering: constant plus up to 15 % of it up and down over some ten seconds (supply and temperature of the drive's
//!   current sensor). A part over the angle would be a ripple, which is an effect of its own;
//! - reserved, warming: grows from 70 % of its value within some seconds (drift of the current sensor's zero).

use serde::Serialize;

use crate::laws::Units;
use crate::laws::family::LawFamily;
use crate::random::Stream;

#[derive(Debug, Clone, Copy, Serialize)]
#[serde(tag = "law", rename_all = "snake_case")]
enum Side {
    Both { coulomb_share: f64, viscous: f64 },
    Viscous { viscous: f64 },
    Palmgren { drag: f64 },
    OneSidedStribeck { drag: f64, speed: f64, viscous: f64 },
}

/// Drag that differs by direction.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct Uneven {
    #[serde(flatten)]
    side: Side,
    speed_unit: f64,
}

impl Uneven {
    /// Draws one. Something always depends on speed: an uneven Coulomb part alone is a torque offset.
    pub fn draw(s: &mut Stream, family: LawFamily, units: Units) -> Self {
        // 0.08 to 0.35 N·m between the directions at the speed of a slide.
        let difference = s.log_uniform(0.08, 0.35) * units.torque;
        let per_speed = difference / units.travel;
        let side = match family.pick(s, &[0, 1, 2], 3) {
            0 => Side::Both {
                coulomb_share: s.signed(0.2, 0.45),
                viscous: s.sign() * (0.05 * per_speed).clamp(0.008, 0.02),
            },
            1 => Side::Viscous { viscous: s.sign() * 0.06 * per_speed },
            2 => Side::Palmgren { drag: s.sign() * 0.25 * difference },
            _ => Side::OneSidedStribeck {
                drag: s.sign() * difference,
                speed: s.uniform(1.0, 4.0) * units.travel,
                viscous: s.sign() * 0.05 * per_speed,
            },
        };
        Self { side, speed_unit: units.travel }
    }

    /// Factor on the Coulomb part and drag beside it, at a speed with smoothed direction `side`.
    #[must_use]
    pub fn at(&self, speed: f64, side: f64) -> (f64, f64) {
        // Which of the two directions drags more is drawn: a negative number belongs to the other.
        let on = |number: f64| (number.abs(), 0.5 * (1.0 + side * number.signum()));
        match self.side {
            Side::Both { coulomb_share, viscous } => {
                (1.0 + coulomb_share * side, (1.2 * viscous.abs() + viscous * side) * speed)
            }
            Side::Viscous { viscous } => (1.0, (viscous.abs() + viscous * side) * speed),
            Side::Palmgren { drag } => {
                let (size, share) = on(drag);
                (1.0, size * share * (speed.abs() / self.speed_unit).powf(2.0 / 3.0) * side)
            }
            Side::OneSidedStribeck { drag, speed: scale, viscous } => {
                let (size, share) = on(drag);
                let (slope, other) = on(viscous);
                (1.0, size * share * (-speed.abs() / scale).exp() * side + slope * other * speed)
            }
        }
    }
}

#[derive(Debug, Clone, Copy, Serialize)]
#[serde(tag = "law", rename_all = "snake_case")]
enum Fall {
    HessSoom,
    Tustin,
    Gauss,
    BoPavelescu { delta: f64 },
}

/// Drag that falls with speed.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct Falling {
    #[serde(flatten)]
    fall: Fall,
    extra: f64,
    speed: f64,
}

impl Falling {
    /// Draws one.
    pub fn draw(s: &mut Stream, family: LawFamily, units: Units) -> Self {
        let fall = match family.pick(s, &[0, 1, 2], 3) {
            0 => Fall::HessSoom,
            1 => Fall::Tustin,
            2 => Fall::Gauss,
            _ => Fall::BoPavelescu { delta: s.uniform(0.5, 0.7) },
        };
        Self {
            fall,
            extra: s.log_uniform(0.12, 0.35) * units.torque,
            speed: s.log_uniform(0.5, 2.5) * units.travel,
        }
    }

    /// Extra drag at a speed.
    #[must_use]
    pub fn at(&self, speed: f64) -> f64 {
        let x = speed.abs() / self.speed;
        self.extra
            * match self.fall {
                Fall::HessSoom => 1.0 / (1.0 + x * x),
                Fall::Tustin => (-x).exp(),
                Fall::Gauss => (-x * x).exp(),
                Fall::BoPavelescu { delta } => (-x.powf(delta)).exp(),
            }
    }
}

#[derive(Debug, Clone, Copy, Serialize)]
#[serde(tag = "law", rename_all = "snake_case")]
enum Bias {
    Constant,
    PerLog,
    Wavering { share: f64, period_s: f64, phase_rad: f64 },
    Warming { time_s: f64 },
}

/// Torque that nobody commanded.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct Offset {
    #[serde(flatten)]
    bias: Bias,
    offset: f64,
    #[serde(skip)]
    of_log: f64,
}

impl Offset {
    /// Draws one.
    pub fn draw(s: &mut Stream, family: LawFamily, units: Units) -> Self {
        let offset = s.sign() * s.log_uniform(0.06, 0.3) * units.torque;
        let bias = match family.pick(s, &[0, 1, 2], 3) {
            0 => Bias::Constant,
            1 => Bias::PerLog,
            2 => Bias::Wavering {
                share: s.uniform(0.0, 0.15),
                period_s: s.uniform(8.0, 30.0),
                phase_rad: s.phase(),
            },
            _ => Bias::Warming { time_s: s.uniform(1.0, 4.0) },
        };
        Self { bias, offset, of_log: 1.0 }
    }

    pub(crate) fn begin_log(&mut self, s: &mut Stream) {
        if matches!(self.bias, Bias::PerLog) {
            self.of_log = 1.0 + 0.15 * s.normal();
        }
    }

    /// Torque at a time.
    #[must_use]
    pub fn at(&self, time_s: f64) -> f64 {
        self.of_log
            * self.offset
            * match self.bias {
                Bias::Constant | Bias::PerLog => 1.0,
                Bias::Wavering { share, period_s, phase_rad } => {
                    1.0 + share * (std::f64::consts::TAU * time_s / period_s + phase_rad).sin()
                }
                Bias::Warming { time_s: warm_s } => 1.0 - 0.3 * (-time_s / warm_s).exp(),
            }
    }
}
