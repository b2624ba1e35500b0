//! Effects that no diagnosis is asked to name, chosen so that no nameable one does the same.

use serde::Serialize;

use crate::laws::friction::Slide;
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
