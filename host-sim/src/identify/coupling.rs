//! What joins motor and disc, or the motor and the load of a linear stage: a spring, or a spring with play, and its numbers.
//!
//! Play: T_s = k x + d x′(φ) φ̇ over the twist φ, with the overlap
//!
//! x = φ − b φ / (|φ|^p + b^p)^(1/p)
//!
//! b half of the play, 1/p its rounding: for 1/p = 0 the dead zone, in which the coupling neither drags nor pulls. However round
//! it is, it carries nothing in its middle (x′(0) = 0): what does is a spring.
//!
//! Spring: T_s = k (x + β x³) + d φ̇ with x = φ, and β of Duffing (G. Duffing, *Erzwungene Schwingungen*, 1918): rubber takes
//! more than in proportion; or in two stages, as clutch springs do (E. J. Nestorides, *A Handbook on Torsional Vibration*, 1958):
//! x = κ φ + (1 − κ) × the overlap with a dead zone, κ the share of the soft stage in the stiffness.

use std::f64::consts::TAU;

use nalgebra::DMatrix;

use super::evidence::{BALANCE_SHARE, log_occam};

/// Modes that the balance's filter lets through, Hz.
const HERTZ: [f64; 2] = [4.0, 150.0];
/// From a steel shaft's to several times a rubber coupling's (relative damping ψ of 0.8 to 1.2, DIN 740, is ζ = ψ/4π): beyond it
/// nothing swings that would tell a coupling from a lag.
const DAMPING_RATIO: [f64; 2] = [0.003, 0.5];
/// Neither motor nor disc is all of the inertia.
const DISC_SHARE: [f64; 2] = [0.1, 0.9];
/// From what only wobbles to a loose key's, in plays (`play`).
const PLAYS: [f64; 2] = [0.025, 75.0];
/// Play narrower than this share of the twist by the usual torque is none: the spring makes the motion.
const LEAST_PLAY: f64 = 0.1;
/// Share of a soft stage: less is play, more is one stage.
const SOFT_SHARE: [f64; 2] = [0.02, 0.98];
/// Rounding of play: at 1 it is felt all over the gap.
const MOST_ROUNDING: f64 = 1.0;
/// A coupling bends by no more than this many times what is plain, by half of it as a rule (deviation of the prior), and is
/// looked for from a tenth.
const MOST_BEND: f64 = 10.0;
const BEND_SD: f64 = 0.5;
const FIRST_BEND: f64 = 0.1;

/// Names of a coupling's numbers: of a rotary drive's, and of a linear stage's.
const STIFFNESS: Name = ["stiffness_nm_per_rad", "stiffness_n_per_m"];
const DAMPING: Name = ["damping_nm_s_per_rad", "damping_n_s_per_m"];
const DISC_INERTIA: Name = ["disc_inertia_kg_m2", "load_mass_kg"];
const GAP: Name = ["gap_rad", "gap_m"];
const SOFT_STAGE: Name = ["soft_stage_rad", "soft_stage_m"];
const HARDENING: Name = ["hardening_per_rad2", "hardening_per_m2"];
/// Name of the share of the bearing's torque that the disc bears.
const BEARING_ON_DISC: &str = "bearing_on_disc_share";

/// A number's name where the motion is a turn, and where it is a way.
type Name = [&'static str; 2];

/// What a coupling is part of.
#[derive(Debug, Clone, Copy)]
pub struct Machine {
    /// Inertia or mass of motor and disc together.
    pub inertia: f64,
    /// Usual torque or force.
    pub effort: f64,
    /// Whether the motion is a turn.
    pub rotary: bool,
}

impl Machine {
    /// How far the usual effort moves all of the inertia while a mode in the middle of those that are looked for turns by 1 rad:
    /// what play is measured in, since a machine that plays by much less does not feel it, whatever it is made of.
    pub fn play(&self) -> f64 {
        self.effort / (self.inertia * TAU * HERTZ[0] * TAU * HERTZ[1])
    }

    fn named(&self, name: Name) -> &'static str {
        name[usize::from(!self.rotary)]
    }
}

