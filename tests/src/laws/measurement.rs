//! Laws of the bridges: crosstalk, drift, a ring that is softer than stated.
//!
//! Crosstalk (`bridge_crosstalk`), what the friction bridge reads of the normal force F:
//! - linear: κ F (gauge misaligned by an angle: K. Hoffmann, *An Introduction to Measurements using Strain
//!   Gages*, 1989);
//! - bent: κ F (1 + ε F/100 N), the lever arm moves under load;
//! - preloaded: κ F beyond a seat of some newtons, κ (√(F² + F_s²) − F_s);
//! - reserved, saturating: κ F_s tanh(F/F_s), the frame comes to rest on a stop.
//!
//! Drift (`bridge_drift`), of zero or gain of either bridge, all 0 at the start of a log:
//! - warm-up: A (1 − e^(−t/τ)) and a slow straight part (self-heating of a bridge, Hoffmann 1989);
//! - straight: A t (change of the room's temperature);
//! - creep: A ((1 + t/τ)^p − 1), p from 0.3 to 0.6 (gauge adhesive: power law of creep, E. N. da C. Andrade,
//!   Proc. R. Soc. A 84, 1910);
//! - reserved, room: A (sin(2πt/P + ψ) − sin ψ), P from 25 to 80 s (a thermostat's cycle).
//!
//! Ring (`ring_resonance`), the true mode where the rig file states another:
//! - low: less than half of the stated frequency, hardly damped (elements clamped loosely);
//! - soft: 0.2 to 0.35 of the stated frequency with the damping stated (a mass forgotten);
//! - reserved, doublet: the mode is split in two, some per cent apart (C. H. J. Fox, J. Sound Vib. 142, 1990:
//!   slightly imperfect rings);
//! - undamped: 0.25 to 0.45 of it, ζ from 0.002 to 0.006 (bare steel).

use serde::Serialize;

use crate::laws::Setting;
use crate::laws::family::{LawFamily, size};
use crate::random::Stream;

#[derive(Debug, Clone, Copy, Serialize)]
#[serde(tag = "law", rename_all = "snake_case")]
enum Leak {
    Linear,
    Bent { curvature: f64 },
    Preloaded { seat_n: f64 },
    Saturating { stop_n: f64 },
}

/// What the friction bridge reads of the normal force.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct Crosstalk {
    #[serde(flatten)]
    leak: Leak,
    gain_nm_per_n: f64,
}

impl Crosstalk {
    /// Draws one: its size of 3 N·m at 60 N.
    pub fn draw(s: &mut Stream, family: LawFamily) -> Self {
        let gain_nm_per_n = s.sign() * size(s) * 3.0 / 60.0;
        let leak = match family.pick(s, &[0, 1, 2], 3) {
            0 => Leak::Linear,
            1 => Leak::Bent { curvature: s.uniform(-0.3, 0.3) },
            2 => Leak::Preloaded { seat_n: s.uniform(3.0, 15.0) },
            _ => Leak::Saturating { stop_n: s.uniform(40.0, 100.0) },
        };
        Self { leak, gain_nm_per_n }
    }

    /// Torque read at a normal force.
    #[must_use]
    pub fn at(&self, normal_n: f64) -> f64 {
        self.gain_nm_per_n
            * match self.leak {
                Leak::Linear => normal_n,
                Leak::Bent { curvature } => normal_n * (1.0 + curvature * normal_n / 100.0),
                Leak::Preloaded { seat_n } => normal_n.hypot(seat_n) - seat_n,
                Leak::Saturating { stop_n } => stop_n * (normal_n / stop_n).tanh(),
            }
    }
}

/// Which bridge drifts, and how.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Drifting {
    /// Zero of the friction bridge.
    FrictionZero,
    /// Gain of the friction bridge.
    FrictionGain,
    /// Zero of the normal bridge.
    NormalZero,
    /// Gain of the normal bridge.
    NormalGain,
}

#[derive(Debug, Clone, Copy, Serialize)]
#[serde(tag = "law", rename_all = "snake_case")]
enum Course {
    WarmUp { warm_up_s: f64, straight_per_s: f64 },
    Straight { per_s: f64 },
    Creep { scale_s: f64, power: f64, share: f64 },
    Room { period_s: f64, phase_rad: f64 },
}

/// A drift.
#[derive(Debug, Clone, Serialize)]
pub struct Drift {
    what: Drifting,
    #[serde(flatten)]
    course: Course,
    size: f64,
}

