//! The coefficient of friction over speed, with its slope.
//!
//! Falling curve: g(v) = a0 + a1·exp(−(|v|/v0)^δ). An effect may replace it by a bell, log-normal in
//! speed as the master curves of rubber are (K. A. Grosch, Proc. R. Soc. A 274, 1963):
//! g = low + rise·exp(−ln²((|v| + v_s)/(v_m + v_s))/(2w²)),
//! or give each direction its own pair of coefficients, joined over a few mm/s.
//! Valid for any speed; the slope's pole at v = 0 for δ < 1 is cut at 0.1 µm/s.

use serde::Serialize;

use crate::random::Stream;
use crate::rig::Friction;

/// Least speed at which a slope is taken.
const FLOOR_M_S: f64 = 1e-7;

/// A bell: friction rises to a maximum, then falls.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Bell {
    low: f64,
    rise: f64,
    peak_speed_m_s: f64,
    shift_m_s: f64,
    width: f64,
}

impl Bell {
    /// Draws a bell.
    pub fn draw(s: &mut Stream) -> Self {
        Self {
            low: s.uniform(0.42, 0.6),
            rise: s.uniform(0.35, 0.6),
            peak_speed_m_s: s.log_uniform(0.1, 0.35),
            shift_m_s: s.uniform(0.01, 0.03),
            width: s.uniform(0.9, 1.3),
        }
    }
}

/// Coefficients that differ by direction.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Asymmetry {
    coulomb_share: f64,
    falling_share: f64,
    join_m_s: f64,
}

impl Asymmetry {
    /// Draws an asymmetry.
    pub fn draw(s: &mut Stream) -> Self {
        let side = s.sign();
        Self {
            coulomb_share: side * s.uniform(0.07, 0.15),
            falling_share: side * s.uniform(-0.05, 0.25),
            join_m_s: s.uniform(1e-3, 4e-3),
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
            let x = ((speed + bell.shift_m_s) / (bell.peak_speed_m_s + bell.shift_m_s)).ln();
            let swell = bell.rise * (-0.5 * (x / bell.width).powi(2)).exp();
            let slope = -swell * x / (bell.width * bell.width * (speed + bell.shift_m_s));
            return (bell.low + swell, sign * slope);
        }
        let ratio = speed / self.v0;
        let power = if self.delta == 0.5 { ratio.sqrt() } else { ratio.powf(self.delta) };
        let (mut a0, mut a1) = (self.a0, self.a1);
        if let Some(asymmetry) = &self.asymmetry {
            let side = v_m_s / v_m_s.hypot(asymmetry.join_m_s);
            a0 *= 1.0 + asymmetry.coulomb_share * side;
            a1 *= 1.0 + asymmetry.falling_share * side;
        }
        let falling = a1 * (-power).exp();
        (a0 + falling, -sign * falling * self.delta * power / speed)
    }

    /// Greatest coefficient the curve reaches.
    #[must_use]
    pub fn peak(&self) -> f64 {
        let sides = self.asymmetry.map_or(1.0, |a| 1.0 + a.coulomb_share.abs().max(a.falling_share.abs()));
        self.bell.map_or((self.a0 + self.a1) * sides, |bell| bell.low + bell.rise)
    }

    /// A coefficient the curve never falls below at the speeds the rig runs.
    #[must_use]
    pub fn least(&self) -> f64 {
        let sides = self.asymmetry.map_or(1.0, |a| 1.0 - a.coulomb_share.abs());
        self.bell.map_or(self.a0 * sides, |bell| bell.low + 0.1 * bell.rise)
    }
}
