//! Logs of a driven rig with a known friction law, by classical Runge–Kutta steps of 2 µs.
//!
//! Disc: J ω̇ = τ − F r − c ω, with τ from a speed controller (proportional, integral, limited).
//! Normal-load actuator: ẍ + 2ζω ẋ + ω² x = ω² F_wanted, load N = max(x, 0).
//! Laws (δ = 1/2 throughout, g(v) = a0 + a1 exp(−√(|v|/v0))):
//! LuGre ż = v − s|v|z/(N g(v)), F = s z; modified: the same with g at the slip v − ż, F = s z;
//! series: block (k, c) before LuGre bristles, F = s z.
//! The sensor shows F r as it is, or behind a chain of two second-order low-passes.

/// What rubs.
#[derive(Debug, Clone, Copy)]
pub enum Law {
    /// Bristles of stiffness `s` (N/m).
    Lugre {
        /// Bristle stiffness, N/m.
        s: f64,
    },
    /// Bristles of stiffness `s`, curve taken at the slip.
    Modified {
        /// Bristle stiffness, N/m.
        s: f64,
    },
    /// A block before the bristles.
    Series {
        /// Bristle stiffness, N/m.
        s: f64,
        /// Block stiffness, N/m.
        k: f64,
        /// Block damping, N·s/m.
        c: f64,
    },
}

/// Curve of steady sliding.
#[derive(Debug, Clone, Copy)]
pub struct Curve {
    /// Limit at high speed.
    pub a0: f64,
    /// Excess at standstill.
    pub a1: f64,
    /// Speed scale, m/s.
    pub v0: f64,
}

impl Curve {
    fn at(&self, v: f64) -> f64 {
        self.a0 + self.a1 * (-(v.abs() / self.v0).sqrt()).exp()
    }
}

/// A sensor of two second-order low-passes in a row, each (frequency in Hz, damping ratio).
pub type Sensor = [(f64, f64); 2];

/// One sample of the log.
#[derive(Debug, Clone, Copy)]
pub struct Sample {
    /// Time, s.
    pub time: f64,
    /// Disc speed, rad/s.
    pub speed: f64,
    /// Load, N.
    pub load: f64,
    /// Friction torque as the sensor shows it, N·m.
    pub torque: f64,
    /// Motor torque, N·m.
    pub motor: f64,
}

/// Radius of the contact, m.
pub const RADIUS: f64 = 0.05;
const INERTIA: f64 = 0.015;
const VISCOUS: f64 = 0.004;
const ACTUATOR: (f64, f64) = (100.0, 0.3);
const STEP: f64 = 2e-6;

/// The wanted speed (rad/s) and load (N) over time: a start under light load, a load step, a faster
/// stretch, a reversal, a stop.
fn wanted(t: f64) -> (f64, f64) {
    let speed = match t {
        t if t < 0.2 => 0.0,
        t if t < 1.0 => 1.5,
        t if t < 1.6 => 6.0,
        t if t < 2.3 => -2.5,
        _ => 0.0,
    };
    (speed, if t < 0.5 { 25.0 } else { 80.0 })
}

/// speed, load, its rate, bristles, block, controller's integral, four states of the sensor
type State = [f64; 10];

struct Rig {
    law: Law,
    curve: Curve,
    sensor: Option<Sensor>,
}

impl Rig {
    fn motor(y: &State, target: f64) -> f64 {
        (1.2 * (target - y[0]) + y[5]).clamp(-8.0, 8.0)
    }

    fn friction(&self, y: &State) -> f64 {
        match self.law {
            Law::Lugre { s } | Law::Modified { s } | Law::Series { s, .. } => s * y[3],
        }
    }

    fn rates(&self, t: f64, y: &State) -> State {
        let (target, pressed) = wanted(t);
        let mut d = [0.0; 10];
        let force = self.friction(y);
        let motor = Self::motor(y, target);
        d[0] = (motor - force * RADIUS - VISCOUS * y[0]) / INERTIA;
        let w = std::f64::consts::TAU * ACTUATOR.0;
        d[1] = y[2];
        d[2] = w * w * (pressed - y[1]) - 2.0 * ACTUATOR.1 * w * y[2];
        let (load, v) = (y[1].max(1e-9), y[0] * RADIUS);
        match self.law {
            Law::Lugre { s } => d[3] = v - s * v.abs() * y[3] / (load * self.curve.at(v)),
            Law::Modified { s } => d[3] = v - self.slip(s * y[3] * v.abs() / load),
            Law::Series { s, k, c } => {
                d[4] = (s * y[3] - k * y[4]) / c;
                let tip = v - d[4];
                d[3] = tip - s * tip.abs() * y[3] / (load * self.curve.at(tip));
            }
        }
        d[5] = 40.0 * (target - y[0]);
        if let Some([first, second]) = self.sensor {
            let mut input = force;
            for (at, (hz, damping)) in [(6, first), (8, second)] {
                let w = std::f64::consts::TAU * hz;
                d[at] = y[at + 1];
                d[at + 1] = w * w * (input - y[at]) - 2.0 * damping * w * y[at + 1];
                input = y[at];
            }
        }
        d
    }

    /// x with x·g(x) = q, by bisection to rounding.
    fn slip(&self, q: f64) -> f64 {
        let size = q.abs();
        let (mut low, mut high) = (size / (self.curve.a0 + self.curve.a1), size / self.curve.a0);
        let mut x = low;
        for _ in 0..60 {
            // Newton with the slope of a straight chord is enough here: x g(x) bends little.
            let next = x - (x * self.curve.at(x) - size) / self.curve.a0.max(self.curve.at(x));
            let next = if next > low && next < high { next } else { 0.5 * (low + high) };
            if next * self.curve.at(next) > size {
                high = next
            } else {
                low = next
            }
            if (next - x).abs() <= 1e-15 * size || high - low <= 1e-15 * high {
                break;
            }
            x = next;
        }
        x.copysign(q)
    }
}

/// A log of 2.6 s; `keep` chooses the (even) microseconds that are sampled.
pub fn record(law: Law, curve: Curve, sensor: Option<Sensor>, keep: impl Fn(u64) -> bool) -> Vec<Sample> {
    let rig = Rig { law, curve, sensor };
    let mut y = [0.0; 10];
    y[1] = 25.0;
    let mut samples = Vec::new();
    for i in 0..1_300_000_u64 {
        let t = i as f64 * STEP;
        if keep(2 * i) {
            let shown = if sensor.is_some() { y[8] } else { rig.friction(&y) };
            let (target, _) = wanted(t);
            samples.push(Sample {
                time: t,
                speed: y[0],
                load: y[1].max(0.0),
                torque: shown * RADIUS,
                motor: Rig::motor(&y, target),
            });
        }
        let k1 = rig.rates(t, &y);
        let k2 = rig.rates(t, &add(&y, &k1, 0.5 * STEP));
        let k3 = rig.rates(t, &add(&y, &k2, 0.5 * STEP));
        let k4 = rig.rates(t, &add(&y, &k3, STEP));
        for j in 0..10 {
            y[j] += STEP / 6.0 * (k1[j] + 2.0 * (k2[j] + k3[j]) + k4[j]);
        }
    }
    samples
}

fn add(y: &State, d: &State, by: f64) -> State {
    std::array::from_fn(|i| y[i] + by * d[i])
}
