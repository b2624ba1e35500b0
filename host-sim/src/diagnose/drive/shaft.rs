//! Motor and disc coupled by a shaft that twists, with or without a dead zone: what the disc does when
//! the motor moves as measured.
//!
//! Per unit of the disc's inertia: θ̈₂ = w − f(θ̇₂), w = s(θ₁ − θ₂) + b (θ̇₁ − θ̇₂). The motor then has to
//! deliver J₁ θ̈₁ + J₂ w, so w is a regressor. f is the disc's share of friction per inertia.
//! In a contact log the friction torque on the disc is a known load on its side.
//! A shaft alone: s = ω² x (1 + κ (x/x₀)²), x₀ the twist at the typical acceleration. With a gap β:
//! s = s₀ (d/x₀)ⁿ outside of it, d = |x| − β/2; n = 1 is a sharp flank, n = 1.5 a Hertzian contact, more
//! a rough or lubricated one; the damper acts in contact and never pulls.
//! With the encoder on the motor this simulation is driven by measured motion and cannot drift: the
//! spring ties the disc to it.
//! Semi-implicit Euler with steps that resolve the stiffest slope. Source: two-mass drives, e.g.
//! Schröder, Elektrische Antriebe; for the dead zone Nordin and Gutman (2002), Hunt and Crossley (1975).

use super::conditioned::DriveLog;
use crate::fit::bounds::Parameter;

/// Elastic part of the coupling, per inertia of the disc.
#[derive(Debug, Clone, Copy)]
pub enum Spring {
    /// No gap: ω² x (1 + κ (x/x₀)²).
    Shaft {
        /// ω², 1/s².
        stiffness: f64,
        /// κ/x₀².
        hardening: f64,
    },
    /// A gap: s₀ (d/x₀)ⁿ.
    Flanks {
        /// Half of the gap.
        half_gap: f64,
        /// s₀/x₀ⁿ.
        factor: f64,
        /// n.
        exponent: f64,
        /// Largest slope that is resolved.
        steepest: f64,
    },
}

/// Properties of the coupling.
#[derive(Debug, Clone, Copy)]
pub struct Shaft {
    /// Elastic part.
    pub spring: Spring,
    /// Damping over the disc's inertia, 1/s.
    pub damping: f64,
    /// Coulomb friction of the disc over its inertia.
    pub coulomb: f64,
    /// Viscous friction of the disc over its inertia.
    pub viscous: f64,
    /// 1 over the disc's inertia, for the friction torque that a contact log measures on it.
    pub per_inertia: f64,
}

/// What the disc does behind the shaft, at each sample of a log.
#[derive(Debug, Clone, Default)]
pub struct Behind {
    /// The shaft's torque less the measured friction, over the disc's inertia.
    pub torque_per_inertia: Vec<f64>,
    /// Angle of the disc less that of the motor.
    pub offset: Vec<f64>,
}

/// Steps are at most this share of 1/ω.
const STEP_SHARE: f64 = 0.25;

/// Most steps in a sample; a stiffer flank is taken for the stiffest that they resolve.
const MOST_STEPS: f64 = 10.0;

impl Spring {
    /// The strain at which it pulls with `torque` (over the disc's inertia).
    fn strain_of(&self, torque: f64) -> f64 {
        match *self {
            Self::Shaft { stiffness, .. } => torque / stiffness,
            Self::Flanks { half_gap, factor, exponent, .. } => {
                if torque == 0.0 {
                    0.0
                } else {
                    (half_gap + (torque.abs() / factor).powf(1.0 / exponent)).copysign(torque)
                }
            }
        }
    }

    fn pull(&self, strain: f64) -> f64 {
        match *self {
            Self::Shaft { stiffness, hardening } => {
                stiffness * strain * (1.0 + hardening * strain * strain).max(0.2)
            }
            Self::Flanks { half_gap, factor, exponent, .. } => {
                let depth = strain.abs() - half_gap;
                if depth <= 0.0 { 0.0 } else { (factor * depth.powf(exponent)).copysign(strain) }
            }
        }
    }

    fn steepest(&self) -> f64 {
        match *self {
            Self::Shaft { stiffness, .. } => 2.0 * stiffness,
            Self::Flanks { steepest, .. } => steepest,
        }
    }

    fn has_gap(&self) -> bool {
        matches!(self, Self::Flanks { .. })
    }
}

