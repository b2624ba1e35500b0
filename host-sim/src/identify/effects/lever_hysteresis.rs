//! `lever_hysteresis`: normal force lags M1 torque by a Coulomb band.

use super::stops::{Stops, coarse, stop};
use super::waves::travel;
use super::{About, Effect, NormalLoadLog, NormalLoadView};
use crate::identify::balance::Alternative;

/// The effect.
pub(super) struct LeverHysteresis;

/// The forms, by the usual size of what is lagged.
const FORCE: &str = "usual_force_n";
const CARRIED: &str = "usual_carried_force_n";
const TORQUE: &str = "usual_torque_nm";
/// Shortest width of the play, in shares of the usual force or torque; the longest, of what it goes over: a wider one slides both
/// ways on less than half of it, and is a spring.
const SHORTEST: f64 = 0.01;
const LONGEST: f64 = 0.25;

/// What lags.
type Signal = fn(&NormalLoadLog) -> &[f64];

impl Effect for LeverHysteresis {
    fn about(&self) -> About {
        About {
            id: "lever_hysteresis",
            meaning: "the normal force lags M1's torque by a Coulomb band",
            experiment: "ramp M1's torque slowly up and down, in loops of three sizes",
        }
    }

    fn normal_load(&self, view: &NormalLoadView<'_>) -> Vec<Alternative> {
        let s = view.scales;
        // The joints yield with the force that they carry, or with the torque before them: the force rings after a step,
        // the torque does not. Each swing of a ring slips in the joints, and the force's noise hides it: the torque has less, and
        // says how the force rings.
        let over = |form: &str, [unit, within]: [&'static str; 2], usual: f64, signal: Signal| {
            // A stop remembers peaks: noise makes some, and a filter that is the same everywhere cuts those that are.
            let column = |width: f64| {
                view.logs.iter().flat_map(|log| log.filtered(&stop(signal(log), width))).collect()
            };
            let stops = Stops {
                effect: self.id(),
                size: 0.5 * s.torque_nm,
                units: [unit, "nm"],
                column: &column,
                deflection: Some(within),
            };
            let found = match view.fixed {
                Some(fixed) => stops.of_constants(fixed),
                None => {
                    let goes_over = view.logs.iter().map(|log| travel(signal(log).iter().copied()));
                    let longest = LONGEST * goes_over.fold(usual, f64::max);
                    stops.searched(view.balance, view.company, &coarse([SHORTEST * usual, longest]))
                }
            };
            let mut constants = found.constants;
            // Which of the forms, as a constant: held-out logs take the one that was found.
            constants.push((form.into(), usual));
            Alternative { form: form.into(), constants, ..found }
        };
        let wanted = |form: &str| view.fixed.is_none_or(|fixed| fixed.iter().any(|(name, _)| name == form));
        let mut all = Vec::new();
        if wanted(FORCE) {
            all.push(over(FORCE, ["n", "force within the band, N"], s.load_n, |log| &log.smoothed_n));
        }
        if wanted(CARRIED) {
            let words = ["n", "carried force within the band, N"];
            all.push(over(CARRIED, words, s.load_n, |log| &log.carried_n));
        }
        if wanted(TORQUE) {
            let words = ["nm", "torque within the band, N m"];
            all.push(over(TORQUE, words, s.torque_nm, |log| &log.smoothed_torque_nm));
        }
        all
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::files::log::Log;
    use crate::files::rig_file::RigFile;
    use crate::files::signal::Signal;
    use crate::identify::balance::Company;
    use crate::identify::contact::log::ContactLog;
    use crate::identify::noise::tests::white;
    use crate::identify::normal_load::{NormalLoadScales, balance};

    const COUNT: usize = 12_000;
    const STEPS_PER_SAMPLE: usize = 20;

    /// Joints that slip in each swing of the ring after a step of the torque (Dahl 1968), and a noisy bridge.
    fn log(rig: &RigFile) -> Log {
        let h = 1e-3 / STEPS_PER_SAMPLE as f64;
        let omega = std::f64::consts::TAU * rig.pressure.mode_hz;
        let (mut torque, mut force, mut rate, mut joints) = (2.0, 50.0, 0.0, 0.0f64);
        let level = |i: usize| 1.0 + 0.5 * ((i / 300 * 7) % 9) as f64 * 0.5;
        let (mut torques, mut forces) = (Vec::new(), Vec::new());
        let noise = white(COUNT, 1).into_iter().zip(white(COUNT, 2));
        for (i, (of_torque, of_force)) in noise.enumerate() {
            for _ in 0..STEPS_PER_SAMPLE {
                torque += h / rig.m1.torque_lag_s * (level(i) - torque);
                let moved = rate * h;
                let kept = (-moved.abs() / 5.0).exp();
                joints = joints * kept + moved.signum() * (1.0 - kept);
                let carries = rig.lever_gain_n_per_nm * torque - rig.preload_n - 5.0 * joints;
                rate += h * omega * (omega * (carries - force) - 2.0 * rig.pressure.damping_ratio * rate);
                force += h * rate;
            }
            torques.push(torque + 0.002 * of_torque);
            forces.push(force + 0.5 * of_force);
        }
        let mut log = Log::default();
        log.set_signal(Signal::Time, (0..COUNT).map(|i| 1e-3 * i as f64).collect());
        log.set_signal(Signal::M2Speed, vec![5.0; COUNT]);
        log.set_signal(Signal::M1Torque, torques);
        log.set_signal(Signal::NormalForce, forces);
        log.set_signal(Signal::FrictionTorque, vec![2.0; COUNT]);
        log
    }

    #[test]
    fn joints_slip_in_the_ring_that_the_torque_tells_and_noise_hides() {
        let rig = RigFile::assumed_rig(&[]).unwrap();
        let contact = ContactLog::new(&log(&rig), &rig).unwrap();
        let logs = [NormalLoadLog::new(&contact, &rig).unwrap()];
        let scales = NormalLoadScales::new(&logs);
        let balance = balance(&logs, &rig, &scales);
        let residual = balance.solve(&[], &[]).residual;
        let company = Company { forms: &[], residual: &residual };
        let view =
            NormalLoadView { logs: &logs, scales: &scales, balance: &balance, company, fixed: None };
        let left = LeverHysteresis.normal_load(&view).into_iter().map(|form| {
            let solved = balance.solve_forms(&[&form]);
            (form.form, balance.rms(&solved.residual) / balance.rms(&residual))
        });
        let left: Vec<(String, f64)> = left.collect();
        let of = |form: &str| left.iter().find(|(known, _)| known == form).unwrap().1;
        // A quarter less than with either of what is measured.
        assert!(of(CARRIED) < 0.75 * of(FORCE).min(of(TORQUE)), "{left:?}");
    }
}