/// Numbers of a coupling.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Coupling {
    /// Frequency of the disc on the spring, the motor held.
    pub mode_hz: f64,
    /// Damping ratio of that mode.
    pub damping_ratio: f64,
    /// The disc's share of the inertia.
    pub disc_share: f64,
    /// Width of the dead zone, or of the soft stage, rad or m.
    pub gap: f64,
    /// How it bends, a ratio: without play by how much more than in proportion a spring takes at the twist that it would have
    /// under the usual torque, with play its rounding.
    pub bend: f64,
    /// Share of the soft stage in the stiffness; 0 where there is none.
    pub soft_share: f64,
    /// Whether the bearing carries the disc; else the motor.
    pub bearing_on_disc: bool,
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
    /// Share of the bearing's torque on the disc.
    pub bearing_on_disc: f64,
    damping: f64,
    rounding: f64,
    soft_share: f64,
    hardening: f64,
}

impl Law {
    /// Twist beyond the play, and its slope.
    fn overlap(&self, twist: f64) -> (f64, f64) {
        let b = self.half_gap;
        if b == 0.0 {
            return (twist, 1.0);
        }
        if self.rounding == 0.0 {
            let over = twist.abs() - b;
            return if over > 0.0 { (over.copysign(twist), 1.0) } else { (0.0, 0.0) };
        }
        // With the smaller one of the ratio and its inverse: no power of it overflows.
        let ratio = twist.abs() / b;
        let least = ratio.min(ratio.recip());
        // Quicker than powers, and as good: the torque is some 1e-15 of itself off.
        let power = (least.ln() / self.rounding).exp();
        let root = (-self.rounding * (1.0 + power).ln()).exp();
        let (held, slope) = if ratio < 1.0 { (ratio * root, 1.0) } else { (root, power / ratio) };
        (b * (ratio - held).copysign(twist), 1.0 - slope * root / (1.0 + power))
    }

    /// Share of the stiffness with which a further twist is met.
    pub fn slope(&self, twist: f64) -> f64 {
        self.soft_share + (1.0 - self.soft_share) * self.overlap(twist).1
    }

    /// T_s.
    pub fn torque(&self, twist: f64, rate: f64) -> f64 {
        let (overlap, slope) = self.overlap(twist);
        let x = self.soft_share * twist + (1.0 - self.soft_share) * overlap;
        let elastic = self.stiffness * x * (1.0 + self.hardening * x * x);
        if !self.is_play() {
            return elastic + self.damping * rate;
        }
        let carried = elastic + self.damping * slope * rate;
        // What touches does not pull.
        if carried * x < 0.0 { 0.0 } else { carried }
    }

    /// Whether there is a dead zone.
    pub fn is_play(&self) -> bool {
        self.half_gap > 0.0 && self.soft_share == 0.0
    }
}

impl Coupling {
    /// A spring without play that takes in proportion.
    pub fn spring(mode_hz: f64, damping_ratio: f64, disc_share: f64) -> Self {
        Self {
            mode_hz,
            damping_ratio,
            disc_share,
            gap: 0.0,
            bend: 0.0,
            soft_share: 0.0,
            bearing_on_disc: false,
        }
    }

    /// The same with the bearing on the motor's side of it, and on the disc's.
    pub fn borne_either_way(&self) -> [Self; 2] {
        [false, true].map(|bearing_on_disc| Self { bearing_on_disc, ..*self })
    }

    /// The same that bends a little.
    pub fn bent(&self) -> Self {
        Self { bend: FIRST_BEND, ..*self }
    }