impl Shaft {
    /// What the disc does when the motor moves as in a log.
    pub fn follow(&self, log: &DriveLog) -> Behind {
        let step_s = log.record.step_s;
        let rate = self.spring.steepest().sqrt().max(self.damping);
        let splits = (rate * step_s / STEP_SHARE).ceil().clamp(1.0, MOST_STEPS);
        let h = step_s / splits;
        let gap = self.spring.has_gap();
        let (Some(&first), Some(&speed)) = (log.position.first(), log.speed.first()) else {
            return Behind::default();
        };
        let rubbing = log.contact.as_ref().map(|contact| contact.friction.as_slice());
        // Settled under the friction at the first sample.
        let load = rubbing.map_or(0.0, |friction| self.per_inertia * friction[0]);
        let (mut x, mut v) = (first - self.spring.strain_of(load), speed);
        let mut torque = vec![0.0; log.len()];
        let mut offset = vec![x - first; log.len()];
        for i in 1..log.len() {
            let (p0, p1) = (log.position[i - 1], log.position[i]);
            let (s0, s1) = (log.speed[i - 1], log.speed[i]);
            // Cubic through both ends' positions and speeds.
            let (a, b) = (step_s * s0 - (p1 - p0), (p1 - p0) - step_s * s1);
            let (load0, load1) = rubbing.map_or((0.0, 0.0), |friction| {
                (self.per_inertia * friction[i - 1], self.per_inertia * friction[i])
            });
            let mut w = 0.0;
            for k in 1..=splits as usize {
                let t = k as f64 / splits;
                let motor = p0 + t * (p1 - p0) + t * (1.0 - t) * (a * (1.0 - t) + b * t);
                let motor_speed = s0 + t * (s1 - s0);
                let strain = motor - x;
                let pull = self.spring.pull(strain);
                offset[i] = -strain;
                w = pull + self.damping * (motor_speed - v);
                if gap && w * pull <= 0.0 {
                    w = 0.0;
                }
                // Coulomb friction cannot turn the disc around within a step.
                // Leapfrog: motor, pull and load belong to the end of the step, speed to its middle.
                let load = load0 + t * (load1 - load0);
                let free = v + h * (w - load - self.viscous * v);
                let stop = h * self.coulomb;
                v = if free.abs() <= stop { 0.0 } else { free - stop.copysign(free) };
                x += h * v;
            }
            // The measured friction is taken off the effort elsewhere.
            torque[i] = w - rubbing.map_or(0.0, |friction| self.per_inertia * friction[i]);
        }
        Behind { torque_per_inertia: torque, offset }
    }
}

/// Root mean square of a log's acceleration where it counts: the typical torque over inertia.
pub fn typical_acceleration(logs: &[&DriveLog]) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0);
    for log in logs {
        for (a, w) in log.acceleration.iter().zip(&log.weight) {
            sum += w * a * a;
            count += w;
        }
    }
    (sum / f64::max(count, 1.0)).sqrt().max(1e-12)
}

/// In contact logs the friction acts on the disc alone, so the disc's share of the inertia matters.
pub fn add_motor_share(logs: &[&DriveLog], shapes: &mut Vec<Parameter>, starts: &mut [Vec<f64>]) {
    if logs.iter().any(|log| log.contact.is_some()) {
        shapes.push(Parameter::linear("motor_inertia_share", 0.4, 0.05, 0.95));
        starts.iter_mut().for_each(|start| start.push(0.4));
    }
}

/// 1 over the disc's inertia for the motor's share of the whole.
pub fn disc_per_inertia(motor_share: Option<&f64>, inertia: f64) -> f64 {
    motor_share.map_or(0.0, |share| 1.0 / ((1.0 - share) * inertia))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::analysis::Role;
    use crate::fit::drive::inverse::Motion;
    use crate::fit::drive::record::DriveRecord;

    #[test]
    fn a_slow_swing_twists_the_shaft_by_torque_over_stiffness() {
        // 1 Hz against a resonance of 40 Hz: the disc follows, and lags by its own inertia's torque.
        let (step_s, omega) = (1e-3, std::f64::consts::TAU);
        let swing = |t: f64| 0.5 * (omega * t).sin();
        let position: Vec<f64> = (0..5000).map(|i| swing(step_s * f64::from(i))).collect();
        let record = DriveRecord { start_s: 0.0, step_s, effort: vec![0.0; 5000], position };
        let log = DriveLog::from_record(record, None, Motion::Rotary, Role::Train);
        let stiffness = (40.0 * std::f64::consts::TAU).powi(2);
        let shaft = Shaft {
            spring: Spring::Shaft { stiffness, hardening: 0.0 },
            damping: 0.4 * stiffness.sqrt(),
            coulomb: 0.0,
            viscous: 0.0,
            per_inertia: 0.0,
        };
        let behind = shaft.follow(&log);
        for i in (1000..4500).step_by(131) {
            // θ₂ − θ₁ = −θ̈₂/ω₀², here 3.1e-4 rad at most; the disc's own swing is larger by (ω/ω₀)².
            let expected = omega * omega * swing(step_s * i as f64) / stiffness;
            // The damper sees speeds half a step apart: 0.2·2ω₀·h/2 of 20 rad/s² over ω₀², 2.5 % of the largest.
            assert!((behind.offset[i] - expected).abs() < 1.2e-5, "{i} {} {expected}", behind.offset[i]);
        }
    }
}
