//! Effects that no diagnosis is asked to name, chosen so that no nameable one does the same.

use serde::Serialize;

use crate::laws::slide::Slide;
use crate::random::Stream;

/// 50 Hz and its third harmonic in the friction channel.
#[derive(Debug, Clone, Serialize)]
pub struct Hum {
    amplitude_nm: f64,
    third_share: f64,
    #[serde(skip)]
    phase: f64,
}

impl Hum {
    /// Draws one.
    pub fn draw(s: &mut Stream) -> Self {
        Self { amplitude_nm: s.uniform(0.1, 0.25), third_share: s.uniform(0.1, 0.3), phase: 0.0 }
    }

    pub(crate) fn begin_log(&mut self, s: &mut Stream) {
        self.phase = s.phase();
    }

    /// Torque read though there is none.
    #[must_use]
    pub fn at(&self, time_s: f64) -> f64 {
        let turn = std::f64::consts::TAU * 50.0 * time_s + self.phase;
        self.amplitude_nm * (turn.sin() + self.third_share * (3.0 * turn).sin())
    }
}

/// µ jumps between two values at random times, unlike in each log.
#[derive(Debug, Clone, Serialize)]
pub struct Telegraph {
    share: f64,
    mean_stay_s: f64,
    #[serde(skip)]
    times: Vec<f64>,
}

impl Telegraph {
    /// Draws one.
    pub fn draw(s: &mut Stream) -> Self {
        Self { share: s.uniform(0.07, 0.13), mean_stay_s: s.uniform(1.2, 2.5), times: Vec::new() }
    }

    pub(crate) fn begin_log(&mut self, s: &mut Stream, duration_s: f64) {
        self.times.clear();
        let mut time = s.uniform(0.0, self.mean_stay_s);
        if s.chance(0.5) {
            self.times.push(-1.0);
        }
        while time < duration_s {
            self.times.push(time);
            time += -self.mean_stay_s * (1.0 - s.uniform(0.0, 1.0)).ln() + 0.3;
        }
    }

    /// Factor on µ.
    #[must_use]
    pub fn factor(&self, slide: &Slide) -> f64 {
        let jumps = self.times.iter().take_while(|time| **time <= slide.time_s).count();
        if jumps % 2 == 0 { 1.0 + self.share } else { 1.0 - self.share }
    }
}

/// µ swings at a rhythm of its own.
#[derive(Debug, Clone, Serialize)]
pub struct Breathing {
    share: f64,
    frequency_hz: f64,
    #[serde(skip)]
    phase: f64,
}

impl Breathing {
    /// Draws one.
    pub fn draw(s: &mut Stream) -> Self {
        Self { share: s.uniform(0.07, 0.13), frequency_hz: s.uniform(0.25, 0.8), phase: 0.0 }
    }

    pub(crate) fn begin_log(&mut self, s: &mut Stream) {
        self.phase = s.phase();
    }

    /// Factor on µ.
    #[must_use]
    pub fn factor(&self, slide: &Slide) -> f64 {
        let turn = std::f64::consts::TAU * self.frequency_hz * slide.time_s + self.phase;
        1.0 + self.share * turn.sin()
    }
}

/// µ falls while the disc's speed changes, the same for speeding up and slowing down:
/// 1 − κ |a|/(a0 + |a|), with a short memory.
#[derive(Debug, Clone, Serialize)]
pub struct Shaken {
    share: f64,
    half_m_s2: f64,
    memory_s: f64,
    #[serde(skip)]
    last_speed: Option<f64>,
    #[serde(skip)]
    shaking: f64,
}

impl Shaken {
    /// Draws one.
    pub fn draw(s: &mut Stream) -> Self {
        Self {
            share: s.uniform(0.3, 0.45),
            half_m_s2: s.uniform(0.6, 1.2),
            memory_s: s.uniform(0.02, 0.05),
            last_speed: None,
            shaking: 0.0,
        }
    }

    /// Factor on µ.
    pub fn factor(&mut self, slide: &Slide) -> f64 {
        let last = self.last_speed.replace(slide.root_speed_m_s).unwrap_or(slide.root_speed_m_s);
        let acceleration = (slide.root_speed_m_s - last) / slide.step_s;
        self.shaking += slide.step_s / self.memory_s * (acceleration - self.shaking);
        let size = self.shaking.abs();
        1.0 - self.share * size / (self.half_m_s2 + size)
    }
}

/// µ grows with the distance since the last reversal and starts again at the next one; a stop
/// without a reversal changes nothing.
#[derive(Debug, Clone, Serialize)]
pub struct Memory {
    share: f64,
    distance_m: f64,
    #[serde(skip)]
    since_m: f64,
}

impl Memory {
    /// Draws one.
    pub fn draw(s: &mut Stream) -> Self {
        Self { share: s.signed(0.15, 0.28), distance_m: s.uniform(0.3, 0.7), since_m: 0.0 }
    }

    /// Factor on µ.
    pub fn factor(&mut self, slide: &Slide) -> f64 {
        // A reversal counts after 2 mm: less is the block springing to and fro.
        let moved = slide.step_s * slide.tip_speed_m_s;
        if moved * self.since_m < 0.0 {
            self.since_m =
                if self.since_m.abs() > 2e-3 { self.since_m.signum() * 2e-3 } else { self.since_m };
        }
        self.since_m += moved;
        1.0 + self.share * (1.0 - (-self.since_m.abs() / self.distance_m).exp())
    }
}

/// Run-out of the disc's face: normal force A sin(φ + ψ) + B sin(2φ + χ), φ the disc's own angle.
#[derive(Debug, Clone, Serialize)]
pub struct Wobble {
    first_n: f64,
    first_phase: f64,
    second_n: f64,
    second_phase: f64,
}