    /// Springs of two stages to begin with whose torque is about this one's at the usual torque.
    pub fn in_stages(&self, machine: &Machine) -> Vec<Self> {
        let twist = machine.effort / self.law(machine).stiffness;
        // The second stage is the stiffer one: its mode is higher than that of both.
        let of = |share: f64| Self {
            mode_hz: 1.2 * self.mode_hz,
            gap: 2.0 * share * twist,
            soft_share: 0.5,
            ..*self
        };
        [0.25, 0.5, 1.0].map(of).to_vec()
    }

    /// Whether it has play.
    pub fn is_play(&self) -> bool {
        self.gap > 0.0 && self.soft_share == 0.0
    }

    /// Its law in this machine.
    pub fn law(&self, machine: &Machine) -> Law {
        let omega = TAU * self.mode_hz;
        let disc_inertia = self.disc_share * machine.inertia;
        let stiffness = disc_inertia * omega * omega;
        let half_gap = 0.5 * self.gap;
        let hardening = if self.gap > 0.0 { 0.0 } else { self.bend };
        Law {
            motor_inertia: machine.inertia - disc_inertia,
            disc_inertia,
            omega_rad_s: omega,
            stiffness,
            half_gap,
            bearing_on_disc: f64::from(u8::from(self.bearing_on_disc)),
            damping: 2.0 * self.damping_ratio * disc_inertia * omega,
            rounding: if self.is_play() { self.bend } else { 0.0 },
            soft_share: self.soft_share,
            hardening: hardening * (stiffness / machine.effort.max(1e-12)).powi(2),
        }
    }

    /// Whether a coupling of this machine may have these numbers.
    pub fn is_allowed(&self, machine: &Machine) -> bool {
        let least_play = LEAST_PLAY * machine.effort / self.law(machine).stiffness;
        let within = |[low, high]: [f64; 2], value: f64| (low..high).contains(&value);
        within(HERTZ, self.mode_hz)
            && within(DAMPING_RATIO, self.damping_ratio)
            && within(DISC_SHARE, self.disc_share)
            && (self.gap == 0.0 || within(PLAYS, self.gap / machine.play()))
            && (!self.is_play() || self.gap >= least_play)
            && (self.soft_share == 0.0 || within(SOFT_SHARE, self.soft_share))
            && within([0.0, if self.is_play() { MOST_ROUNDING } else { MOST_BEND }], self.bend)
    }

    /// Which coupling, in words.
    pub fn words(&self, machine: &Machine) -> String {
        let width = if self.soft_share > 0.0 { "soft stage" } else { "gap" };
        let unit = if machine.rotary { "rad" } else { "m" };
        format!("{:.0} Hz, {width} {:.2e} {unit}, bend {:.2}", self.mode_hz, self.gap, self.bend)
    }

    /// Its law's numbers in this machine, with their names.
    pub fn constants(&self, machine: &Machine) -> Vec<(String, f64)> {
        let law = self.law(machine);
        let always = [
            (machine.named(STIFFNESS), law.stiffness),
            (machine.named(DAMPING), law.damping),
            (machine.named(DISC_INERTIA), law.disc_inertia),
            ("mode_hz", self.mode_hz),
        ];
        let width = machine.named(if self.is_play() { GAP } else { SOFT_STAGE });
        let own = [
            (width, self.gap),
            ("gap_rounding", law.rounding),
            ("soft_stage_share", self.soft_share),
            (machine.named(HARDENING), law.hardening),
            (BEARING_ON_DISC, law.bearing_on_disc),
        ];
        let own = own.into_iter().filter(|(_, value)| *value > 0.0);
        always.into_iter().chain(own).map(|(name, value)| (name.to_string(), value)).collect()
    }

