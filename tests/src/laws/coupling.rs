//! Motor and disc joined by a shaft (`shaft_torsion`) or with play (`backlash`); φ is the twist.
//!
//! Shaft:
//! - linear: k φ + c φ̇ (two-mass system: G. Zhang, J. Furusho, IEEE Trans. Ind. Electron. 47, 2000);
//! - hardening: k φ (1 + ε (φ/φ_r)²) + c φ̇ (rubber in a coupling; E. J. Nestorides, *A Handbook on Torsional
//!   Vibration*, 1958);
//! - damped by hysteresis: k φ + c φ̇ / (1 + |φ̇|/φ̇_r), a damper that gives way (elastomers: loss that hardly
//!   grows with rate; ibid.);
//! - reserved, two stages: a soft stage, then a stiff one, with a rounded bend (clutch dampers: Nestorides 1958).
//!
//! Play, b its half width:
//! - dead zone: k (φ − b) beyond b, dashpot only in contact, no pull (M. Nordin, J. Galić, P.-O. Gutman, Int. J.
//!   Adapt. Control 11, 1997);
//! - smooth: φ replaced by φ − b tanh(φ/b), dashpot open in the middle;
//! - greased: dead zone, and inside it a film of grease that drags with c_g φ̇ (M. Nordin, P.-O. Gutman,
//!   Automatica 38, 2002);
//! - reserved, impact: k_h δ^1.5 (1 + λ δ̇), δ the overlap, by Hertz with losses (K. H. Hunt, F. R. E. Crossley,
//!   J. Appl. Mech. 42, 1975).

use serde::Serialize;

use crate::laws::Setting;
use crate::random::Stream;

#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(tag = "law", rename_all = "snake_case")]
enum Shaft {
    Linear,
    Hardening { hardening: f64, reference: f64 },
    GivingDamper { rate: f64 },
    TwoStages { soft_share: f64, bend: f64 },
}

#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(tag = "play_law", rename_all = "snake_case")]
enum Gap {
    None,
    DeadZone,
    Smooth,
    Greased { drag_share: f64 },
    Impact { loss_s_per_unit: f64 },
}

/// A coupling.
#[derive(Debug, Clone, Serialize)]
pub struct Coupling {
    #[serde(flatten)]
    shaft: Shaft,
    #[serde(flatten)]
    gap: Gap,
    /// Share of the inertia on the motor's side.
    pub motor_share: f64,
    /// Stiffness.
    pub stiffness: f64,
    /// Damping.
    pub damping: f64,
    /// Half of the play.
    pub play: f64,
}

impl Coupling {
    fn of(s: &mut Stream, setting: &Setting<'_>, frequency_hz: f64, ratio: f64) -> Self {
        let units = setting.units;
        let inertia = setting.rig.inertia_kg_m2 * units.torque / units.travel;
        let motor_share = s.uniform(0.25, 0.45);
        let reduced = inertia * motor_share * (1.0 - motor_share);
        let omega = std::f64::consts::TAU * frequency_hz;
        Self {
            shaft: Shaft::Linear,
            gap: Gap::None,
            motor_share,
            stiffness: reduced * omega * omega,
            damping: 2.0 * ratio * omega * reduced,
            play: 0.0,
        }
    }

    /// A soft shaft of 18 to 60 Hz.
    pub fn torsion(s: &mut Stream, setting: &Setting<'_>) -> Self {
        let (frequency, ratio) = (s.log_uniform(18.0, 60.0), s.log_uniform(0.02, 0.08));
        let plain = Self::of(s, setting, frequency, ratio);
        // Twist under the torque of a slide.
        let twist = 4.0 * setting.units.torque / plain.stiffness;
        let shaft = match setting.family.pick(s, &[0, 1, 2], 3) {
            0 => Shaft::Linear,
            1 => Shaft::Hardening { hardening: s.uniform(0.05, 0.3), reference: twist },
            2 => Shaft::GivingDamper { rate: s.uniform(0.5, 2.0) * twist * frequency },
            _ => Shaft::TwoStages { soft_share: s.uniform(0.4, 0.75), bend: s.uniform(0.3, 0.7) * twist },
        };
        Self { shaft, ..plain }
    }

