//! What joins motor and disc: a spring, or a spring with play, and its numbers.
//!
//! T_s = k (x + β x³) + d x′(φ) φ̇ over the twist φ, with the overlap
//!
//! x = φ + ½ √((φ − b)² + ε²) − ½ √((φ + b)² + ε²)
//!
//! b half of the play, ε its rounding: for ε = 0 the dead zone, in which the coupling neither drags nor pulls; without play φ
//! itself. β is Duffing's (G. Duffing, *Erzwungene Schwingungen*, 1918): rubber and clutch springs take more than in proportion.

use std::f64::consts::TAU;

use nalgebra::DMatrix;

use super::evidence::{BALANCE_SHARE, log_occam};

/// Modes that the balance's filter lets through, Hz.
const HERTZ: [f64; 2] = [4.0, 150.0];
/// From a steel shaft's to one beyond which nothing swings.
const DAMPING_RATIO: [f64; 2] = [0.003, 1.5];
/// Neither motor nor disc is all of the inertia.
const DISC_SHARE: [f64; 2] = [0.1, 0.9];
/// From the width of some counts of an encoder to a loose key's.
const GAP_RAD: [f64; 2] = [1e-4, 0.3];
/// A coupling bends by no more than this many times what is plain, by half of it as a rule (deviation of the prior), and is
/// looked for from a tenth.
const MOST_BEND: f64 = 10.0;
const BEND_SD: f64 = 0.5;
const FIRST_BEND: f64 = 0.1;

/// Numbers of a coupling.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Coupling {
    /// Frequency of the disc on the spring, the motor held.
    pub mode_hz: f64,
    /// Damping ratio of that mode.
    pub damping_ratio: f64,
    /// The disc's share of the inertia.
    pub disc_share: f64,
    /// Width of the dead zone.
    pub gap_rad: f64,
    /// How it bends, a ratio: without play by how much more than in proportion a spring takes at the twist that it would have
    /// under the usual torque, with play the rounding over half of that.
    pub bend: f64,
}

/// Torque over the twist, and what it acts between.
pub struct Law {
    /// Inertia of the motor.
    pub motor_inertia: f64,
    /// Inertia of the disc.
    pub disc_inertia: f64,
    /// Frequency of the disc on the spring, the motor held, rad/s.
    pub omega_rad_s: f64,
    /// k.
    pub stiffness: f64,
    /// b.
    pub half_gap: f64,
    damping: f64,
    rounding: f64,
    hardening_per_rad2: f64,
}

impl Law {
    fn overlap(&self, twist: f64) -> f64 {
        let (b, e) = (self.half_gap, self.rounding);
        if e > 0.0 {
            twist + 0.5 * ((twist - b).hypot(e) - (twist + b).hypot(e))
        } else {
            (twist.abs() - b).max(0.0).copysign(twist)
        }
    }

    /// Slope of the overlap.
    pub fn slope(&self, twist: f64) -> f64 {
        let (b, e) = (self.half_gap, self.rounding);
        if e > 0.0 {
            1.0 + 0.5 * ((twist - b) / (twist - b).hypot(e) - (twist + b) / (twist + b).hypot(e))
        } else {
            f64::from(u8::from(twist.abs() > b || b == 0.0))
        }
    }

    /// T_s.
    pub fn torque(&self, twist: f64, rate: f64) -> f64 {
        let x = self.overlap(twist);
        let carried = self.stiffness * x * (1.0 + self.hardening_per_rad2 * x * x)
            + self.damping * self.slope(twist) * rate;
        // What touches does not pull.
        if self.half_gap > 0.0 && carried * x < 0.0 { 0.0 } else { carried }
    }
}

impl Coupling {
    /// A spring without play that takes in proportion.
    pub fn spring(mode_hz: f64, damping_ratio: f64, disc_share: f64) -> Self {
        Self { mode_hz, damping_ratio, disc_share, gap_rad: 0.0, bend: 0.0 }
    }

    /// The same that bends a little.
    pub fn bent(&self) -> Self {
        Self { bend: FIRST_BEND, ..*self }
    }

    /// Its law where motor and disc have this inertia together.
    pub fn law(&self, inertia: f64, usual_torque: f64) -> Law {
        let omega = TAU * self.mode_hz;
        let disc_inertia = self.disc_share * inertia;
        let stiffness = disc_inertia * omega * omega;
        let half_gap = 0.5 * self.gap_rad;
        let hardening = if self.gap_rad > 0.0 { 0.0 } else { self.bend };
        Law {
            motor_inertia: inertia - disc_inertia,
            disc_inertia,
            omega_rad_s: omega,
            stiffness,
            half_gap,
            damping: 2.0 * self.damping_ratio * disc_inertia * omega,
            rounding: self.bend * half_gap,
            hardening_per_rad2: hardening * (stiffness / usual_torque.max(1e-12)).powi(2),
        }
    }

    /// Whether a coupling may have these numbers.
    pub fn is_allowed(&self) -> bool {
        let within = |[low, high]: [f64; 2], value: f64| (low..high).contains(&value);
        within(HERTZ, self.mode_hz)
            && within(DAMPING_RATIO, self.damping_ratio)
            && within(DISC_SHARE, self.disc_share)
            && (self.gap_rad == 0.0 || within(GAP_RAD, self.gap_rad))
            && within([0.0, MOST_BEND], self.bend)
    }

    /// Which coupling, in words.
    pub fn words(&self) -> String {
        format!("{:.0} Hz, gap {:.2e} rad, bend {:.2}", self.mode_hz, self.gap_rad, self.bend)
    }