impl Wobble {
    /// Draws one.
    pub fn draw(s: &mut Stream) -> Self {
        Self {
            first_n: s.uniform(2.5, 5.0),
            first_phase: s.phase(),
            second_n: s.uniform(0.5, 2.0),
            second_phase: s.phase(),
        }
    }

    /// Extra normal force.
    #[must_use]
    pub fn at(&self, disc_angle_rad: f64) -> f64 {
        self.first_n * (disc_angle_rad + self.first_phase).sin()
            + self.second_n * (2.0 * disc_angle_rad + self.second_phase).sin()
    }
}

/// The glue under the normal bridge's gauges: the reading follows a change of load at once in part,
/// the rest comes over seconds.
#[derive(Debug, Clone, Serialize)]
pub struct Creep {
    share: f64,
    time_s: f64,
    #[serde(skip)]
    late_n: f64,
}

impl Creep {
    /// Draws one.
    pub fn draw(s: &mut Stream) -> Self {
        Self { share: s.uniform(0.08, 0.15), time_s: s.uniform(0.8, 2.0), late_n: 0.0 }
    }

    /// What is read of a normal force.
    pub fn read(&mut self, normal_n: f64, step_s: f64) -> f64 {
        self.late_n += step_s / self.time_s * (normal_n - self.late_n);
        normal_n + self.share * (self.late_n - normal_n)
    }
}

/// µ wanders: e^(w), w an Ornstein–Uhlenbeck process (G. E. Uhlenbeck, L. S. Ornstein, Phys. Rev. 36, 1930; random
/// friction in R. A. Ibrahim, Appl. Mech. Rev. 47, 1994), another in each log.
#[derive(Debug, Clone, Serialize)]
pub struct Wander {
    share: f64,
    memory_s: f64,
    #[serde(skip)]
    path: Vec<f64>,
}

/// Step of the wandering.
const WANDER_STEP_S: f64 = 0.02;

impl Wander {
    /// Draws one.
    pub fn draw(s: &mut Stream) -> Self {
        Self { share: s.uniform(0.07, 0.13), memory_s: s.uniform(0.5, 1.5), path: Vec::new() }
    }

    pub(crate) fn begin_log(&mut self, s: &mut Stream, duration_s: f64) {
        let keep = (-WANDER_STEP_S / self.memory_s).exp();
        let kick = self.share * (1.0 - keep * keep).sqrt();
        let mut value = self.share * s.normal();
        self.path = (0..=(duration_s / WANDER_STEP_S) as usize + 1)
            .map(|_| {
                value = keep * value + kick * s.normal();
                value
            })
            .collect();
    }

    /// Factor on µ.
    #[must_use]
    pub fn factor(&self, slide: &Slide) -> f64 {
        let at = slide.time_s / WANDER_STEP_S;
        let from = at as usize;
        let value = |i: usize| self.path.get(i).copied().unwrap_or(0.0);
        (value(from) + (value(from + 1) - value(from)) * at.fract()).exp()
    }
}

/// A plug of the friction bridge that loses part of the signal for tenths of a second, at random times, others
/// in each log.
#[derive(Debug, Clone, Serialize)]
pub struct LoosePlug {
    lost_share: f64,
    mean_pause_s: f64,
    #[serde(skip)]
    spells: Vec<(f64, f64)>,
}

impl LoosePlug {
    /// Draws one.
    pub fn draw(s: &mut Stream) -> Self {
        Self { lost_share: s.uniform(0.2, 0.4), mean_pause_s: s.uniform(0.8, 1.6), spells: Vec::new() }
    }

    pub(crate) fn begin_log(&mut self, s: &mut Stream, duration_s: f64) {
        self.spells.clear();
        let mut time = s.uniform(0.0, self.mean_pause_s);
        while time < duration_s {
            let length = s.uniform(0.1, 0.35);
            self.spells.push((time, time + length));
            time += length - self.mean_pause_s * (1.0 - s.uniform(0.0, 1.0)).ln();
        }
    }

    /// Factor on what the bridge reads.
    #[must_use]
    pub fn factor(&self, time_s: f64) -> f64 {
        let next = self.spells.partition_point(|(start, _)| *start <= time_s);
        let inside = next > 0 && time_s < self.spells[next - 1].1;
        if inside { 1.0 - self.lost_share } else { 1.0 }
    }
}

/// Friction follows a change of the normal force only after some sliding: the share of the load that counts is
/// renewed over a distance (V. Prakash, J. Tribology 120, 1998: no jump of friction at a jump of load).
#[derive(Debug, Clone, Serialize)]
pub struct LoadMemory {
    distance_m: f64,
    share: f64,
    #[serde(skip)]
    remembered_n: Option<f64>,
}

impl LoadMemory {
    /// Draws one.
    pub fn draw(s: &mut Stream) -> Self {
        Self { distance_m: s.uniform(0.04, 0.12), share: s.uniform(0.5, 0.9), remembered_n: None }
    }

    /// Factor on µ.
    pub fn factor(&mut self, slide: &Slide) -> f64 {
        let remembered = self.remembered_n.get_or_insert(slide.normal_n);
        let renewed = 1.0 - (-slide.step_s * slide.tip_speed_m_s.abs() / self.distance_m).exp();
        *remembered += renewed * (slide.normal_n - *remembered);
        let felt = slide.normal_n + self.share * (*remembered - slide.normal_n);
        (felt / slide.normal_n.max(1.0)).clamp(0.3, 3.0)
    }
}