    /// The coupling that has these numbers.
    pub fn of_constants(constants: &[(String, f64)], machine: &Machine) -> Self {
        let get = |name: &str| constants.iter().find(|(key, _)| key == name).map_or(0.0, |(_, value)| *value);
        let of = |name: Name| get(machine.named(name));
        let (stiffness, mode_hz) = (of(STIFFNESS), get("mode_hz"));
        let hardening = of(HARDENING) * (machine.effort / stiffness.max(1e-12)).powi(2);
        Self {
            mode_hz,
            damping_ratio: of(DAMPING) * std::f64::consts::PI * mode_hz / stiffness.max(1e-12),
            disc_share: of(DISC_INERTIA) / machine.inertia,
            gap: of(GAP).max(of(SOFT_STAGE)),
            bend: get("gap_rounding").max(hardening),
            soft_share: get("soft_stage_share"),
            bearing_on_disc: get(BEARING_ON_DISC) > 0.0,
        }
    }

    /// What is fitted: logarithms, so that a step is a ratio, and what is a ratio.
    pub fn fitted(&self) -> Vec<f64> {
        let always = [self.mode_hz, self.damping_ratio, self.disc_share].map(f64::ln);
        let gap = (self.gap > 0.0).then(|| self.gap.ln());
        let ratios = [self.bend, self.soft_share].into_iter().filter(|ratio| *ratio > 0.0);
        always.into_iter().chain(gap).chain(ratios).collect()
    }

    /// A coupling of the same kind with these values.
    pub fn with(&self, p: &[f64]) -> Self {
        let mut more = p[3..].iter().copied();
        let mut own = |has: bool| if has { more.next().unwrap_or(0.0) } else { 0.0 };
        Self {
            mode_hz: p[0].exp(),
            damping_ratio: p[1].exp(),
            disc_share: p[2].exp(),
            gap: if self.gap > 0.0 { own(true).exp() } else { 0.0 },
            bend: own(self.bend > 0.0),
            soft_share: own(self.soft_share > 0.0),
            bearing_on_disc: self.bearing_on_disc,
        }
    }

