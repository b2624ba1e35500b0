//! Laws of M2, its shaft and its bearing. They serve the rotary drive and the linear stage.

use serde::Serialize;

use crate::laws::Setting;
use crate::random::Stream;

/// Size of the drive's quantities relative to the rotary one: a linear stage moves 10 mm where the
/// rotary drive turns 1 rad, and pushes 80 N where it turns with 1 N·m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Units {
    /// Torque or force per N·m.
    pub torque: f64,
    /// Angle or length per rad.
    pub travel: f64,
}

impl Units {
    /// The rotary drive.
    pub const ROTARY: Self = Self { torque: 1.0, travel: 1.0 };
    /// The linear stage.
    pub const LINEAR: Self = Self { torque: 80.0, travel: 0.01 };
}

/// Motor and disc joined by a shaft: torque k φ (1 + ε (φ/φ_r)²) + c φ̇; with play, φ is replaced by
/// φ − b tanh(φ/b), which is flat in the middle and has smooth ends, and the dashpot works only
/// outside the play.
#[derive(Debug, Clone, Serialize)]
pub struct Coupling {
    /// Share of the inertia on the motor's side.
    pub motor_share: f64,
    /// Stiffness.
    pub stiffness: f64,
    /// Damping.
    pub damping: f64,
    /// Hardening at the reference twist.
    pub hardening: f64,
    /// Reference twist.
    pub reference: f64,
    /// Half of the play.
    pub play: f64,
}

impl Coupling {
    fn of(s: &mut Stream, setting: &Setting<'_>, frequency_hz: f64, ratio: f64, play: f64) -> Self {
        let units = setting.units;
        let inertia = setting.rig.inertia_kg_m2 * units.torque / units.travel;
        let motor_share = s.uniform(0.25, 0.45);
        let reduced = inertia * motor_share * (1.0 - motor_share);
        let omega = std::f64::consts::TAU * frequency_hz;
        let stiffness = reduced * omega * omega;
        Self {
            motor_share,
            stiffness,
            damping: 2.0 * ratio * omega * reduced,
            hardening: s.uniform(0.0, 0.2),
            reference: 5.0 * units.torque / stiffness,
            play: play * units.travel,
        }
    }

    /// A soft shaft.
    pub fn torsion(s: &mut Stream, setting: &Setting<'_>) -> Self {
        let (frequency, ratio) = (s.uniform(18.0, 45.0), s.uniform(0.03, 0.07));
        Self::of(s, setting, frequency, ratio, 0.0)
    }

    /// A stiff coupling with play.
    pub fn backlash(s: &mut Stream, setting: &Setting<'_>) -> Self {
        let (frequency, ratio) = (s.uniform(60.0, 95.0), s.uniform(0.08, 0.15));
        let play = s.uniform(0.012, 0.035);
        Self::of(s, setting, frequency, ratio, play)
    }

    /// Torque that the shaft carries.
    #[must_use]
    pub fn torque(&self, twist: f64, twist_rate: f64) -> f64 {
        let (bent, open) = if self.play > 0.0 {
            let inside = (twist / self.play).tanh();
            (twist - self.play * inside, inside * inside)
        } else {
            (twist, 1.0)
        };
        let ratio = bent / self.reference;
        self.stiffness * bent * (1.0 + self.hardening * ratio * ratio) + open * self.damping * twist_rate
    }

    /// Soft shaft and play in one: the softer stiffness with the play.
    #[must_use]
    pub fn joined(torsion: Option<&Self>, backlash: Option<&Self>) -> Option<Self> {
        match (torsion, backlash) {
            (Some(t), Some(b)) => Some(Self { play: b.play, ..t.clone() }),
            (Some(one), None) | (None, Some(one)) => Some(one.clone()),
            (None, None) => None,
        }
    }
}

