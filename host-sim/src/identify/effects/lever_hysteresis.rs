//! `lever_hysteresis`: normal force lags M1 torque by a Coulomb band.

use super::stops::{Stops, stop};
use super::waves::travel;
use super::{About, Effect, NormalLoadLog, NormalLoadView};
use crate::identify::balance::Alternative;
use crate::identify::filters::adaptively_smoothed;

/// The effect.
pub(super) struct LeverHysteresis;

/// The two forms, by what their widths are relative to.
const FORCE: &str = "usual_force_n";
const TORQUE: &str = "usual_torque_nm";
/// Shortest width of the play, in shares of the usual force or torque; the longest, of what it goes over: a wider one slides both
/// ways on less than half of it, and is a spring.
const SHORTEST: f64 = 0.01;
const LONGEST: f64 = 0.25;

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
        // the torque does not.
        let over = |form: &str, usual: f64, signal: &dyn Fn(&NormalLoadLog) -> (&[f64], f64)| {
            // A stop remembers peaks: noise makes some, and a filter that is the same everywhere cuts those that are.
            let denoised = |log: &NormalLoadLog| adaptively_smoothed(signal(log).0, signal(log).1);
            let signals: Vec<Vec<f64>> = view.logs.iter().map(denoised).collect();
            let column = |width: f64| {
                let of = |(log, signal): (&NormalLoadLog, &Vec<f64>)| log.filtered(&stop(signal, width));
                view.logs.iter().zip(&signals).flat_map(of).collect()
            };
            let goes_over = signals.iter().map(|signal| travel(signal.iter().copied())).fold(0.0, f64::max);
            let longest = LONGEST * goes_over.max(usual);
            let within = if form == FORCE { "force within the band, N" } else { "torque within the band, N m" };
            let stops = Stops {
                effect: self.id(),
                size: 0.5 * s.torque_nm,
                column: &column,
                deflection: Some(within),
            };
            let found = match view.fixed {
                Some(fixed) => stops.of_constants(fixed),
                None => stops.searched(view.balance, view.company, [SHORTEST * usual, longest]),
            };
            let mut constants = found.constants;
            // Which of the forms, as a constant: held-out logs take the one that was found.
            constants.push((form.into(), usual));
            Alternative { form: form.into(), constants, ..found }
        };
        let wanted = |form: &str| view.fixed.is_none_or(|fixed| fixed.iter().any(|(name, _)| name == form));
        let mut all = Vec::new();
        if wanted(FORCE) {
            all.push(over(FORCE, s.load_n, &|log| (&log.normal_n, log.normal_noise_n)));
        }
        if wanted(TORQUE) {
            all.push(over(TORQUE, s.torque_nm, &|log| (&log.torque_nm, log.torque_noise_nm)));
        }
        all
    }
}