    /// What their priors make of the numbers, as a logarithm: Occam's factor, and how far they are from what is usual. Logarithms are
    /// normal about the middle of what is allowed, with the deviation of one that is equally likely between its ends: what lies at
    /// the ends of several is no coupling but a lag, or a small mass that takes what another law leaves.
    pub fn log_prior(&self, curvature: &DMatrix<f64>, machine: &Machine) -> f64 {
        let deviation = |[low, high]: [f64; 2]| (high / low).ln() / 12f64.sqrt();
        let of = |range: [f64; 2], value: f64| {
            let sd = deviation(range);
            (sd, (value / (range[0] * range[1]).sqrt()).ln() / sd)
        };
        let always =
            [of(HERTZ, self.mode_hz), of(DAMPING_RATIO, self.damping_ratio), of(DISC_SHARE, self.disc_share)];
        let gap = (self.gap > 0.0).then(|| of(PLAYS, self.gap / machine.play()));
        let (mut sd, off): (Vec<f64>, Vec<f64>) = always.into_iter().chain(gap).unzip();
        sd.extend((self.bend > 0.0).then_some(BEND_SD));
        sd.extend((self.soft_share > 0.0).then(|| 12f64.sqrt().recip()));
        log_occam(curvature, BALANCE_SHARE, &sd) - 0.5 * off.iter().map(|off| off * off).sum::<f64>()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const USUAL_NM: f64 = 2.0;

    fn of_inertia(inertia: f64) -> Machine {
        Machine { inertia, effort: USUAL_NM, rotary: true }
    }

    fn play(bend: f64) -> Coupling {
        Coupling { gap: 0.02, bend, ..Coupling::spring(50.0, 0.05, 0.6) }
    }

    #[test]
    fn its_constants_tell_all_of_it() {
        for rotary in [true, false] {
            let machine = Machine { rotary, ..of_inertia(0.02) };
            let spring = Coupling::spring(20.0, 0.1, 0.5);
            let stages = spring.in_stages(&machine)[0];
            for coupling in [spring, spring.bent(), stages, play(0.0), play(0.7)] {
                let constants = coupling.constants(&machine);
                let of_turn = |name: &str| ["nm", "_rad", "kg_m2"].iter().any(|unit| name.contains(unit));
                assert_eq!(constants.iter().any(|(name, _)| of_turn(name)), rotary, "{constants:?}");
                let told = Coupling::of_constants(&constants, &machine);
                let (told, own) = (told.fitted(), coupling.fitted());
                assert_eq!(told.len(), own.len());
                assert!(told.iter().zip(&own).all(|(a, b)| (a - b).abs() < 1e-9), "{told:?} {own:?}");
                assert_eq!(coupling.with(&own).fitted(), own);
                assert!(coupling.is_allowed(&machine));
            }
        }
    }

    #[test]
    fn play_that_a_stiff_torque_does_not_feel_is_none() {
        // The twist by the usual torque is 0.0338 rad.
        let of_gap = |gap| Coupling { gap, ..Coupling::spring(10.0, 0.05, 0.5) };
        let twist = USUAL_NM / of_gap(0.01).law(&of_inertia(0.03)).stiffness;
        for (share, allowed) in [(0.05, false), (0.2, true)] {
            assert_eq!(of_gap(share * twist).is_allowed(&of_inertia(0.03)), allowed, "{share}");
        }
        // A soft stage is a spring's.
        assert!(Coupling { soft_share: 0.5, ..of_gap(0.05 * twist) }.is_allowed(&of_inertia(0.03)));
    }

    #[test]
    fn a_spring_that_hardens_takes_its_bend_more_at_the_usual_torque() {
        let spring = Coupling { bend: 0.3, ..Coupling::spring(20.0, 0.1, 0.5) };
        let law = spring.law(&of_inertia(0.02));
        let twist = USUAL_NM / law.stiffness;
        assert!((law.torque(twist, 0.0) - 1.3 * USUAL_NM).abs() < 1e-9);
        assert!((law.torque(-twist, 0.0) + 1.3 * USUAL_NM).abs() < 1e-9);
    }

    #[test]
    fn a_spring_of_two_stages_is_soft_and_then_stiff() {
        let stages = Coupling { gap: 0.02, soft_share: 0.4, ..Coupling::spring(20.0, 0.1, 0.5) };
        let law = stages.law(&of_inertia(0.02));
        assert!((law.torque(0.005, 0.0) / law.stiffness - 0.4 * 0.005).abs() < 1e-12);
        assert!((law.torque(-0.03, 0.0) / law.stiffness + 0.4 * 0.03 + 0.6 * 0.02).abs() < 1e-12);
        // It is a spring: it drags in its middle, and pulls.
        assert!(law.torque(0.001, -1.0) < 0.0 && !stages.is_play());
    }

    #[test]
    fn rounded_play_is_the_dead_zone_far_from_its_ends_and_carries_nothing_in_its_middle() {
        let [sharp, round] = [play(0.0), play(0.5)].map(|coupling| coupling.law(&of_inertia(0.02)));
        assert_eq!([sharp.torque(0.009, 1.0), sharp.torque(-0.009, -1.0)], [0.0, 0.0]);
        assert!((sharp.torque(0.03, 0.0) - 0.02 * sharp.stiffness).abs() < 1e-9);
        assert!((round.torque(0.5, 0.0) / sharp.torque(0.5, 0.0) - 1.0).abs() < 1e-3);
        assert!(round.torque(0.001, 0.0) < 0.01 * 0.001 * round.stiffness && round.torque(0.01, 0.0) > 0.0);
        // Nothing pulls.
        assert_eq!(sharp.torque(0.0101, -100.0), 0.0);
        for rounding in [0.02, 0.2, 0.5, 1.0] {
            let law = play(rounding).law(&of_inertia(0.02));
            for twist in [-0.03, -0.01001, 0.004, 0.00999, 0.011, 3.0] {
                let slope = (law.overlap(twist + 1e-7).0 - law.overlap(twist - 1e-7).0) / 2e-7;
                assert!((law.slope(twist) - slope).abs() < 1e-3, "{twist}: {} {slope}", law.slope(twist));
            }
        }
    }
}
