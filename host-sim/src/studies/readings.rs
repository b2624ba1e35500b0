//! The ways in which eqs. 17–19 can be read, each with what it shows at constant sliding speed and load.
//!
//! The paper prints an overshoot of the modified LuGre model and no parameters. Here one element starts from rest with the
//! stiffness of the assumed rubber under 88 N at the speeds of Figs. 18–21, and, in a last column, with the steep curve in
//! which a lag shows most (a0 0.2, a1 1, v0 0.05 m/s, δ ½, 181.54 1/m, 0.5 m/s). Overshoot is that of the deflection: of the
//! force for σ1 = a2 = 0.
//!
//! Left out: the patch. There the literal reading is LuGre's patch in steady rolling, and the material one does along its way
//! what the element does in time (`model-core/tests/suite/claims.rs`).

use std::f64::consts::TAU;

use rayon::prelude::*;

use model_core::friction::stribeck::{Stribeck, StribeckParameters};

/// Speeds of the disc in Figs. 18–21, rpm.
pub const SPEEDS_RPM: [f64; 4] = [10.0, 20.0, 30.0, 120.0];
/// Distance of the elements from the disc's axis, m.
const RADIUS_M: f64 = 0.06;
/// Steps of the continuous readings over which LuGre's bristles wind up.
const STEPS_OF_WIND_UP: f64 = 2000.0;
/// Above this an overshoot would be seen in a plot.
const SEEN: f64 = 0.01;

/// A way to read the equations.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Reading {
    /// s = v_r − ∂u/∂t in the same instant; for one element the same as with Du/Dt.
    Literal,
    /// s with the rate of the step before, steps of this length, s.
    PreviousStep(f64),
    /// s follows v_r − u̇ with this time constant, s.
    Lag(f64),
    /// The power ½ on the bracket: g = (a0 + a1 e^{−|s|/v0})^½.
    RootOfBracket,
    /// The asperities' own speed in place of |v_r|: u̇ = v_r − σ0 |s| u/(F_N g(s)).
    TipSpeed,
}

/// What a reading shows at one speed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Seen {
    /// Largest deflection over F_N g(v_r)/σ0, less one.
    pub overshoot: f64,
    /// Whether it comes to rest there.
    pub settles: bool,
}

/// A row of the table.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// Which.
    pub reading: Reading,
    /// Most solutions s that the equation has for a deflection between none and the steady one.
    pub roots: usize,
    /// At the speeds of the figures.
    pub figures: [Seen; 4],
    /// With the steep curve.
    pub steep: Seen,
}

/// A curve with its stiffness per load (1/m), so that y = σ0 u/F_N is a friction coefficient.
#[derive(Debug, Clone, Copy)]
struct Case {
    curve: Stribeck<f64>,
    parameters: StribeckParameters<f64>,
    stiffness_per_load: f64,
    speed_m_s: f64,
}

impl Case {
    fn new(parameters: StribeckParameters<f64>, stiffness_per_load: f64, speed_m_s: f64) -> Option<Self> {
        Some(Self { curve: Stribeck::new(&parameters).ok()?, parameters, stiffness_per_load, speed_m_s })
    }

    fn g(&self, reading: Reading, s: f64) -> f64 {
        match reading {
            Reading::RootOfBracket => {
                let p = &self.parameters;
                (p.a0 + p.a1 * (-s.abs() / p.v0_m_s).exp()).sqrt()
            }
            _ => self.curve.coefficient(s),
        }
    }

    /// What s must make zero for y = σ0 u/F_N.
    fn balance(&self, reading: Reading, y: f64, s: f64) -> f64 {
        match reading {
            Reading::TipSpeed => s * (self.g(reading, s) - y),
            _ => s * self.g(reading, s) - y * self.speed_m_s,
        }
    }

    fn roots(&self, reading: Reading) -> usize {
        let top = self.g(reading, 0.0);
        let count = |y: f64| {
            let speeds = (0..4000).map(|k| 1e-7 * (k as f64 * 0.006).exp());
            let signs: Vec<bool> = speeds.map(|s| self.balance(reading, y, s) > 0.0).collect();
            let crossings = signs.windows(2).filter(|w| w[0] != w[1]).count();
            crossings + usize::from(reading == Reading::TipSpeed)
        };
        (1..200).map(|k| count(top * f64::from(k) / 200.0)).max().unwrap_or(0)
    }

    fn seen(&self, reading: Reading) -> Seen {
        let v = self.speed_m_s;
        let steady = self.g(reading, v);
        // Forty times the way on which LuGre's bristles wind up, and the lag's own time to settle.
        let lag_s = if let Reading::Lag(time_s) = reading { time_s } else { 0.0 };
        let duration_s = 40.0 * (steady / self.stiffness_per_load / v + lag_s);
        let step_s = match reading {
            Reading::PreviousStep(step_s) => step_s,
            _ => steady / self.stiffness_per_load / v / STEPS_OF_WIND_UP,
        };
        let steps = (duration_s / step_s) as usize;
        let (mut y, mut s) = (0.0f64, 0.0f64);
        let (mut peak, mut low, mut high) = (0.0f64, f64::INFINITY, 0.0f64);
        for k in 0..steps {
            let wound = step_s * self.stiffness_per_load;
            match reading {
                Reading::Literal | Reading::RootOfBracket => {
                    s = self.single_root(reading, y);
                    y += wound * (v - s);
                }
                Reading::PreviousStep(_) | Reading::Lag(_) => {
                    let rate = v - y * v / self.g(reading, s);
                    y += wound * rate;
                    match reading {
                        Reading::Lag(time_s) => s += -(-step_s / time_s).exp_m1() * (v - rate - s),
                        _ => s = v - rate,
                    }
                }
                Reading::TipSpeed => {
                    // It sticks (s = 0) until g(0); the sliding root is left of no force: it falls at once.
                    y += wound * v;
                    if y >= self.curve.largest() {
                        y = self.curve.smallest();
                    }
                }
            }
            peak = peak.max(y);
            if k > steps / 2 {
                (low, high) = (low.min(y), high.max(y));
            }
        }
        Seen { overshoot: peak / steady - 1.0, settles: high - low < SEEN * steady }
    }