    /// Its law's numbers, with their names.
    pub fn constants(&self, law: &Law) -> Vec<(String, f64)> {
        let always = [
            ("stiffness_nm_per_rad", law.stiffness),
            ("damping_nm_s_per_rad", law.damping),
            ("disc_inertia_kg_m2", law.disc_inertia),
            ("mode_hz", self.mode_hz),
        ];
        let own = [
            ("gap_rad", self.gap_rad),
            ("gap_rounding_rad", law.rounding),
            ("hardening_per_rad2", law.hardening_per_rad2),
        ];
        let own = own.into_iter().filter(|(_, value)| *value > 0.0);
        always.into_iter().chain(own).map(|(name, value)| (name.to_string(), value)).collect()
    }

    /// The coupling that has these numbers.
    pub fn of_constants(constants: &[(String, f64)], inertia: f64, usual_torque: f64) -> Self {
        let get = |name: &str| constants.iter().find(|(key, _)| key == name).map_or(0.0, |(_, value)| *value);
        let (stiffness, mode_hz, gap_rad) = (get("stiffness_nm_per_rad"), get("mode_hz"), get("gap_rad"));
        let bend = if gap_rad > 0.0 {
            get("gap_rounding_rad") / (0.5 * gap_rad)
        } else {
            get("hardening_per_rad2") * (usual_torque / stiffness.max(1e-12)).powi(2)
        };
        Self {
            mode_hz,
            damping_ratio: get("damping_nm_s_per_rad") * std::f64::consts::PI * mode_hz
                / stiffness.max(1e-12),
            disc_share: get("disc_inertia_kg_m2") / inertia,
            gap_rad,
            bend,
        }
    }

    /// What is fitted: logarithms, so that a step is a ratio, and how it bends, which is a ratio.
    pub fn fitted(&self) -> Vec<f64> {
        let always = [self.mode_hz, self.damping_ratio, self.disc_share].map(f64::ln);
        let gap = (self.gap_rad > 0.0).then(|| self.gap_rad.ln());
        always.into_iter().chain(gap).chain((self.bend > 0.0).then_some(self.bend)).collect()
    }

    /// A coupling of the same kind with these values.
    pub fn with(&self, p: &[f64]) -> Self {
        let (gap, bend) = (self.gap_rad > 0.0, self.bend > 0.0);
        Self {
            mode_hz: p[0].exp(),
            damping_ratio: p[1].exp(),
            disc_share: p[2].exp(),
            gap_rad: if gap { p[3].exp() } else { 0.0 },
            bend: if bend { p[p.len() - 1] } else { 0.0 },
        }
    }

    /// Occam's factor of the numbers, as a logarithm: logarithms are equally likely between their ends, which is told by a normal
    /// prior of the same deviation.
    pub fn log_occam(&self, curvature: &DMatrix<f64>) -> f64 {
        let even = |[low, high]: [f64; 2]| (high / low).ln() / 12f64.sqrt();
        let always = [even(HERTZ), even(DAMPING_RATIO), even(DISC_SHARE)];
        let gap = (self.gap_rad > 0.0).then(|| even(GAP_RAD));
        let sd: Vec<f64> =
            always.into_iter().chain(gap).chain((self.bend > 0.0).then_some(BEND_SD)).collect();
        log_occam(curvature, BALANCE_SHARE, &sd)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const USUAL_NM: f64 = 2.0;

    fn play(bend: f64) -> Coupling {
        Coupling { gap_rad: 0.02, bend, ..Coupling::spring(50.0, 0.05, 0.6) }
    }

    #[test]
    fn its_constants_tell_all_of_it() {
        for coupling in
            [Coupling::spring(20.0, 0.1, 0.5), Coupling::spring(20.0, 0.1, 0.5).bent(), play(0.0), play(0.7)]
        {
            let constants = coupling.constants(&coupling.law(0.6, USUAL_NM));
            let told = Coupling::of_constants(&constants, 0.6, USUAL_NM);
            let (told, own) = (told.fitted(), coupling.fitted());
            assert_eq!(told.len(), own.len());
            assert!(told.iter().zip(&own).all(|(a, b)| (a - b).abs() < 1e-9), "{told:?} {own:?}");
            assert_eq!(coupling.with(&own).fitted().len(), own.len());
        }
    }

    #[test]
    fn a_spring_that_hardens_takes_its_bend_more_at_the_usual_torque() {
        let spring = Coupling { bend: 0.3, ..Coupling::spring(20.0, 0.1, 0.5) };
        let law = spring.law(0.02, USUAL_NM);
        let twist = USUAL_NM / law.stiffness;
        assert!((law.torque(twist, 0.0) - 1.3 * USUAL_NM).abs() < 1e-9);
        assert!((law.torque(-twist, 0.0) + 1.3 * USUAL_NM).abs() < 1e-9);
    }

    #[test]
    fn rounded_play_is_the_dead_zone_far_from_its_ends_and_its_slope_is_that_of_its_overlap() {
        let [sharp, round] = [play(0.0), play(0.2)].map(|coupling| coupling.law(0.02, USUAL_NM));
        assert_eq!([sharp.torque(0.009, 1.0), sharp.torque(-0.009, -1.0)], [0.0, 0.0]);
        assert!((sharp.torque(0.03, 0.0) - 0.02 * sharp.stiffness).abs() < 1e-9);
        assert!((round.torque(0.2, 0.0) / sharp.torque(0.2, 0.0) - 1.0).abs() < 1e-3);
        // Nothing pulls.
        assert_eq!(sharp.torque(0.0101, -100.0), 0.0);
        for twist in [-0.03, -0.01, 0.0, 0.004, 0.011] {
            let slope = (round.overlap(twist + 1e-6) - round.overlap(twist - 1e-6)) / 2e-6;
            assert!((round.slope(twist) - slope).abs() < 1e-6, "{twist}");
        }
    }
}