impl Drift {
    /// Draws one for logs of this length.
    pub fn draw(s: &mut Stream, family: LawFamily, setting: &Setting<'_>) -> Self {
        let what = s.pick(&[
            Drifting::FrictionZero,
            Drifting::FrictionGain,
            Drifting::NormalZero,
            Drifting::NormalGain,
        ]);
        let size = s.sign()
            * size(s)
            * match what {
                Drifting::FrictionZero => 3.0,
                Drifting::FrictionGain | Drifting::NormalGain => 1.0,
                Drifting::NormalZero => 0.6 * setting.greatest_normal_n,
            };
        let duration = setting.duration_s;
        // Each form is scaled so that its RMS over a log is about the size.
        let (course, size) = match family.pick(s, &[0, 1, 2], 3) {
            0 => {
                let warm_up_s = duration * s.uniform(0.2, 0.7);
                (Course::WarmUp { warm_up_s, straight_per_s: s.uniform(0.0, 0.4) / duration }, 1.4 * size)
            }
            1 => (Course::Straight { per_s: 1.0 / duration }, 1.7 * size),
            2 => {
                let (scale_s, power) = (duration * s.uniform(0.02, 0.1), s.uniform(0.3, 0.6));
                (
                    Course::Creep { scale_s, power, share: (1.0 + duration / scale_s).powf(power) - 1.0 },
                    1.5 * size,
                )
            }
            _ => (Course::Room { period_s: s.uniform(25.0, 80.0), phase_rad: s.phase() }, 1.2 * size),
        };
        Self { what, course, size }
    }

    /// What drifts.
    #[must_use]
    pub fn what(&self) -> Drifting {
        self.what
    }

    /// How far it has drifted.
    #[must_use]
    pub fn at(&self, time_s: f64) -> f64 {
        self.size
            * match self.course {
                Course::WarmUp { warm_up_s, straight_per_s } => {
                    1.0 - (-time_s / warm_up_s).exp() + straight_per_s * time_s
                }
                Course::Straight { per_s } => per_s * time_s,
                Course::Creep { scale_s, power, share } => {
                    ((1.0 + time_s / scale_s).powf(power) - 1.0) / share
                }
                Course::Room { period_s, phase_rad } => {
                    (std::f64::consts::TAU * time_s / period_s + phase_rad).sin() - phase_rad.sin()
                }
            }
    }
}

#[derive(Debug, Clone, Copy, Serialize)]
#[serde(rename_all = "snake_case")]
enum RingLaw {
    Low,
    Soft,
    Undamped,
    Doublet,
}

/// The torque ring's true mode.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct Ring {
    law: RingLaw,
    /// Frequency.
    pub mode_hz: f64,
    /// Damping ratio.
    pub damping_ratio: f64,
    /// Relative distance of the second mode of a doublet, and its share; 0 for none.
    pub split: f64,
    /// Share of the second mode.
    pub second_share: f64,
}

impl Ring {
    /// Draws one that a log of this rate can show.
    pub fn draw(s: &mut Stream, setting: &Setting<'_>) -> Self {
        let high = (0.36 * setting.rate_hz).min(280.0);
        let stated = setting.rig.friction_bridge.map_or((600.0, 0.025), |b| (b.mode_hz, b.damping_ratio));
        let law = setting.family.pick(s, &[RingLaw::Low, RingLaw::Soft, RingLaw::Undamped], RingLaw::Doublet);
        let (hz, damping_ratio) = match law {
            RingLaw::Low => (s.uniform(0.3, 0.6) * high, s.log_uniform(6e-3, 1.5e-2)),
            RingLaw::Soft => (s.uniform(0.2, 0.35) * stated.0, stated.1),
            RingLaw::Undamped => (s.uniform(0.25, 0.45) * stated.0, s.log_uniform(2e-3, 6e-3)),
            RingLaw::Doublet => (s.uniform(0.3, 0.7) * high, s.log_uniform(6e-3, 1.5e-2)),
        };
        let doublet = matches!(law, RingLaw::Doublet);
        let (split, second_share) = (s.uniform(0.04, 0.12), s.uniform(0.2, 0.5));
        Self {
            law,
            mode_hz: hz.min(high),
            damping_ratio,
            split: if doublet { split } else { 0.0 },
            second_share: if doublet { second_share } else { 0.0 },
        }
    }
}