    /// The only s > 0 with s g(s) = y v: by bisection, with no trick shared with the core's model.
    fn single_root(&self, reading: Reading, y: f64) -> f64 {
        let (mut low, mut high) = (0.0, y * self.speed_m_s / self.g(reading, 1e9));
        for _ in 0..50 {
            let middle = 0.5 * (low + high);
            if self.balance(reading, y, middle) > 0.0 { high = middle } else { low = middle }
        }
        0.5 * (low + high)
    }
}

/// All readings, for a rubber of this stiffness under this load.
#[must_use]
pub fn table(curve: &StribeckParameters<f64>, stiffness_n_per_m: f64, normal_force_n: f64) -> Vec<Row> {
    let steep = StribeckParameters { a0: 0.2, a1: 1.0, v0_m_s: 0.05, delta: 0.5, theta: 1.0 };
    let Some(steep) = Case::new(steep, 181.54, 0.5) else { return Vec::new() };
    let case = |rpm: f64| Case::new(*curve, stiffness_n_per_m / normal_force_n, rpm * TAU / 60.0 * RADIUS_M);
    let Some(cases) = SPEEDS_RPM.map(case).into_iter().collect::<Option<Vec<_>>>() else { return Vec::new() };
    let readings = [
        Reading::Literal,
        Reading::PreviousStep(1e-3),
        Reading::PreviousStep(5e-4),
        Reading::PreviousStep(1e-4),
        Reading::Lag(2e-3),
        Reading::Lag(5e-3),
        Reading::Lag(20e-3),
        Reading::RootOfBracket,
        Reading::TipSpeed,
    ];
    let row = |reading: Reading| Row {
        reading,
        roots: cases.iter().map(|case| case.roots(reading)).max().unwrap_or(0),
        figures: std::array::from_fn(|k| cases[k].seen(reading)),
        steep: steep.seen(reading),
    };
    readings.into_par_iter().map(row).collect()
}

impl Reading {
    /// In words.
    #[must_use]
    pub fn words(&self) -> String {
        match self {
            Self::Literal => "literal, s = v_r − ∂u/∂t (in one element also Du/Dt)".into(),
            Self::PreviousStep(step_s) => format!("rate of the step before, {} ms", step_s * 1e3),
            Self::Lag(time_s) => format!("s lags by τ = {} ms", time_s * 1e3),
            Self::RootOfBracket => "power ½ on the bracket".into(),
            Self::TipSpeed => "|v_r| → |s|".into(),
        }
    }
}

impl Seen {
    /// In words.
    #[must_use]
    pub fn words(&self) -> String {
        let percent = format!("{:.1} %", 100.0 * self.overshoot.max(0.0));
        if self.settles { percent } else { format!("{percent}, never settles") }
    }
}

impl Row {
    /// What the authors would have seen.
    #[must_use]
    pub fn verdict(&self) -> &'static str {
        let all = self.figures.iter().chain([&self.steep]);
        if all.clone().any(|seen| !seen.settles) {
            "stick-slip without end"
        } else if self.figures.iter().any(|seen| seen.overshoot > SEEN) {
            "an overshoot"
        } else if self.steep.overshoot > SEEN {
            "an overshoot with a steep curve only"
        } else {
            "none"
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_solved_for_one_root_never_overshoots_and_what_lags_does() {
        let curve = StribeckParameters { a0: 0.5, a1: 0.7, v0_m_s: 0.5, delta: 0.5, theta: 1.0 };
        for row in table(&curve, 3e4, 88.0) {
            let most = row.figures.iter().map(|seen| seen.overshoot).fold(row.steep.overshoot, f64::max);
            match row.reading {
                Reading::Literal | Reading::RootOfBracket => {
                    assert!(most < 1e-3 && row.roots == 1, "{row:?}")
                }
                Reading::TipSpeed => assert!(row.roots == 2 && !row.figures[0].settles, "{row:?}"),
                // The figures of the steep curve.
                Reading::PreviousStep(1e-3) => {
                    assert!((row.steep.overshoot - 0.14).abs() < 0.01, "{row:?}");
                }
                Reading::PreviousStep(_) => assert!(row.steep.overshoot < 5e-3, "{row:?}"),
                Reading::Lag(2e-3) => {
                    assert!((row.steep.overshoot - 0.12).abs() < 0.02, "{row:?}");
                }
                Reading::Lag(5e-3) => {
                    assert!((row.steep.overshoot - 0.34).abs() < 0.02, "{row:?}");
                }
                Reading::Lag(_) => assert!(row.steep.overshoot > 0.34, "{row:?}"),
            }
        }
    }
}