    /// A stiff coupling with play of 0.3 to 2 degrees.
    pub fn backlash(s: &mut Stream, setting: &Setting<'_>) -> Self {
        let (frequency, ratio) = (s.uniform(60.0, 110.0), s.uniform(0.05, 0.2));
        let plain = Self::of(s, setting, frequency, ratio);
        let play = s.log_uniform(0.005, 0.035) * setting.units.travel;
        let gap = match setting.family.pick(s, &[0, 1, 2], 3) {
            0 => Gap::DeadZone,
            1 => Gap::Smooth,
            2 => Gap::Greased { drag_share: s.uniform(0.01, 0.05) },
            _ => Gap::Impact { loss_s_per_unit: s.uniform(0.2, 0.6) / setting.units.travel },
        };
        Self { gap, play, ..plain }
    }

    /// Torque that the coupling carries.
    #[must_use]
    pub fn torque(&self, twist: f64, rate: f64) -> f64 {
        let overlap = (twist.abs() - self.play).max(0.0).copysign(twist);
        let damped = self.damping * rate;
        let in_contact = |torque: f64| if torque * twist > 0.0 { torque } else { 0.0 };
        match self.gap {
            Gap::None => self.shaft_torque(twist, rate),
            Gap::DeadZone if overlap == 0.0 => 0.0,
            Gap::DeadZone => in_contact(self.shaft_torque(overlap, rate)),
            Gap::Smooth => {
                let inside = (twist / self.play).tanh();
                let bent = twist - self.play * inside;
                self.shaft_torque(bent, inside * inside * rate)
            }
            Gap::Greased { drag_share } if overlap == 0.0 => drag_share * damped,
            Gap::Greased { drag_share } => in_contact(self.shaft_torque(overlap, rate)) + drag_share * damped,
            Gap::Impact { loss_s_per_unit } => {
                // Of Hertz' form, as stiff as k at an overlap of half the play.
                let scale = 0.5 * self.play;
                let elastic = self.stiffness * overlap.abs().powf(1.5) / scale.sqrt();
                let size = elastic * (1.0 + loss_s_per_unit * rate * overlap.signum());
                if overlap == 0.0 { 0.0 } else { size.max(0.0).copysign(overlap) }
            }
        }
    }

    fn shaft_torque(&self, twist: f64, rate: f64) -> f64 {
        let (k, damped) = (self.stiffness, self.damping * rate);
        match self.shaft {
            Shaft::Linear => k * twist + damped,
            Shaft::Hardening { hardening, reference } => {
                k * twist * (1.0 + hardening * (twist / reference).powi(2)) + damped
            }
            Shaft::GivingDamper { rate: giving } => k * twist + damped / (1.0 + rate.abs() / giving),
            Shaft::TwoStages { soft_share, bend } => {
                let beyond = 0.5 * (twist.abs() - bend + (twist.abs() - bend).hypot(0.1 * bend));
                let at_rest = 0.5 * (-bend + bend.hypot(0.1 * bend));
                k * (soft_share * twist + (1.0 - soft_share) * (beyond - at_rest).copysign(twist)) + damped
            }
        }
    }

    /// Soft shaft and play in one: the softer stiffness with the play.
    #[must_use]
    pub fn joined(torsion: Option<&Self>, backlash: Option<&Self>) -> Option<Self> {
        match (torsion, backlash) {
            (Some(t), Some(b)) => Some(Self { play: b.play, gap: b.gap, ..t.clone() }),
            (Some(one), None) | (None, Some(one)) => Some(one.clone()),
            (None, None) => None,
        }
    }
}
