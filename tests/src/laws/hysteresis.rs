//! Rate-independent hysteresis: of the lever (`lever_hysteresis`, x is M1's torque, y the torque lost) and of
//! the bearing before it slides (`presliding`, x is travel, y the share of the Coulomb drag).
//!
//! y runs from −1 to 1, X is the way over which it yields:
//! - stop: ẏ = ẋ/X inside of ±1, an elastic-plastic element (L. Prandtl, Z. angew. Math. Mech. 8, 1928;
//!   P. Dupont, V. Hayward, B. Armstrong, F. Altpeter, IEEE Trans. Autom. Control 47, 2002);
//! - Dahl: dy/dx = (1 − y sgn ẋ)/X (P. R. Dahl, Aerospace Corp. TOR-158, 1968);
//! - Bouc–Wen: ẏ = (ẋ/X)(1 − |y|^n (γ + (1 − γ) sgn(ẋ y))) (Y. K. Wen, J. Eng. Mech. 102, 1976);
//! - Iwan: several stops side by side (W. D. Iwan, J. Appl. Mech. 33, 1966);
//! - reserved, virgin curve: stops whose weights make the first loading (x/X)^p, p from 0.4 to 0.7 (F. Al-
//!   Bender, W. Symens, J. Swevers, H. Van Brussel, Int. J. Non-Linear Mech. 39, 2004).

use serde::Serialize;

use crate::laws::family::LawFamily;
use crate::random::Stream;

/// Stops that stand for a smooth virgin curve.
const VIRGIN_STOPS: usize = 12;

#[derive(Debug, Clone, Serialize)]
#[serde(tag = "law", rename_all = "snake_case")]
enum Yield {
    Stop,
    Dahl,
    BoucWen { power: f64, gamma: f64 },
    Iwan { stops: Vec<(f64, f64)> },
    VirginCurve { power: f64, stops: Vec<(f64, f64)> },
}

/// A hysteresis with its state.
#[derive(Debug, Clone, Serialize)]
pub struct Hysteresis {
    #[serde(flatten)]
    law: Yield,
    /// Way over which it yields.
    pub reach: f64,
    #[serde(skip)]
    states: Vec<f64>,
}

impl Hysteresis {
    /// Draws one that yields over `reach`.
    pub fn draw(s: &mut Stream, family: LawFamily, reach: f64) -> Self {
        let law = match family.pick(s, &[0, 1, 2, 3], 4) {
            0 => Yield::Stop,
            1 => Yield::Dahl,
            2 => Yield::BoucWen { power: s.uniform(1.0, 2.0), gamma: s.uniform(0.4, 0.6) },
            3 => {
                let weights: Vec<f64> = (0..5).map(|_| s.uniform(0.5, 1.5)).collect();
                let sum: f64 = weights.iter().sum();
                let stops = weights.iter().enumerate();
                Yield::Iwan {
                    stops: stops.map(|(i, w)| (reach * (0.12 + 0.22 * i as f64), w / sum)).collect(),
                }
            }
            _ => {
                let power = s.uniform(0.4, 0.7);
                Yield::VirginCurve { power, stops: virgin_stops(power, reach) }
            }
        };
        let count = match &law {
            Yield::Iwan { stops } | Yield::VirginCurve { stops, .. } => stops.len(),
            _ => 1,
        };
        Self { law, reach, states: vec![0.0; count] }
    }

    /// y after x has moved on by `change`.
    pub fn step(&mut self, change: f64) -> f64 {
        match &self.law {
            Yield::Iwan { stops } | Yield::VirginCurve { stops, .. } => {
                let mut sum = 0.0;
                for ((limit, weight), state) in stops.iter().zip(&mut self.states) {
                    *state = (*state + change).clamp(-limit, *limit);
                    sum += weight * *state / limit;
                }
                sum
            }
            one => {
                let y = self.states[0];
                let rate = match one {
                    Yield::Dahl => 1.0 - y * change.signum(),
                    Yield::BoucWen { power, gamma } => {
                        let along = gamma + (1.0 - gamma) * (change * y).signum();
                        1.0 - y.abs().powf(*power) * along
                    }
                    _ => 1.0,
                };
                self.states[0] = (y + change / self.reach * rate).clamp(-1.0, 1.0);
                self.states[0]
            }
        }
    }
}

/// (yield way, weight) of stops whose sum follows (x/X)^p at their own ways: a straight line between two of
/// them has the slope of all the stops that have not yielded.
fn virgin_stops(power: f64, reach: f64) -> Vec<(f64, f64)> {
    let way = |i: usize| reach * (i as f64 / VIRGIN_STOPS as f64).powi(2);
    let force = |i: usize| (way(i) / reach).powf(power);
    let slope = |i: usize| {
        if i < VIRGIN_STOPS { (force(i + 1) - force(i)) / (way(i + 1) - way(i)) } else { 0.0 }
    };
    (1..=VIRGIN_STOPS).map(|i| (way(i), (slope(i - 1) - slope(i)) * way(i))).collect()
}