/// Cogging: Σ A_k w(n_k θ + ψ_k), where w is a sine pressed towards a triangle or a square.
#[derive(Debug, Clone, Serialize)]
pub struct Ripple {
    /// (order per rad, amplitude, phase)
    waves: Vec<(f64, f64, f64)>,
    press: f64,
}

impl Ripple {
    /// Draws one.
    pub fn draw(s: &mut Stream, units: Units) -> Self {
        let mut orders = [4.0, 6.0, 8.0, 10.0, 12.0];
        s.shuffle(&mut orders);
        let count = 1 + s.below(2);
        let waves = orders[..count]
            .iter()
            .map(|order| (order / units.travel, s.uniform(0.1, 0.22) * units.torque, s.phase()))
            .collect();
        Self { waves, press: s.uniform(-0.3, 0.5) }
    }

    /// Torque at an angle of the motor.
    #[must_use]
    pub fn at(&self, angle: f64) -> f64 {
        let wave = |turn: f64| {
            let (sine, cosine) = turn.sin_cos();
            sine / (1.0 + self.press * cosine * cosine).sqrt()
        };
        self.waves.iter().map(|(order, amplitude, phase)| amplitude * wave(order * angle + phase)).sum()
    }
}

/// Drag that differs by direction.
#[derive(Debug, Clone, Serialize)]
pub struct Uneven {
    /// Share of the Coulomb part, + for positive speed.
    pub coulomb_share: f64,
    /// Extra viscous part, + for positive speed.
    pub viscous: f64,
}

impl Uneven {
    /// Draws one. The viscous part is never small: an uneven Coulomb part alone is a torque offset.
    pub fn draw(s: &mut Stream, units: Units) -> Self {
        Self {
            coulomb_share: s.signed(0.2, 0.45),
            viscous: s.signed(0.011, 0.02) * units.torque / units.travel,
        }
    }
}

/// Drag that falls with speed (D. P. Hess, A. Soom, J. Tribology 112, 1990):
/// extra/(1 + (ω/ω_s)²) on top of the Coulomb part.
#[derive(Debug, Clone, Serialize)]
pub struct Falling {
    /// Extra drag at rest.
    pub extra: f64,
    /// Speed scale.
    pub speed: f64,
}

impl Falling {
    /// Draws one.
    pub fn draw(s: &mut Stream, units: Units) -> Self {
        Self { extra: s.uniform(0.18, 0.35) * units.torque, speed: s.log_uniform(0.5, 2.0) * units.travel }
    }
}

/// Iwan's chain (W. D. Iwan, J. Appl. Mech. 33, 1966): springs in parallel, each with a slider of its
/// own; together they yield over a range of travel.
#[derive(Debug, Clone, Serialize)]
pub struct Yielding {
    /// (yield travel, share of the drag)
    pub sliders: Vec<(f64, f64)>,
    /// Factor on the Coulomb drag of the rig.
    pub stronger: f64,
    #[serde(skip)]
    state: Vec<f64>,
}

impl Yielding {
    /// Draws one.
    pub fn draw(s: &mut Stream, units: Units) -> Self {
        let reach = s.log_uniform(0.04, 0.12) * units.travel;
        let weights: Vec<f64> = (0..5).map(|_| s.uniform(0.5, 1.5)).collect();
        let sum: f64 = weights.iter().sum();
        let sliders =
            weights.iter().enumerate().map(|(i, w)| (reach * (0.12 + 0.22 * i as f64), w / sum)).collect();
        Self { sliders, stronger: s.uniform(1.8, 2.6), state: vec![0.0; 5] }
    }

    /// Drag as a share of the Coulomb drag, after moving on by `travel`.
    pub fn share(&mut self, travel: f64) -> f64 {
        let mut sum = 0.0;
        for ((limit, weight), state) in self.sliders.iter().zip(&mut self.state) {
            *state = (*state + travel).clamp(-limit, *limit);
            sum += weight * *state / limit;
        }
        sum
    }
}
